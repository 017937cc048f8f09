"""What the environments tell beside the observation: the same keys in every step and reset."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env.simulation import Simulation

Int64 = npt.NDArray[np.int64]

_KEYS: Final = ("success", "is_success", "score_percent", "coins", "time_s", "fall", "diverged")


def single_info(simulation: Simulation) -> dict[str, Any]:
    """Return the info of a simulation of one game."""
    (info,) = rows_of(_told(simulation))
    return info


def vector_info(simulation: Simulation, rows: Int64 | None = None) -> dict[str, Any]:
    """Return the info of ``rows`` (all, if None) as Gymnasium's vectors have it.

    Each key has an array of (N,), 0 in other rows, and ``_key`` says in which rows it is told.
    """
    info: dict[str, Any] = {}
    for name, values in _told(simulation, rows).items():
        info[name] = _among(simulation.num_envs, rows, values)
        info[f"_{name}"] = _among(simulation.num_envs, rows, np.ones(len(values), dtype=bool))
    return info


def _among(num_envs: int, rows: Int64 | None, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return values of ``rows`` as those of all rows, 0 in the others."""
    if rows is None:
        return values
    every = np.zeros(num_envs, dtype=values.dtype)
    every[rows] = values
    return every


def rows_of(told: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a vector's info as one for each row, as Stable-Baselines3 has it."""
    columns = (told[name].tolist() for name in _KEYS)
    # Written out: hundreds of these are made in a step.
    return [
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


def _told(simulation: Simulation, rows: Int64 | None = None) -> dict[str, npt.NDArray[Any]]:
    """Return how the games in ``rows`` (all, if None) stand, arrays of (n,) by key.

    ``is_success`` is what Stable-Baselines3 calls ``success``; it logs the rate of it.
    """
    found = simulation.results(rows)
    return {**found, "is_success": found["success"].copy()}
