"""The report's rigid body: what is integrated, what follows from it, what never changes.

The report splits a body's values in three, and so does this module:

* **primary**: position, momentum, orientation, angular momentum. Only these are integrated.
* **secondary**: velocity, angular velocity, spin and the body-to-world and world-to-body matrices.
  They follow from the primary values.
* **constant**: size, mass, inverse mass, inertia, inverse inertia; here the class `Body`.

Momentum is primary and velocity is not because angular *momentum* is what a free body conserves:
on anything but a cube (or ball) the angular velocity wanders while no torque acts.

Every array has a leading axis of bodies, N; one body is N = 1. Units are SI. Vectors are in the
world frame unless a name says body. Nothing here depends on which way the axes point, only on
their being right-handed; `roller_env.rigid_body.axes` has the map between the report's and the
game's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from roller_env.rigid_body import kernels, quaternion
from roller_env.rigid_body.arrays import (
    Float64,
    chosen,
    dot,
    floats,
    numbers,
    positive,
    read_only,
    rows,
    scalars,
    whole,
)

_LEAST, _MOST = 1e-300, 1e300
"""Masses, kg, and moments, kg m^2, within which they, their sums and inverses are exact floats."""

_TRIANGLE_SLACK = 1e-9
"""Relative rounding allowed before three moments of inertia are called impossible."""


@dataclass(frozen=True, eq=False)
class Body:
    """The constant part of N rigid bodies, of uniform density or given by its moments of inertia.

    Make one with `cube`, `box` or `from_inertia`. Body axes are the principal axes and the origin
    is the centre of mass, so the inertia tensor is its diagonal. Arrays are read-only float64.

    Attributes:
        size: (N, 3) edge lengths along the body axes, m.
        mass: (N,) kg.
        inverse_mass: (N,) 1/kg; stored because a product is cheaper than a division.
        inertia: (N, 3) principal moments about the centre of mass, kg m^2.
        inverse_inertia: (N, 3) 1/(kg m^2).
    """

    size: Float64
    mass: Float64
    inverse_mass: Float64
    inertia: Float64
    inverse_inertia: Float64

    @classmethod
    def cube(
        cls, size: npt.ArrayLike = 1.0, mass: npt.ArrayLike = 1.0, *, count: int | None = None
    ) -> Body:
        """Return cubes of edge ``size``, m: inertia size^2 * mass / 6 about every axis.

        Args:
            size: one number or (N,).
            mass: kg, one number or (N,).
            count: N, when neither of the two says it.

        Raises:
            ValueError: a size or mass that is not positive and finite, or lengths that differ.
        """
        edge = positive("size", size)
        if edge.ndim > 1:
            raise ValueError(f"size of a cube must be one number or (N,), got shape {edge.shape}")
        number = _count(count, edge.shape, np.shape(mass))
        edges = scalars("size", edge, number)
        masses = scalars("mass", positive("mass", mass), number)
        with np.errstate(over="ignore", under="ignore"):
            moment = edges**2 * masses / 6.0
        return cls._made(np.stack([edges] * 3, axis=-1), masses, np.stack([moment] * 3, axis=-1))

    @classmethod
    def box(
        cls, size: npt.ArrayLike, mass: npt.ArrayLike = 1.0, *, count: int | None = None
    ) -> Body:
        """Return boxes of edges (a, b, c), m: moments mass/12 * (b^2 + c^2, c^2 + a^2, a^2 + b^2).

        Args:
            size: (3,) or (N, 3).
            mass: kg, one number or (N,).
            count: N, when neither of the two says it.

        Raises:
            ValueError: a size or mass that is not positive and finite, or shapes that do not fit.
        """
        edges = positive("size", size)
        number = _count(count, edges.shape[:-1], np.shape(mass))
        edges = rows("size", edges, number, 3)
        masses = scalars("mass", positive("mass", mass), number)
        with np.errstate(over="ignore", under="ignore"):
            squares = edges**2
            of_both = np.roll(squares, -1, axis=1) + np.roll(squares, 1, axis=1)
            moments = masses[:, None] / 12.0 * of_both
        return cls._made(edges, masses, moments)

    @classmethod
    def from_inertia(
        cls, inertia: npt.ArrayLike, mass: npt.ArrayLike = 1.0, *, count: int | None = None
    ) -> Body:
        """Return bodies of given principal moments, kg m^2; ``size`` is that of the box with them.

        Args:
            inertia: (3,) or (N, 3).
            mass: kg, one number or (N,).
            count: N, when neither of the two says it.

        Raises:
            ValueError: a value that is not positive and finite, shapes that do not fit, or moments
                that no mass distribution has (one larger than the sum of the other two).
        """
        moments = positive("inertia", inertia)
        number = _count(count, moments.shape[:-1], np.shape(mass))
        moments = rows("inertia", moments, number, 3)
        masses = scalars("mass", positive("mass", mass), number)
        _check_range("inertia", moments)
        total = moments.sum(axis=1, keepdims=True)
        excess = total - 2.0 * moments
        if (excess < -_TRIANGLE_SLACK * total).any():
            wrong = moments[int(np.argmax((excess < -_TRIANGLE_SLACK * total).any(axis=1)))]
            raise ValueError(
                f"inertia {wrong.tolist()} belongs to no body: "
                "no moment may exceed the sum of the other two"
            )
        # Two roots, since the quotient of what they are of may be out of range.
        edges = np.sqrt(6.0 * np.maximum(excess, 0.0)) / np.sqrt(masses)[:, None]
        return cls._made(edges, masses, moments)

    @classmethod
    def _made(cls, size: Float64, mass: Float64, inertia: Float64) -> Body:
        _check_range("mass", mass)
        _check_range("inertia (it follows from size and mass)", inertia)
        values = (size, mass, 1.0 / mass, inertia, 1.0 / inertia)
        return cls(*(read_only(value) for value in values))

    @property
    def count(self) -> int:
        """The number of bodies, N."""
        return len(self.mass)

    @cached_property
    def isotropic(self) -> bool:
        """Whether every body has three equal moments, so that omega = L / I needs no rotation."""
        return bool((self.inertia == self.inertia[:, :1]).all())

    @cached_property
    def axes_by_inertia(self) -> npt.NDArray[np.intp]:
        """The body axes in order of rising moment of inertia, (N, 3)."""
        return np.argsort(self.inertia, axis=1, kind="stable")

    @cached_property
    def constants(self) -> kernels.Bodies:
        """The same values as compiled loops take them."""
        return kernels.Bodies(
            self.mass,
            self.inverse_mass,
            self.inertia,
            self.inverse_inertia,
            self.axes_by_inertia.astype(np.int64),
            (self.inertia == self.inertia[:, :1]).all(axis=1),
        )

    def take(self, indices: npt.ArrayLike) -> Body:
        """Return the bodies at ``indices`` (K,), which may repeat one, or under a mask (N,).

        Raises:
            ValueError: on rows that are not there, fractions, a mask of another length, or none.
        """
        index = chosen("indices", indices, self.count)
        return Body._made(self.size[index], self.mass[index], self.inertia[index])


def _check_range(name: str, value: Float64) -> None:
    """Refuse what has no inverse, or is none: beyond them energies are 0, infinite or NaN.

    Raises:
        ValueError: naming the first value that is outside `_LEAST` to `_MOST`.
    """
    outside = ~((value >= _LEAST) & (value <= _MOST))
    if outside.any():
        raise ValueError(
            f"{name} must be from {_LEAST:g} to {_MOST:g}, to have an inverse, "
            f"got {value[outside][0]:g}"
        )


def _count(count: int | None, *shapes: tuple[int, ...]) -> int:
    """Return the number of bodies that the arguments' leading axes ask for."""
    lengths = {shape[0] for shape in shapes if shape}
    if count is not None:
        lengths.add(whole("count", count, 1))
    wanted = lengths - {1} or {1}
    if len(wanted) > 1:
        raise ValueError(
            f"sizes, masses and count disagree on the number of bodies: {sorted(wanted)}"
        )
    number = wanted.pop()
    if number < 1:
        raise ValueError(f"the number of bodies must be at least 1, got {number}")
    return number


class Pose(NamedTuple):
    """Where N bodies are: all that drawing needs.

    Attributes:
        position: (N, 3) centre of mass, world frame, m.
        orientation: (N, 4) unit quaternion (w, x, y, z), body to world.
    """

    position: Float64
    orientation: Float64

    def body_to_world(self) -> Float64:
        """Return the matrices, (N, 4, 4), that first rotate and then translate."""
        matrix = np.zeros((*self.position.shape[:-1], 4, 4))
        matrix[..., :3, :3] = quaternion.to_matrix(self.orientation)
        matrix[..., :3, 3] = self.position
        matrix[..., 3, 3] = 1.0
        return matrix


@dataclass(frozen=True, eq=False)
class State:
    """N rigid bodies at one moment. Start with `State.create`, go on with `recalculate`.

    A state never changes, and its arrays are read-only: the secondary values cannot fall out of
    step with the primary ones, which is the mistake the report's ``recalculate`` guards against.
    Each secondary value is worked out when it is first asked for, so four stages of a Runge-Kutta
    step build no 4x4 matrices.

    Attributes:
        body: the constant values.
        position: (N, 3) centre of mass, m.
        momentum: (N, 3) kg m/s.
        orientation: (N, 4) quaternion (w, x, y, z), body to world. Unit, except in a state that was
            recalculated with ``renormalise=False``; the rotation is then that of its direction.
        angular_momentum: (N, 3) about the centre of mass, world frame, kg m^2/s.
        normalised: whether the orientation has been scaled to norm 1.
        own_momentum: ``body_angular_momentum`` to the last bit, (N, 3), in a state of a method that
            keeps that instead; None: it follows.
    """

    body: Body
    position: Float64
    momentum: Float64
    orientation: Float64
    angular_momentum: Float64
    normalised: bool = field(default=True, kw_only=True)
    own_momentum: Float64 | None = field(default=None, kw_only=True, repr=False)

    @classmethod
    def create(
        cls,
        body: Body,
        *,
        position: npt.ArrayLike = (0.0, 0.0, 0.0),
        velocity: npt.ArrayLike | None = None,
        momentum: npt.ArrayLike | None = None,
        orientation: npt.ArrayLike = (1.0, 0.0, 0.0, 0.0),
        angular_velocity: npt.ArrayLike | None = None,
        angular_momentum: npt.ArrayLike | None = None,
    ) -> State:
        """Return a state from world-frame values, each of one row for all bodies or of N rows.

        Args:
            body: what moves.
            position: (3,) or (N, 3), m.
            velocity: (3,) or (N, 3), m/s; or give ``momentum``. Neither: at rest.
            momentum: (3,) or (N, 3), kg m/s.
            orientation: (4,) or (N, 4) unit quaternion, renormalised.
            angular_velocity: (3,) or (N, 3), rad/s, world frame; or give ``angular_momentum``.
            angular_momentum: (3,) or (N, 3), kg m^2/s, world frame.

        Raises:
            ValueError: a wrong shape, NaN, a quaternion far from unit, or a velocity and its
                momentum both given; or a momentum that is too large to be a number.
        """
        count = body.count
        q = rows("orientation", quaternion.checked_unit("orientation", orientation), count, 4)
        given = _one_of("velocity", velocity, "momentum", momentum)
        linear = rows(*given, count, 3)
        with np.errstate(over="ignore", invalid="ignore"):
            linear = linear if velocity is None else linear * body.mass[:, None]
        given = _one_of("angular_velocity", angular_velocity, "angular_momentum", angular_momentum)
        angular = rows(*given, count, 3)
        with np.errstate(over="ignore", invalid="ignore"):
            if angular_velocity is not None:
                angular = _tensor_product(body, body.inertia, q, angular)
        linear, angular = numbers("momentum", linear), numbers("angular_momentum", angular)
        where = rows("position", position, count, 3)
        return cls(body, *(read_only(value) for value in (where, linear, q, angular)))

    def recalculate(
        self,
        *,
        position: Float64 | None = None,
        momentum: Float64 | None = None,
        orientation: Float64 | None = None,
        angular_momentum: Float64 | None = None,
        renormalise: bool = True,
    ) -> State:
        """Return the state with these primary values and every secondary value in step with them.

        What is not given stays. This is the one way from a state to the next, and the inner loop of
        every integrator, so it checks shapes but not values: a motion that blew up is a state like
        any other, and `finite` says which rows are still numbers.

        Args:
            position: (N, 3) m.
            momentum: (N, 3) kg m/s.
            orientation: (N, 4).
            angular_momentum: (N, 3) kg m^2/s.
            renormalise: scale the orientation to norm 1, which adding quaternions (Euler,
                Runge-Kutta) needs and the report does here. False keeps its norm: for the stages
                inside a step, and for measuring what happens without.

        Raises:
            ValueError: when an array has another shape than the one it replaces.
        """
        values = [
            _replaced("position", position, self.position),
            _replaced("momentum", momentum, self.momentum),
            _replaced("orientation", orientation, self.orientation),
            _replaced("angular_momentum", angular_momentum, self.angular_momentum),
        ]
        if orientation is None:
            own = self.own_momentum if angular_momentum is None else None
            return State(self.body, *values, normalised=self.normalised, own_momentum=own)
        if renormalise:
            values[2] = read_only(quaternion.normalise(values[2]))
        return State(self.body, *values, normalised=renormalise)

    @property
    def count(self) -> int:
        """The number of bodies, N."""
        return self.body.count

    @cached_property
    def velocity(self) -> Float64:
        """Velocity of the centre of mass, (N, 3) m/s: momentum * inverse mass."""
        return read_only(self.momentum * self.body.inverse_mass[:, None])

    @cached_property
    def angular_velocity(self) -> Float64:
        """Angular velocity, (N, 3) rad/s, world frame: R I^-1 R^T L; on cubes simply L / I."""
        return read_only(self.over_inertia(self.angular_momentum))

    @cached_property
    def body_angular_momentum(self) -> Float64:
        """Angular momentum in **body** axes, (N, 3) kg m^2/s: what Euler's equations move."""
        if self.own_momentum is not None:
            return self.own_momentum
        return read_only(quaternion.rotate_inverse(self.rotation, self.angular_momentum))

    @cached_property
    def spin(self) -> Float64:
        """Rate of the orientation, (N, 4) 1/s: 1/2 (0, omega) q."""
        return read_only(quaternion.spin(self.angular_velocity, self.orientation))

    @cached_property
    def rotation(self) -> Float64:
        """The unit quaternion of the orientation, (N, 4): itself, unless renormalising is off."""
        if self.normalised:
            return self.orientation
        return read_only(quaternion.normalise(self.orientation))

    @property
    def pose(self) -> Pose:
        """Position and orientation, for drawing."""
        return Pose(self.position, self.rotation)

    @cached_property
    def body_to_world(self) -> Float64:
        """Matrices from body to world coordinates, (N, 4, 4): rotate, then translate."""
        return read_only(self.pose.body_to_world())

    @cached_property
    def world_to_body(self) -> Float64:
        """The inverse of `body_to_world`, (N, 4, 4), by transposing and not by elimination."""
        matrix = np.zeros((self.count, 4, 4))
        back = np.swapaxes(self.body_to_world[:, :3, :3], 1, 2)
        matrix[:, :3, :3] = back
        matrix[:, :3, 3] = -np.einsum("nij,nj->ni", back, self.position)
        matrix[:, 3, 3] = 1.0
        return read_only(matrix)

    def rows(self, *, body_axes: bool = False) -> Float64:
        """Return the primary values as compiled loops take them, (N, `kernels.POINT`).

        Args:
            body_axes: the last three numbers of a row are the angular momentum in body axes.
        """
        rows = np.zeros((self.count, kernels.POINT))
        rows[:, 0:3] = self.position
        rows[:, 3:6] = self.momentum
        rows[:, 6:10] = self.orientation
        rows[:, 10:13] = self.angular_momentum
        if body_axes:
            rows[:, 13:16] = self.body_angular_momentum
        return rows

    def from_rows(self, rows: Float64, *, normalised: bool, body_axes: bool) -> State:
        """Return these bodies in the state of ``rows``; the inverse of `rows`."""
        x, p, q, momentum, own = (
            read_only(np.ascontiguousarray(rows[:, first:end]))
            for first, end in ((0, 3), (3, 6), (6, 10), (10, 13), (13, 16))
        )
        return State(
            self.body,
            x,
            p,
            q,
            momentum,
            normalised=normalised,
            own_momentum=own if body_axes else None,
        )

    def over_inertia(self, vector: Float64) -> Float64:
        """Return I^-1 ``vector``, both (N, 3) world frame: torque to angular acceleration.

        Raises:
            ValueError: on another shape.
        """
        _same_shape("vector", vector, self.momentum)
        return _tensor_product(self.body, self.body.inverse_inertia, self.rotation, vector)

    def times_inertia(self, vector: Float64) -> Float64:
        """Return I ``vector``, both (N, 3) in the world frame: angular velocity to momentum.

        Raises:
            ValueError: on another shape.
        """
        _same_shape("vector", vector, self.momentum)
        return _tensor_product(self.body, self.body.inertia, self.rotation, vector)

    def points_to_world(self, points: npt.ArrayLike) -> Float64:
        """Return points fixed to the bodies in world coordinates, m.

        Args:
            points: body coordinates: (3,) the same for all, (N, 3) one a body, or (N, K, 3).

        Raises:
            ValueError: on any other shape, or NaN.
        """
        at, q, position = self._aligned("points", points)
        return quaternion.rotate(q, at) + position

    def points_to_body(self, points: npt.ArrayLike) -> Float64:
        """Return world points in the bodies' coordinates, m; shapes as `points_to_world`."""
        at, q, position = self._aligned("points", points)
        return quaternion.rotate_inverse(q, at - position)

    def vectors_to_world(self, vectors: npt.ArrayLike) -> Float64:
        """Return body-frame directions (forces, velocities) in the world frame: no translation."""
        at, q, _ = self._aligned("vectors", vectors)
        return quaternion.rotate(q, at)

    def vectors_to_body(self, vectors: npt.ArrayLike) -> Float64:
        """Return world-frame directions in the bodies' frames: no translation."""
        at, q, _ = self._aligned("vectors", vectors)
        return quaternion.rotate_inverse(q, at)

    def _aligned(self, name: str, value: npt.ArrayLike) -> tuple[Float64, Float64, Float64]:
        """Return ``value`` with the rotations and positions in shapes that broadcast to it."""
        array = numbers(name, value)
        if array.ndim == 3 and array.shape[0] == self.count and array.shape[2] == 3:
            return array, self.rotation[:, None, :], self.position[:, None, :]
        if array.shape not in {(3,), (1, 3), (self.count, 3)}:
            raise ValueError(
                f"{name} must have shape (3,), ({self.count}, 3) or ({self.count}, K, 3), "
                f"got {array.shape}"
            )
        return array, self.rotation, self.position

    def kinetic_energy(self) -> Float64:
        """Return energy of translation and rotation together, (N,) J."""
        linear = dot(self.momentum, self.velocity)
        return 0.5 * (linear + dot(self.angular_momentum, self.angular_velocity))

    def finite(self) -> npt.NDArray[np.bool_]:
        """Say which bodies' primary values are all finite numbers, (N,)."""
        primary = (self.position, self.momentum, self.orientation, self.angular_momentum)
        finite: npt.NDArray[np.bool_] = np.all(np.isfinite(np.hstack(primary)), axis=1)
        return finite

    def take(self, indices: npt.ArrayLike) -> State:
        """Return some bodies as a state of their own; argument and errors as `Body.take`."""
        index = chosen("indices", indices, self.count)
        primary = (self.position, self.momentum, self.orientation, self.angular_momentum)
        taken = (read_only(value[index]) for value in primary)
        own = None if self.own_momentum is None else read_only(self.own_momentum[index])
        return State(self.body.take(index), *taken, normalised=self.normalised, own_momentum=own)


def _one_of(
    rate: str, rate_value: npt.ArrayLike | None, momentum: str, momentum_value: npt.ArrayLike | None
) -> tuple[str, npt.ArrayLike]:
    if rate_value is not None and momentum_value is not None:
        raise ValueError(f"give {rate} or {momentum}, not both: one follows from the other")
    if rate_value is not None:
        return rate, rate_value
    return momentum, (0.0, 0.0, 0.0) if momentum_value is None else momentum_value


def _tensor_product(body: Body, diagonal: Float64, q: Float64, vector: Float64) -> Float64:
    """Return R diag R^T ``vector``: a tensor that is diagonal in the body frame, in the world's."""
    if body.isotropic:
        return diagonal * vector
    return quaternion.rotate(q, diagonal * quaternion.rotate_inverse(q, vector))


def _replaced(name: str, new: Float64 | None, old: Float64) -> Float64:
    if new is None:
        return old
    array = floats(name, new)
    _same_shape(name, array, old)
    return read_only(array)


def _same_shape(name: str, new: Float64, old: Float64) -> None:
    if np.shape(new) != old.shape:
        raise ValueError(f"{name} must have shape {old.shape}, got {np.shape(new)}")
