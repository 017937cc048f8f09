"""What a replay is: all that an episode depended on, so that it can be played again exactly."""

from __future__ import annotations

import hashlib
import platform
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from typing import Annotated, Any, Final, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, model_validator

from roller_env import __version__
from roller_env.config import EnvConfig, make_config
from roller_env.game.actions import ActionMode
from roller_env.game.observations import ObservationMode
from roller_env.game.rewards import RewardMode, RewardWeights
from roller_env.level import Level
from roller_env.physics.presets import PhysicsPreset, physics_preset

Float64 = npt.NDArray[np.float64]
Checksums = npt.NDArray[np.uint32]

FORMAT_VERSION: Final = 1
"""Raised when a file of before can no longer be read."""

MAX_STEPS: Final = 2**20
"""Control steps of a replay: 14 hours of play at 20 a second."""

MAX_PHYSICS_STEPS: Final = 2**22
"""Physics steps of a replay, since a file must not be able to ask for days of work: over an hour
of the finest preset."""

_MIN_PHYSICS_DT_S: Final = 1e-5
_MAX_SOLVER_ITERATIONS: Final = 1000

MAX_TEXT: Final = 200
"""Characters of a name in a replay."""

Text = Annotated[str, Field(max_length=MAX_TEXT)]
Number = Annotated[float, Field(allow_inf_nan=False)]


class ReplayError(ValueError):
    """A replay that cannot be read, written or played; the message says in one line why."""


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Versions(_Frozen):
    """What computed the episode. The same on two machines, the bits are the same.

    Attributes:
        roller: this package.
        mujoco: the physics.
        numpy: the rules' arrays.
        numba: the rules' arithmetic.
        python: the interpreter.
        machine: the processor's architecture, such as ``x86_64``.
        system: the operating system.
        libc: the C library, whose sines and cosines MuJoCo uses.
    """

    roller: Text
    mujoco: Text
    numpy: Text
    numba: Text
    python: Text
    machine: Text
    system: Text
    libc: Text

    @staticmethod
    def here() -> Versions:
        """Return what is installed here."""
        return Versions(
            roller=__version__,
            mujoco=version("mujoco"),
            numpy=version("numpy"),
            numba=version("numba"),
            python=platform.python_version(),
            machine=platform.machine(),
            system=platform.system(),
            libc=" ".join(platform.libc_ver()).strip(),
        )

    def differences(self, other: Versions) -> tuple[str, ...]:
        """Return ``name mine, not theirs`` of all in which the two differ."""
        mine, theirs = self.model_dump(), other.model_dump()
        return tuple(
            f"{name} {mine[name] or 'unknown'}, not {theirs[name] or 'unknown'}"
            for name in mine
            if mine[name] != theirs[name]
        )


class Options(_Frozen):
    """The options of the environment on which an episode and what an agent sees of it depend.

    They are those of `roller_env.config.EnvConfig`; ``physics`` is the whole preset, so that a
    replay outlives a change of what the preset's name stands for.
    """

    action: ActionMode
    observation: ObservationMode
    reward: RewardMode
    reward_weights: RewardWeights
    discount: Number
    control_dt_s: Number
    physics: PhysicsPreset
    max_episode_steps: int | None

    @model_validator(mode="after")
    def _can_be_played(self) -> Options:
        preset = self.physics
        if not _MIN_PHYSICS_DT_S <= preset.dt_s <= 1.0:
            raise ValueError(f"physics.dt_s: found {preset.dt_s}; must be {_MIN_PHYSICS_DT_S} to 1")
        if not 1 <= preset.iterations <= _MAX_SOLVER_ITERATIONS:
            raise ValueError(
                f"physics.iterations: found {preset.iterations}; must be 1 to "
                f"{_MAX_SOLVER_ITERATIONS}"
            )
        if not (0.0 < preset.impratio < np.inf and 0.0 <= preset.tolerance < np.inf):
            raise ValueError("physics: impratio and tolerance must be positive and finite")
        EnvConfig(**self.keywords())
        return self

    @staticmethod
    def of(config: EnvConfig) -> Options:
        """Return the options of a configuration."""
        return Options(
            action=config.action,
            observation=config.observation,
            reward=config.reward,
            reward_weights=config.reward_weights,
            discount=float(config.discount),
            control_dt_s=float(config.control_dt_s),
            physics=physics_preset(config.physics),
            max_episode_steps=config.max_episode_steps,
        )

    def keywords(self) -> dict[str, Any]:
        """Return the options by the names `EnvConfig` has for them."""
        return {name: getattr(self, name) for name in Options.model_fields}


class Result(_Frozen):
    """How an episode ended, or stood when its recording did.

    Attributes:
        success: at the finish.
        fall: below the kill height.
        diverged: the physics failed.
        truncated: the time was up.
        coins: collected.
        score_percent: of the level's coins.
        time_s: played.
        total_reward: undiscounted sum, with the replay's reward options.
    """

    success: bool
    fall: bool
    diverged: bool
    truncated: bool
    coins: Annotated[int, Field(ge=0)]
    score_percent: Number
    time_s: Number
    total_reward: Number

    @property
    def outcome(self) -> Literal["finish", "fall", "diverged", "time limit", "not ended"]:
        """The end in a word or two."""
        if self.success:
            return "finish"
        if self.fall:
            return "fall"
        if self.diverged:
            return "diverged"
        return "time limit" if self.truncated else "not ended"


@dataclass(frozen=True, eq=False)
class Replay:
    """One episode from its start, by what it depends on; all else is computed again from that.

    Attributes:
        level: what was played.
        options: how.
        start: where the ball's centre began, metres, world frame. It is all that chance decides in
            an episode: the jitter that the row's random generator drew at the reset.
        intro: whether the keys worked only after the intro.
        force_n: (T, 2) float64 newtons of the keys in every control step, world x and y.
        checksums: (T + 1,) uint32 of the game's whole state before the first step and after each;
            see `roller_env.replay.recorder.checksums`.
        result: how it ended.
        versions: what computed it.
        player: who played, in words.
        seed: what the row's generator was seeded with before the first of its episodes, if known.
    """

    level: Level
    options: Options
    start: tuple[float, float, float]
    intro: bool
    force_n: Float64
    checksums: Checksums
    result: Result
    versions: Versions
    player: str = ""
    seed: int | None = None

    def __post_init__(self) -> None:
        """Refuse what no recording of this level can hold.

        Raises:
            ReplayError: it does.
        """
        if len(self.player) > MAX_TEXT:
            raise ReplayError(f"player: found {len(self.player)} characters; at most {MAX_TEXT}")
        steps = len(self.force_n)
        if self.force_n.shape != (steps, 2) or not np.isfinite(self.force_n).all():
            raise ReplayError("the forces must be two finite numbers a step")
        if self.checksums.shape != (steps + 1,):
            raise ReplayError(f"{len(self.checksums)} checksums for {steps} steps; one more needed")
        substeps = EnvConfig(**self.options.keywords()).substeps
        if steps > MAX_STEPS or steps * substeps > MAX_PHYSICS_STEPS:
            raise ReplayError(
                f"{steps} control steps of {substeps} physics steps each are too long a replay; "
                f"allowed are {MAX_STEPS} control steps and {MAX_PHYSICS_STEPS} physics steps"
            )
        begin, jitter = self.level.start.at, (*self.level.start.jitter, 0.0)
        for here, there, most in zip(self.start, begin, jitter, strict=True):
            # The sum of start and jitter is rounded.
            if not abs(here - there) <= most + 1e-9 * max(1.0, abs(there)):
                raise ReplayError(
                    f"the ball starts at {self.start}; this level lets it start within {jitter} "
                    f"of {begin}"
                )

    def __len__(self) -> int:
        """Return the number of control steps."""
        return len(self.force_n)

    @cached_property
    def level_text(self) -> str:
        """The level as `canonical_text` writes it."""
        return canonical_text(self.level)

    @cached_property
    def level_hash(self) -> str:
        """SHA-256 of `level_text`, hexadecimal."""
        return hashlib.sha256(self.level_text.encode()).hexdigest()

    def config(self, **changes: Any) -> EnvConfig:
        """Return the configuration in which the replay is played again.

        Args:
            changes: other options than the recording's, such as ``observation="rays"``. The game
                is the same for it, as long as they are not those of the physics or of time.
        """
        options = {"level": self.level, "num_threads": 1, **self.options.keywords(), **changes}
        return make_config(**options)


def canonical_text(level: Level) -> str:
    """Return a level as JSON in metres with every default written out: equal levels, equal text."""
    return level.model_dump_json()
