"""What callers pass to `reset`: seeds and options, checked before anything is changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Bool, Float64, Int64
from roller_env.checks import is_whole, known_names
from roller_env.pieces.coin import COIN
from roller_env.simulation import Placement, Simulation, Snapshot

RESET_MASK: Final = "reset_mask"
OPTIONS: Final = ("intro", "state", "position", "velocity", "angular_velocity", "coins")
"""What a reset can be told of its games."""

_OF_OTHERS: Final = ("minari_autoseed",)
"""Read by a wrapper of another library, which passes them on."""


def seed_of(seed: object) -> int | None:
    """Return one seed, None or an integer of Python's or NumPy's, as Gymnasium takes it.

    Raises:
        TypeError: it is neither.
        ValueError: it is negative.
    """
    if isinstance(seed, np.ndarray) and seed.ndim == 0:
        seed = seed[()]
    if seed is None:
        return None
    if not is_whole(seed):
        raise TypeError(f"seed: found {seed!r}; must be None or a whole number")
    if seed < 0:
        raise ValueError(f"seed: found {seed}; must be at least 0")
    return int(seed)


def seeds_of(seed: Any, num_envs: int) -> list[int | None]:
    """Return the seeds of all rows: s + i for an integer s, else one for each.

    Raises:
        TypeError: ``seed`` is neither None, nor an integer, nor a sequence or array of them.
        ValueError: there are too many or too few, or one is negative.
    """
    is_array = isinstance(seed, np.ndarray) and seed.ndim > 0
    if is_array or (isinstance(seed, Sequence) and not isinstance(seed, str)):
        seeds = [seed_of(one) for one in seed]
        if len(seeds) != num_envs:
            raise ValueError(f"seed: found {len(seeds)} seeds; needed is one a row, {num_envs}")
        return seeds
    first = seed_of(seed)
    return [None if first is None else first + row for row in range(num_envs)]


@dataclass(frozen=True, eq=False)
class Reset:
    """What a reset's options ask for.

    Attributes:
        rows: (n,) which rows begin an episode.
        intro: whether the keys work only after the intro.
        state: of n rows to begin from, or None.
        placement: of the n balls, or None.
    """

    rows: Int64
    intro: bool
    state: Snapshot | None
    placement: Placement | None

    def apply(self, simulation: Simulation) -> None:
        """Begin the episodes. The rows' generators stay their own, whatever the state's were."""
        if self.state is None:
            simulation.reset(self.rows, self.intro, self.placement)
        else:
            own = simulation.snapshot(self.rows).generators
            simulation.restore(replace(self.state, generators=own), self.rows)


def reset_of(options: Mapping[str, Any] | None, simulation: Simulation, *, batched: bool) -> Reset:
    """Return what a reset's options ask for.

    Args:
        options: of `RollerEnv.reset`, or of `RollerVectorEnv.reset`.
        simulation: that is to be reset.
        batched: whether they are of a vector, of which some rows can be named and in which every
            row can have values of its own.

    Raises:
        TypeError: an option's type is wrong.
        ValueError: an option is unknown, or its value is not allowed.
    """
    if options is not None and not isinstance(options, Mapping):
        raise TypeError(f"options: found {options!r}; must be None or a mapping")
    given = {
        name: value
        for name, value in (options or {}).items()
        if value is not None and name not in _OF_OTHERS
    }
    known_names("options", given, (RESET_MASK, *OPTIONS) if batched else OPTIONS)
    rows = _masked(given.pop(RESET_MASK, None), simulation.num_envs)
    intro = given.pop("intro", False)
    if not isinstance(intro, bool | np.bool_):
        raise TypeError(f"options['intro']: found {intro!r}; must be True or False")
    if "state" in given:
        others = [name for name in OPTIONS if name in given and name != "state"]
        if others or intro:
            raise ValueError(
                f"options['state']: found with {(others or ['intro'])[0]!r}; a state has all of "
                "it: leave one of the two out"
            )
        state = _state(given["state"], simulation, len(rows))
        return Reset(rows, bool(intro), state, None)
    if not given:
        return Reset(rows, bool(intro), None, None)
    read = _Reader(simulation.num_envs, rows, batched)
    placement = simulation.placement(
        position=read.vectors(given, "position"),
        velocity=read.vectors(given, "velocity"),
        angular_velocity=read.vectors(given, "angular_velocity"),
        coin_left=read.coins(given, simulation.table.of(COIN).at.shape[1]),
    )
    return Reset(rows, bool(intro), None, placement)


def _masked(mask: object, num_envs: int) -> Int64:
    if mask is None:
        return np.arange(num_envs)
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        raise TypeError(f"options['reset_mask']: found {type(mask)}; must be a bool array")
    if mask.shape != (num_envs,):
        raise ValueError(f"options['reset_mask']: found shape {mask.shape}; must be ({num_envs},)")
    return np.flatnonzero(mask)


def _state(state: object, simulation: Simulation, count: int) -> Snapshot:
    """Return the state of ``count`` rows to begin from; one state serves for all of them."""
    if not isinstance(state, Snapshot):
        raise TypeError(f"options['state']: found {type(state)}; must be what get_state() returns")
    simulation.check_snapshot(state)
    if len(state) == 1:
        state = state.take(np.zeros(count, dtype=np.int64))
    if len(state) != count:
        raise ValueError(f"options['state']: found {len(state)} rows for the {count} to be reset")
    over = np.flatnonzero(state.game.over)
    if len(over):
        raise ValueError(
            f"options['state']: found rows {over.tolist()} over; an episode can begin only where "
            "one is under way"
        )
    return state


@dataclass(frozen=True)
class _Reader:
    """Reads values of games: one for all rows, or (N, ...) with one for each."""

    num_envs: int
    rows: Int64
    batched: bool

    def vectors(self, given: Mapping[str, Any], name: str) -> Float64 | None:
        """Return the option ``name`` as (n, 3), or None if it is not given."""
        if name not in given:
            return None
        values = _array(given, name, "iuf", "numbers")
        vectors: Float64 = self._of_rows(name, values, (3,)).astype(np.float64)
        return vectors

    def coins(self, given: Mapping[str, Any], count: int) -> Bool | None:
        """Return which of ``count`` coins are left, (n, count), or None if it is not given."""
        if "coins" not in given:
            return None
        values = _array(given, "coins", "biu", "bools or coin numbers")
        if values.dtype == np.bool_:
            return self._of_rows("coins", values, (count,))
        if values.ndim != 1 or not ((values >= 0) & (values < count)).all():
            raise ValueError(
                f"options['coins']: found {values.tolist()}; must be numbers from 0 to "
                f"{count - 1} of the coins that are left, or a bool for each"
            )
        left = np.zeros((len(self.rows), count), dtype=bool)
        left[:, values] = True
        return left

    def _of_rows(
        self, name: str, values: npt.NDArray[Any], one: tuple[int, ...]
    ) -> npt.NDArray[Any]:
        whole = (self.num_envs, *one)
        if values.shape != one and not (self.batched and values.shape == whole):
            wanted = f"{one} or {whole}" if self.batched else f"{one}"
            raise ValueError(f"options[{name!r}]: found shape {values.shape}; must be {wanted}")
        return np.broadcast_to(values, whole)[self.rows]


def _array(given: Mapping[str, Any], name: str, kinds: str, wanted: str) -> npt.NDArray[Any]:
    try:
        values = np.asarray(given[name])
    except ValueError:  # ragged
        values = np.asarray(None)
    if values.size == 0:  # of no type that anyone chose
        values = values.astype(np.int64)
    if values.dtype.kind not in kinds:
        raise TypeError(f"options[{name!r}]: found {given[name]!r}; must be an array of {wanted}")
    return values
