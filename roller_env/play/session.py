"""GameSession: one person's game over the Simulation that agents play.

Time comes in as frames of any length and goes to the simulation in control steps of one fixed
length, so that the same actions give the same bits here and in training. By default a step is one
step of the physics: the keys are read as often as the physics looks at them, and the picture,
which lies between the last two steps, is late by one of them and no more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final, Protocol

import numpy as np
from gymnasium.utils import seeding

from roller_env.arrays import Float64
from roller_env.config import EnvConfig, LevelSource
from roller_env.game.actions import action_of_keys, forces
from roller_env.game.result import EpisodeResult
from roller_env.game.state import GameState
from roller_env.level import Level
from roller_env.physics.presets import PhysicsPreset, physics_preset
from roller_env.play.history import History
from roller_env.rigid_body import FixedStepPacer, Pose, interpolate
from roller_env.simulation import Simulation, Transition

MAX_CATCH_UP_S: Final = 0.1
"""Most game time that one frame may ask for. After a longer stall the game runs slower than the
clock for that frame: it never jumps, and never asks for more than it can compute."""

SLOWEST: Final = 0.05
FASTEST: Final = 4.0
"""Bounds of a game's speed, of the clock's."""


class Phase(Enum):
    """What a person's game is doing."""

    START = "start"
    INTRO = "intro"
    PLAYING = "playing"
    PAUSED = "paused"
    ENDED = "ended"


class Player(Protocol):
    """Who plays when no key is held: an agent."""

    def reset(self) -> None:
        """An episode begins."""

    def __call__(self, simulation: Simulation) -> Any:
        """Return the action, in the simulation's action mode, for its next control step."""


class Observer(Protocol):
    """Somebody who keeps what was played, such as a recorder of replays.

    What it is given is the game's own: it reads and copies, and changes nothing.
    """

    def on_reset(self, simulation: Simulation, seed: int) -> None:
        """An episode has begun, with the generator that Gymnasium makes of ``seed``."""

    def on_step(self, simulation: Simulation, force_n: Float64, transition: Transition) -> None:
        """A control step has been made with the keys' force ``force_n``, (1, 2) newtons."""

    def on_rewind(self, simulation: Simulation) -> None:
        """The game went back to a step before, and goes on from there."""

    def on_end(self, simulation: Simulation, result: EpisodeResult) -> None:
        """The episode is over, or was left; nothing more of it comes."""


@dataclass(frozen=True, eq=False)
class GameFrame:
    """All that a picture and its panels need of one moment; nothing in it changes any more.

    Attributes:
        level: what is played.
        phase: what the game is doing.
        episode: number of this episode in the session, from 0.
        before: (7 + M,) before the last control step: the ball's centre and orientation, and the
            slabs' displacements, in the order of `Simulation.qpos`.
        after: (7 + M,) after it.
        velocity: (3,) m/s of the ball's centre after it.
        force_n: (2,) newtons of the keys in it.
        fraction: 0 to 1, how far between the two the picture is.
        state: the game's, of one row.
        clock_s: time that scenery moves by; it stands still only in a pause.
        result: how the episode stands.
        coins_in_level: as many as can be collected.
        control_in_s: until the keys work.
        falls: episodes of this session that ended in a fall.
        agent: whether there is an agent.
        agent_plays: whether it plays now.
        speed: of the game, of the clock's.
        practice: whether the game went back, or ran slower, in this episode.
    """

    level: Level
    phase: Phase
    episode: int
    before: Float64
    after: Float64
    velocity: Float64
    force_n: Float64
    fraction: float
    state: GameState
    clock_s: float
    result: EpisodeResult
    coins_in_level: int
    control_in_s: float
    falls: int
    agent: bool
    agent_plays: bool
    speed: float
    practice: bool

    def qpos(self) -> Float64:
        """Return the positions to draw, (7 + M,): between the last two states.

        The ball's centre and the slabs by a straight line, the ball's orientation by slerp.
        """
        fraction = min(max(self.fraction, 0.0), 1.0)
        drawn = self.before + fraction * (self.after - self.before)
        poses = [Pose(qpos[None, :3], qpos[None, 3:7]) for qpos in (self.before, self.after)]
        drawn[3:7] = interpolate(poses[0], poses[1], fraction).orientation[0]
        return drawn


def play_config(level: LevelSource, physics: str | PhysicsPreset = "default") -> EnvConfig:
    """Return the options of a person's game: direct keys, a control step of one physics step."""
    step = physics_preset(physics).dt_s
    return EnvConfig(level=level, physics=physics, action="keys", control_dt_s=step, num_threads=1)


class GameSession:
    """One person's game: its phases, its time and its episodes.

    Attributes:
        simulation: what is played; of one row.
        phase: what the game is doing.
        episode: number of the episode, from 0.
        falls: episodes that ended in a fall.
        seed: of the episode under way; the simulation's generator was made of it.
        agent_plays: whether the agent, if there is one, has the ball.
        speed: of the game, of the clock's.
        practice: whether the game went back, or ran slower, in this episode: it is no record.
    """

    def __init__(
        self,
        config: EnvConfig,
        *,
        skip_intro: bool = False,
        seed: int | None = None,
        agent: Player | None = None,
        observers: Sequence[Observer] = (),
    ):
        """Load the level and wait at the start panel.

        Args:
            config: the options; see `play_config`.
            skip_intro: let the keys work at once, not after the original's six seconds.
            seed: of the first episode; each next one has the next number. None takes one from the
                operating system.
            agent: plays until a key is held.
            observers: told of everything played.

        Raises:
            LevelError: the level is not valid.
        """
        self.simulation = Simulation(config, num_envs=1)
        self.phase = Phase.START
        self.episode = -1
        self.falls = 0
        self.agent_plays = agent is not None
        self._agent = agent
        self._observers = tuple(observers)
        self._skip_intro = skip_intro
        self.speed = 1.0
        self._first_seed = _fresh_seed() if seed is None else seed
        self._under_way = False
        step = self.simulation.duration_s
        self._pacer = FixedStepPacer(step, max_steps=max(1, round(MAX_CATCH_UP_S / step)))
        self._scenery_s = 0.0
        self._resumes_to = Phase.PLAYING
        self._history = History(self.simulation)
        self._begin(intro=not skip_intro)

    # What can be read ------------------------------------------------------------------------

    @property
    def level(self) -> Level:
        """What is played."""
        return self.simulation.level

    @property
    def preset(self) -> PhysicsPreset:
        """The settings of the physics."""
        return self.simulation.preset

    @property
    def config(self) -> EnvConfig:
        """The options of the simulation."""
        return self.simulation.config

    @property
    def seed(self) -> int:
        """Seed of the episode under way."""
        return self._first_seed + self.episode

    @property
    def dropped_s(self) -> float:
        """Time by which the game is behind the clock, because frames took longer than allowed."""
        return self._pacer.dropped_s

    @property
    def control_dt_s(self) -> float:
        """Length of a control step."""
        return self.simulation.duration_s

    @property
    def moments_s(self) -> tuple[float, float]:
        """The first and the last moment of the episode that can be shown, since its start."""
        return 0.0, len(self._history) * self.simulation.duration_s

    @property
    def is_moving(self) -> bool:
        """Whether a game is under way."""
        return self.phase in (Phase.INTRO, Phase.PLAYING)

    @property
    def result(self) -> EpisodeResult:
        """How the episode stands."""
        return self.simulation.result()

    def frame(self) -> GameFrame:
        """Return what is to be drawn now."""
        state = self.simulation.state
        return GameFrame(
            level=self.level,
            phase=self.phase,
            episode=self.episode,
            before=self._before,
            after=self._after,
            velocity=self.simulation.ball_velocity[0],
            force_n=self._force_n,
            fraction=self._pacer.fraction if self.phase is not Phase.ENDED else 1.0,
            state=state.copy_rows(),
            clock_s=self._scenery_s,
            result=self.result,
            coins_in_level=int(self.simulation.coins_in_level[0]),
            control_in_s=float(state.control_delay_s[0]),
            falls=self.falls,
            agent=self._agent is not None,
            agent_plays=self.agent_plays,
            speed=self.speed,
            practice=self.practice,
        )

    # What a person can do --------------------------------------------------------------------

    def start(self) -> None:
        """Leave the start panel: the level is loaded, and the intro runs unless it is skipped."""
        if self.phase is Phase.START:
            self.phase = Phase.PLAYING if self._skip_intro else Phase.INTRO

    def restart(self) -> None:
        """Load the level anew and go on at once, as after a fall: no intro."""
        if self.phase is not Phase.START:
            self._begin(intro=False)
            self.phase = Phase.PLAYING

    def skip_intro(self) -> None:
        """Let the keys work at once, instead of when the intro is over."""
        if self.phase is Phase.INTRO:
            self.restart()

    def pause(self) -> None:
        """Stop time, while a game is under way."""
        if self.is_moving:
            self._resumes_to, self.phase = self.phase, Phase.PAUSED

    def resume(self) -> None:
        """Let time go on, from the moment that is shown."""
        if self.phase is Phase.PAUSED:
            self._go_on()
            self.phase = self._resumes_to

    def seek(self, time_s: float) -> None:
        """Show another moment of the episode, nearest to ``time_s`` since its start; in a pause."""
        if self.phase is Phase.PAUSED:
            self._history.seek(round(time_s / self.simulation.duration_s))
            self._before = self._after = self.simulation.qpos[0]

    def step_once(self, held: str = "") -> None:
        """Make one control step in a pause, from the moment that is shown."""
        if self.phase is Phase.PAUSED:
            self._go_on()
            self._step(held)

    def set_speed(self, factor: float) -> None:
        """Let the game run slower or faster than the clock, from `SLOWEST` to `FASTEST` of it."""
        self.speed = min(max(factor, SLOWEST), FASTEST)
        self.practice |= self.speed < 1.0

    def hand_back(self) -> None:
        """Give the ball back to the agent, if there is one."""
        if self._agent is not None:
            self._agent.reset()
            self.agent_plays = True

    def warm_up(self) -> None:
        """Have compiled what a step needs, in a game that nobody sees."""
        unseen = Simulation(self.config, num_envs=1)
        unseen.seed([np.random.default_rng(0)])
        unseen.reset()
        unseen.step(np.zeros((1, 2)))

    def close(self) -> None:
        """Leave the game; the observers are told of an episode that was not played to its end."""
        self._leave()

    # What time does --------------------------------------------------------------------------

    def advance(self, elapsed_s: float, held: str = "") -> int:
        """Let real time pass and return how many control steps were made.

        Args:
            elapsed_s: since the last call.
            held: the letters of "wasd" that are held. Holding any takes the ball from the agent.

        Raises:
            ValueError: the time is negative or no finite number.
        """
        if held and self.phase is Phase.PLAYING:
            self.agent_plays = False
        if self.phase is Phase.PAUSED:
            return 0
        elapsed_s *= self.speed
        self._scenery_s += elapsed_s
        made = 0
        if self.is_moving:
            for _ in range(self._pacer.advance(elapsed_s)):
                made += 1
                if self._step(held):
                    break
        return made

    def _step(self, held: str) -> bool:
        """Make one control step; return whether the game ended or began anew in it."""
        simulation = self.simulation
        force = forces(self.config.action, np.asarray(self._action(held))[None])
        self._before = simulation.qpos[0]
        transition = simulation.step(force)
        self._after = simulation.qpos[0]
        self._force_n = force[0]
        self._history.record(force)
        for observer in self._observers:
            observer.on_step(simulation, force, transition)
        if self.phase is Phase.INTRO and simulation.state.control_delay_s[0] <= 0.0:
            self.phase = Phase.PLAYING
        if not simulation.state.over[0]:
            return False
        self._leave()
        if simulation.state.fallen[0]:
            self.falls += 1
            self._begin(intro=False)
        else:
            self.phase = Phase.ENDED
        return True

    def _action(self, held: str) -> Any:
        if self._agent is not None and self.agent_plays:
            return self._agent(self.simulation)
        return action_of_keys(self.config.action, held)

    def _begin(self, intro: bool) -> None:
        """Begin the next episode."""
        self._leave()
        self.episode += 1
        generator, _ = seeding.np_random(self.seed)
        self.simulation.seed([generator])
        self.simulation.reset(intro=intro)
        # Nothing to draw between: the ball did not move there, it was put there.
        self._before = self._after = self.simulation.qpos[0]
        self._force_n = np.zeros(2)
        self._history = History(self.simulation)
        self.practice = self.speed < 1.0
        if self._agent is not None:
            self._agent.reset()
        self._under_way = True
        for observer in self._observers:
            observer.on_reset(self.simulation, self.seed)

    def _go_on(self) -> None:
        """Tell those who watch if time goes on from a moment before the last."""
        if self._history.is_back:
            self.practice = True
            if self._agent is not None:
                self._agent.reset()
            for observer in self._observers:
                observer.on_rewind(self.simulation)

    def _leave(self) -> None:
        if self._under_way:
            self._under_way = False
            result = self.result
            for observer in self._observers:
                observer.on_end(self.simulation, result)


def _fresh_seed() -> int:
    """Return a seed that leaves room for an episode's number to be added."""
    return int(np.random.SeedSequence().generate_state(1)[0]) // 2
