"""What a training is told: one frozen model, read from YAML, checked before anything runs."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal

import yaml
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    JsonValue,
    Strict,
    ValidationError,
    ValidationInfo,
    field_serializer,
    field_validator,
    model_validator,
)
from pydantic_core import ErrorDetails, PydanticCustomError

from roller_env.checks import Refused, messages_of, nearest
from roller_env.config import MAX_ENVS, EnvConfig, LevelSource
from roller_env.envs.spaces import action_space, observation_space
from roller_env.game.observations import entries
from roller_env.problems import FieldPath, Problem, listed
from roller_env.training.config_source import ConfigError, ConfigSource

MAX_STEPS: Final = 10**12
MAX_ROLLOUT: Final = 10**8
"""Samples of a rollout: they are in memory, some hundred bytes each."""

_OPTIONS: Final = tuple(name for name in EnvConfig().keywords() if name != "level")
"""Of an environment; the level is said of the training."""

_LONG: Final = 64
"""Characters of a value that a message shows."""


def _whole(value: object) -> object:
    """Return 1e6 as the whole number that it is; YAML's exponents are of floats."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("must be text that can be printed")
    return text


WholeNumber = Annotated[int, BeforeValidator(_whole)]
Count = Annotated[WholeNumber, Field(gt=0, le=10**6)]
Fraction = Annotated[float, Field(gt=0.0, le=1.0)]
PositiveFloat = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegativeFloat = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Name = Annotated[str, Field(min_length=1, max_length=1_000), AfterValidator(_printable)]


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    former_names: ClassVar[Mapping[str, str]] = {}
    """Fields' names of before, which are still taken, and what they are now."""

    @model_validator(mode="before")
    @classmethod
    def _renamed(cls, given: Any) -> Any:
        if not isinstance(given, Mapping):
            return given
        former = [old for old, new in cls.former_names.items() if old in given and new not in given]
        for old in former:
            message = f"{old} is called {cls.former_names[old]} now"
            warnings.warn(message, DeprecationWarning, stacklevel=2)
        return {cls.former_names[n] if n in former else n: value for n, value in given.items()}


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
        entropy_coefficient: weight of the entropy bonus, at the start.
        final_entropy_coefficient: that at the last step, to which it goes linearly; None: the same
            throughout. Below 0 it makes the policy sure of itself, so that the likeliest actions,
            by which it is judged, are those by which it was trained.
        value_coefficient: weight of the value loss.
        max_grad_norm: gradients are clipped to this norm.
        target_kl: an update ends early past 1.5 times this divergence; None never does.
        hidden_sizes: units of the hidden layers, of the policy and of the value network each.
        activation: between the layers.
    """

    rollout_steps: Count = 128
    batch_size: Annotated[WholeNumber, Field(gt=0, le=MAX_ROLLOUT)] = 8192
    epochs: Count = 4
    learning_rate: PositiveFloat = 1e-3
    learning_rate_decay: Literal["constant", "linear"] = "linear"
    gamma: Fraction = 0.99
    gae_lambda: Fraction = 0.95
    clip_range: PositiveFloat = 0.2
    entropy_coefficient: NonNegativeFloat = 0.01
    final_entropy_coefficient: Annotated[float, Field(allow_inf_nan=False)] | None = None
    value_coefficient: NonNegativeFloat = 0.5
    max_grad_norm: PositiveFloat = 0.5
    target_kl: PositiveFloat | None = None
    hidden_sizes: Annotated[
        tuple[Annotated[WholeNumber, Field(gt=0, le=2**14)], ...],
        Strict(False),  # a list will do
        Field(min_length=1, max_length=16),
    ] = (64, 64)
    activation: Literal["tanh", "relu", "elu"] = "tanh"


class CloningConfig(_Frozen):
    """Behaviour cloning, before the first step.

    Attributes:
        epochs: passes over the demonstrations; the policy kept is that of the epoch which was best
            on the episodes held out.
        batch_size: decisions of one gradient step.
        learning_rate: of Adam.
        held_out_fraction: of the episodes, not learnt from; one episode at least.
    """

    former_names: ClassVar = {"held_out_share": "held_out_fraction"}

    epochs: Count = 50
    batch_size: Count = 256
    learning_rate: PositiveFloat = 1e-3
    held_out_fraction: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.2


class ClusterConfig(_Frozen):
    """How a training is spread over a cluster; no matter where it runs on one machine alone.

    The samples of an update are the same as on one machine: the runners share the environments, the
    learners the batches.

    Attributes:
        runners: processes that play, one CPU each.
        learners: processes that learn, one CPU each; 0: the one that was started learns itself.
        gpus_per_learner: of learners in processes of their own.
        patience_s: a training that no runner has answered for so long ends.
    """

    runners: Annotated[WholeNumber, Field(gt=0, le=4096)] = 2
    learners: Annotated[WholeNumber, Field(ge=0, le=256)] = 0
    gpus_per_learner: Annotated[WholeNumber, Field(ge=0, le=16)] = 0
    patience_s: PositiveFloat = 300.0


class TrainingConfig(_Frozen):
    """A training, whole: with the package's version it is all that a result depends on.

    Attributes:
        level: name or path of a level, as ``Roller/Level-v0`` takes it.
        algorithm: how it learns.
        ppo: what the algorithm is told.
        environment: what it learns in. It is given as the options that are not the defaults; the
            discount is by default the learner's.
        evaluation_environment: what it is judged in. It is given as the options that are other ones
            than in training, such as ``physics: default`` after a training with ``fast``.
        seed: of the environments, the network's initial weights and the order of the samples.
        num_envs: environments that are stepped together.
        start_state_curriculum: fraction of the environments that do not play from the level's start
            but practise what is achieved least surely; see `roller_env.training.curriculum`.
        total_steps: environment steps, over all environments, after which training ends at the
            latest.
        mastery: share of the coins in games that end at the finish, as a running mean over
            episodes, from which on the level counts as mastered; training then ends after
            ``final_steps``, if the likeliest actions reach as much in the evaluation's environment,
            and goes on otherwise. None: it goes on to ``total_steps``.
        final_steps: environment steps at the end over which the learning rate and the entropy
            coefficient go to their last values. Before, the learning rate is constant, and the
            entropy coefficient falls towards 0 as mastery comes. (Of language models: S. Hu et al.,
            *MiniCPM*, 2024, "warmup-stable-decay".) Only with ``mastery``; at most ``total_steps``.
        wall_clock_budget_s: training ends after this time at the latest; None for no limit.
            A run that ends by time is not repeatable bit for bit on another machine.
        checkpoint_interval_s: a checkpoint is written when the last is this old.
        normalise_observations: with running mean and variance.
        normalise_rewards: with the running variance of the discounted return.
        torch_threads: of the network's arithmetic.
        evaluation_episodes: played by the trained policy for the evaluation table.
        evaluation_replays: whether every episode of the evaluation is kept as a replay.
        demonstrations: replays or a Minari data set that the policy learns from before its first
            step, as `roller_env.training.demonstrations.load_demonstrations` takes them.
        cloning: how it learns from them.
        cluster: how it is spread over machines, if it is trained on several.
    """

    former_names: ClassVar = {"practice_share": "start_state_curriculum"}

    level: Name
    algorithm: Literal["ppo"] = "ppo"
    ppo: PPOConfig = PPOConfig()
    # Given as options, which are completed by the fields above them.
    environment: EnvConfig = Field({}, validate_default=True)
    evaluation_environment: EnvConfig = Field({}, validate_default=True)
    seed: Annotated[WholeNumber, Field(ge=0, lt=2**31)] = 0
    num_envs: Annotated[WholeNumber, Field(gt=0, le=MAX_ENVS)] = 256
    start_state_curriculum: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    total_steps: Annotated[WholeNumber, Field(gt=0, le=MAX_STEPS)] = 4_000_000
    mastery: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    final_steps: Annotated[WholeNumber, Field(gt=0, le=MAX_STEPS)] = 400_000
    wall_clock_budget_s: PositiveFloat | None = None
    checkpoint_interval_s: NonNegativeFloat = 30.0
    normalise_observations: bool = True
    normalise_rewards: bool = True
    torch_threads: Annotated[WholeNumber, Field(gt=0, le=1024)] = 1
    evaluation_episodes: Annotated[WholeNumber, Field(ge=2, le=10**6)] = 100
    evaluation_replays: bool = False
    demonstrations: Name | None = None
    cloning: CloningConfig = CloningConfig()
    cluster: ClusterConfig = ClusterConfig()

    @model_validator(mode="after")
    def _batches_fill_the_rollout(self) -> TrainingConfig:
        samples = self.num_envs * self.ppo.rollout_steps
        if samples > MAX_ROLLOUT:
            raise PydanticCustomError(
                "large_rollout",
                "num_envs {envs} * ppo.rollout_steps {steps} are {samples} samples of a rollout; "
                "allowed are at most {most}",
                {
                    "envs": self.num_envs,
                    "steps": self.ppo.rollout_steps,
                    "samples": samples,
                    "most": MAX_ROLLOUT,
                },
            )
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

    @field_validator("environment", "evaluation_environment", mode="plain")
    @classmethod
    def _completed(cls, given: object, info: ValidationInfo) -> EnvConfig:
        # What was refused itself is not there.
        known = info.data
        base = _default_env(known.get("level", EnvConfig.level), known.get("ppo", PPOConfig()))
        if info.field_name == "evaluation_environment":
            base = known.get("environment", base)
        if isinstance(given, EnvConfig):
            return replace(given, level=base.level)
        if not isinstance(given, Mapping):
            raise ValueError(f"found {_short(given)}; must be a mapping of options")
        return _with_options(base, given)

    @field_serializer("environment")
    def _options(self, environment: EnvConfig) -> dict[str, JsonValue]:
        return environment.differences(_default_env(self.level, self.ppo))

    @field_serializer("evaluation_environment")
    def _evaluation_options(self, environment: EnvConfig) -> dict[str, JsonValue]:
        return environment.differences(self.environment)

    @model_validator(mode="after")
    def _the_agent_fits_into_its_evaluation(self) -> TrainingConfig:
        learnt, judged = self.environment, self.evaluation_environment
        # Both are on the same level, which need not be there.
        parts = [entries(each.observation, each.kinds) for each in (learnt, judged)]
        seen = [observation_space(e, p) for e, p in zip((learnt, judged), parts, strict=True)]
        others = {"observation": learnt.kinds != judged.kinds or seen[0] != seen[1]}
        others["action"] = action_space(learnt) != action_space(judged)
        for name, differ in others.items():
            if differ:
                message = (
                    "evaluation_environment: an agent can be judged only with the observations "
                    "and actions it was trained with; remove {name}, or train with it"
                )
                raise PydanticCustomError("other_spaces", message, {"name": name})
        return self

    def on_level(self, level: str) -> TrainingConfig:
        """Return the configuration with another level, its name or path."""
        changes = {
            name: replace(getattr(self, name), level=level)
            for name in ("environment", "evaluation_environment")
        }
        return self.model_copy(update={"level": level, **changes})

    @property
    def steps_per_update(self) -> int:
        """Environment steps between two updates, over all environments."""
        return self.num_envs * self.ppo.rollout_steps

    def to_yaml(self) -> str:
        """Return the text that `load_config` reads back as an equal configuration."""
        return yaml.dump(self.model_dump(mode="json"), Dumper=_Dumper, sort_keys=False)

    def differences(self, other: TrainingConfig) -> list[str]:
        """Return ``field: mine, theirs`` for every field in which the two differ."""
        mine, theirs = (
            _flat(
                config.model_dump(mode="json")
                | {"environment": replace(config.environment, level=EnvConfig.level).to_json()}
            )
            for config in (self, other)
        )
        return [
            f"{name}: {mine.get(name)!r}, {theirs.get(name)!r}"
            for name in sorted(mine.keys() | theirs.keys())
            if mine.get(name) != theirs.get(name)
        ]


def _default_env(level: LevelSource, ppo: PPOConfig) -> EnvConfig:
    """Return the environment of which a configuration says nothing."""
    return EnvConfig(level=level, discount=ppo.gamma)


def _with_options(base: EnvConfig, options: Mapping[str, Any]) -> EnvConfig:
    """Return an environment with other options.

    Raises:
        ValueError: some are unknown or not allowed; a message each, all of them.
    """
    refused = [
        f"{name}: is a field of the training itself; remove it here"
        if name == "level"
        else f"{name}: unknown option; known are {listed(_OPTIONS)}{nearest(str(name), _OPTIONS)}"
        for name in options
        if name not in _OPTIONS
    ]
    try:
        made = replace(base, **{name: v for name, v in options.items() if name in _OPTIONS})
    except ValueError as error:
        raise Refused([*refused, *messages_of(error)]) from None
    if refused:
        raise Refused(refused)
    return made


class _Dumper(yaml.SafeDumper):
    """Quotes what YAML 1.2 takes for a number and PyYAML's 1.1 does not, such as ``1e3``."""


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    style = '"' if text[:1] in "+-.0123456789" else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Dumper.add_representer(str, _text)


def load_config(file: str | os.PathLike[str], overrides: Sequence[str] = ()) -> TrainingConfig:
    """Read a configuration.

    Args:
        file: YAML, such as ``configs/ppo.yaml``.
        overrides: ``field=value`` each, a field inside another as ``ppo.gamma=0.995``; values
            are YAML.

    Raises:
        ConfigError: unreadable, unknown field, or a value that is not allowed; says where.
    """
    source = ConfigSource(Path(file), overrides)
    try:
        return TrainingConfig.model_validate(source.content)
    except ValidationError as error:
        problems = [
            problem
            for details in error.errors(include_url=False)
            for problem in _problems(details, source)
        ]
        raise ConfigError(sorted(problems, key=lambda problem: problem.line or 0)) from None


def _problems(details: ErrorDetails, source: ConfigSource) -> list[Problem]:
    path, message, found = details["loc"], details["msg"], details["input"]
    if details["type"] == "extra_forbidden":
        models: dict[tuple[Any, ...], type[BaseModel]] = {
            ("ppo",): PPOConfig,
            ("cloning",): CloningConfig,
            ("cluster",): ClusterConfig,
        }
        known = tuple(models.get(path[:-1], TrainingConfig).model_fields)
        return [_unknown(path, known, source)]
    if details["type"] == "value_error":
        messages = messages_of(details["ctx"]["error"])
        if isinstance(found, dict):
            return [_of_option(path, found, one, source) for one in messages]
        (message,) = messages
    elif path and not isinstance(found, dict):
        message = f"{message}; found {_short(found)}"
        if isinstance(found, str) and found.replace("_", "").isdecimal() and "_" in found:
            message += " (write it without '_')"
    path = _as_written(path, source.content)
    return [Problem(path, message, **source.where(path, of_key=False))]


def _as_written(path: FieldPath, content: object) -> FieldPath:
    """Return the path of a field as the file has it, where it may have a name of before."""
    models = (TrainingConfig, CloningConfig)
    former = {new: old for model in models for old, new in model.former_names.items()}
    written: list[str | int] = []
    for part in path:
        known = content if isinstance(content, Mapping) else {}
        is_former = part not in known and former.get(str(part)) in known
        written.append(former[str(part)] if is_former else part)
        content = known.get(written[-1])
    return tuple(written)


def _unknown(path: FieldPath, known: tuple[str, ...], source: ConfigSource) -> Problem:
    message = f"unknown field; known are {listed(known)}"
    where = source.where(path, of_key=True)
    return Problem(path, message, **where, written=str(path[-1]), known=known)


def _of_option(
    path: FieldPath, options: Mapping[str, Any], message: str, source: ConfigSource
) -> Problem:
    """Return the problem with an option of an environment, whose name its message begins with."""
    name, _, said = message.partition(": ")
    if name in options and name not in _OPTIONS and name != "level":
        return _unknown((*path, name), _OPTIONS, source)
    at: Any = options
    for part in name.split("."):
        # An option that is not given itself is at fault beside one that is.
        if not isinstance(at, Mapping) or part not in at:
            break
        at, path, message = at[part], (*path, part), said
    return Problem(path, message, **source.where(path, of_key=False))


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _LONG else f"{text[:_LONG]}..."


def _flat(fields: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in fields.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{name}.")
        else:
            flat[prefix + name] = value
    return flat
