"""N games as a `gymnasium.vector.VectorEnv`, stepped in native threads."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from roller_env.config import EnvConfig, make_config
from roller_env.drawing.renderer import GameRenderer
from roller_env.envs import spaces
from roller_env.game.actions import forces
from roller_env.simulation import Simulation

Bool = npt.NDArray[np.bool_]
Float64 = npt.NDArray[np.float64]
Int64 = npt.NDArray[np.int64]


class RollerVectorEnv(gym.vector.VectorEnv[Any, Any, Any]):
    """N games of one level; row i does what a `RollerEnv` with row i's seed does, bit for bit.

    Autoreset as Gymnasium defines it. NEXT_STEP: the step after an episode's last ignores its
    action and returns the reset observation with reward 0. SAME_STEP: the last step returns the
    reset observation, with the last one in ``info["final_obs"]`` and the episode's results in
    ``info["final_info"]``. DISABLED: the caller resets rows with
    ``reset(options={"reset_mask": mask})``.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **options: Any,
    ):
        """Make ``num_envs`` games; see `roller_env.config.EnvConfig` for the options.

        Raises:
            ValueError: an option is unknown or its value is not allowed.
            LevelError: the level is not valid.
        """
        self.config: EnvConfig = make_config(**options)
        self.autoreset_mode = _autoreset_mode(autoreset_mode)
        self.num_envs = num_envs
        self.simulation = Simulation(self.config, num_envs)
        self.single_action_space = spaces.action_space(self.config)
        self.single_observation_space = spaces.observation_space(self.config)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.render_mode = self.config.render_mode
        self.metadata = {
            "render_modes": ["rgb_array"],
            "render_fps": round(1.0 / self.config.control_dt_s),
            "autoreset_mode": self.autoreset_mode,
        }
        self._generators: list[np.random.Generator] | None = None
        self._renderer: GameRenderer | None = None

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode in every row, or in those of ``options["reset_mask"]``.

        Args:
            seed: an integer s seeds row i with s + i; a sequence has one a row; None goes on with
                the generators there are, which at first are seeded by the operating system.
            options: ``reset_mask``, (N,) bool: the rows to reset; ``intro``: see `RollerEnv`.
        """
        options = options or {}
        rows = self._rows_to_reset(options.get("reset_mask"))
        self._seed(seed, rows)
        self.simulation.reset(rows, intro=bool(options.get("intro", False)))
        return self._observation(), {}

    def step(self, actions: Any) -> tuple[Any, Float64, Bool, Bool, dict[str, Any]]:
        """Advance every row by one control step, resetting rows as the autoreset mode says.

        Raises:
            ValueError: the actions are not in the action space.
            gymnasium.error.ResetNeeded: `reset` was never called, or (DISABLED) a row is over.
        """
        if self._generators is None:
            raise gym.error.ResetNeeded("step: no episode is under way; call reset() first")
        force = forces(self.config.action, actions)
        if len(force) != self.num_envs:
            raise ValueError(f"actions: found {len(force)} rows; needed are {self.num_envs}")
        over = self.simulation.state.over
        if over.any() and self.autoreset_mode is AutoresetMode.NEXT_STEP:
            self.simulation.reset(np.flatnonzero(over))
            transition = self.simulation.step(force, hold=over)
        elif over.any():
            raise gym.error.ResetNeeded(
                f"step: rows {np.flatnonzero(over).tolist()} are over; reset them first with "
                "reset(options={'reset_mask': mask})"
            )
        else:
            transition = self.simulation.step(force)
        done = np.flatnonzero(transition.terminated | transition.truncated)
        info = self._results(done) if len(done) else {}
        observation = self._observation()
        if len(done) and self.autoreset_mode is AutoresetMode.SAME_STEP:
            observation, info = self._reset_now(done, observation, info)
        return observation, transition.reward, transition.terminated, transition.truncated, info

    def render(self) -> tuple[npt.NDArray[np.uint8], ...] | None:
        """Return a picture of every row, or None without a render mode."""
        if self.render_mode is None:
            gym.logger.warn("render: make the environment with render_mode='rgb_array'")
            return None
        return tuple(self.picture(row) for row in range(self.num_envs))

    def picture(self, row: int) -> npt.NDArray[np.uint8]:
        """Return a picture of one row, (height, width, 3) uint8."""
        if self._renderer is None:
            self._renderer = GameRenderer(self.simulation, self.config.width, self.config.height)
        return self._renderer.render(row, self.config.camera)

    def close_extras(self, **kwargs: Any) -> None:
        """Free the renderer, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _rows_to_reset(self, mask: Any) -> Int64:
        if mask is None:
            return np.arange(self.num_envs)
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            raise TypeError(f"options['reset_mask']: found {type(mask)}; must be a bool array")
        if mask.shape != (self.num_envs,):
            raise ValueError(
                f"options['reset_mask']: found shape {mask.shape}; must be ({self.num_envs},)"
            )
        return np.flatnonzero(mask)

    def _seed(self, seed: int | Sequence[int | None] | None, rows: Int64) -> None:
        if seed is None and self._generators is not None:
            return
        if seed is None or isinstance(seed, (int, np.integer)):
            first = seed
            seeds = [None if first is None else int(first) + row for row in range(self.num_envs)]
        elif isinstance(seed, (Sequence, np.ndarray)):
            seeds = list(seed)
        else:
            raise TypeError(f"seed: found {seed!r}; must be None, an integer or one for each row")
        if len(seeds) != self.num_envs:
            raise ValueError(
                f"seed: found {len(seeds)} seeds; needed is one a row, {self.num_envs}"
            )
        generators = self._generators or [seeding.np_random(None)[0] for _ in seeds]
        for row in rows:
            if seeds[row] is not None:
                generators[row] = seeding.np_random(seeds[row])[0]
        self._generators = generators
        self.simulation.seed(generators)

    def _observation(self, rows: Int64 | None = None) -> Any:
        if self.config.observation == "pixels":
            numbers = range(self.num_envs) if rows is None else rows
            return np.stack([self.picture(int(row)) for row in numbers])
        return spaces.shape_observation(self.config, self.simulation.observe(rows))

    def _results(self, rows: Int64) -> dict[str, Any]:
        """Return the results of the episodes that ended in ``rows``, as a vector info."""
        info: dict[str, Any] = {}
        ended = np.zeros(self.num_envs, dtype=bool)
        ended[rows] = True
        for name, values in self.simulation.results(rows).items():
            info[name] = np.zeros(self.num_envs, dtype=values.dtype)
            info[name][rows] = values
            info[f"_{name}"] = ended
        return info

    def _reset_now(
        self, rows: Int64, observation: Any, info: dict[str, Any]
    ) -> tuple[Any, dict[str, Any]]:
        """Reset ``rows``; return the observations with theirs replaced, and the vector info."""
        final = np.full(self.num_envs, None, dtype=object)
        ended = np.zeros(self.num_envs, dtype=bool)
        ended[rows] = True
        for row in rows:
            final[row] = _row(observation, row)
        self.simulation.reset(rows)
        fresh = self._observation(rows)
        if isinstance(observation, dict):
            for name, values in observation.items():
                values[rows] = fresh[name]
        else:
            observation[rows] = fresh
        final_info = {
            "final_obs": final,
            "_final_obs": ended,
            "final_info": info,
            "_final_info": ended,
        }
        return observation, final_info


def _row(observation: Any, row: int) -> Any:
    """Return a copy of one row of a batched observation."""
    if isinstance(observation, dict):
        return {name: values[row].copy() for name, values in observation.items()}
    return observation[row].copy()


def _autoreset_mode(mode: AutoresetMode | str) -> AutoresetMode:
    if isinstance(mode, AutoresetMode):
        return mode
    for candidate in AutoresetMode:
        if mode in (candidate.name, candidate.value):
            return candidate
    names = [candidate.name for candidate in AutoresetMode]
    near = get_close_matches(str(mode).upper(), names, n=1, cutoff=0.5)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    allowed = ", ".join(map(repr, names))
    raise ValueError(f"autoreset_mode: found {mode!r}; allowed are {allowed}{hint}")
