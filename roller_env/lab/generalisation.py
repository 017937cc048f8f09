"""How well an agent that learnt on so many generated levels plays levels that it never saw.

One agent a number of levels and seed: PPO with the numbers of ``configs/ppo.yaml`` but without its
curriculum, which is of one level, on ``rays`` and the route's progress. Training levels have the
seeds from 0 on, test levels those from `UNSEEN` on, as in K. Cobbe et al., *Leveraging procedural
generation to benchmark reinforcement learning*, 2020.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas
import torch
from gymnasium.vector import AutoresetMode
from matplotlib.figure import Figure
from stable_baselines3 import PPO
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecNormalize

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.envs.vector import RollerVectorEnv
from roller_env.game.actions import forces
from roller_env.lab import chart
from roller_env.level import Level
from roller_env.level.generate import generate

NUMBERS: Final = (1, 10, 100, 500)
DIFFICULTY: Final = 0.25
UNSEEN: Final = 1_000_000
TESTED: Final = 200
"""Levels on which an agent is judged, of the training's and of the unseen ones."""

ENVS: Final = 256

OPTIONS: Final[dict[str, Any]] = {
    "physics": "relaxed",
    "observation": "rays",
    "control_dt_s": 0.1,
    "max_episode_steps": 300,
    "reward": "shaped",
    "reward_weights": {"coin": 1.0, "finish": 10.0, "fall": -2.0, "progress": 10.0},
}


def levels_from(seed: int, count: int) -> list[Level]:
    """Return generated levels with the seeds from one on."""
    return [generate(seed + number, DIFFICULTY, version=1) for number in range(count)]


def row(count: int, seed: int, steps: int) -> dict[str, Any]:
    """Train an agent on so many levels, and judge it on them and on unseen ones."""
    torch.set_num_threads(1)
    begun = time.process_time()
    levels = levels_from(0, count)
    envs = VecNormalize(
        RollerVecEnv(num_envs=ENVS, levels=levels, seed=seed, num_threads=1, **OPTIONS),
        gamma=0.99,
    )
    model = PPO(
        "MlpPolicy",
        envs,
        n_steps=32,
        batch_size=1024,
        n_epochs=6,
        gamma=0.99,
        learning_rate=LinearSchedule(7e-4, 0.0, end_fraction=1.0),
        ent_coef=0.005,
        policy_kwargs={"net_arch": [128, 128]},
        seed=seed,
        device="cpu",
    )
    model.learn(steps)
    known = judged(model, envs, levels[:TESTED])
    unseen = judged(model, envs, levels_from(UNSEEN, TESTED))
    return {
        "levels": count,
        "seed": seed,
        "steps": model.num_timesteps,
        "known_finish": known[0],
        "known_coins": known[1],
        "unseen_finish": unseen[0],
        "unseen_coins": unseen[1],
        "cpu_s": round(time.process_time() - begun, 1),
    }


def judged(model: PPO, envs: VecNormalize, levels: Sequence[Level]) -> tuple[float, float]:
    """Return the share of games at the finish and of coins, one game on about every level."""
    games = RollerVectorEnv(
        TESTED, autoreset_mode=AutoresetMode.DISABLED, levels=levels, num_threads=1, **OPTIONS
    )
    observations, _ = games.reset(seed=UNSEEN)
    simulation = games.simulation
    while not simulation.state.over.all():
        actions, _ = model.predict(envs.normalize_obs(observations), deterministic=True)
        over = simulation.state.over
        rows = np.flatnonzero(~over)
        simulation.step(forces("directions", actions), hold=over)
        observations[rows] = simulation.observe(rows)
    share = simulation.state.coins / np.maximum(simulation.coins_in_level, 1)
    return round(float(simulation.state.finished.mean()), 4), round(float(share.mean()), 4)


def run(
    file: Path, seeds: int, steps: int, numbers: Iterable[int] = NUMBERS, watched: Any = iter
) -> None:
    """Add the rows that a file has not, while one is ``watched``."""
    done = set()
    if file.exists():
        done = {(r.levels, r.seed) for r in pandas.read_csv(file).itertuples()}
    wanted = [(count, seed) for seed in range(seeds) for count in numbers]
    file.parent.mkdir(parents=True, exist_ok=True)
    for count, seed in watched([one for one in wanted if one not in done]):
        found = row(count, seed, steps)
        is_new = not file.exists()
        with file.open("a", encoding="utf-8", newline="") as text:
            writer = csv.DictWriter(text, list(found), lineterminator="\n")
            if is_new:
                writer.writeheader()
            writer.writerow(found)


@chart.styled
def draw(file: Path) -> Figure:
    """Draw success on known and unseen levels over the number of levels learnt on."""
    rows = pandas.read_csv(file)
    figure, ((axes,),) = chart.grid(
        (1, 1),
        "How many levels it takes to play one that was never seen",
        f"Generated levels of difficulty {DIFFICULTY:g}; {TESTED} games with the likeliest actions "
        f"on levels that were learnt and on levels that were not; {rows.steps.max():,} steps each; "
        "line: mean of the seeds, dots: each.",
        panel=(6.4, 3.4),
        margins=(0.9, 0.4, 1.2, 0.9),
    )
    for column, said, colour in (
        ("known_finish", "levels it learnt on", chart.SERIES[2]),
        ("unseen_finish", "levels it never saw", chart.SERIES[0]),
    ):
        mean = rows.groupby("levels")[column].mean()
        axes.plot(mean.index, mean, "-", color=colour, lw=2, label=said)
        axes.plot(rows.levels, rows[column], "o", color=colour, ms=5)
    axes.set(xscale="log", ylim=(-0.03, 1.03), xlabel="levels learnt on")
    axes.set_ylabel("share at the finish")
    chart.plain(axes.xaxis)
    axes.set_xticks(sorted(set(rows.levels)))
    axes.legend(loc="center left", fontsize=9)
    return figure
