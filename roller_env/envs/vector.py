"""N games as a `gymnasium.vector.VectorEnv`, stepped in native threads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from roller_env.arrays import Bool, Float64, Int64, UInt8
from roller_env.checks import nearest
from roller_env.config import EnvConfig, LevelSource, make_config
from roller_env.envs import spaces
from roller_env.envs.arguments import reset_of, seeds_of
from roller_env.envs.infos import vector_info
from roller_env.envs.specs import plain_options, plain_spec
from roller_env.game.actions import forces
from roller_env.simulation import Simulation, Snapshot

if TYPE_CHECKING:
    from roller_env.drawing.renderer import GameRenderer


class RollerVectorEnv(gym.vector.VectorEnv[Any, Any, Any]):
    """N games; of one level row i does what a `RollerEnv` with row i's seed does, bit for bit.

    Autoreset as Gymnasium defines it. NEXT_STEP: the step after an episode's last ignores its
    action and returns the reset observation with reward 0. SAME_STEP: the last step returns the
    reset observation, with the last one in ``info["final_obs"]`` and the episode's last info in
    ``info["final_info"]``. DISABLED: the caller resets rows with
    ``reset(options={"reset_mask": mask})``.

    Infos are those of `RollerEnv`, as arrays of (N,). Like that it can be copied and pickled.

    Version history:
        v0: of every id, the first version; as `RollerEnv`'s.
    """

    # Before Gymnasium 1.3 its __del__ closes also what its options kept from being made.
    _renderer: GameRenderer | None = None

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        levels: Sequence[LevelSource] | None = None,
        **options: Any,
    ):
        """Make ``num_envs`` games; see `roller_env.config.EnvConfig` for the options.

        Args:
            num_envs: how many.
            autoreset_mode: when games that are over begin again.
            levels: instead of the option ``level``: every reset draws one of them for each row, and
                ``info["level"]`` says which; only with ``physics="rigid"`` or ``"relaxed"``.
            options: of the environment.

        Raises:
            TypeError: there is no option of that name.
            ValueError: an option's value is not allowed.
            LevelError: a level is not valid.
        """
        self.config: EnvConfig = make_config(**options)
        self.autoreset_mode = _autoreset_mode(autoreset_mode)
        self._spec: EnvSpec | None = None
        self.simulation = Simulation(self.config, num_envs, levels)
        self.num_envs = self.simulation.num_envs
        self.single_action_space = spaces.action_space(self.config)
        self.single_observation_space = spaces.observation_space(
            self.config, self.simulation.entries
        )
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.render_mode = self.config.render_mode
        self.metadata = {
            "render_modes": ["rgb_array"],
            "render_fps": round(1.0 / self.config.control_dt_s),
            "autoreset_mode": self.autoreset_mode,
        }

    @property
    def spec(self) -> EnvSpec | None:
        """What Gymnasium made it from; `EnvSpec.to_json` can write it."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        plain = {**plain_options(self.simulation), "autoreset_mode": self.autoreset_mode.name}
        self._spec = plain_spec(spec, plain)

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The random generator of each row."""
        return self.simulation.generators

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """What each row's generator was seeded with."""
        return tuple(_seed_of(generator) for generator in self.simulation.generators)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | Int64 | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode in every row, or in those of ``options["reset_mask"]``.

        Args:
            seed: an integer s seeds row i with s + i; a sequence or array has one a row; None goes
                on with the generators there are, which at first are seeded by the operating system.
            options: ``reset_mask``, (N,) bool: the rows to reset; and those of `RollerEnv`, for
                all rows or, as (N, ...), with a value for each.

        Raises:
            TypeError: the seed's or an option's type is wrong.
            ValueError: an option is unknown, or its or the seed's value is not allowed. Nothing
                has changed then.
        """
        wanted = reset_of(options, self.simulation, batched=True)
        seeds = seeds_of(seed, self.num_envs)
        self._seed({int(row): seeds[row] for row in wanted.rows})
        wanted.apply(self.simulation)
        rows = None if len(wanted.rows) == self.num_envs else wanted.rows
        return self._observation(), vector_info(self.simulation, rows)

    def step(self, actions: Any) -> tuple[Any, Float64, Bool, Bool, dict[str, Any]]:
        """Advance every row by one control step, resetting rows as the autoreset mode says.

        Raises:
            ValueError: the actions are not in the action space.
            gymnasium.error.ResetNeeded: `reset` was never called, or (DISABLED) a row is over.
        """
        force = forces(self.config.action, actions)
        if len(force) != self.num_envs:
            raise ValueError(f"actions: found {len(force)} rows; needed are {self.num_envs}")
        over = self.simulation.state.over
        if over.any():
            self._reset_before(over)
            transition = self.simulation.step(force, hold=over)
        else:
            transition = self.simulation.step(force)
        done = np.flatnonzero(transition.terminated | transition.truncated)
        observation = self._observation()
        if len(done) and self.autoreset_mode is AutoresetMode.SAME_STEP:
            observation, info = self._reset_now(done, observation)
        else:
            info = vector_info(self.simulation)
        return observation, transition.reward, transition.terminated, transition.truncated, info

    def get_state(self, rows: npt.ArrayLike | None = None) -> Snapshot:
        """Return all that the future of ``rows`` (all, if None) depends on; it can be pickled.

        Args:
            rows: (n,) row numbers.
        """
        return self.simulation.snapshot(None if rows is None else np.asarray(rows))

    def set_state(self, state: Snapshot, rows: npt.ArrayLike | None = None) -> None:
        """Put a state of n rows, of this or of another environment, into ``rows`` (all, if None).

        The same actions then give the same bits as they did there, also through later resets.

        Raises:
            TypeError: it is no state.
            ValueError: it is of another level, physics preset or control step, or of more or fewer
                rows; `Snapshot.take` picks and repeats rows.
        """
        every = np.arange(self.num_envs) if rows is None else np.asarray(rows)
        self.simulation.restore(state, every)

    def render(self) -> tuple[UInt8, ...] | None:
        """Return a picture of every row, or None without a render mode."""
        if self.render_mode is None:
            gym.logger.warn("render: make the environment with render_mode='rgb_array'")
            return None
        return tuple(self.picture(row) for row in range(self.num_envs))

    def picture(self, row: int) -> UInt8:
        """Return a picture of one row, (height, width, 3) uint8."""
        if self._renderer is None:
            # Not above: what is not drawn needs no MuJoCo on the rigid engine.
            from roller_env.drawing.renderer import GameRenderer

            self._renderer = GameRenderer(self.simulation, self.config.width, self.config.height)
        return self._renderer.render(row, self.config.camera)

    def close_extras(self, **kwargs: Any) -> None:
        """Free the renderer, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _seed(self, seeds: dict[int, int | None]) -> None:
        """Give rows new generators, where there is a seed for them."""
        if all(seed is None for seed in seeds.values()):
            return
        generators = list(self.simulation.generators)
        for row, seed in seeds.items():
            if seed is not None:
                generators[row] = seeding.np_random(seed)[0]
        self.simulation.seed(generators)

    def _reset_before(self, over: Bool) -> None:
        """Reset the rows that are over before a step, or refuse the step."""
        if (over & (self.simulation.state.steps == 0)).any():
            raise gym.error.ResetNeeded("step: no episode is under way; call reset() first")
        rows = np.flatnonzero(over)
        if self.autoreset_mode is not AutoresetMode.NEXT_STEP:
            raise gym.error.ResetNeeded(
                f"step: rows {rows.tolist()} are over; reset them first with "
                "reset(options={'reset_mask': mask})"
            )
        self.simulation.reset(rows)

    def _observation(self, rows: Int64 | None = None) -> Any:
        if self.config.observation == "pixels":
            numbers = range(self.num_envs) if rows is None else rows
            return np.stack([self.picture(int(row)) for row in numbers])
        return spaces.shape_observation(
            self.config, self.simulation.entries, self.simulation.observe(rows)
        )

    def _reset_now(self, rows: Int64, observation: Any) -> tuple[Any, dict[str, Any]]:
        """Reset ``rows``; return the observations with theirs replaced, and the vector info."""
        final = np.full(self.num_envs, None, dtype=object)
        ended = np.zeros(self.num_envs, dtype=bool)
        ended[rows] = True
        for row in rows:
            final[row] = spaces.row_of(observation, row)
        final_info = vector_info(self.simulation, rows)
        self.simulation.reset(rows)
        fresh = self._observation(rows)
        if isinstance(observation, dict):
            for name, values in observation.items():
                values[rows] = fresh[name]
        else:
            observation[rows] = fresh
        info = {
            **vector_info(self.simulation),
            "final_obs": final,
            "_final_obs": ended,
            "final_info": final_info,
            "_final_info": ended.copy(),
        }
        return observation, info


def _seed_of(generator: np.random.Generator) -> int:
    sequence = generator.bit_generator.seed_seq
    assert isinstance(sequence, np.random.SeedSequence)
    assert isinstance(sequence.entropy, int)
    return sequence.entropy


def _autoreset_mode(mode: AutoresetMode | str) -> AutoresetMode:
    if isinstance(mode, AutoresetMode):
        return mode
    for candidate in AutoresetMode:
        if mode in (candidate.name, candidate.value):
            return candidate
    names = [candidate.name for candidate in AutoresetMode]
    allowed = ", ".join(map(repr, names))
    hint = nearest(str(mode), names)
    raise ValueError(f"autoreset_mode: found {mode!r}; allowed are {allowed}{hint}")
