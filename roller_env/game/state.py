"""GameState: all that the rules change, arrays with a leading axis of envs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Bool, Float64, Int64
from roller_env.game.cameras import CameraState
from roller_env.game.kinds import RULES
from roller_env.game.result import REWARD_TERMS
from roller_env.game.rewards import ShapingState
from roller_env.game.tables import LevelTable
from roller_env.pieces.coin import COIN
from roller_env.pieces.rules import Rules, StateT

COIN_ON_PANELS: Final = 10
"""What a coin counts on whatever shows a player how the game stands: the original's `digits` show
ten times the variable. Rewards, scores and all that programs read count a coin as one."""


class GameState(NamedTuple):
    """The game's own state of N envs; the ball and the slabs are the physics'.

    Attributes:
        steps: (N,) control steps since the episode began.
        control_delay_s: (N,) time until the keys work (the intro).
        touching: (N, R) which regions the ball was in at the end of the last step.
        signals: (N, S) which gates, platforms and fans have been told to go on.
        finished: (N,) the ball has reached the finish and is frozen.
        fallen: (N,) the ball has fallen below the kill height.
        diverged: (N,) the physics failed.
        truncated: (N,) the time is up.
        total_reward: (N,) sum of the rewards since the episode began.
        reward_terms: (N, terms) of which sums that is one: of each of `REWARD_TERMS`.
        camera: what the cameras own.
        shaping: what the shaping of the reward owns.
        kinds: what each kind of piece owns; see `of`.
    """

    steps: Int64
    control_delay_s: Float64
    touching: Bool
    signals: Bool
    finished: Bool
    fallen: Bool
    diverged: Bool
    truncated: Bool
    total_reward: Float64
    reward_terms: Float64
    camera: CameraState
    shaping: ShapingState
    kinds: tuple[Any, ...]

    @staticmethod
    def initial(table: LevelTable, num_envs: int) -> GameState:
        """Return the state of N envs at the start of an episode, of whichever of the levels."""

        def flags(*shape: int) -> Bool:
            return np.zeros((num_envs, *shape), dtype=bool)

        return GameState(
            steps=np.zeros(num_envs, dtype=np.int64),
            control_delay_s=np.zeros(num_envs),
            touching=flags(table.regions.radius.shape[1]),
            signals=flags(table.signals),
            finished=flags(),
            fallen=flags(),
            diverged=flags(),
            truncated=flags(),
            total_reward=np.zeros(num_envs),
            reward_terms=np.zeros((num_envs, len(REWARD_TERMS))),
            camera=CameraState.initial(num_envs),
            shaping=ShapingState.initial(num_envs),
            kinds=tuple(
                rules.state(own, num_envs) for rules, own in zip(RULES, table.kinds, strict=True)
            ),
        )

    def of(self, rules: Rules[Any, StateT]) -> StateT:
        """Return a kind's own state."""
        state: StateT = self.kinds[RULES.index(rules)]
        return state

    @property
    def coins(self) -> Int64:
        """(N,) how many coins are collected."""
        return self.of(COIN).collected

    @property
    def achieved(self) -> Bool:
        """(N, A) what is done once in an episode: coins taken, plates struck, triggers spent."""
        flags = [
            getattr(own, deed)
            for rules, own in zip(RULES, self.kinds, strict=True)
            for deed in rules.deeds
        ]
        return np.concatenate(flags, axis=1)

    @property
    def terminated(self) -> Bool:
        """(N,) whether the game is over for good: finished, fallen or diverged."""
        return self.finished | self.fallen | self.diverged

    @property
    def over(self) -> Bool:
        """(N,) whether the episode has ended, also by time."""
        return self.terminated | self.truncated

    def copy_rows(self, rows: Int64 | slice = slice(None)) -> GameState:
        """Return the state of some of the envs, as a copy."""
        return cast("GameState", _mapped(self, lambda array: np.array(array[rows])))

    def set_rows(self, rows: Int64 | slice, other: GameState) -> None:
        """Write what `copy_rows` returned back into ``rows``."""
        for mine, theirs in zip(self.arrays(), other.arrays(), strict=True):
            mine[rows] = theirs

    def arrays(self) -> Iterator[npt.NDArray[Any]]:
        """Yield every array, always in the same order."""
        yield from _leaves(self)

    def named(self) -> dict[str, npt.NDArray[Any]]:
        """Return every array by its name, such as ``plate/struck``."""
        owners = {"kinds": [rules.name for rules in RULES]}
        return {
            name: array
            for field in self._fields
            for name, array in _named(getattr(self, field), field, owners.get(field))
        }

    def with_arrays(self, named: Mapping[str, npt.NDArray[Any]]) -> GameState:
        """Return a state of the same kind with the arrays of another's `named`."""
        arrays = iter([named[name] for name in self.named()])
        return cast("GameState", _mapped(self, lambda array: next(arrays)))

    @staticmethod
    def joined(states: Sequence[GameState]) -> GameState:
        """Return the states of some envs and of others as one."""
        parts = zip(*(state.arrays() for state in states), strict=True)
        whole = (np.concatenate(arrays) for arrays in parts)
        return cast("GameState", _mapped(states[0], lambda array: next(whole)))


def _mapped(tree: Any, function: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]) -> Any:
    """Return a tree of tuples with every array replaced."""
    if not isinstance(tree, tuple):
        return tree if tree is None else function(tree)
    branches = (_mapped(branch, function) for branch in tree)
    return type(tree)(*branches) if hasattr(tree, "_fields") else tuple(branches)


def _named(
    tree: Any, name: str, branches: Sequence[str] | None = None
) -> Iterator[tuple[str, npt.NDArray[Any]]]:
    """Yield the arrays of a tree with the names on the way; ``branches`` stand for this one's."""
    if not isinstance(tree, tuple):
        if tree is not None:
            yield name, tree
        return
    prefix = "" if branches else f"{name}/"
    for branch, inner in zip(branches or tree._fields, tree, strict=True):  # type: ignore[attr-defined]
        yield from _named(inner, prefix + branch)


def _leaves(tree: Any) -> Iterator[npt.NDArray[Any]]:
    if isinstance(tree, tuple):
        for branch in tree:
            yield from _leaves(branch)
    elif tree is not None:
        yield tree


def score_percent(coins: Int64, coin_count: Int64, finished: Bool) -> Float64:
    """Return the percentage of the level's coins collected, (N,).

    A level without coins is all or nothing: 100 once it is finished, 0 before and after a fall.
    """
    collected = 100.0 * coins / np.maximum(coin_count, 1)
    return np.where(coin_count > 0, collected, np.where(finished, 100.0, 0.0))
