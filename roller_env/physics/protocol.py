"""What the rules ask of an engine, whichever it is."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from roller_env.arrays import Bool, Float64, Int64


class Columns(NamedTuple):
    """Where things begin in a row of an engine's state.

    Attributes:
        position: ball's centre, 3: metres, world frame.
        orientation: 4: unit quaternion (w, x, y, z), ball to world.
        velocity: 3: m/s, world frame.
        angular_velocity: 3: rad/s, in the ball's own frame.
        displacement: one a slab: how far it is from where it began, metres, <= 0.
        aim: one a slab: displacement to which it is being pulled, which it may trail.
        force_n: 3, a control: mean force on the ball over the step, newtons, world frame.
        pull: one a slab, a control: m/s at which its aim moves; below zero is down.
        movers: number of slabs.
        path: where the ball's centre begins in a row of the path that a step leaves.
        path_width: 3 if pieces of the path are straight, 6 if they are bent, by the next three
            numbers: see `Path`.
    """

    position: int
    orientation: int
    velocity: int
    angular_velocity: int
    displacement: int
    aim: int
    force_n: int
    pull: int
    movers: int
    path: int
    path_width: int


class Bodies(NamedTuple):
    """Views of the columns of N envs; see `Columns`."""

    position: Float64
    orientation: Float64
    velocity: Float64
    angular_velocity: Float64
    displacement: Float64
    aim: Float64
    force_n: Float64
    pull: Float64

    @staticmethod
    def of(physics: Float64, at: Columns) -> Bodies:
        """Return views of ``physics``, (N, width)."""

        def columns(first: int, count: int) -> Float64:
            return physics[:, first : first + count]

        return Bodies(
            position=columns(at.position, 3),
            orientation=columns(at.orientation, 4),
            velocity=columns(at.velocity, 3),
            angular_velocity=columns(at.angular_velocity, 3),
            displacement=columns(at.displacement, at.movers),
            aim=columns(at.aim, at.movers),
            force_n=columns(at.force_n, 3),
            pull=columns(at.pull, at.movers),
        )


class Path(NamedTuple):
    """Where n balls went in a control step: knots, and pieces between them.

    A piece from p to q is straight, or with the bend b it is the parabola
    ``p + s (q - p - b) + s^2 b``. Either is run through evenly in time, s from 0 to 1.

    Attributes:
        at: (n, K, p): the knots, metres, world frame, and with each the bend of the piece that
            begins there, if pieces are bent; see `Columns`.
        knots: (n,) how many there are.
    """

    at: Float64
    knots: Int64


class Physics(Protocol):
    """N worlds of one level: balls, and slabs that go down.

    Worlds are named by sorted numbers without repetition. What one does depends neither on how many
    there are nor on the number of threads, bit for bit.

    Attributes:
        state: (N, width) float64, C-contiguous, live: all that a world's future depends on. What is
            written there counts from the next step on.
        columns: where everything is in it.
        substeps: steps of `advance`, S, in which `advance_late` counts.
        parts: ranges of worlds: for worlds of one range methods may be called while they are, in
            other threads, for worlds of others.
    """

    state: Float64
    columns: Columns
    substeps: int
    parts: list[slice]

    def reset(self, worlds: Int64) -> None:
        """Put worlds back to where the level begins, at rest."""

    def advance(self, worlds: Int64 | None) -> Path:
        """Advance worlds (all, if None) by a control step, and return where they went.

        The next call for one of them overwrites it.
        """

    def advance_late(self, worlds: Int64 | None, still: Int64) -> Path:
        """Advance worlds as `advance` does, each after it has stood still for a while.

        Args:
            worlds: which; None for all.
            still: (n,) steps at the beginning, 0 to S, in which each does not move.
        """

    def diverged(self, worlds: Int64 | None) -> Bool:
        """Say which worlds (of all, if None) are not finite, or given up on since their `reset`.

        Returns:
            (n,) in the order of ``worlds``.
        """

    def rays(
        self, offsets: Float64, directions: Float64, longest: float, worlds: Int64 | None
    ) -> Float64:
        """Return the distances, (n, rays) metres, to the first solid along each ray; else ``inf``.

        Args:
            offsets: (rays, 3) where they begin, from the ball's centre, metres, world frame.
            directions: (rays, 3) unit vectors, world frame.
            longest: what is further need not be found, metres.
            worlds: which; None for all.
        """
