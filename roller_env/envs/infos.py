"""What the environments tell beside the observation: the same keys in every step and reset.

At an episode's end there is one more, ``reward_terms``: what the episode's rewards were for.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Bool, Float64, Int64
from roller_env.game.result import REWARD_TERMS
from roller_env.simulation import Simulation

_KEYS: Final = ("success", "is_success", "score_percent", "coins", "time_s", "fall", "diverged")

LEVEL: Final = "level"
"""Key of the number of the level that a row plays, where there are several."""

TERMS: Final = "reward_terms"
"""Key of the episode's reward by term, a dict with the keys `REWARD_TERMS`."""


def single_info(simulation: Simulation) -> dict[str, Any]:
    """Return the info of a simulation of one game."""
    result = simulation.result()
    info: dict[str, Any] = {
        "success": result.success,
        "is_success": result.success,
        "score_percent": result.score_percent,
        "coins": result.coins,
        "time_s": result.time_s,
        "fall": result.fall,
        "diverged": result.diverged,
    }
    if len(simulation.levels) > 1:
        info[LEVEL] = int(simulation.level_of[0])
    if result.outcome != "not ended":
        info[TERMS] = result.reward_terms
    return info


def vector_info(simulation: Simulation, rows: Int64 | None = None) -> dict[str, Any]:
    """Return the info of ``rows`` (all, if None) as Gymnasium's vectors have it.

    Each key has an array of (N,), 0 in other rows, and ``_key`` says in which rows it is told.
    """
    results = simulation.results(rows)
    # What Stable-Baselines3 calls success; it logs the rate of it.
    results["is_success"] = results["success"].copy()
    info: dict[str, Any] = {}
    for name in _KEYS:
        values = results[name]
        info[name] = _among(simulation.num_envs, rows, values)
        info[f"_{name}"] = _among(simulation.num_envs, rows, np.ones(len(values), dtype=bool))
    if len(simulation.levels) > 1:
        level_of = simulation.level_of if rows is None else simulation.level_of[rows]
        info[LEVEL] = _among(simulation.num_envs, rows, level_of)
        info[f"_{LEVEL}"] = info[f"_{_KEYS[0]}"].copy()
    over = simulation.state.over if rows is None else simulation.state.over[rows]
    if over.any():
        ended = _among(simulation.num_envs, rows, over)
        info[TERMS] = _terms(_among(simulation.num_envs, rows, results[TERMS]), ended)
        info[f"_{TERMS}"] = ended
    return info


def _terms(terms: Float64, ended: Bool) -> dict[str, npt.NDArray[Any]]:
    """Return the terms, (N, 4), of the rows that ended as an info of infos."""
    inner: dict[str, npt.NDArray[Any]] = {}
    for name, values in zip(REWARD_TERMS, terms.T, strict=True):
        inner[name] = np.where(ended, values, 0.0)
        inner[f"_{name}"] = ended.copy()
    return inner


def _among(num_envs: int, rows: Int64 | None, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return values of ``rows`` as those of all rows, 0 in the others."""
    if rows is None:
        return values
    every = np.zeros((num_envs, *values.shape[1:]), dtype=values.dtype)
    every[rows] = values
    return every


def rows_of(told: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a vector's info as one for each row, as Stable-Baselines3 has it."""
    columns = (told[name].tolist() for name in _KEYS)
    # Written out: hundreds of these are made in a step.
    infos: list[dict[str, Any]] = [
        {
            "success": success,
            "is_success": is_success,
            "score_percent": score_percent,
            "coins": coins,
            "time_s": time_s,
            "fall": fall,
            "diverged": diverged,
        }
        for success, is_success, score_percent, coins, time_s, fall, diverged in zip(
            *columns, strict=True
        )
    ]
    if LEVEL in told:
        for info, number in zip(infos, told[LEVEL].tolist(), strict=True):
            info[LEVEL] = number
    if TERMS in told:
        for row in np.flatnonzero(told[f"_{TERMS}"]):
            infos[row][TERMS] = {name: float(told[TERMS][name][row]) for name in REWARD_TERMS}
    return infos
