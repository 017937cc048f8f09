"""N games as Stable-Baselines3's `VecEnv`, without processes and without copies of infos."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

from roller_env.envs.vector import RollerVectorEnv
from roller_env.level import Level
from roller_env.simulation import Simulation, Snapshot


@dataclass(frozen=True, eq=False)
class VecSnapshot:
    """All that the future of a `RollerVecEnv` depends on.

    Attributes:
        games: of the simulation, every row.
        returns: (N,) returns of the episodes under way.
        lengths: (N,) their lengths, steps.
    """

    games: Snapshot
    returns: npt.NDArray[np.float64]
    lengths: npt.NDArray[np.int64]


class RollerVecEnv(VecEnv):
    """N games of one level for Stable-Baselines3.

    An episode's last step returns the next one's first observation; ``infos[i]`` then holds
    ``terminal_observation``, ``TimeLimit.truncated``, ``episode`` (return ``r``, length ``l``,
    seconds ``t``, as `Monitor` writes it, so no monitor is needed) and the results ``success``,
    ``score_percent``, ``coins``, ``time_s``, ``fall``, ``diverged``.
    """

    def __init__(
        self,
        level: Any = "classic",
        num_envs: int = 64,
        *,
        seed: int | None = None,
        **options: Any,
    ):
        """Make ``num_envs`` games of ``level``.

        Args:
            level: name of a shipped level, path of a level file, or a `Level`.
            num_envs: number of games.
            seed: row i is seeded with ``seed + i`` at the first reset.
            options: the other keywords of `roller_env.config.EnvConfig`.
        """
        self.vector = RollerVectorEnv(
            num_envs, autoreset_mode=AutoresetMode.SAME_STEP, level=level, **options
        )
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
        return self.vector.simulation.compiled.level

    def reset(self) -> Any:
        """Begin an episode in every row, with what `seed` and `set_options` were given.

        Raises:
            ValueError: the rows were given different options.
        """
        options = self._options[0]
        if any(other != options for other in self._options):
            raise ValueError(
                f"options: found {self._options}; the rows share one environment, so they must "
                "be the same for all of them"
            )
        observation, _ = self.vector.reset(seed=self._seeds, options=options)
        # The base class resets its seeds and options after use, as its other children do.
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = [{} for _ in range(self.num_envs)]
        self._returns[:] = 0.0
        self._lengths[:] = 0
        self._began = time.time()
        return observation

    def step_async(self, actions: npt.NDArray[Any]) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step every row with the actions kept, and reset the rows that are over."""
        observation, reward, terminated, truncated, vector_info = self.vector.step(self._actions)
        done = terminated | truncated
        self._returns += reward
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        rows = np.flatnonzero(done)
        if len(rows):
            self._fill_infos(infos, rows, truncated & ~terminated, vector_info)
        return observation, reward.astype(np.float32), done, infos

    def _fill_infos(
        self,
        infos: list[dict[str, Any]],
        rows: npt.NDArray[np.int64],
        truncated: npt.NDArray[np.bool_],
        vector_info: dict[str, Any],
    ) -> None:
        """Write what SB3 expects at an episode's end, and begin the next one's count."""
        results = vector_info["final_info"]
        elapsed = round(time.time() - self._began, 6)
        for row in rows:
            info = {
                name: values[row].item()
                for name, values in results.items()
                if not name.startswith("_")
            }
            info["terminal_observation"] = vector_info["final_obs"][row]
            info["TimeLimit.truncated"] = bool(truncated[row])
            info["episode"] = {
                "r": float(self._returns[row]),
                "l": int(self._lengths[row]),
                "t": elapsed,
            }
            infos[row] = info
        self._returns[rows] = 0.0
        self._lengths[rows] = 0

    def snapshot(self) -> VecSnapshot:
        """Return the state of all rows, also in the middle of episodes, as copies."""
        return VecSnapshot(self.simulation.snapshot(), self._returns.copy(), self._lengths.copy())

    def restore(self, snapshot: VecSnapshot) -> None:
        """Put all rows back to a snapshot; the same actions then give the same bits.

        Raises:
            ValueError: the snapshot is of another level or number of rows.
        """
        if len(snapshot.returns) != self.num_envs:
            raise ValueError(
                f"snapshot: found {len(snapshot.returns)} rows; this has {self.num_envs}"
            )
        self.simulation.restore(snapshot.games)
        self._returns = snapshot.returns.copy()
        self._lengths = snapshot.lengths.copy()

    def close(self) -> None:
        """Free what the environment holds."""
        self.vector.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the underlying vector environment once for each index.

        The rows share one environment object, so they share their attributes.

        Raises:
            AttributeError: there is no such attribute.
        """
        value = getattr(self.vector, attr_name)
        return [value for _ in self._rows(indices)]

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

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Call a method for each index; ``render`` and ``picture`` are of the row's own picture.

        Raises:
            AttributeError: there is no such method.
        """
        rows = self._rows(indices)
        if method_name in ("render", "picture"):
            return [self.vector.picture(row) for row in rows]
        method = getattr(self.vector, method_name)
        return [method(*args, **kwargs) for _ in rows]

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Say for each index whether it is wrapped: in what does a `Monitor`'s work, and no more.

        Evaluation then takes returns from ``infos[i]["episode"]``, which no wrapper has changed.
        """
        return [issubclass(Monitor, wrapper_class) for _ in self._rows(indices)]

    def get_images(self) -> Sequence[npt.NDArray[np.uint8] | None]:
        """Return a picture of every row; None for each without a render mode."""
        if self.vector.render_mode is None:
            return [None] * self.num_envs
        return [self.vector.picture(row) for row in range(self.num_envs)]

    def _rows(self, indices: VecEnvIndices) -> Iterable[int]:
        rows: list[int] = list(self._get_indices(indices))
        return rows
