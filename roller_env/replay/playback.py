"""Playing a replay again: step by step, from any moment, and bit for bit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from roller_env.arrays import Float64
from roller_env.game.result import EpisodeResult
from roller_env.game.state import GameState
from roller_env.replay.checksums import checksums
from roller_env.replay.contents import Replay, Versions
from roller_env.replay.recorder import place_at_starts
from roller_env.simulation import Simulation, Snapshot, Transition

_KEYFRAMES: Final = 256
"""Moments kept while playing, so that going back need not begin at the start."""

_MIN_KEYFRAME_STEPS: Final = 32
_ROW: Final = np.array([0])


@dataclass(frozen=True, eq=False)
class Frame:
    """One moment of an episode.

    Attributes:
        step: control steps since the start.
        time_s: likewise.
        qpos: (nq,) MuJoCo's positions.
        state: the game's state, one row.
        force_n: (2,) newtons of the keys in the step that follows; zeros at the end.
    """

    step: int
    time_s: float
    qpos: Float64
    state: GameState
    force_n: Float64


class Playback:
    """A replay's game, which can be put to any moment of it.

    Going forward plays; going back restores the nearest of a bounded number of snapshots and plays
    from there. What draws a `Simulation` draws this one, in row 0.

    Attributes:
        replay: what is played.
        simulation: the game as it stands; read it, and change it only through this object.
        step: control steps since the start.
    """

    def __init__(self, replay: Replay, **changes: Any):
        """Compile the level and stand at the start.

        Args:
            replay: what to play.
            changes: other options of `EnvConfig`, such as ``observation``; see `Replay.config`.
        """
        self.replay = replay
        self.simulation = Simulation(replay.config(**changes))
        place_at_starts(self.simulation, np.array([replay.start]), replay.intro)
        self.step = 0
        self._spacing = max(_MIN_KEYFRAME_STEPS, -(-len(replay) // _KEYFRAMES))
        self._keyframes: list[Snapshot] = [self.simulation.snapshot()]

    def __len__(self) -> int:
        """Return the number of control steps; there is one more moment than that."""
        return len(self.replay)

    @property
    def duration_s(self) -> float:
        """Length of the whole episode."""
        return len(self) * self.simulation.duration_s

    def advance(self) -> Transition:
        """Play one control step.

        Raises:
            IndexError: the replay is at its end.
        """
        if self.step >= len(self):
            raise IndexError(f"step: found {self.step}; the replay ends there")
        transition = self.simulation.step(self.replay.force_n[self.step : self.step + 1])
        self.step += 1
        if self.step == len(self._keyframes) * self._spacing:
            self._keyframes.append(self.simulation.snapshot())
        return transition

    def seek(self, step: int) -> None:
        """Go to the moment after ``step`` control steps; beyond the ends, to the nearer end."""
        step = min(max(step, 0), len(self))
        known = min(step // self._spacing, len(self._keyframes) - 1)
        if step < self.step or known * self._spacing > self.step:
            self.simulation.restore(self._keyframes[known])
            self.step = known * self._spacing
        while self.step < step:
            self.advance()

    def seek_time(self, time_s: float) -> None:
        """Go to the last moment that is not after ``time_s``, seconds."""
        # A time that was made by multiplying a step must not fall short of it by rounding.
        self.seek(int(np.floor(time_s / self.simulation.duration_s + 1e-6)))

    def frame(self, step: int | None = None) -> Frame:
        """Return the moment after ``step`` control steps (None: this moment), as copies."""
        if step is not None:
            self.seek(step)
        simulation, force = self.simulation, np.zeros(2)
        if self.step < len(self):
            force = self.replay.force_n[self.step].copy()
        return Frame(
            step=self.step,
            time_s=self.step * simulation.duration_s,
            qpos=simulation.qpos[0],
            state=simulation.state.copy_rows(_ROW),
            force_n=force,
        )


def frames(replay: Replay) -> Iterator[Frame]:
    """Yield every moment of a replay, from the start to the end: one more than it has steps."""
    playback = Playback(replay)
    yield playback.frame()
    while playback.step < len(playback):
        playback.advance()
        yield playback.frame()


def play_together(simulation: Simulation, replays: Sequence[Replay]) -> Iterator[Transition]:
    """Play replays of one level and one set of options in the rows of a simulation, step by step.

    The simulation is at their starts before the first transition is asked for. A row whose replay
    is over is left alone. A row's bits do not depend on its neighbours.

    Args:
        simulation: of as many rows as there are replays, all of which begin anew.
        replays: alike also in whether they begin with the intro.

    Returns:
        The transitions of all steps of the longest.
    """
    place_at_starts(simulation, np.array([r.start for r in replays]), replays[0].intro)
    lengths = np.array([len(replay) for replay in replays])
    force_n = np.zeros((int(lengths.max()), len(replays), 2))
    for row, replay in enumerate(replays):
        force_n[: len(replay), row] = replay.force_n
    return (simulation.step(force, hold=lengths <= step) for step, force in enumerate(force_n))


def paths(replays: Sequence[Replay]) -> list[Float64]:
    """Return where the balls of replays went: centres before every step, (T, 3) metres each.

    Args:
        replays: of one level and one set of options.
    """
    if not replays:
        return []
    simulation = Simulation(replays[0].config(), len(replays))
    steps = play_together(simulation, replays)
    centres = [simulation.ball_position]
    centres += [simulation.ball_position for _ in steps]
    together = np.stack(centres)
    return [together[: len(replay), row] for row, replay in enumerate(replays)]


@dataclass(frozen=True, slots=True)
class Verification:
    """What playing a replay again has shown.

    Attributes:
        steps: the replay's.
        checks: moments at which the replay has checksums.
        step_s: length of one.
        first_mismatch_step: the first step after which a checksum was another than when it was
            recorded, 0 if the game began otherwise; None if none was.
        last_match_step: the last step before that after which all of them were the same; None if
            there is none. The game parted somewhere between the two.
        mismatches: names of the quantities that were others then, of
            `roller_env.replay.checksums.QUANTITIES`; none if the game was over by then.
        result: how the game ended this time.
        recorded: how it ended then.
        differences: what is of another version here than it was there.
    """

    steps: int
    checks: int
    step_s: float
    first_mismatch_step: int | None
    last_match_step: int | None
    mismatches: tuple[str, ...]
    result: EpisodeResult
    recorded: EpisodeResult
    differences: tuple[str, ...]

    @property
    def is_exact(self) -> bool:
        """Whether the game was the same, bit for bit, and ended the same."""
        return self.first_mismatch_step is None and self.result == self.recorded

    def __str__(self) -> str:
        """Say it in a line or a few."""
        others = "; ".join(self.differences)
        if self.is_exact:
            note = f" (though recorded with {others})" if others else ""
            seen = f"{self.steps} steps, checked at {self.checks} moments"
            return f"the same bit for bit over {seen}{note}"
        if self.first_mismatch_step is None:
            reason = f"recorded with {others}" if others else "its result was written by another"
            return f"the same states bit for bit, but another result is recorded: {reason}"
        if others:
            reason = f"recorded with {others}"
        else:
            reason = (
                "no version differs: the rules were changed since it was recorded, its processor "
                "rounded otherwise, or the file was changed"
            )
        what = ", ".join(self.mismatches) or "that the game is over before it"
        known = "" if self.last_match_step is None else f", not yet at step {self.last_match_step}"
        return (
            f"another game at step {self.first_mismatch_step} of {self.steps} "
            f"({self.first_mismatch_step * self.step_s:.2f} s){known}, in {what}: {reason}; "
            f"it ended in {self.recorded.outcome!r} with {self.recorded.coins} coins, "
            f"and now in {self.result.outcome!r} with {self.result.coins}"
        )


def verify(replay: Replay) -> Verification:
    """Play a replay again and compare every checksum."""
    playback = Playback(replay)
    simulation, sums = playback.simulation, replay.checksums
    first: int | None = None
    last: int | None = None
    mismatches: tuple[str, ...] = ()
    while True:
        row = sums.row_of(playback.step, len(replay))
        if first is None and row is not None:
            now = checksums(simulation, _ROW, sums.quantities)[0]
            mismatches = sums.mismatches(row, now)
            first, last = (playback.step, last) if mismatches else (None, playback.step)
        if playback.step == len(replay):
            break
        if simulation.state.over[0]:
            # Nobody can do anything after the end.
            first = playback.step + 1 if first is None else first
            break
        playback.advance()
    return Verification(
        steps=len(replay),
        checks=len(sums.table),
        step_s=simulation.duration_s,
        first_mismatch_step=first,
        last_match_step=last,
        mismatches=mismatches,
        result=simulation.result(),
        recorded=replay.result,
        differences=replay.versions.differences(Versions.here(replay.versions.engine)),
    )
