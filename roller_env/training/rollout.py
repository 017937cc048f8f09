"""What many environments did in a number of steps, as arrays, and the episodes that is."""

from __future__ import annotations

from collections import defaultdict
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
        self._kept: dict[str, list[npt.NDArray[Any]]] = defaultdict(list)
        self._final: list[npt.NDArray[Any] | None] = []

    def step(self, actions: Int64, logits: Float32, log_probability: Float32) -> None:
        """Step every row.

        Args:
            actions: (N,) directions.
            logits: (N, 9) by which they were drawn.
            log_probability: (N,) of the actions.
        """
        kept = {"observations": self._envs.observations, "actions": actions, "logits": logits}
        kept["log_probability"] = log_probability
        _, kept["rewards"], kept["terminated"], kept["truncated"], told = self._envs.step(actions)
        for name, values in kept.items():
            self._kept[name].append(values)
        self._final.append(told.get("final_obs"))

    def pieces(self) -> Iterator[Piece]:
        """Return all steps, row by row, cut where episodes ended."""
        kept = {name: np.stack(values, axis=1) for name, values in self._kept.items()}
        over = kept["terminated"] | kept["truncated"]
        steps = len(self._final)
        for row in range(self._envs.num_envs):
            begin = 0
            for end in (np.flatnonzero(over[row]) + 1).tolist():
                yield self._piece(kept, row, slice(begin, end))
                begin = end
            if begin < steps:
                yield self._piece(kept, row, slice(begin, steps))

    def _piece(self, kept: dict[str, npt.NDArray[Any]], row: int, steps: slice) -> Piece:
        last = steps.stop - 1
        ends = bool(kept["terminated"][row, last]), bool(kept["truncated"][row, last])
        after = self._envs.observations[row]
        if any(ends):
            final = self._final[last]
            assert final is not None
            after = final[row]
        return Piece(
            observations=np.concatenate([kept["observations"][row, steps], after[None]]),
            actions=kept["actions"][row, steps],
            rewards=kept["rewards"][row, steps],
            logits=kept["logits"][row, steps],
            log_probability=kept["log_probability"][row, steps],
            terminated=ends[0],
            truncated=ends[1],
        )
