"""Every option of the environments, in one frozen and validated object."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Final, Literal, get_args

from pydantic import JsonValue

from roller_env import checks
from roller_env.game.actions import ActionMode
from roller_env.game.cameras import MODES
from roller_env.game.observations import Kinds, ObservationMode
from roller_env.game.rewards import RewardMode, RewardWeights
from roller_env.level import Level, load_level
from roller_env.level.load import is_path
from roller_env.physics.presets import PRESETS, PhysicsPreset, physics_preset

RenderMode = Literal["rgb_array"]
LevelSource = str | os.PathLike[str] | Level

MAX_PICTURE_EDGE: Final = 4096
MAX_ENVS: Final = 10**6


_NOT_OF_AN_EPISODE: Final = (
    "level",
    "kinds",
    "camera",
    "render_mode",
    "width",
    "height",
    "num_threads",
)
"""Options by which neither a game's steps change nor what its agent is paid."""


@dataclass(frozen=True, kw_only=True)
class EnvConfig:
    """Options of `gymnasium.make("Roller/...", **options)` and of `RollerVecEnv`.

    Every option is given as Python's objects or as plain JSON values: a level, a preset and the
    weights also as mappings of their fields; NumPy's numbers are numbers. The attributes are then
    what they are written as here, and `to_json` and `make_config` go there and back.

    Attributes:
        level: name of a shipped level, path of a level file, or a `Level`.
        action: ``directions`` (Discrete(9): nothing, then forward and round to the left),
            ``keys`` (MultiBinary(4): W A S D) or ``force`` (Box(2): -1 to 1 of a key's force).
        observation: ``state``, ``rays``, ``dict`` or ``pixels``.
        kinds: whose entries an observation has besides those of coins, plates, gates, lift pads
            and the finish: ``level`` (of what the level has) or ``all`` (of everything there is, so
            that an agent can go from level to level).
        reward: ``points`` or ``shaped`` (points and potential-based progress along the route).
        reward_weights: what coins, finish, fall and progress are worth.
        discount: gamma of the shaping; give the same to the training algorithm.
        control_dt_s: time between actions; a multiple of the preset's time step.
        physics: ``fast``, ``default``, ``accurate``, ``rigid``, ``relaxed`` or a `PhysicsPreset`.
        max_episode_steps: truncates episodes before the level's own time limit does.
        camera: ``game`` (as the level's triggers say) or a mode 0 to 5 for good.
        render_mode: None or ``rgb_array``.
        width: width of pictures in pixels.
        height: height of pictures in pixels.
        num_threads: native threads of a vector environment; 0 means one for each CPU.

    Raises:
        ValueError: options' values are not allowed; a line for each says what is.
    """

    level: LevelSource = "classic"
    action: ActionMode = "directions"
    observation: ObservationMode = "state"
    kinds: Kinds = "level"
    reward: RewardMode = "points"
    reward_weights: RewardWeights = field(default_factory=RewardWeights)
    discount: float = 0.99
    control_dt_s: float = 1 / 20
    physics: str | PhysicsPreset = "default"
    max_episode_steps: int | None = None
    camera: int | Literal["game"] = "game"
    render_mode: RenderMode | None = None
    width: int = 480
    height: int = 320
    num_threads: int = 0

    def __post_init__(self) -> None:
        """Check every option, and the control step against the physics step."""
        one_of, whole = checks.one_of, checks.whole
        checked = checks.each(
            {
                "level": lambda: _level(self.level),
                "action": lambda: one_of("action", self.action, get_args(ActionMode)),
                "observation": lambda: one_of(
                    "observation", self.observation, get_args(ObservationMode)
                ),
                "kinds": lambda: one_of("kinds", self.kinds, get_args(Kinds)),
                "reward": lambda: one_of("reward", self.reward, get_args(RewardMode)),
                "reward_weights": lambda: checks.record(
                    "reward_weights", RewardWeights, self.reward_weights
                ),
                "discount": lambda: checks.number(
                    "discount", self.discount, 0.0, 1.0, "a number from 0 to 1"
                ),
                "control_dt_s": lambda: _control_dt(self.control_dt_s, self.physics),
                "physics": lambda: _physics(self.physics),
                "max_episode_steps": lambda: (
                    self.max_episode_steps
                    if self.max_episode_steps is None
                    else whole("max_episode_steps", self.max_episode_steps, 1, 10**9)
                ),
                "camera": lambda: one_of("camera", self.camera, ("game", *range(len(MODES)))),
                "render_mode": lambda: one_of(
                    "render_mode", self.render_mode, (None, *get_args(RenderMode))
                ),
                "width": lambda: whole("width", self.width, 16, MAX_PICTURE_EDGE),
                "height": lambda: whole("height", self.height, 16, MAX_PICTURE_EDGE),
                "num_threads": lambda: whole("num_threads", self.num_threads, 0, 4096),
            }
        )
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def preset(self) -> PhysicsPreset:
        """The physics settings, whether they were given by name or whole."""
        return physics_preset(self.physics)

    @property
    def substeps(self) -> int:
        """Physics steps in a control step."""
        return round(self.control_dt_s / self.preset.dt_s)

    def keywords(self) -> dict[str, Any]:
        """Return every option by name, as the environments' constructors take them."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def to_json(self) -> dict[str, JsonValue]:
        """Return every option as a plain JSON value.

        ``make_config(**config.to_json())`` is an equal configuration.
        """
        options = self.keywords()
        options["reward_weights"] = asdict(self.reward_weights)
        if isinstance(self.level, Level):
            options["level"] = self.level.model_dump(mode="json", exclude_defaults=True)
        if isinstance(self.physics, PhysicsPreset):
            options["physics"] = asdict(self.physics)
        return options

    def differences(self, other: EnvConfig) -> dict[str, JsonValue]:
        """Return, as plain JSON values, the options that are not the same in the other."""
        theirs = other.to_json()
        return {name: mine for name, mine in self.to_json().items() if mine != theirs[name]}

    def episode_options(self) -> dict[str, JsonValue]:
        """Return, as plain JSON values, what an episode depends on beside the level.

        The preset is among them whole, so that they outlive a change of what its name stands for.
        """
        options = self.to_json() | {"physics": asdict(self.preset)}
        return {name: v for name, v in options.items() if name not in _NOT_OF_AN_EPISODE}


def make_config(**options: Any) -> EnvConfig:
    """Return the configuration with these options.

    Raises:
        TypeError: there is no option of that name.
        ValueError: an option's value is not allowed.
    """
    known = [f.name for f in fields(EnvConfig)]
    for name in options:
        if name not in known:
            # Python's own words: some clients offer a keyword and look for them in the answer.
            raise TypeError(
                f"{EnvConfig.__name__}() got an unexpected keyword argument {name!r}; options are "
                f"{', '.join(known)}{checks.nearest(name, known)}"
            )
    return EnvConfig(**options)


def _level(level: object) -> str | Level:
    """Return a level, or its name or path as text that JSON can carry."""
    if isinstance(level, Mapping):
        return load_level(level)
    if isinstance(level, Level):
        return level
    if isinstance(level, str):
        return str(level)
    if isinstance(level, os.PathLike):
        path = os.fsdecode(level)
        return path if is_path(path) else f"{os.curdir}{os.sep}{path}"
    raise ValueError(
        f"level: found {level!r}; must be a shipped level's name, a path, a Level or a mapping of "
        "a level's fields"
    )


def _physics(physics: object) -> str | PhysicsPreset:
    if isinstance(physics, PhysicsPreset | Mapping):
        return checks.record("physics", PhysicsPreset, physics)
    return checks.one_of("physics", physics, tuple(PRESETS))


def _control_dt(value: object, physics: object) -> float:
    """Return a length of the control step that is a multiple of the physics'."""
    seconds = "a number of seconds more than 0 and at most 1"
    control_dt_s = checks.number("control_dt_s", value, sys.float_info.min, 1.0, seconds)
    try:
        step = physics_preset(_physics(physics)).dt_s
    except ValueError:  # told of the physics itself
        return control_dt_s
    multiple = control_dt_s / step
    if round(multiple) < 1 or abs(multiple - round(multiple)) > 1e-6:
        nearest = max(round(multiple), 1) * step
        raise ValueError(
            f"control_dt_s: found {control_dt_s:g}, which is no multiple of the physics "
            f"step {step:g}; the nearest is {nearest:.10g}"
        )
    return control_dt_s
