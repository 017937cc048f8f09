"""How far a training is, for a person: a bar on a terminal, plain lines anywhere else."""

from __future__ import annotations

import sys
import time
from typing import Final

from tqdm import tqdm

SECONDS_BETWEEN_LINES: Final = 15.0


class ProgressDisplay:
    """Shows the step count, the speed and what the agent reaches."""

    def __init__(self, total_steps: int, steps: int) -> None:
        """Begin.

        Args:
            total_steps: of the training.
            steps: done in earlier sessions.
        """
        self._total = total_steps
        self._start = self._steps = steps
        self._start_s = self._line_s = time.monotonic()
        self._bar = (
            tqdm(total=total_steps, initial=steps, unit=" steps", unit_scale=True)
            if sys.stderr.isatty()
            else None
        )

    def update(self, steps: int, total_steps: int, achieved: str) -> None:
        """Show that `steps` are done, and in a few words what the agent now reaches.

        Args:
            steps: so far.
            total_steps: of the training, as far as that is known now.
            achieved: in a few words.
        """
        self._total = total_steps
        if self._bar is not None:
            self._bar.total = total_steps
            self._bar.set_postfix_str(achieved, refresh=False)
            self._bar.update(steps - self._steps)
        elif time.monotonic() - self._line_s >= SECONDS_BETWEEN_LINES or steps >= self._total:
            self._line_s = time.monotonic()
            print(self._line(steps, achieved), flush=True)
        self._steps = steps

    def close(self) -> None:
        """End; the bar stays on the screen."""
        if self._bar is not None:
            self._bar.close()

    def _line(self, steps: int, achieved: str) -> str:
        speed = (steps - self._start) / max(time.monotonic() - self._start_s, 1e-9)
        minutes, seconds = divmod(round(max(self._total - steps, 0) / max(speed, 1e-9)), 60)
        return (
            f"{steps:>12,} of {self._total:,} steps, {speed:,.0f} steps/s, "
            f"{minutes} min {seconds:02} s left; {achieved}"
        )
