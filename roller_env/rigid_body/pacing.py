"""Fixed steps of physics under frames of any length, and the picture between two steps.

Physics advances in steps of one fixed length, drawing in frames that take as long as they take.
`FixedStepPacer` says how many steps a frame asks for and what fraction of a step is left over;
`interpolate` draws that fraction of the way from the previous state to the current one, so that
motion is smooth at any frame rate, one step late (Fiedler 2004, "Fix Your Timestep!"; the report's
"interpolate between the previous and current physics orientation").

Nothing here knows about rigid bodies' forces: poses from MuJoCo can be drawn with it as well.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy.typing as npt

from roller_env.rigid_body import quaternion
from roller_env.rigid_body.arrays import number, positive_time, scalars, whole
from roller_env.rigid_body.state import Pose

_ROUNDING = 1e-9
"""Fraction of a step that may be missing from a whole one: sums of frame lengths are rounded."""


_UNCOUNTABLE = 2.0**53
"""Steps beyond which a float64 has no fraction of a step left, if it is a number at all."""


@dataclass
class FixedStepPacer:
    """Turns the lengths of frames into whole steps of physics, and never into too many.

    A frame that took long asks for many steps, which take long, which makes the next frame ask for
    more. The cap breaks that spiral: time beyond it is dropped, and the game runs slower than the
    clock instead of not at all.

    Attributes:
        step_s: length of a step, s.
        max_steps: most steps that one frame may ask for.
        dropped_s: time not simulated so far because of the cap, s.
    """

    step_s: float
    max_steps: int = 8
    dropped_s: float = field(default=0.0, init=False)
    _left_s: float = field(default=0.0, init=False, repr=False)

    def __post_init__(self) -> None:
        positive_time("step_s", self.step_s)
        whole("max_steps", self.max_steps, 1)

    def advance(self, frame_s: float) -> int:
        """Return how many steps to take for a frame of ``frame_s`` seconds, 0 to ``max_steps``.

        Raises:
            ValueError: when the frame's length is negative or no finite number.
        """
        if not (math.isfinite(number("frame_s", frame_s)) and frame_s >= 0.0):
            raise ValueError(f"frame_s must be a number of seconds, not negative, got {frame_s}")
        self._left_s += frame_s
        in_steps = self._left_s / self.step_s + _ROUNDING
        if in_steps >= _UNCOUNTABLE:
            self.dropped_s += self._left_s - self.max_steps * self.step_s
            self._left_s = 0.0
            return self.max_steps
        wanted = math.floor(in_steps)
        steps = min(wanted, self.max_steps)
        self._left_s = max(self._left_s - wanted * self.step_s, 0.0)
        self.dropped_s += (wanted - steps) * self.step_s
        return steps

    @property
    def fraction(self) -> float:
        """How far the clock is into the next step, in [0, 1): the fraction to draw with."""
        return self._left_s / self.step_s


def interpolate(previous: Pose, current: Pose, fraction: npt.ArrayLike) -> Pose:
    """Return the pose to draw ``fraction`` of the way from one state's to the next one's.

    Position by a straight line, which under an acceleration a is off by at most a step_s^2 / 8;
    orientation by slerp, which is exact at constant spin up to half a turn a step.

    Args:
        previous: N bodies before the last step.
        current: the same bodies after it.
        fraction: 0 to 1, one number or (N,).

    Raises:
        ValueError: when the poses have different shapes, or a fraction is outside 0 to 1.
    """
    for before, after, name in zip(previous, current, Pose._fields, strict=True):
        if before.shape != after.shape:
            raise ValueError(f"{name} has shape {before.shape} before and {after.shape} after")
    share = scalars("fraction", fraction, len(previous.position))
    if ((share < 0.0) | (share > 1.0)).any():
        raise ValueError(f"fraction must be from 0 to 1, got {share.tolist()}")
    position = previous.position + share[:, None] * (current.position - previous.position)
    return Pose(position, quaternion.slerp(previous.orientation, current.orientation, share))
