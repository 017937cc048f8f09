"""Hypothesis strategies for bodies and states, and the measures that the tests share."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from hypothesis import assume, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from roller_env.rigid_body import Body, State, quaternion
from roller_env.rigid_body.arrays import Float64

FREE_BOX_SIZE_M = (0.1, 0.4, 0.9)
"""The box of the free-body benchmark (scpeters/benchmark): 10 kg, three different moments."""

EXAMPLES = settings(max_examples=15, deadline=None)
"""For property tests: enough examples for a formula, and no complaint when the machine is busy."""


def vectors(count: int, largest: float = 5.0) -> st.SearchStrategy[Float64]:
    """Return rows of 3 numbers, (count, 3)."""
    return arrays(np.float64, (count, 3), elements=st.floats(-largest, largest))


@st.composite
def orientations(draw: st.DrawFn, count: int) -> Float64:
    """Draw unit quaternions, (count, 4)."""
    q: Float64 = draw(arrays(np.float64, (count, 4), elements=st.floats(-1.0, 1.0)))
    assume((quaternion.norm(q) > 0.1).all())
    return quaternion.normalise(q)


@st.composite
def cubes(draw: st.DrawFn, count: int) -> Body:
    sizes = draw(arrays(np.float64, count, elements=st.floats(0.1, 5.0)))
    masses = draw(arrays(np.float64, count, elements=st.floats(0.01, 100.0)))
    return Body.cube(sizes, masses)


@st.composite
def boxes(draw: st.DrawFn, count: int) -> Body:
    """Draw boxes whose three moments of inertia differ."""
    sizes = draw(arrays(np.float64, (count, 3), elements=st.floats(0.1, 5.0)))
    masses = draw(arrays(np.float64, count, elements=st.floats(0.01, 100.0)))
    body = Body.box(sizes, masses)
    moments = np.sort(body.inertia, axis=1)
    assume((np.diff(moments, axis=1) > 1e-3 * moments[:, 2:]).all())
    return body


@st.composite
def states(draw: st.DrawFn, bodies: st.SearchStrategy[Body]) -> State:
    """Draw bodies anywhere, in any orientation, moving and turning."""
    body = draw(bodies)
    return State.create(
        body,
        position=draw(vectors(body.count)),
        velocity=draw(vectors(body.count)),
        orientation=draw(orientations(body.count)),
        angular_velocity=draw(vectors(body.count)),
    )


@st.composite
def tumbling(draw: st.DrawFn, count: int) -> State:
    """Draw free asymmetric tops that are not next to the separatrix, where nothing can be exact."""
    state = draw(states(boxes(count)))
    middle = np.sort(state.body.inertia, axis=1)[:, 1]
    square = np.sum(state.angular_momentum**2, axis=1)
    twice_energy = np.sum(state.angular_momentum * state.angular_velocity, axis=1)
    assume((np.abs(square - middle * twice_energy) >= 1e-2 * square).all())
    return state


def attitude_error(a: State, b: State) -> float:
    """Return the largest angle between two states' bodies, rad."""
    return float(quaternion.angle_between(a.rotation, b.rotation).max())


def errors(state: State, truth: State) -> dict[str, float]:
    """Return the largest error of each primary value over all bodies."""
    return {
        "position": float(np.abs(state.position - truth.position).max()),
        "momentum": float(np.abs(state.momentum - truth.momentum).max()),
        "attitude": attitude_error(state, truth),
        "angular momentum": float(np.abs(state.angular_momentum - truth.angular_momentum).max()),
    }


def slope(steps: Sequence[int], error: Sequence[float]) -> float:
    """Return the measured order: minus the slope of log error over log steps."""
    return -float(np.polyfit(np.log(steps), np.log(error), 1)[0])


def exact_product(a: Sequence[Fraction], b: Sequence[Fraction]) -> list[Fraction]:
    """Return Hamilton's product of two quaternions of exact numbers, from ij = k and no array."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
