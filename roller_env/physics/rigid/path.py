"""The way of a ball's centre in a control step: knots, and parabolas between them.

A row of a path, (6,), is a knot and the bend of the piece that begins there, metres, world frame. A
piece from ``p`` to ``q`` with the bend ``b`` goes through ``p + s (q - p - b) + s^2 b``, where s
runs from 0 to 1 evenly in time: ``b`` is half the acceleration times the square of the duration.
"""

from __future__ import annotations

from typing import Any, Final

from roller_env.physics.rigid.kernels import Vector, add, kernel, plus, scaled, store, vector

_STRAIGHT: Final = (0.0, 0.0, 0.0)


@kernel
def begin(path: Any, place: Vector) -> int:
    """Let a path begin somewhere; return how many knots it has."""
    store(path[0], place)
    store(path[0, 3:], _STRAIGHT)
    return 1


@kernel
def follow(path: Any, knots: int, to: Vector, bend: Vector) -> int:
    """Let a path go on to a place; return how many knots it has then.

    Where there is no room for more the last piece is made longer, and straight. So it is with a
    ball that chatters between solids.
    """
    if knots == len(path):
        knots -= 1
        bend = _STRAIGHT
    store(path[knots - 1, 3:], bend)
    store(path[knots], to)
    store(path[knots, 3:], _STRAIGHT)
    return knots + 1


@kernel
def bend_through(path: Any, knots: int, middle: Vector, to: Vector) -> Vector:
    """Return the bend of a piece that goes on from a path through a place, half-way in time."""
    return plus(scaled(2.0, add(vector(path[knots - 1]), to)), -4.0, middle)
