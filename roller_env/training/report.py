"""What a run leaves for people to read: the evaluation table and the learning curve."""

from __future__ import annotations

import csv
import io
import json
import math
from collections import Counter
from dataclasses import asdict
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from roller_env.arrays import Float64
from roller_env.training.config import TrainingConfig
from roller_env.training.evaluate import CONFIDENCE, Estimate, Evaluation
from roller_env.training.files import RunFiles, write_atomically
from roller_env.training.logs import STEPS, read_progress

_SMOOTHING_SHARE: Final = 1.0 / 40.0
"""Width of the learning curve's Gaussian, as a share of the whole training."""

_COLOURS: Final = ("#2f6db3", "#c98a12", "#3a8f5c")
_STYLE: Final[dict[Any, Any]] = {
    "axes.edgecolor": "#888888",
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "font.size": 10,
    "grid.color": "#e6e6e6",
}
_RATES: Final = frozenset({"success rate", "fall rate"})
_RESULT_FIELDS: Final = ("outcome", "score_percent", "coins", "time_s", "total_reward")


def write_evaluation(evaluation: Evaluation, config: TrainingConfig, files: RunFiles) -> None:
    """Write the evaluation as a table for people, as JSON, and episode by episode as CSV."""
    write_atomically(files.evaluation_table, markdown_table(evaluation, config))
    facts = {
        "level": evaluation.level.name,
        "episodes": len(evaluation),
        "seed": evaluation.seed,
        "training_seed": config.seed,
        "coins_in_level": evaluation.coins_in_level,
        "confidence": CONFIDENCE,
        "measures": {name: _finite(value) for name, value in evaluation.table().items()},
    }
    write_atomically(files.evaluation, json.dumps(facts, indent=2, allow_nan=False) + "\n")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["row", *_RESULT_FIELDS, "steps"])
    for number, replay in enumerate(evaluation.replays):
        result = replay.result
        writer.writerow(
            [
                number // evaluation.episodes_per_env,
                *(getattr(result, name) for name in _RESULT_FIELDS),
                len(replay),
            ]
        )
    write_atomically(files.episodes, text.getvalue())


def markdown_table(evaluation: Evaluation, config: TrainingConfig) -> str:
    """Return the evaluation as a Markdown table with a heading line."""
    lines = [
        f"{len(evaluation)} episodes on `{evaluation.level.name}` "
        f"({evaluation.coins_in_level} coins), "
        f"deterministic policy of training seed {config.seed}, "
        f"evaluation seed {evaluation.seed}.",
        "",
        f"| measure | mean | {CONFIDENCE:.0%} interval |",
        "| --- | ---: | ---: |",
    ]
    for name, value in evaluation.table().items():
        unit = "{:.1%}" if name in _RATES else "{:.2f}"
        if math.isnan(value.mean):
            lines.append(f"| {name} | none | |")
            continue
        mean, low, high = (unit.format(x) for x in (value.mean, value.low, value.high))
        lines.append(f"| {name} | {mean} | {low} to {high} |")
    return "\n".join(lines) + "\n"


GOOD: Final = 0.95
"""Share of the games at the finish, and of the coins, under which an agent fell short."""


def advice(evaluation: Evaluation, config: TrainingConfig) -> str:
    """Return where the agent fell short of `GOOD` and what to try, or nothing if nowhere."""
    results = evaluation.results
    finished = sum(result.success for result in results) / len(results)
    coins = sum(result.score_percent for result in results) / len(results) / 100.0
    if finished >= GOOD and coins >= GOOD:
        return ""
    ends = Counter(result.outcome for result in results if not result.success)
    lines = [f"It fell short: {finished:.0%} at the finish, {coins:.0%} of the coins. Try"]
    lines += [
        f"- twice the steps: --set total_steps={2 * config.total_steps}; another --seed",
    ]
    if ends["fall"] > ends["time limit"]:
        lines.append("- a fall that costs more: --set environment.reward_weights.fall=-10")
    elif ends["time limit"]:
        lines.append("- more exploration: --set ppo.entropy_coefficient=0.01 (it stood still)")
    if finished >= GOOD:
        lines.append("- coins left that cost more: --set environment.reward_weights.completeness=8")
    return "\n".join(lines) + "\n"


def draw_learning_curve(config: TrainingConfig, coins_in_level: int, files: RunFiles) -> None:
    """Draw success, coins and reward against environment steps.

    Pale dots are what the episodes of one update reached; the line is their mean under a Gaussian
    weighted by the number of episodes, so an update with one episode does not pull it.

    Args:
        config: of the training.
        coins_in_level: as many as can be collected.
        files: where the log is and the picture goes.
    """
    rows = read_progress(files.progress)
    steps = np.array([float(row[STEPS]) for row in rows])
    weights = np.array([float(row["rollout/episodes"]) for row in rows])
    wall_s = float(rows[-1]["time/wall_s"]) if rows else 0.0
    panels = (
        ("at the finish", "rollout/success_rate", 1.0),
        ("coins collected", "rollout/coins", float(max(coins_in_level, 1))),
        ("total reward", "rollout/ep_rew_mean", None),
    )
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(12.0, 3.9), layout="constrained", dpi=150)
        axes = figure.subplots(1, len(panels))
        for axis, colour, (title, column, whole) in zip(axes, _COLOURS, panels, strict=True):
            values = np.array([float(row[column]) for row in rows]) / (whole or 1.0)
            _draw_panel(axis, steps, values, weights, colour)
            axis.set_title(title, loc="left", fontweight="bold")
            if whole is not None:
                axis.set_ylim(-0.03, 1.03)
                axis.yaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{share:.0%}"))
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2, frameon=False)
        figure.suptitle(
            f"{config.algorithm.upper()} on {config.level}, seed {config.seed}: "
            f"{steps[-1] if rows else 0:,.0f} steps in {wall_s / 60:.1f} min, "
            f"{config.num_envs} environments",
            x=0.01,
            ha="left",
        )
        figure.savefig(files.learning_curve)


def smoothed(steps: Float64, values: Float64, weights: Float64, width: float) -> Float64:
    """Return the values' mean under a Gaussian round each step.

    Args:
        steps: (n,) where the values stand.
        values: (n,) NaN where there is nothing.
        weights: (n,) how many observations a value is the mean of.
        width: the Gaussian's standard deviation, in steps.

    Returns:
        (n,) NaN where nothing is near.
    """
    known = np.isfinite(values) & (weights > 0)
    distance = (steps[:, None] - steps[None, known]) / width
    kernel = np.exp(-0.5 * distance**2) * weights[known]
    total = kernel.sum(axis=1)
    mean = kernel @ values[known] / np.where(total > 0, total, np.nan)
    return np.asarray(mean, dtype=np.float64)


def _draw_panel(axis: Axes, steps: Float64, values: Float64, weights: Float64, colour: str) -> None:
    label = "episodes of one update"
    axis.scatter(steps, values, s=7, color=colour, alpha=0.35, linewidths=0, label=label)
    if steps.size:
        width = max(steps[-1] * _SMOOTHING_SHARE, 1.0)
        mean = smoothed(steps, values, weights, width)
        axis.plot(steps, mean, color=colour, linewidth=2, label="smoothed")
        axis.set_xlim(0, steps[-1])
    axis.set_xlabel("environment steps")
    axis.xaxis.set_major_formatter(FuncFormatter(lambda count, _: _short(count)))


def _short(count: float) -> str:
    for size, letter in ((1e6, " M"), (1e3, " k")):
        if count >= size:
            return f"{count / size:g}{letter}"
    return f"{count:g}"


def _finite(value: Estimate) -> dict[str, float | None]:
    return {name: None if math.isnan(x) else x for name, x in asdict(value).items()}
