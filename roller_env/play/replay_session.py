"""A replay in the place of a game: it plays, stands still, and goes to wherever one wants."""

from __future__ import annotations

from typing import Final

import numpy as np

from roller_env.game.result import EpisodeResult
from roller_env.game.step import INTRO_S
from roller_env.level.schema import Level
from roller_env.physics.presets import PhysicsPreset
from roller_env.play.session import FASTEST, SLOWEST, GameFrame, Phase
from roller_env.replay import Playback, Replay

_STEP_ROUNDING: Final = 1e-6


class ReplaySession:
    """A replay in the place of a person's game: it gives frames, and takes no keys.

    Attributes:
        phase: playing or paused.
        time_s: the moment shown, since the episode's start.
        speed: of the replay, of the clock's.
        intro_s: how long after the episode's start the keys work, as recorded.
    """

    def __init__(self, replay: Replay):
        """Stand at the start, playing."""
        self.phase = Phase.PLAYING
        self.time_s = 0.0
        self.speed = 1.0
        self.intro_s = INTRO_S if replay.intro else 0.0
        self._playback = Playback(replay)
        # Played once, so that from now on every moment is near to one that is kept.
        self._playback.seek(len(self._playback))
        self._scenery_s = 0.0
        self._rewinds = 0
        self._step = -1
        self._show()

    @property
    def level(self) -> Level:
        """What is played."""
        return self._playback.simulation.level

    @property
    def preset(self) -> PhysicsPreset:
        """The settings of the physics."""
        return self._playback.simulation.preset

    @property
    def control_dt_s(self) -> float:
        """Length of a control step."""
        return self._playback.simulation.duration_s

    @property
    def moments_s(self) -> tuple[float, float]:
        """The first and the last moment."""
        return 0.0, self._playback.duration_s

    @property
    def is_moving(self) -> bool:
        """Whether it plays."""
        return self.phase is Phase.PLAYING

    @property
    def result(self) -> EpisodeResult:
        """How the episode stands at the moment shown."""
        return self._playback.simulation.result()

    def start(self) -> None:
        """Play on; at the end, from the start."""
        self.resume()

    def skip_intro(self) -> None:
        """Nothing: it is on record."""

    def restart(self) -> None:
        """Play from the start."""
        self.seek(0.0)
        self.phase = Phase.PLAYING

    def pause(self) -> None:
        """Stand still."""
        self.phase = Phase.PAUSED

    def resume(self) -> None:
        """Play on; at the end, from the start."""
        if self.time_s >= self.moments_s[1]:
            self.seek(0.0)
        self.phase = Phase.PLAYING

    def hand_back(self) -> None:
        """Nothing: nobody else plays."""

    def close(self) -> None:
        """Nothing: nothing is recorded."""

    def set_speed(self, factor: float) -> None:
        """Play slower or faster than the clock, from `SLOWEST` to `FASTEST` of it."""
        self.speed = min(max(factor, SLOWEST), FASTEST)

    def step_once(self, held: str = "") -> None:
        """Go on by a control step."""
        del held
        self.seek((self._step + 1) * self.control_dt_s)

    def seek(self, time_s: float) -> None:
        """Show another moment, between the start and the end."""
        time_s = min(max(time_s, 0.0), self.moments_s[1])
        if time_s < self.time_s:
            self._rewinds += 1
        self.time_s = time_s
        self._show()

    def advance(self, elapsed_s: float, held: str = "") -> int:
        """Let real time pass; return how many control steps that was."""
        del held
        if self.phase is not Phase.PLAYING:
            return 0
        elapsed_s *= self.speed
        self._scenery_s += elapsed_s
        before, self.time_s = self._step, min(self.time_s + elapsed_s, self.moments_s[1])
        self._show()
        if self.time_s >= self.moments_s[1]:
            self.phase = Phase.PAUSED
        return self._step - before

    def frame(self) -> GameFrame:
        """Return what is to be drawn now."""
        simulation, replay = self._playback.simulation, self._playback.replay
        return GameFrame(
            level=self.level,
            phase=self.phase,
            episode=self._rewinds,
            before=self._before,
            after=self._after,
            velocity=simulation.ball_velocity[0],
            force_n=replay.force_n[self._step] if len(replay) else np.zeros(2),
            fraction=min(max(self.time_s / self.control_dt_s - self._step, 0.0), 1.0),
            state=simulation.state.copy_rows(),
            clock_s=self._scenery_s,
            result=simulation.result(),
            coins_in_level=int(simulation.coins_in_level[0]),
            control_in_s=float(simulation.state.control_delay_s[0]),
            # On record it is a part of the episode.
            intro_s=0.0,
            falls=0,
            agent=False,
            agent_plays=False,
            speed=self.speed,
            practice=False,
        )

    def _show(self) -> None:
        """Find the two states between which the moment lies; the game's is the later one."""
        playback = self._playback
        last = max(len(playback) - 1, 0)
        step = min(int(self.time_s / self.control_dt_s + _STEP_ROUNDING), last)
        if step == self._step:
            return
        self._step = step
        playback.seek(step)
        self._before = playback.simulation.qpos[0]
        playback.seek(step + 1)
        self._after = playback.simulation.qpos[0]
