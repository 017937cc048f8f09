"""A run from its configuration to its last picture, each part picked up where a kill left it."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np
from pydantic_core import from_json
from stable_baselines3 import PPO

from roller_env import __version__
from roller_env.divergence import reports_in
from roller_env.envs.vector import RollerVectorEnv
from roller_env.problems import printable, shown
from roller_env.replay.contents import MAX_TEXT
from roller_env.training.behaviour_cloning import start_from_demonstrations
from roller_env.training.checkpoint import (
    CheckpointError,
    Progress,
    load_checkpoint,
    write_checkpoint,
)
from roller_env.training.cluster import check_cluster
from roller_env.training.config import TrainingConfig, load_config
from roller_env.training.demonstrations import Demonstration, load_demonstrations
from roller_env.training.evaluate import Evaluation, check_recordable, envs_and_repeats, evaluate
from roller_env.training.files import (
    RunError,
    RunFiles,
    only_one_process,
    read_whole,
    write_atomically,
)
from roller_env.training.pictures import draw_paths, film_episode
from roller_env.training.policy import Policy, load_policy, save_policy
from roller_env.training.ppo import learn
from roller_env.training.report import (
    advice,
    draw_learning_curve,
    markdown_table,
    write_evaluation,
)
from roller_env.training.schedule import has_spent_all

EVALUATION_SEED_OFFSET: Final = 1_000_000
"""Added to a training's seed, so that an agent is judged on starts it was not trained on."""

VALIDATION_SEED_OFFSET: Final = 2_000_000
"""The same of the games that decide whether a training goes on: the evaluation has others."""

VALIDATION_EPISODES: Final = 64

MAX_SUMMARY_BYTES: Final = 2**24

_PACKAGES: Final = ("mujoco", "gymnasium", "stable-baselines3", "torch", "numpy")


@dataclass(frozen=True, slots=True)
class TrainingRun:
    """A finished run.

    Attributes:
        files: what it left.
        summary: what ran, on what, for how long; the content of ``run.json``.
        was_finished: nothing was left to do.
    """

    files: RunFiles
    summary: dict[str, Any]
    was_finished: bool


def train(
    config: TrainingConfig, directory: Path, *, resume: bool = False, cluster: str | None = None
) -> TrainingRun:
    """Train, evaluate and draw; every file of `RunFiles` is there afterwards.

    The video is left out, and said to be, where no OpenGL library is found.

    Args:
        config: of the training.
        directory: of the run; made if it does not exist.
        resume: go on with what is there, if anything is.
        cluster: address of the Ray cluster that RLlib trains on: ``auto``, the one that this
            machine is part of; ``local``, this machine alone; or the head node's ``host:port``.
            None: Stable-Baselines3 trains, in this process. What is left is the same.

    Raises:
        RunError: the directory holds another run, one that was not to be resumed, or one that
            another process is training; or the disk is full or cannot be written to; or the
            cluster cannot be used.
        CheckpointError: the checkpoint is damaged.
        DemonstrationError: the demonstrations cannot be used.
        LevelError: the level cannot be used.
    """
    files = RunFiles(directory)
    # All that can be wrong with what is asked for shows now, before there is a directory for it.
    demonstrations = None
    if cluster is not None:
        check_cluster(config, cluster)
    if not (files.checkpoint.exists() or files.summary.exists()):
        check_playable(config)
        if config.demonstrations is not None:
            demonstrations = load_demonstrations(config.demonstrations, config)
    try:
        with only_one_process(directory), reports_in(directory):
            return _train(config, files, demonstrations, resume, cluster)
    except OSError as error:
        raise RunError(_unwritable(error, files)) from error
    except MemoryError as error:
        raise RunError(f"this machine's memory is too small for this training: {error}") from error


def check_playable(config: TrainingConfig) -> None:
    """Make the environments of training and evaluation once, with one row, and close them.

    Raises:
        LevelError: the level cannot be used.
        RunError: the evaluation's episodes cannot be kept.
        ValueError: an option cannot be used.
    """
    RollerVectorEnv(1, **config.environment.keywords()).close()
    judged = RollerVectorEnv(1, **config.evaluation_environment.keywords())
    try:
        check_recordable(judged)
    finally:
        judged.close()


def _train(
    config: TrainingConfig,
    files: RunFiles,
    demonstrations: Sequence[Demonstration] | None,
    resume: bool,
    cluster: str | None,
) -> TrainingRun:
    _claim(config, files, resume)
    if files.summary.exists():
        return TrainingRun(files, _read_summary(files.summary), was_finished=True)
    if demonstrations is not None:
        print(start_from_demonstrations(config, demonstrations, files), flush=True)
    progress = learn_to_mastery(config, files, cluster)
    start_s = time.monotonic()
    policy = load_policy(files.directory)
    player = player_of(files.directory)
    evaluation = evaluate_policy(policy, config, config.evaluation_episodes, player=player)
    write_evaluation(evaluation, config, files)
    print(markdown_table(evaluation, config) + advice(evaluation, config), flush=True)
    draw_learning_curve(config, evaluation.coins_in_level, files)
    draw_paths(evaluation, files.paths)
    film_episode(evaluation, files.video)
    if config.evaluation_replays:
        evaluation.save_replays(files.directory / "replays")
    summary = _summary(config, progress, time.monotonic() - start_s)
    write_atomically(files.summary, json.dumps(summary, indent=2) + "\n")
    return TrainingRun(files, summary, was_finished=False)


def learn_to_mastery(
    config: TrainingConfig, files: RunFiles, cluster: str | None = None
) -> Progress:
    """Train until the level is mastered by the likeliest actions, too, and keep the policy.

    While it learns the agent draws its actions, and may finish all of its games by chance where the
    likeliest action leads nowhere. So what has been mastered is judged once more, in games of the
    evaluation's environment that the evaluation does not play; an agent that falls short goes on.

    Args:
        config: of the training. Without ``mastery`` it just ends after its steps.
        files: where checkpoint and logs are or go.
        cluster: address of the one that trains, if any.
    """
    while True:
        model, progress = _learn(config, files, cluster)
        save_policy(model, config, files)
        if config.mastery is None or has_spent_all(config, progress):
            return progress
        seed = config.seed + VALIDATION_SEED_OFFSET
        played = evaluate_policy(load_policy(files.directory), config, VALIDATION_EPISODES, seed)
        mastery = float(np.mean([r.success * r.score_percent / 100.0 for r in played.results]))
        if mastery >= config.mastery:
            return progress
        print(f"by its likeliest actions {mastery:.0%} are mastered: it goes on", flush=True)
        again = replace(progress, mastery=0.0, final_from=None)
        write_checkpoint(replace(load_checkpoint(files.checkpoint), progress=again))


def _learn(config: TrainingConfig, files: RunFiles, cluster: str | None) -> tuple[PPO, Progress]:
    if cluster is None:
        return learn(config, files)
    # Ray need not be installed where no cluster is asked for.
    from roller_env.training import rllib

    return rllib.learn(config, files, cluster)


def evaluate_policy(
    policy: Policy,
    config: TrainingConfig,
    episodes: int,
    seed: int | None = None,
    player: str = "",
) -> Evaluation:
    """Play at least `episodes` whole episodes in a configuration's evaluation environment.

    Args:
        policy: what plays.
        config: says where; it may be another than the policy was trained with.
        episodes: rounded up so that all environments play equally many.
        seed: of the environments; by default one the training never used.
        player: who plays, in words, for whoever reads the replays.
    """
    num_envs, repeats = envs_and_repeats(episodes)
    seed = config.seed + EVALUATION_SEED_OFFSET if seed is None else seed
    envs = RollerVectorEnv(num_envs, **config.evaluation_environment.keywords())
    try:
        return evaluate(policy, envs, seed=seed, episodes_per_env=repeats, player=player)
    finally:
        envs.close()


def player_of(run: Path) -> str:
    """Return who plays, in a replay's words, when a run's agent does."""
    return f"policy {printable(run.name)}"[:MAX_TEXT]


def _claim(config: TrainingConfig, files: RunFiles, resume: bool) -> None:
    """Make the directory this configuration's, or refuse."""
    if not (files.config.exists() and files.has_begun):
        # What a start that failed has left behind is in nobody's way.
        write_atomically(files.config, config.to_yaml())
        return
    name = shown(files.directory)
    if not resume:
        raise RunError(f"{name} exists; --resume goes on with it, --name starts another")
    begun = load_config(files.config)
    # Over how many processes it is spread is no part of what a run is.
    differences = begun.model_copy(update={"cluster": config.cluster}).differences(config)
    if differences:
        raise RunError(
            f"{name} was started with another configuration (its value, yours):\n"
            + "\n".join(f"  {difference}" for difference in differences)
            + "\nchoose another --name, or ask for what it was started with"
        )


def _read_summary(file: Path) -> dict[str, Any]:
    try:
        summary = from_json(read_whole(file, MAX_SUMMARY_BYTES))
    except ValueError as error:
        message = f"{shown(file)}: damaged ({error}); remove it to have the run evaluated again"
        raise RunError(message) from None
    if not isinstance(summary, dict):
        raise RunError(f"{shown(file)}: damaged; remove it to have the run evaluated again")
    return summary


def _unwritable(error: OSError, files: RunFiles) -> str:
    """Return what failed, what is kept, and how to go on."""
    fault = error.strerror or str(error)
    where = shown(error.filename or files.directory)
    try:
        steps = load_checkpoint(files.checkpoint).progress.steps
    except CheckpointError:
        return f"{where}: {fault}; nothing was kept yet. When it can be written to, --resume begins"
    return (
        f"{where}: {fault}; kept is the training up to its checkpoint at {steps:,} steps. When it "
        "can be written to, --resume goes on from there"
    )


def _summary(config: TrainingConfig, progress: Progress, rest_s: float) -> dict[str, Any]:
    return {
        "config": config.model_dump(mode="json"),
        "progress": asdict(progress),
        "steps_per_s": round(progress.steps / max(progress.wall_s, 1e-9)),
        "evaluation_and_drawing_s": round(rest_s, 1),
        "processors": os.cpu_count(),
        "platform": platform.platform(),
        "python": platform.python_version(),
        "roller": __version__,
        "packages": {name: version(name) for name in _PACKAGES},
    }
