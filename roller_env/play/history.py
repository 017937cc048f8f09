"""History: the episode under way, which can be put back to any moment and go on from there."""

from __future__ import annotations

from typing import Final

import numpy as np

from roller_env.arrays import Float64
from roller_env.simulation import Simulation, Snapshot

KEYFRAMES: Final = 2_048
"""Moments kept at most: when there are more, every second one is forgotten."""

KEYFRAME_S: Final = 0.1
"""Time from one of them to the next, at first: what going back has to play again."""


class History:
    """What was done in the episode of a simulation's row 0, and how it stood now and then.

    The same forces give the same bits, so that a moment between two that are kept is played again.
    """

    def __init__(self, simulation: Simulation):
        """Begin with an episode that has just begun."""
        self._simulation = simulation
        self._forces: list[Float64] = []
        self._keyframes: list[Snapshot] = [simulation.snapshot()]
        self._spacing = max(1, round(KEYFRAME_S / simulation.duration_s))

    def __len__(self) -> int:
        """Return how many control steps there are, made or gone back from."""
        return len(self._forces)

    @property
    def step(self) -> int:
        """Control steps since the episode began, of the moment that is shown."""
        return int(self._simulation.state.steps[0])

    @property
    def is_back(self) -> bool:
        """Whether the moment that is shown is not the last one."""
        return self.step < len(self)

    def record(self, force_n: Float64) -> None:
        """Remember a control step that the simulation has just made with ``force_n``, (1, 2).

        After going back this is another course of events: what came after is forgotten.
        """
        made = self.step
        del self._forces[made - 1 :]
        del self._keyframes[(made - 1) // self._spacing + 1 :]
        self._forces.append(force_n.copy())
        if made % self._spacing == 0:
            self._keyframes.append(self._simulation.snapshot())
            if len(self._keyframes) > KEYFRAMES:
                del self._keyframes[1::2]
                self._spacing *= 2

    def seek(self, step: int) -> None:
        """Put the simulation to the moment after ``step`` control steps, or the nearest one."""
        step = min(max(step, 0), len(self))
        kept = min(step // self._spacing, len(self._keyframes) - 1)
        if step < self.step or kept * self._spacing > self.step:
            self._simulation.restore(self._keyframes[kept], np.array([0]))
        while self.step < step:
            self._simulation.step(self._forces[self.step])
