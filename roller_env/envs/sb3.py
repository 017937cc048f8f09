"""N games as Stable-Baselines3's `VecEnv`, without processes and without copies of infos."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

from roller_env.arrays import Float64, Int64, UInt8
from roller_env.checks import is_whole, nearest
from roller_env.envs.arguments import seed_of
from roller_env.envs.infos import rows_of, vector_info
from roller_env.envs.spaces import keys_to_action, row_of
from roller_env.envs.vector import RollerVectorEnv
from roller_env.level import Level
from roller_env.simulation import Simulation, Snapshot

TRUNCATED: Final = "TimeLimit.truncated"
"""Key under which SB3 looks for whether time alone ended an episode."""


@dataclass(frozen=True, eq=False)
class VecSnapshot:
    """All that the future of n rows of a `RollerVecEnv` depends on.

    Attributes:
        games: of the simulation.
        returns: (n,) returns of the episodes under way.
        lengths: (n,) their lengths, steps.
    """

    games: Snapshot
    returns: Float64
    lengths: Int64


class RollerVecEnv(VecEnv):
    """N games of one level for Stable-Baselines3.

    Every ``infos[i]`` holds what `RollerEnv` tells of the game, and ``TimeLimit.truncated``. An
    episode's last step returns the next one's first observation; ``infos[i]`` is then the last of
    the episode that ended, with ``terminal_observation`` and ``episode`` (return ``r``, length
    ``l``, seconds ``t``, as `Monitor` writes it, so no monitor is needed).

    It can be copied and pickled, and goes on with the same bits.
    """

    def __init__(
        self,
        level: Any = "classic",
        num_envs: int = 64,
        *,
        seed: int | np.integer[Any] | None = None,
        **options: Any,
    ):
        """Make ``num_envs`` games of ``level``.

        Args:
            level: name of a shipped level, path of a level file, or a `Level`.
            num_envs: number of games.
            seed: row i is seeded with ``seed + i`` at the first reset.
            options: the other keywords of `roller_env.config.EnvConfig`, and the ``levels`` of
                `RollerVectorEnv`.

        Raises:
            TypeError: there is no option of that name, or the seed is no whole number.
            ValueError: an option's or the seed's value is not allowed.
            LevelError: the level is not valid.
        """
        seed = seed_of(seed)
        if "autoreset_mode" in options:
            raise TypeError(
                f"{type(self).__name__}() got an unexpected keyword argument 'autoreset_mode'; its "
                "rows are reset as Stable-Baselines3 wants it"
            )
        self.vector = RollerVectorEnv(
            num_envs, autoreset_mode=AutoresetMode.SAME_STEP, level=level, **options
        )
        num_envs = self.vector.num_envs
        self._actions: Any = None
        self._returns = np.zeros(num_envs)
        self._lengths = np.zeros(num_envs, dtype=np.int64)
        self._began = time.time()
        super().__init__(
            num_envs,
            self.vector.single_observation_space,
            self.vector.single_action_space,
        )
        self.metadata = self.vector.metadata
        if seed is not None:
            self.seed(seed)

    @property
    def simulation(self) -> Simulation:
        """The games themselves."""
        return self.vector.simulation

    @property
    def level(self) -> Level:
        """The level that all rows play."""
        return self.vector.simulation.level

    def reset(self) -> Any:
        """Begin an episode in every row, with what `seed` and `set_options` were given.

        Raises:
            TypeError: an option's type is wrong.
            ValueError: an option is unknown, or its or a seed's value is not allowed.
        """
        first = self._options[0]
        # set_options makes one mapping that all rows share, unless each is given its own.
        if all(options is first or not (options or first) for options in self._options):
            observation, _ = self.vector.reset(seed=self._seeds, options=first)
        else:
            for row in range(self.num_envs):
                observation, _ = self._reset_vector(row, self._seeds[row], self._options[row])
        # The base class resets its seeds and options after use, as its other children do.
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = rows_of(vector_info(self.simulation))
        self._returns[:] = 0.0
        self._lengths[:] = 0
        self._began = time.time()
        return observation

    def step_async(self, actions: npt.NDArray[Any]) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step every row with the actions kept, and reset the rows that are over."""
        observation, reward, terminated, truncated, told = self.vector.step(self._actions)
        done = terminated | truncated
        self._returns += reward
        self._lengths += 1
        infos = rows_of(told)
        rows = np.flatnonzero(done)
        if len(rows):
            self._end_episodes(infos, rows, told)
        for info, by_time_alone in zip(infos, (truncated & ~terminated).tolist(), strict=True):
            info[TRUNCATED] = by_time_alone
        return observation, reward.astype(np.float32), done, infos

    def _end_episodes(
        self,
        infos: list[dict[str, Any]],
        rows: Int64,
        told: dict[str, Any],
    ) -> None:
        """Write what SB3 expects at an episode's end, and begin the next one's count."""
        ended = rows_of(told["final_info"])
        elapsed = round(time.time() - self._began, 6)
        for row in rows:
            self.reset_infos[row] = dict(infos[row])
            info = ended[row]
            info["terminal_observation"] = told["final_obs"][row]
            info["episode"] = {
                "r": float(self._returns[row]),
                "l": int(self._lengths[row]),
                "t": elapsed,
            }
            infos[row] = info
        self._begin_counts(rows)

    def _begin_counts(self, rows: Any) -> None:
        self._returns[rows] = 0.0
        self._lengths[rows] = 0

    def get_state(self, rows: npt.ArrayLike | None = None) -> VecSnapshot:
        """Return all that the future of ``rows`` (all, if None) depends on; it can be pickled.

        Args:
            rows: (n,) row numbers.
        """
        numbers = np.arange(self.num_envs) if rows is None else np.asarray(rows)
        games = self.vector.get_state(numbers)
        return VecSnapshot(games, self._returns[numbers].copy(), self._lengths[numbers].copy())

    def set_state(self, state: VecSnapshot, rows: npt.ArrayLike | None = None) -> None:
        """Put a state of n rows into ``rows`` (all, if None); the same actions give the same bits.

        Raises:
            TypeError: it is no state.
            ValueError: it is of another game, or of another number of rows.
        """
        if not isinstance(state, VecSnapshot):
            raise TypeError(f"state: found {type(state)}; must be what get_state() returns")
        numbers = np.arange(self.num_envs) if rows is None else np.asarray(rows)
        self.vector.set_state(state.games, numbers)
        self._returns[numbers] = state.returns
        self._lengths[numbers] = state.lengths

    def close(self) -> None:
        """Free what the environment holds."""
        self.vector.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the row's game for each index.

        The spaces and the random generators are those of one game. The rows share all else, which
        is the underlying vector environment's.

        Raises:
            AttributeError: there is no such attribute.
        """
        rows = self._rows(indices)
        if attr_name in ("action_space", "observation_space"):
            return [getattr(self, attr_name) for _ in rows]
        value = getattr(self.vector, attr_name)
        if attr_name in ("np_random", "np_random_seed"):
            return [value[row] for row in rows]
        return [value for _ in rows]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the environment, which all rows share.

        Raises:
            ValueError: only some of the rows were named.
        """
        if len(set(self._rows(indices))) != self.num_envs:
            raise ValueError(
                f"set_attr: the rows share one environment, so {attr_name!r} can be set for all "
                "of them only; leave indices out"
            )
        setattr(self.vector, attr_name, value)

    def set_options(self, options: list[dict[str, Any]] | dict[str, Any] | None = None) -> None:
        """Keep the options of the next `reset`: one mapping for all rows, or one for each.

        Raises:
            TypeError: it is neither a mapping nor a list of mappings.
            ValueError: there are more or fewer mappings than rows.
        """
        each = options if isinstance(options, list) else [options or {}]
        if not all(isinstance(one, Mapping) for one in each):
            raise TypeError(f"options: found {options!r}; must be a mapping, or a list of mappings")
        if isinstance(options, list) and len(options) != self.num_envs:
            raise ValueError(
                f"options: found {len(options)} mappings; needed is one a row, {self.num_envs}"
            )
        super().set_options(options)

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Call a method of one game for each index.

        ``reset(seed=..., options=...)``, ``get_state()``, ``set_state(state)`` and ``render()`` do
        to the row what they do to a `RollerEnv`; ``picture()`` draws it without a render mode too,
        and ``get_keys_to_action()`` is the same for all.

        Raises:
            AttributeError: one game has no such method.
            ValueError: it can be called for all rows together only.
        """
        rows = self._rows(indices)
        if method_name in ("step", "close"):
            raise ValueError(
                f"env_method: the rows share one environment, so {method_name!r} can be done to "
                "all of them only; call it on this environment"
            )
        methods: dict[str, Callable[..., Any]] = {
            "reset": self._reset_row,
            "get_state": lambda row: self.get_state([row]),
            "set_state": lambda row, state: self.set_state(state, [row]),
            "render": self._picture_or_warning,
            "picture": self.vector.picture,
            "get_keys_to_action": lambda row: keys_to_action(self.vector.config.action),
        }
        if method_name not in methods:
            raise AttributeError(
                f"env_method: one game has no method {method_name!r}; there are "
                f"{', '.join(methods)}{nearest(method_name, methods)}"
            )
        return [methods[method_name](row, *args, **kwargs) for row in rows]

    def _reset_row(
        self, row: int, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        observation, info = self._reset_vector(row, seed, options)
        self._begin_counts(row)
        self.reset_infos[row] = rows_of(info)[row]
        return row_of(observation, row), dict(self.reset_infos[row])

    def _reset_vector(
        self, row: int, seed: int | None, options: dict[str, Any] | None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode in one row; return what the vector returns."""
        mask = np.arange(self.num_envs) == row
        seeds = [seed if chosen else None for chosen in mask]
        return self.vector.reset(seed=seeds, options={**(options or {}), "reset_mask": mask})

    def _picture_or_warning(self, row: int) -> UInt8 | None:
        """Return a row's picture if there is a render mode; else warn, as `RollerEnv.render`."""
        if self.vector.render_mode is None:
            self.vector.render()
            return None
        return self.vector.picture(row)

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Say for each index whether it is wrapped: in what does a `Monitor`'s work, and no more.

        Evaluation then takes returns from ``infos[i]["episode"]``, which no wrapper has changed.
        """
        return [issubclass(Monitor, wrapper_class) for _ in self._rows(indices)]

    def get_images(self) -> Sequence[UInt8 | None]:
        """Return a picture of every row; None for each without a render mode."""
        if self.vector.render_mode is None:
            return [None] * self.num_envs
        return [self.vector.picture(row) for row in range(self.num_envs)]

    def _rows(self, indices: VecEnvIndices) -> list[int]:
        """Return the rows that are meant; a negative index counts from the end, as in a list."""
        if is_whole(indices):
            indices = [indices]
        numbers = range(self.num_envs)
        found = list(self._get_indices(indices))
        if not all(is_whole(index) and -self.num_envs <= index < self.num_envs for index in found):
            raise IndexError(
                f"indices: found {found}; must be row numbers from 0 to {self.num_envs - 1}"
            )
        return [numbers[index] for index in found]
