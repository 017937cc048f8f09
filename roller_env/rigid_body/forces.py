"""Forces and torques on rigid bodies, and the derivative that an integrator follows.

A **load** is a function ``(state, t) -> Wrench``: it may depend on the state and on the time.
What it returns is a force and a torque for **each** body, two arrays (N, 3): whoever calls a load
(`total`, `on_axle`, the integrators) has `checked` it, and nothing is stretched to fit. A plain
pair of nested lists will do as well.

The loads made here are compiled (`BuiltInLoad`), and their sums and axles too; one of your own is
an ordinary function, and costs a call of Python for each stage of a step.

`total` adds loads, `derivative_of` makes of a load what the integrators take. What a player holds
(keys, a lift) changes by jumps, which no method of high order can follow inside a step: it is a
function of time alone, sampled at the beginning of a step and held through it (`held`), just as
MuJoCo holds ``ctrl`` and ``xfrc_applied``.

SI units, world frame, torques about the centre of mass.

Two formulae of the report are damaged in print; the ones here are mended. It has the torque of a
force F at p as F x (p - x), whose sign is wrong: the torque is **(p - x) x F**. And it has the
velocity at p as v + omega * (p - x), a product of two vectors which lost its cross:
**v + omega x (p - x)**.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from roller_env.rigid_body import kernels
from roller_env.rigid_body.arrays import (
    Float64,
    cross,
    direction,
    dot,
    finite_number,
    fitting_column,
    fitting_rows,
    floats,
    non_negative,
    numbers,
    read_only,
    row_or_rows,
    rows,
)
from roller_env.rigid_body.state import State

SWITCH_SLACK_S: Final = 1e-9
"""A switch this close after a step's beginning belongs to the step: 3 * 0.1 is not 0.3."""

GAME_KEYS: Final[Mapping[str, tuple[float, float, float]]] = {
    "W": (1.0, 0.0, 0.0),
    "S": (-1.0, 0.0, 0.0),
    "A": (0.0, 1.0, 0.0),
    "D": (0.0, -1.0, 0.0),
}
"""Directions of the original's keys in the game's axes (x forward, y left, z up)."""

KEY_FORCE_N: Final = 200.0 * 0.0254
"""Force of one key: 200 kg quant/s^2 (``phent_addcentralforce``), a quant being an inch."""


class Wrench(NamedTuple):
    """A force and a torque on each of N bodies.

    Attributes:
        force: (N, 3) N, world frame, acting at the centre of mass.
        torque: (N, 3) N m, world frame, about the centre of mass.
    """

    force: Float64
    torque: Float64


Load = Callable[[State, float], Wrench]
"""What acts on the bodies in a state at a time, s."""


def checked(load: Load, state: State, t: float) -> Wrench:
    """Return what ``load`` gives, float64 (N, 3) and (N, 3), or refuse it.

    The numbers themselves are not checked: a motion that blew up has infinite forces.

    Raises:
        ValueError: when it is no pair, or a half is not real numbers of the shape (N, 3).
    """
    given = load(state, t)
    if not isinstance(given, (tuple, list)) or len(given) != len(Wrench._fields):
        raise ValueError(
            f"a load must return a Wrench, which is a force and a torque, got {given!r}"
        )
    return Wrench(
        *(
            _for_each_body(name, value, state.count)
            for name, value in zip(Wrench._fields, given, strict=True)
        )
    )


def _for_each_body(name: str, value: npt.ArrayLike, count: int) -> Float64:
    of_load = f"the load's {name}"
    array = value
    if not (isinstance(array, np.ndarray) and array.dtype == np.float64):
        array = floats(of_load, value)
    if array.shape != (count, 3):
        raise ValueError(f"{of_load} must have shape ({count}, 3), got {array.shape}")
    return array


@dataclass(frozen=True, slots=True)
class Derivative:
    """The report's Derivatives: rates of change of the four primary values.

    Orientation has its rate twice: ``spin`` for methods that add quaternions, ``angular_velocity``
    for those that turn by a rotation vector.
    """

    state: State
    wrench: Wrench

    @property
    def velocity(self) -> Float64:
        """Rate of the position, (N, 3) m/s."""
        return self.state.velocity

    @property
    def spin(self) -> Float64:
        """Rate of the orientation as a quaternion, (N, 4) 1/s."""
        return self.state.spin

    @property
    def angular_velocity(self) -> Float64:
        """Rate of the orientation as a vector, (N, 3) rad/s, world frame."""
        return self.state.angular_velocity

    @property
    def force(self) -> Float64:
        """Rate of the momentum, (N, 3) N."""
        return self.wrench.force

    @property
    def torque(self) -> Float64:
        """Rate of the angular momentum, (N, 3) N m."""
        return self.wrench.torque


DerivativeFunction = Callable[[State, float], Derivative]
"""Rates of change in a state at a time, s."""


def derivative_of(load: Load) -> DerivativeFunction:
    """Return the derivative under ``load``.

    Raises:
        ValueError: from the returned function, as `checked`.
    """

    def derivative(state: State, t: float) -> Derivative:
        return Derivative(state, checked(load, state, t))

    return derivative


@dataclass(frozen=True, eq=False)
class _Term:
    """One built-in load before the number of bodies is known; see `kernels.Terms`."""

    kind: int
    a: tuple[str, Float64] = ("a", np.zeros(3))
    b: tuple[str, Float64] = ("b", np.zeros(3))
    c: tuple[str, Float64] = ("c", np.zeros(()))
    axles: tuple[Float64, ...] = ()
    """Unit vectors, (3,) or (N, 3), in the order in which the torque meets them."""

    def axle(self, count: int) -> Float64:
        """Return what of a torque the axles let through, (N, 3, 3)."""
        through = np.broadcast_to(np.eye(3), (count, 3, 3))
        for unit in self.axles:
            along = np.broadcast_to(fitting_rows("axis", unit, count, 3), (count, 3))
            through = np.einsum("ni,nj,njk->nik", along, along, through)
        return through


class BuiltInLoad:
    """A sum of the loads of this module, which compiled loops evaluate; a `Load` like any other.

    Loads of the user's own are Python, and so is every sum that one of them is part of: an
    integration then goes back to Python for each stage of each step.
    """

    def __init__(self, terms: tuple[_Term, ...] = ()) -> None:
        """Take the terms; the functions of this module make them."""
        self._terms = terms
        self._packed: dict[int, kernels.Terms] = {}

    def __call__(self, state: State, t: float) -> Wrench:
        """Return what acts on the bodies; none of these depends on the time."""
        wrench = Wrench(np.empty((state.count, 3)), np.empty((state.count, 3)))
        terms = self.terms(state.count)
        constants = state.body.constants
        kernels.wrenches(constants, terms, state.normalised, state.rows(), *wrench)
        return wrench

    def __add__(self, other: BuiltInLoad) -> BuiltInLoad:
        """Return both together."""
        return BuiltInLoad(self._terms + other._terms)

    def through_axle(self, unit: Float64) -> BuiltInLoad:
        """Return it as it acts on bodies that an axle along ``unit``, (3,) or (N, 3), holds."""
        return BuiltInLoad(tuple(replace(one, axles=(*one.axles, unit)) for one in self._terms))

    def terms(self, count: int) -> kernels.Terms:
        """Return what compiled loops take, for ``count`` bodies.

        Raises:
            ValueError: when it was made for another number of bodies.
        """
        if count not in self._packed:
            self._packed = {count: self._pack(count)}
        return self._packed[count]

    def _pack(self, count: int) -> kernels.Terms:
        size = len(self._terms)
        c, a, b = (np.zeros((size, count, *width)) for width in ((), (3,), (3,)))
        axle = np.zeros((size, count, 3, 3))
        for i, one in enumerate(self._terms):
            c[i] = fitting_column(*one.c, count)[..., 0]
            a[i], b[i] = fitting_rows(*one.a, count, 3), fitting_rows(*one.b, count, 3)
            axle[i] = one.axle(count)
        kind = np.array([one.kind for one in self._terms], dtype=np.int64)
        held = np.array([bool(one.axles) for one in self._terms], dtype=np.bool_)
        return kernels.Terms(kind, c, a, b, held, axle)


none: Final = BuiltInLoad()
"""No force and no torque: the load of a free body."""


def total(*loads: Load) -> Load:
    """Return the load that is the sum of ``loads``; of none, no load."""
    built_in = [one for one in loads if isinstance(one, BuiltInLoad)]
    if len(built_in) == len(loads):
        return sum(built_in, none)

    def load(state: State, t: float) -> Wrench:
        wrench = none(state, t)
        for one in loads:
            added = checked(one, state, t)
            wrench = Wrench(wrench.force + added.force, wrench.torque + added.torque)
        return wrench

    return load


def constant(
    force: npt.ArrayLike = (0.0, 0.0, 0.0), torque: npt.ArrayLike = (0.0, 0.0, 0.0)
) -> Load:
    """Return a force, N, and a torque, N m, that never change; each (3,) or (N, 3)."""
    force_n, torque_nm = row_or_rows("force", force, 3), row_or_rows("torque", torque, 3)
    return BuiltInLoad((_Term(kernels.CONSTANT, ("force", force_n), ("torque", torque_nm)),))


def gravity(acceleration: npt.ArrayLike) -> Load:
    """Return the weight in a uniform field, m/s^2, (3,) or (N, 3). It has no torque.

    The report's up is y and the game's is z, so there is no default.
    """
    field = row_or_rows("acceleration", acceleration, 3)
    return BuiltInLoad((_Term(kernels.GRAVITY, ("acceleration", field)),))


def linear_drag(coefficient: npt.ArrayLike) -> Load:
    """Return the force -c v, with c in N s/m, one number or (N,), not negative."""
    c = non_negative("coefficient", coefficient)
    return BuiltInLoad((_Term(kernels.DRAG, c=("coefficient", c)),))


def driving_torque(torque: npt.ArrayLike = (1.0, 0.0, 0.0), damping: npt.ArrayLike = 0.1) -> Load:
    """Return the report's torque, (1, 0, 0) - 0.1 omega unless told otherwise.

    Driving and damping balance at omega = torque / damping (10 rad/s about x), which a cube nears
    with the time constant inertia / damping (10 I seconds).

    Args:
        torque: N m, (3,) or (N, 3), world frame.
        damping: N m s, one number or (N,), not negative.
    """
    drive, c = row_or_rows("torque", torque, 3), non_negative("damping", damping)
    return BuiltInLoad((_Term(kernels.DRIVE, ("torque", drive), c=("damping", c)),))


def force_at(state: State, force: npt.ArrayLike, point: npt.ArrayLike) -> Wrench:
    """Return what a force at a point of the body does: **all** of it pushes, and it turns as well.

    Args:
        state: N bodies.
        force: F, (3,) or (N, 3) N, world frame.
        point: p, (3,) or (N, 3) m, world frame.

    Returns:
        Force F and torque (p - x) x F, x being the centre of mass.

    Raises:
        ValueError: on a wrong shape or NaN.
    """
    push = rows("force", force, state.count, 3)
    return Wrench(push, cross(rows("point", point, state.count, 3) - state.position, push))


def push_at(force: npt.ArrayLike, body_point: npt.ArrayLike, *, in_body: bool = False) -> Load:
    """Return a steady push at a point fixed to the body.

    Args:
        force: (3,) or (N, 3) N.
        body_point: (3,) or (N, 3) m, body coordinates.
        in_body: whether the force turns with the body, as a thruster's does. Otherwise it keeps
            its direction in the world.
    """
    push, point = row_or_rows("force", force, 3), row_or_rows("body_point", body_point, 3)
    kind = kernels.THRUST if in_body else kernels.PUSH
    return BuiltInLoad((_Term(kind, ("force", push), ("body_point", point)),))


def on_axle(load: Load, axis: npt.ArrayLike) -> Load:
    """Return ``load`` as it acts on bodies held by a smooth axle through the centre of mass.

    The axle takes up the whole force and every torque but that about itself: a wheel held by its
    axle only turns. True for bodies that turn about a principal axis along the axle (otherwise
    the axle would also have to hold against the body's own wobble).

    Args:
        load: what acts on the free body.
        axis: (3,) or (N, 3), world frame, any length but 0.

    Raises:
        ValueError: on an axis of length 0 or of a wrong shape.
    """
    unit = direction("axis", row_or_rows("axis", axis, 3))
    if isinstance(load, BuiltInLoad):
        return load.through_axle(unit)

    def held_load(state: State, t: float) -> Wrench:
        along = fitting_rows("axis", unit, state.count, 3)
        wrench = checked(load, state, t)
        return Wrench(np.zeros_like(wrench.force), dot(wrench.torque, along)[:, None] * along)

    return held_load


def velocity_at(state: State, point: npt.ArrayLike) -> Float64:
    """Return the velocity of the body's matter at a point: v + omega x (p - x), (N, 3) m/s.

    Args:
        state: N bodies.
        point: p, (3,) or (N, 3) m, world frame.

    Raises:
        ValueError: on a wrong shape or NaN.
    """
    arm = rows("point", point, state.count, 3) - state.position
    return state.velocity + cross(state.angular_velocity, arm)


@dataclass(frozen=True, eq=False)
class PiecewiseConstantForce:
    """A force on the centres of mass that changes by jumps: what a keyboard gives.

    Attributes:
        switches_s: (K,) rising times at which a new force begins, s. Before the first, no force.
        forces: (K, 3) N, the same for all bodies, or (K, N, 3).
    """

    switches_s: Float64
    forces: Float64

    def __post_init__(self) -> None:
        times, forces = numbers("switches_s", self.switches_s), numbers("forces", self.forces)
        if times.ndim != 1 or len(times) == 0 or (np.diff(times) <= 0.0).any():
            raise ValueError(f"switches_s must be one or more rising times, got {times.tolist()}")
        if forces.ndim not in {2, 3} or forces.shape[0] != len(times) or forces.shape[-1] != 3:
            raise ValueError(
                f"forces must have shape ({len(times)}, 3) or ({len(times)}, N, 3) for "
                f"{len(times)} switches, got {forces.shape}"
            )
        object.__setattr__(self, "switches_s", read_only(times))
        object.__setattr__(self, "forces", read_only(forces))

    def force_at_time(self, t: float) -> Float64:
        """Return the force at t, (3,) or (N, 3) N; at a switch, the new one."""
        t = finite_number("t", t)
        index = int(np.searchsorted(self.switches_s, t + SWITCH_SLACK_S, side="right")) - 1
        return self.forces[index] if index >= 0 else np.zeros_like(self.forces[0])

    def held(self, t: float) -> Load:
        """Return the force at t as a load that keeps it whatever the time."""
        return constant(force=self.force_at_time(t))

    def pieces(self, start_s: float, dt: float, steps: int) -> Iterator[range]:
        """Yield the runs of steps that begin under the same force, together 0 to ``steps`` - 1."""
        begin = start_s + dt * np.arange(steps) + SWITCH_SLACK_S
        index = np.searchsorted(self.switches_s, begin, side="right")
        edges = [0, *(np.flatnonzero(np.diff(index)) + 1).tolist(), steps]
        for first, end in itertools.pairwise(edges):
            yield range(first, end)


def key_sequence(
    events: Sequence[tuple[float, str]],
    *,
    key_force_n: float = KEY_FORCE_N,
    keys: Mapping[str, tuple[float, float, float]] = GAME_KEYS,
) -> PiecewiseConstantForce:
    """Return the force of held keys over time; keys add, so two of them push on the diagonal.

    Args:
        events: (time in s, keys held from then on), such as
            ``[(0.0, "W"), (1.0, "WA"), (2.5, "")]``; times rise.
        key_force_n: force of one key, N.
        keys: direction of each key.

    Raises:
        ValueError: an unknown key, or times that do not rise.
    """
    unknown = sorted({key for _, held in events for key in held} - set(keys))
    if unknown:
        raise ValueError(f"unknown keys {unknown}: the keys are {sorted(keys)}")
    pushes = [
        np.sum([keys[key] for key in set(held)] or [(0.0, 0.0, 0.0)], axis=0) for _, held in events
    ]
    return PiecewiseConstantForce(
        np.array([time for time, _ in events]), key_force_n * np.array(pushes)
    )
