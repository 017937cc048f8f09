"""A ball that skids over a plane while a force pushes it aside, in closed form.

The slip u (the velocity of the ball's lowest point over the plane) of a uniform sphere obeys
``du/dt = g - k u/|u|``: g is the tangential force over the mass, k = 7/2 mu N/m. With the angle phi
between u and g the hodograph separates, and in the parameter X with ``dt = |u| dX`` it is

    u = |u0| (c^2 e^((g-k)X) - s^2 e^(-(g+k)X),  2 c s e^(-kX)),    c, s = cos, sin of phi0 / 2

along g and at right angles to it. Time and the way of the lowest point are integrals of
exponentials. The centre follows from ``dv/dt = 5/7 g + 2/7 du/dt``, since friction does to u what
it does to v seven halves times over. (Rolling and sliding of a sphere: e.g. L. D. Landau, E. M.
Lifshitz, *Mechanics*, paragraph 38, gives the equations; the parameter is ours.)
"""

from __future__ import annotations

import math
from typing import Final

from roller_env.physics.rigid.kernels import kernel

SLIP_SHARE: Final = 2.0 / 7.0
"""Of a change of the slip, what the centre's velocity takes of it (the spin takes 5/7)."""

_MOST_ITERATIONS: Final = 100
_LAST_CHANGE: Final = 1e-9


@kernel
def _integral(rate: float, parameter: float) -> float:
    """Return the integral of ``e^(-rate x)`` from 0 to ``parameter``, which may be infinite."""
    if rate * parameter == 0.0:
        return parameter
    return -math.expm1(-rate * parameter) / rate


@kernel
def stop_time(slip: float, push: float, cos_angle: float, k: float) -> float:
    """Return when a slip ends: ``|u0| (k + g cos phi0) / (k^2 - g^2)``; ``inf`` if it never does.

    Args:
        slip: |u0|, m/s.
        push: g, m/s^2.
        cos_angle: of the angle between them.
        k: 7/2 mu N/m, m/s^2.
    """
    if k <= push:
        return math.inf
    return slip * (k + push * cos_angle) / ((k - push) * (k + push))


@kernel
def slide(
    slip: float, push: float, cos_angle: float, sin_angle: float, k: float, time: float
) -> tuple[float, float, float, float]:
    """Return the slip after ``time``, and the way of the lowest point until then.

    Args:
        slip: |u0|, m/s, more than 0.
        push: g, m/s^2.
        cos_angle: of the angle from the push to the slip.
        sin_angle: likewise.
        k: 7/2 mu N/m, m/s^2.
        time: seconds, at most `stop_time`.

    Returns:
        The slip along the push and at right angles to it, m/s; the way along both, metres.
    """
    # Of the two squares the smaller would drown in rounding.
    more = 0.5 * (1.0 + abs(cos_angle))
    less = 0.25 * sin_angle * sin_angle / more
    c2, s2 = (more, less) if cos_angle > 0.0 else (less, more)
    two_cs = sin_angle
    x = _parameter(slip, push, c2, s2, k, time)
    along = slip * (c2 * math.exp((push - k) * x) - s2 * math.exp(-(push + k) * x))
    across = slip * two_cs * math.exp(-k * x)
    square = slip * slip
    way_along = square * (
        c2 * c2 * _integral(2.0 * (k - push), x) - s2 * s2 * _integral(2.0 * (k + push), x)
    )
    way_across = (
        square * two_cs * (c2 * _integral(2.0 * k - push, x) + s2 * _integral(2.0 * k + push, x))
    )
    return along, across, way_along, way_across


@kernel
def _parameter(slip: float, push: float, c2: float, s2: float, k: float, time: float) -> float:
    """Return X at ``time``: Newton's iteration, held between bounds that close in on it."""
    low, high = 0.0, math.inf
    x = time / slip
    if push > k and c2 > 0.0:
        # The part of the slip that grows would alone take this long.
        high = math.log1p((push - k) * time / (slip * c2)) / (push - k) * (1.0 + 1e-12)
        x = min(x, high)
    for _ in range(_MOST_ITERATIONS):
        slow, fast = _integral(k - push, x), _integral(k + push, x)
        excess = slip * (c2 * slow + s2 * fast) - time
        if excess > 0.0:
            high = x
        else:
            low = x
        # Of an exponential and its integral one says the other.
        rate = slip * (c2 * (1.0 - (k - push) * slow) + s2 * (1.0 - (k + push) * fast))
        following = x - excess / rate if rate > 0.0 else math.inf
        if not low <= following <= high:
            following = 0.5 * (low + high) if high < math.inf else 2.0 * x + 1.0 / k
        # What is left is about the square of the last change.
        if abs(following - x) <= _LAST_CHANGE * x:
            return following
        x = following
    return x
