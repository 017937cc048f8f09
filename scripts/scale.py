"""Measure how cost and memory grow: environments, substeps, boxes, coins, threads, time.

Examples::

    python scripts/scale.py                 # a quarter of an hour
    python scripts/scale.py --long          # ten million steps in the long run: half an hour more
    python scripts/scale.py --quick
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import tyro

from roller_env.lab import chart, table
from roller_env.lab.benchmark import scale
from roller_env.lab.runner import Config, header, provenance
from roller_env.level.errors import LevelError

_LONG = 10_000_000
_QUICK = {
    "environments": (1, 16),
    "substeps": (1, 4),
    "boxes": scale.BOXES_COMPARED,
    "coins": (0, 100),
    "threads": (1, 4),
    "threads_environments": (1, 16),
    "memory": (1, scale.MEMORY_ENVS),
}


@dataclass(frozen=True, slots=True)
class Arguments:
    """Measure how cost and memory grow."""

    level: str = "classic"
    """Name of a shipped level, where boxes and coins are not what is measured."""

    physics: str = "default"
    """Preset of the physics: fast, default or accurate."""

    reward: Literal["points", "shaped"] = "shaped"
    """The dearer of the two, unless told otherwise."""

    num_envs: int = 256
    """Environments, where they are not what is measured."""

    threads: int = 2
    """Threads, where they are not what is measured."""

    rounds: int = 7
    """Turns at every place of an axis."""

    round_s: float = 0.3
    """Length of one turn, about."""

    warm_up_s: float = 4.0
    """Game time before the first turn, for the balls to spread."""

    leak_steps: int = 1_000_000
    """Environment steps of the long run."""

    long: bool = False
    """Ten million steps in the long run."""

    out: Path = Path("runs/scale")
    """Directory of the tables and pictures."""

    quick: bool = False
    """See that all of it works; the figures mean nothing."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    task = _task(arguments)
    costs, boxes_goal = scale.measure_cost(task, _say)
    _say("memory")
    memory, memory_goal = scale.measure_memory(task)
    _say(f"long run of {task.leak_steps:,} environment steps")
    leak = scale.measure_leak(task)
    goals = table.Frame([boxes_goal, memory_goal, scale.judge_leak(leak)])
    facts = provenance(("mujoco", "numpy"))
    text = f"{header(facts)}\n\n{scale.report(goals, costs, memory)}"
    tables = {"cost": costs, "memory": memory, "long_run": leak, "goals": goals}
    figures = {"scale": scale.draw(costs, memory, leak)}
    chart.write(arguments.out, facts, tables, figures, ("scale", text))
    print(f"\n{text}\nTables and pictures: {arguments.out}")


def _say(what: str) -> None:
    print(f"{what} ...", file=sys.stderr, flush=True)


def _task(arguments: Arguments) -> scale.Task:
    names = ("level", "physics", "reward")
    task = scale.Task(
        config=Config(arguments.rounds, arguments.round_s, arguments.warm_up_s),
        sizes=scale.SIZES,
        options={name: getattr(arguments, name) for name in names},
        num_envs=arguments.num_envs,
        num_threads=arguments.threads,
        leak_steps=_LONG if arguments.long else arguments.leak_steps,
    )
    if not arguments.quick:
        return task
    config = Config(rounds=2, round_s=0.02, warm_up_s=0.2)
    return replace(task, config=config, sizes=_QUICK, num_envs=16, leak_steps=4_000)


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except (LevelError, ValueError) as error:
        sys.exit(f"error: {error}")
