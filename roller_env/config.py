"""Every option of the environments, in one frozen and validated object."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from numbers import Integral, Real
from typing import Any, Final, Literal, get_args

from roller_env.game.actions import ActionMode
from roller_env.game.cameras import MODES
from roller_env.game.observations import ObservationMode
from roller_env.game.rewards import RewardMode, RewardWeights
from roller_env.level import Level
from roller_env.physics.presets import PRESETS, PhysicsPreset, physics_preset

RenderMode = Literal["rgb_array"]
LevelSource = str | os.PathLike[str] | Level

MAX_PICTURE_EDGE: Final = 4096
MAX_ENVS: Final = 10**6


@dataclass(frozen=True, kw_only=True)
class EnvConfig:
    """Options of `gymnasium.make("Roller/...", **options)` and of `RollerVecEnv`.

    Attributes:
        level: name of a shipped level, path of a level file, or a `Level`.
        action: ``directions`` (Discrete(9): nothing, then forward and round to the left),
            ``keys`` (MultiBinary(4): W A S D) or ``force`` (Box(2): -1 to 1 of a key's force).
        observation: ``state``, ``rays``, ``dict`` or ``pixels``.
        reward: ``points`` or ``shaped`` (points and potential-based progress along the route).
        reward_weights: what coins, finish, fall and progress are worth.
        discount: gamma of the shaping; give the same to the training algorithm.
        control_dt_s: time between actions; a multiple of the preset's time step.
        physics: ``fast``, ``default``, ``accurate`` or a `PhysicsPreset`.
        max_episode_steps: truncates episodes before the level's own time limit does.
        camera: ``game`` (as the level's triggers say) or a mode 0 to 5 for good.
        render_mode: None or ``rgb_array``.
        width: width of pictures in pixels.
        height: height of pictures in pixels.
        num_threads: native threads of a vector environment; 0 means one for each CPU.

    Raises:
        ValueError: an option's value is not allowed; the message says what is.
    """

    level: LevelSource = "classic"
    action: ActionMode = "directions"
    observation: ObservationMode = "state"
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
        if not isinstance(self.level, (str, os.PathLike, Level)):
            raise ValueError(
                f"level: found {self.level!r}; must be a shipped level's name, a path or a Level"
            )
        _one_of("action", self.action, get_args(ActionMode))
        _one_of("observation", self.observation, get_args(ObservationMode))
        _one_of("reward", self.reward, get_args(RewardMode))
        _one_of("render_mode", self.render_mode, (None, *get_args(RenderMode)))
        _one_of("camera", self.camera, ("game", *range(len(MODES))))
        if not isinstance(self.reward_weights, RewardWeights):
            raise ValueError(
                f"reward_weights: found {self.reward_weights!r}; must be a RewardWeights"
            )
        if not (_is_number(self.discount) and 0.0 <= self.discount <= 1.0):
            raise ValueError(f"discount: found {self.discount!r}; must be a number from 0 to 1")
        for name in ("width", "height"):
            check_whole(name, getattr(self, name), 16, MAX_PICTURE_EDGE)
        check_whole("num_threads", self.num_threads, 0, 4096)
        if self.max_episode_steps is not None:
            check_whole("max_episode_steps", self.max_episode_steps, 1, 10**9)
        self._check_control_dt()

    def _check_control_dt(self) -> None:
        if not isinstance(self.physics, PhysicsPreset):
            _one_of("physics", self.physics, tuple(PRESETS))
        step = physics_preset(self.physics).dt_s
        if not (_is_number(self.control_dt_s) and 0.0 < self.control_dt_s <= 1.0):
            raise ValueError(
                f"control_dt_s: found {self.control_dt_s!r}; must be a number of seconds more than "
                "0 and at most 1"
            )
        multiple = self.control_dt_s / step
        if round(multiple) < 1 or abs(multiple - round(multiple)) > 1e-6:
            nearest = max(round(multiple), 1) * step
            raise ValueError(
                f"control_dt_s: found {self.control_dt_s:g}, which is no multiple of the physics "
                f"step {step:g}; the nearest is {nearest:.10g}"
            )

    @property
    def substeps(self) -> int:
        """Physics steps in a control step."""
        return round(self.control_dt_s / physics_preset(self.physics).dt_s)


def make_config(**options: Any) -> EnvConfig:
    """Return the configuration with these options.

    Raises:
        ValueError: there is no option of that name, or its value is not allowed.
    """
    known = [f.name for f in fields(EnvConfig)]
    for name in options:
        if name not in known:
            near = get_close_matches(name, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise ValueError(f"unknown option {name!r}; options are {', '.join(known)}{hint}")
    return EnvConfig(**options)


def _one_of(name: str, value: object, allowed: tuple[object, ...]) -> None:
    # True == 1 in Python, but camera=True is a mistake.
    if any(value == choice and type(value) is type(choice) for choice in allowed):
        return
    near = get_close_matches(str(value), [str(choice) for choice in allowed], n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    choices = ", ".join(repr(choice) for choice in allowed)
    raise ValueError(f"{name}: found {value!r}; allowed are {choices}{hint}")


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def check_whole(name: str, value: object, low: int, high: int) -> None:
    """Refuse what is not a whole number from ``low`` to ``high``.

    Raises:
        ValueError: it is not; the message calls it ``name``.
    """
    if isinstance(value, bool) or not isinstance(value, Integral) or not low <= int(value) <= high:
        raise ValueError(f"{name}: found {value!r}; must be a whole number from {low} to {high}")
