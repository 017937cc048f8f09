"""What a replay is: all that an episode depended on, so that it can be played again exactly."""

from __future__ import annotations

import hashlib
import json
import platform
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.metadata import version
from typing import Annotated, Any, Final

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from roller_env import __version__
from roller_env.arrays import Float64
from roller_env.config import EnvConfig, make_config
from roller_env.game.actions import forces
from roller_env.game.result import EpisodeResult
from roller_env.game.version import RULES_VERSION
from roller_env.level import Level
from roller_env.physics.presets import Engine
from roller_env.physics.version import PHYSICS_VERSION
from roller_env.replay.actions import Actions, checked_actions
from roller_env.replay.checksums import MAX_ROWS, QUANTITIES, Checksums, row_count
from roller_env.replay.errors import ReplayError

FORMAT_VERSION: Final = 2
"""Raised when a file of before can no longer be read."""

MAX_STEPS: Final = 2**20
"""Control steps of a replay: 14 hours of play at 20 a second."""

MAX_PHYSICS_STEPS: Final = 2**22
"""Physics steps of a replay, since a file must not be able to ask for days of work: over an hour
of the finest preset."""

MAX_TEXT: Final = 200
"""Characters of a name in a replay."""


def _printable(text: str) -> str:
    """Refuse what would do something to the terminal that it is written on."""
    if not text.isprintable():
        raise ValueError(f"found {text!r}, which has characters that cannot be printed")
    return text


Text = Annotated[str, Field(max_length=MAX_TEXT), AfterValidator(_printable)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0, lt=2**31)]


class Versions(BaseModel):
    """What computed the episode. The same on two machines, the bits are the same.

    Attributes:
        rules: `roller_env.game.version.RULES_VERSION`.
        engine: of the physics.
        physics: `roller_env.physics.version.PHYSICS_VERSION` of that engine.
        roller: this package.
        mujoco: the physics.
        numpy: the rules' arrays.
        numba: the rules' arithmetic.
        python: the interpreter.
        machine: the processor's architecture, such as ``x86_64``.
        system: the operating system.
        libc: the C library, whose sines and cosines MuJoCo uses.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    rules: Count
    engine: Engine
    physics: Count
    roller: Text
    mujoco: Text
    numpy: Text
    numba: Text
    python: Text
    machine: Text
    system: Text
    libc: Text

    @staticmethod
    @cache
    def here(engine: Engine = "mujoco") -> Versions:
        """Return what is installed here."""
        return Versions(
            rules=RULES_VERSION,
            engine=engine,
            physics=PHYSICS_VERSION[engine],
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
            f"{name} {str(mine[name]) or 'unknown'}, not {str(theirs[name]) or 'unknown'}"
            for name in mine
            if mine[name] != theirs[name]
        )


def recorded_options(config: EnvConfig, level: Level) -> EnvConfig:
    """Return the options on which an episode and what an agent sees of it depend, alone.

    Args:
        config: in which it is played; the preset is taken whole, so that a replay outlives a change
            of what the preset's name stands for.
        level: that is played.
    """
    return make_config(level=level, num_threads=1, **config.episode_options())


@dataclass(frozen=True, eq=False)
class Replay:
    """One episode from its start, by what it depends on; all else is computed again from that.

    Attributes:
        options: what was played and how, as `recorded_options` has them.
        start: where the ball's centre began, metres, world frame. It is all that chance decides in
            an episode: the jitter that the row's random generator drew at the reset.
        intro: whether the keys worked only after the intro.
        actions: what the player did in every control step, (T,), (T, 4) or (T, 2) as the action
            mode has it; see `roller_env.replay.actions.checked_actions`.
        checksums: by which a game is seen to be this one.
        result: how it ended.
        versions: what computed it.
        player: who played, in words.
        seed: what the row's generator was seeded with before the first of its episodes, if known.
    """

    options: EnvConfig
    start: tuple[float, float, float]
    intro: bool
    actions: Actions
    checksums: Checksums
    result: EpisodeResult
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
        if not self.player.isprintable():
            raise ReplayError(f"player: found {self.player!r}; must be characters that print")
        object.__setattr__(self, "actions", checked_actions(self.options.action, self.actions))
        check_game(self.options, self.start, len(self.actions))
        self._check_checksums()

    def _check_checksums(self) -> None:
        sums = self.checksums
        unknown = [name for name in sums.quantities if name not in QUANTITIES]
        if unknown or not sums.quantities or len(set(sums.quantities)) < len(sums.quantities):
            raise ReplayError(
                f"quantities: found {', '.join(sums.quantities)}; must be some of "
                f"{', '.join(QUANTITIES)}, each once"
            )
        if sums.every < 1:
            raise ReplayError(f"found checksums every {sums.every} steps; must be 1 or more")
        rows = row_count(len(self), sums.every)
        if sums.table.shape != (rows, len(sums.quantities)) or rows > MAX_ROWS:
            raise ReplayError(
                f"found checksums {sums.table.shape} for {len(self)} steps; needed are {rows} rows "
                f"of {len(sums.quantities)}, and {MAX_ROWS} rows at most"
            )

    def __len__(self) -> int:
        """Return the number of control steps."""
        return len(self.actions)

    @property
    def level(self) -> Level:
        """What was played."""
        return _level_of(self.options)

    @cached_property
    def force_n(self) -> Float64:
        """(T, 2) newtons of the keys in every control step, world x and y."""
        return forces(self.options.action, self.actions)

    @cached_property
    def level_text(self) -> str:
        """The level as `canonical_text` writes it."""
        return canonical_text(self.level)

    @cached_property
    def level_hash(self) -> str:
        """See `level_hash`."""
        return _hash(self.level_text)

    @cached_property
    def environment_key(self) -> tuple[str, str]:
        """The level and the options as text, the same for all replays of one environment."""
        return self.level_hash, json.dumps(self.options.episode_options())

    def config(self, **changes: Any) -> EnvConfig:
        """Return the configuration in which the replay is played again.

        Args:
            changes: other options than the recording's, such as ``observation="rays"``. The game
                is the same for it, as long as they are not those of the physics or of time.
        """
        return make_config(**{**self.options.keywords(), **changes})


def check_length(options: EnvConfig, steps: int) -> None:
    """Refuse an episode of more control steps than a replay can have.

    Raises:
        ReplayError: it is too long.
    """
    substeps = options.substeps
    if steps > MAX_STEPS or steps * substeps > MAX_PHYSICS_STEPS:
        raise ReplayError(
            f"{steps} control steps of {substeps} physics steps each are too long a replay; "
            f"allowed are {MAX_STEPS} control steps and {MAX_PHYSICS_STEPS} physics steps"
        )


def _level_of(options: EnvConfig) -> Level:
    """Return the level of options as `recorded_options` has them: checked, and no name."""
    assert isinstance(options.level, Level)
    return options.level


def canonical_text(level: Level) -> str:
    """Return a level as JSON in metres with every default written out: equal levels, equal text."""
    return level.model_dump_json()


def level_hash(level: Level) -> str:
    """Return the SHA-256 of `canonical_text`, hexadecimal: equal levels, equal hash."""
    return _hash(canonical_text(level))


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def check_game(options: EnvConfig, start: tuple[float, float, float], steps: int) -> None:
    """Refuse, before anything is made, a game that no recording of a level can hold.

    Args:
        options: what was played and how, as `recorded_options` has them.
        start: where the ball's centre began, metres.
        steps: control steps.

    Raises:
        ReplayError: it is too long, or begins where the level does not.
    """
    level = _level_of(options)
    check_length(options, steps)
    begin, jitter = level.start.at, (*level.start.jitter, 0.0)
    for here, there, most in zip(start, begin, jitter, strict=True):
        # The sum of start and jitter is rounded.
        if not abs(here - there) <= most + 1e-9 * max(1.0, abs(there)):
            raise ReplayError(
                f"the ball starts at {start}; this level lets it start within {jitter} of {begin}"
            )
