"""What many environments did in a number of steps, as arrays, and the episodes that is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Float32, Int64
from roller_env.training.vector import RecipeVectorEnv


@dataclass(frozen=True, eq=False)
class Piece:
    """Steps of one episode, from its beginning or the rollout's to its end or the rollout's.

    Attributes:
        observations: (n + 1, D) before each step, and after the last.
        actions: (n,) directions.
        rewards: (n,) scaled.
        logits: (n, 9) by which the actions were drawn.
        log_probability: (n,) of the actions.
        terminated: the game's end is the episode's.
        truncated: the episode was ended, the game would have gone on.
    """

    observations: Float32
    actions: Int64
    rewards: Float32
    logits: Float32
    log_probability: Float32
    terminated: bool
    truncated: bool


class Rollout:
    """Steps environments, and keeps what happened."""

    def __init__(self, envs: RecipeVectorEnv) -> None:
        """Begin where the environments are."""
        self._envs = envs
        self._columns: tuple[list[npt.NDArray[Any]], ...] = ([], [], [], [], [], [], [])
        self._final: list[npt.NDArray[Any] | None] = []

    def step(self, actions: Int64, logits: Float32, log_probability: Float32) -> None:
        """Step every row.

        Args:
            actions: (N,) directions.
            logits: (N, 9) by which they were drawn.
            log_probability: (N,) of the actions.
        """
        before = self._envs.observations
        _, rewards, terminated, truncated, told = self._envs.step(actions)
        step = (before, actions, rewards, logits, log_probability, terminated, truncated)
        for column, values in zip(self._columns, step, strict=True):
            column.append(values)
        self._final.append(told.get("final_obs"))

    def pieces(self) -> Iterator[Piece]:
        """Return all steps, row by row, cut where episodes ended."""
        columns = [np.stack(column, axis=1) for column in self._columns]
        observations, *between, terminated, truncated = columns
        steps, last = len(self._final), self._envs.observations
        for row in range(self._envs.num_envs):
            begin = 0
            for end in (*np.flatnonzero(terminated[row] | truncated[row]).tolist(), steps - 1):
                if begin == steps:
                    continue
                final = self._final[end]
                is_over = bool(terminated[row, end] or truncated[row, end])
                after = final[row] if final is not None and is_over else last[row]
                part = (row, slice(begin, end + 1))
                seen = np.concatenate([observations[part], after[None]])
                ends = bool(terminated[row, end]), bool(truncated[row, end])
                yield Piece(seen, *(column[part] for column in between), *ends)
                begin = end + 1
