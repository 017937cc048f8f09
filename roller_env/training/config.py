"""What a training is told: one frozen model, read from YAML, checked before anything runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator
from pydantic_core import ErrorDetails, PydanticCustomError

from roller_env.config import make_config
from roller_env.game.rewards import RewardWeights
from roller_env.problems import Problem, listed

Fraction = Annotated[float, Field(gt=0.0, le=1.0)]
PositiveInt = Annotated[int, Field(gt=0)]
PositiveFloat = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegativeFloat = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class ConfigError(ValueError):
    """A training configuration that cannot be used; the message has one line a fault."""


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class PPOConfig(_Frozen):
    """Proximal policy optimisation, in the field's own terms.

    Attributes:
        rollout_steps: steps of every environment between two updates.
        batch_size: samples of one gradient step; divides ``num_envs * rollout_steps``.
        epochs: passes over a rollout.
        learning_rate: of Adam, at the start.
        learning_rate_decay: ``linear`` goes to 0 at the last step of the training.
        gamma: discount of one step.
        gae_lambda: of generalised advantage estimation.
        clip_range: of the probability ratio.
        entropy_coefficient: weight of the entropy bonus.
        value_coefficient: weight of the value loss.
        max_grad_norm: gradients are clipped to this norm.
        target_kl: an update ends early past 1.5 times this divergence; None never does.
        hidden_sizes: units of the hidden layers, of the policy and of the value network each.
        activation: between the layers.
    """

    rollout_steps: PositiveInt = 128
    batch_size: PositiveInt = 8192
    epochs: PositiveInt = 4
    learning_rate: PositiveFloat = 1e-3
    learning_rate_decay: Literal["constant", "linear"] = "linear"
    gamma: Fraction = 0.99
    gae_lambda: Fraction = 0.95
    clip_range: PositiveFloat = 0.2
    entropy_coefficient: NonNegativeFloat = 0.01
    value_coefficient: NonNegativeFloat = 0.5
    max_grad_norm: PositiveFloat = 0.5
    target_kl: PositiveFloat | None = None
    hidden_sizes: Annotated[tuple[PositiveInt, ...], Field(min_length=1)] = (64, 64)
    activation: Literal["tanh", "relu", "elu"] = "tanh"


class CloningConfig(_Frozen):
    """Behaviour cloning, before the first step.

    Attributes:
        epochs: passes over the demonstrations; the policy kept is that of the epoch which was best
            on the episodes held out.
        batch_size: decisions of one gradient step.
        learning_rate: of Adam.
        held_out_share: of the episodes, not learnt from; one at least.
    """

    epochs: PositiveInt = 50
    batch_size: PositiveInt = 256
    learning_rate: PositiveFloat = 1e-3
    held_out_share: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.2


class TrainingConfig(_Frozen):
    """A training, whole: with the package's version it is all that a result depends on.

    Attributes:
        level: name or path of a level, as ``Roller/Level-v0`` takes it.
        environment: options of the environment (``reward``, ``observation``, ...), those of
            `roller_env.config.EnvConfig`; ``reward_weights`` by name.
        algorithm: how it learns.
        seed: of the environments, the network's initial weights and the order of the samples.
        num_envs: environments that are stepped together.
        practice_share: of the episodes that begin at a waypoint of the route that the agent has
            reached before, not at the level's start; see `roller_env.training.practice`.
        total_steps: environment steps, over all environments, after which training ends.
        wall_clock_budget_s: training ends after this time at the latest; None for no limit.
            A run that ends by time is not repeatable bit for bit on another machine.
        checkpoint_interval_s: a checkpoint is written when the last is this old.
        normalise_observations: with running mean and variance.
        normalise_rewards: with the running variance of the discounted return.
        torch_threads: of the network's arithmetic.
        evaluation_episodes: played by the trained policy for the evaluation table.
        evaluation_environment: options that are other ones then, such as ``physics: default``
            after a training with ``fast``.
        evaluation_replays: whether every episode of the evaluation is kept as a replay.
        demonstrations: replays or a Minari data set that the policy learns from before its first
            step, as `roller_env.training.demonstrations.load_demonstrations` takes them.
        cloning: how it learns from them.
        ppo: what the algorithm is told.
    """

    level: str
    environment: Mapping[str, Any] = Field(default_factory=dict)
    algorithm: Literal["ppo"] = "ppo"
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0
    num_envs: PositiveInt = 256
    practice_share: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    total_steps: PositiveInt = 4_000_000
    wall_clock_budget_s: PositiveFloat | None = None
    checkpoint_interval_s: NonNegativeFloat = 30.0
    normalise_observations: bool = True
    normalise_rewards: bool = True
    torch_threads: PositiveInt = 1
    evaluation_episodes: Annotated[int, Field(ge=2)] = 100
    evaluation_environment: Mapping[str, Any] = Field(default_factory=dict)
    evaluation_replays: bool = False
    demonstrations: str | None = None
    cloning: CloningConfig = CloningConfig()
    ppo: PPOConfig = PPOConfig()

    @model_validator(mode="after")
    def _batches_fill_the_rollout(self) -> TrainingConfig:
        samples = self.num_envs * self.ppo.rollout_steps
        if samples % self.ppo.batch_size:
            raise PydanticCustomError(
                "uneven_batches",
                "ppo.batch_size {batch} does not divide the {samples} samples of a rollout "
                "(num_envs {envs} * ppo.rollout_steps {steps})",
                {
                    "batch": self.ppo.batch_size,
                    "samples": samples,
                    "envs": self.num_envs,
                    "steps": self.ppo.rollout_steps,
                },
            )
        return self

    @field_validator("environment", "evaluation_environment")
    @classmethod
    def _environment_takes_these(cls, options: Mapping[str, Any]) -> Mapping[str, Any]:
        if "level" in options:
            raise ValueError("level is a field of the training itself; remove it here")
        make_config(**_with_weights(options))
        return options

    @property
    def environment_options(self) -> dict[str, Any]:
        """The options of the training's environments; they discount as the learner does."""
        return {"discount": self.ppo.gamma, **_with_weights(self.environment)}

    @property
    def evaluation_options(self) -> dict[str, Any]:
        """The options of the evaluation's environments."""
        return self.environment_options | _with_weights(self.evaluation_environment)

    @property
    def steps_per_update(self) -> int:
        """Environment steps between two updates, over all environments."""
        return self.num_envs * self.ppo.rollout_steps

    def to_yaml(self) -> str:
        """Return the text that `load_config` reads back as an equal configuration."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False)

    def differences(self, other: TrainingConfig) -> list[str]:
        """Return ``field: mine, theirs`` for every field in which the two differ."""
        mine, theirs = (_flat(config.model_dump(mode="json")) for config in (self, other))
        return [
            f"{name}: {mine.get(name)!r}, {theirs.get(name)!r}"
            for name in sorted(mine.keys() | theirs.keys())
            if mine.get(name) != theirs.get(name)
        ]


def load_config(file: Path, overrides: Sequence[str] = ()) -> TrainingConfig:
    """Read a configuration.

    Args:
        file: YAML, such as ``configs/ppo_classic.yaml``.
        overrides: ``field=value`` each, a field inside another as ``ppo.gamma=0.995``; values
            are YAML.

    Raises:
        ConfigError: unreadable, unknown field, or a value that is not allowed; says where.
    """
    try:
        content = yaml.safe_load(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{file}: {error.strerror}") from error
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(f"{file}: not YAML: {error}") from error
    if not isinstance(content, dict):
        raise ConfigError(f"{file}: expected fields such as 'level: classic', found {content!r}")
    for override in overrides:
        _override(content, override)
    try:
        return TrainingConfig.model_validate(content)
    except ValidationError as error:
        problems = [str(_problem(details, file)) for details in error.errors()]
        raise ConfigError("\n".join(problems)) from error


def _with_weights(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return environment options with the reward's weights as the environment takes them."""
    weights = options.get("reward_weights")
    if weights is None:
        return dict(options)
    known = tuple(field.name for field in fields(RewardWeights))
    if not isinstance(weights, Mapping):
        raise ValueError(f"reward_weights: expected any of {listed(known)}; found {weights!r}")
    for name in weights:
        if name not in known:
            message = f"unknown weight {name!r}; known are {listed(known)}"
            raise ValueError(str(Problem(("reward_weights",), message, written=name, known=known)))
    return {**options, "reward_weights": RewardWeights(**weights)}


def _override(content: dict[str, Any], override: str) -> None:
    name, equals, value = override.partition("=")
    if not equals or not name:
        raise ConfigError(f"{override!r}: expected field=value, such as ppo.gamma=0.995")
    *parents, leaf = name.split(".")
    for parent in parents:
        inner = content.setdefault(parent, {})
        if not isinstance(inner, dict):
            raise ConfigError(f"{override!r}: {parent!r} has no fields of its own")
        content = inner
    try:
        content[leaf] = yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise ConfigError(f"{override!r}: the value is not YAML: {error}") from error


def _problem(details: ErrorDetails, file: Path) -> Problem:
    path, message = details["loc"], details["msg"]
    if details["type"] == "extra_forbidden":
        models: dict[tuple[Any, ...], type[BaseModel]] = {
            ("ppo",): PPOConfig,
            ("cloning",): CloningConfig,
        }
        known = tuple(models.get(path[:-1], TrainingConfig).model_fields)
        message = f"unknown field; known are {listed(known)}"
        return Problem(path, message, str(file), written=str(path[-1]), known=known)
    if path and not isinstance(details["input"], dict):
        message = f"{message}; found {details['input']!r}"
    return Problem(path, message, str(file))


def _flat(fields: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in fields.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{name}.")
        else:
            flat[prefix + name] = value
    return flat
