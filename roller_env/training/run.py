"""A run from its configuration to its last picture, each part picked up where a kill left it."""

from __future__ import annotations

import json
import os
import platform
import time
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from roller_env import __version__
from roller_env.divergence import reports_in
from roller_env.envs.sb3 import RollerVecEnv
from roller_env.training.behaviour_cloning import start_from_demonstrations
from roller_env.training.checkpoint import Progress
from roller_env.training.config import TrainingConfig, load_config
from roller_env.training.demonstrations import load_demonstrations
from roller_env.training.evaluate import Evaluation, evaluate, rows_and_repeats
from roller_env.training.files import RunError, RunFiles, only_one_process, write_atomically
from roller_env.training.pictures import draw_paths, record_video
from roller_env.training.policy import Policy, load_policy, save_policy
from roller_env.training.ppo import learn
from roller_env.training.replays import save_replays
from roller_env.training.report import draw_learning_curve, markdown_table, write_evaluation

EVALUATION_SEED_OFFSET: Final = 1_000_000
"""Added to a training's seed, so that an agent is judged on starts it was not trained on."""

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


def train(config: TrainingConfig, directory: Path, *, resume: bool = False) -> TrainingRun:
    """Train, evaluate and draw; every file of `RunFiles` is there afterwards.

    The video is left out, and said to be, where no OpenGL library is found.

    Args:
        config: of the training.
        directory: of the run; made if it does not exist.
        resume: go on with what is there, if anything is.

    Raises:
        RunError: the directory holds another run, one that was not to be resumed, or one that
            another process is training.
        CheckpointError: the checkpoint is damaged.
        DemonstrationError: the demonstrations cannot be used.
    """
    files = RunFiles(directory)
    with only_one_process(directory), reports_in(directory):
        # Read first: a run is not to be begun with what cannot be learnt from.
        demonstrations = (
            load_demonstrations(config.demonstrations, config)
            if config.demonstrations is not None and not files.checkpoint.exists()
            else None
        )
        _claim(config, files, resume)
        if files.summary.exists():
            return TrainingRun(files, json.loads(files.summary.read_text()), was_finished=True)
        if demonstrations is not None:
            print(start_from_demonstrations(config, demonstrations, files), flush=True)
        model, progress = learn(config, files)
        save_policy(model, files)
        start_s = time.monotonic()
        policy = load_policy(directory)
        evaluation = evaluate_policy(policy, config, config.evaluation_episodes)
        write_evaluation(evaluation, config, files)
        print(markdown_table(evaluation, config), flush=True)
        draw_learning_curve(config, evaluation.coins_in_level, files)
        draw_paths(evaluation, files.paths)
        record_video(policy, config, evaluation.seed, files.video)
        if config.evaluation_replays:
            save_replays(evaluation, config, directory / "replays", f"policy {directory.name}")
        summary = _summary(config, progress, time.monotonic() - start_s)
        write_atomically(files.summary, json.dumps(summary, indent=2) + "\n")
        return TrainingRun(files, summary, was_finished=False)


def evaluate_policy(
    policy: Policy, config: TrainingConfig, episodes: int, seed: int | None = None
) -> Evaluation:
    """Play at least `episodes` whole episodes in a configuration's evaluation environment.

    Args:
        policy: what plays.
        config: says where; it may be another than the policy was trained with.
        episodes: rounded up so that all rows play equally many.
        seed: of the environments; by default one the training never used.
    """
    rows, repeats = rows_and_repeats(episodes)
    seed = config.seed + EVALUATION_SEED_OFFSET if seed is None else seed
    environments = RollerVecEnv(config.level, rows, **config.evaluation_options)
    try:
        return evaluate(policy, environments, seed=seed, episodes_per_row=repeats)
    finally:
        environments.close()


def _claim(config: TrainingConfig, files: RunFiles, resume: bool) -> None:
    """Make the directory this configuration's, or refuse."""
    if not files.config.exists():
        write_atomically(files.config, config.to_yaml())
        return
    if not resume:
        message = f"{files.directory} exists; --resume goes on with it, --name starts another"
        raise RunError(message)
    differences = load_config(files.config).differences(config)
    if differences:
        raise RunError(
            f"{files.directory} was started with another configuration (its value, yours):\n"
            + "\n".join(f"  {difference}" for difference in differences)
            + "\nchoose another --name, or ask for what it was started with"
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
