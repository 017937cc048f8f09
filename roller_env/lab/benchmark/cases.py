"""Our environments as benchmark cases, and the physics alone that they are measured against.

Physics alone is a fair yardstick only for the same balls in the same places: a ball in the air
costs less than one on a ledge. So the yardstick replays the motors' controls of a real game, and
its balls are put back wherever the game's were. MuJoCo's profiler is off, as in the game's own
steps, which makes physics alone faster than one would find it.
"""

from __future__ import annotations

import multiprocessing
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any, Final

import gymnasium as gym
import mujoco
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from mujoco.batch import Batch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv

from roller_env.arrays import Float64, Int64
from roller_env.compile.compiled import compile_level
from roller_env.config import make_config
from roller_env.envs.sb3 import RollerVecEnv
from roller_env.envs.single import RollerEnv
from roller_env.envs.vector import RollerVectorEnv
from roller_env.game.actions import DIRECTIONS
from roller_env.lab.runner import Case, Config, timed
from roller_env.level import load_level
from roller_env.physics.profiler import profiler_off
from roller_env.physics.stepper import keeps_poses
from roller_env.simulation import Simulation
from roller_env.training.config import TrainingConfig
from roller_env.training.ppo import make_environments, new_model

SEED: Final = 0
STATE: Final = mujoco.mjtState.mjSTATE_INTEGRATION


def check_options(options: Mapping[str, Any]) -> None:
    """Raise what making an environment with these options would raise, before anything runs."""
    load_level(make_config(**options).level)


def random_actions(num_envs: int) -> Iterator[Int64]:
    """Yield the same uniformly random ``directions``, (num_envs,), every time it is called."""
    rng = np.random.default_rng(SEED)
    while True:
        yield rng.integers(len(DIRECTIONS), size=num_envs)


class Game(Case):
    """An environment of ours under random keys; what stands behind it does its physics again."""

    def __init__(
        self, name: str, num_envs: int, simulation: Simulation, options: Mapping[str, Any]
    ) -> None:
        self.simulation, self.options = simulation, dict(options)
        self._actions = random_actions(num_envs)
        super().__init__(name, num_envs, simulation.duration_s)

    def _run(self, steps: int) -> float:
        actions = [next(self._actions) for _ in range(steps)]
        return timed(partial(self._play, actions))

    @abstractmethod
    def _play(self, actions: Sequence[Int64]) -> None:
        """Step once an action."""


class VectorStep(Game):
    """Whole steps of the vector environment: rules, observation, reward and autoreset."""

    def __init__(self, name: str, num_envs: int, num_threads: int, **options: Any) -> None:
        options = {"num_threads": num_threads, **options}
        self._env = RollerVectorEnv(num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
        self._env.reset(seed=SEED)
        super().__init__(name, num_envs, self._env.simulation, options)

    def _play(self, actions: Sequence[Int64]) -> None:
        step = self._env.step
        for action in actions:
            step(action)


class SingleStep(Game):
    """Steps of one environment as `gymnasium.make` makes it, wrappers and resets included."""

    def __init__(self, name: str, **options: Any) -> None:
        options = {"num_threads": 1, **options}
        self._env: gym.Env[Any, Any] = gym.make("roller_env:Roller/Level-v0", **options)
        self._env.reset(seed=SEED)
        game = self._env.unwrapped
        assert isinstance(game, RollerEnv)
        super().__init__(name, 1, game.simulation, options)

    def _play(self, actions: Sequence[Int64]) -> None:
        env = self._env
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action[0])
            if terminated or truncated:
                env.reset()


class PhysicsAlone(Case):
    """The physics of a game, its leader, once more, step by step, to the bit, and nothing else."""

    def __init__(self, name: str, leader: Game) -> None:
        count = leader.env_steps
        self._leader, self._actions = leader, random_actions(count)
        self._env = RollerVectorEnv(count, autoreset_mode=AutoresetMode.DISABLED, **leader.options)
        self._env.reset(seed=SEED)
        games = self._env.simulation
        self.model: mujoco.MjModel = compile_level(games.level, games.preset).model
        self.substeps = self._env.config.substeps
        # The parts of a state row lie in the order of their bits.
        before = int(STATE) & (int(mujoco.mjtState.mjSTATE_CTRL) - 1)
        begin = mujoco.mj_stateSize(self.model, before)
        self._control = slice(begin, begin + self.model.nu)
        super().__init__(name, count, leader.simulated_s)

    def prepare(self, config: Config) -> None:
        """Catch up with the leader, and take as many steps a round."""
        self.run(self._leader.steps_done)
        self.steps_a_round = self._leader.steps_a_round

    @property
    def _states(self) -> Float64:
        return self._env.simulation.snapshot().physics

    def _record_step(self) -> tuple[Float64, Int64, Float64]:
        """Return what one control step's physics depends on.

        (N, nu) the actuators' controls during it, (n,) rows whose episode it ended, and (n, nstate)
        the integration states that those rows were put into after it.
        """
        _, _, terminated, truncated, _ = self._env.step(next(self._actions))
        control, over = self._states[:, self._control].copy(), terminated | truncated
        rows = np.flatnonzero(over)
        if len(rows):
            self._env.reset(options={"reset_mask": over})
        return control, rows, self._env.simulation.snapshot(rows).physics

    def _run(self, steps: int) -> float:
        seconds = 0.0
        for control, ended, fresh in [self._record_step() for _ in range(steps)]:
            with profiler_off():
                seconds += self._step(control)
            if len(ended):
                self._put(ended, fresh)
        return seconds

    @abstractmethod
    def _step(self, control: Float64) -> float:
        """Do a control step's physics, and return the seconds that it took."""

    @abstractmethod
    def _put(self, rows: Int64, states: Float64) -> None:
        """Put rows into integration states, (n, nstate)."""

    @abstractmethod
    def _reached(self) -> Float64:
        """Return the integration states, (N, nstate)."""

    def verify(self) -> None:
        """Raise a RuntimeError unless every ball is, to the bit, where the leader's is."""
        theirs = self._leader.simulation.snapshot().physics
        wrong = np.flatnonzero((self._reached() != theirs).any(axis=1))
        if len(wrong):
            raise RuntimeError(
                f"{self.name}: after {self._leader.steps_done} steps row(s) {wrong[:5].tolist()} "
                f"are not where those of {self._leader.name} are; the two did not do the same work"
            )


class BatchAlone(PhysicsAlone):
    """`mujoco.batch.Batch`, of which only `Batch.step` is timed: neither controls nor resets."""

    def __init__(self, name: str, leader: VectorStep) -> None:
        super().__init__(name, leader)
        threads = leader.simulation.config.num_threads
        # As the game's stepper opens it.
        persistent = keeps_poses(self.model)
        self._batch = Batch(self.model, leader.env_steps, threads, persistent=persistent)
        self._batch.state[:] = self._states
        self._ctrl = self._batch.bind("ctrl")

    def _step(self, control: Float64) -> float:
        self._ctrl[:] = control
        return timed(lambda: self._batch.step(nstep=self.substeps))

    def _put(self, rows: Int64, states: Float64) -> None:
        self._batch.reset(rows, stage=mujoco.mjtStage.mjSTAGE_NONE)
        self._batch.state[rows] = states

    def _reached(self) -> Float64:
        return np.asarray(self._batch.state)


class BareLoop(PhysicsAlone):
    """A Python loop of `mj_step`. Setting the controls is timed as well; resets are not."""

    def __init__(self, name: str, leader: SingleStep) -> None:
        super().__init__(name, leader)
        self._data = mujoco.MjData(self.model)
        self._put(np.zeros(1, np.int64), self._states)

    def _step(self, control: Float64) -> float:
        model, data, substeps, now = self.model, self._data, range(self.substeps), control[0]

        def loop() -> None:
            data.ctrl[:] = now
            for _ in substeps:
                mujoco.mj_step(model, data)

        return timed(loop)

    def _put(self, rows: Int64, states: Float64) -> None:
        mujoco.mj_resetData(self.model, self._data)
        mujoco.mj_setState(self.model, self._data, states[0], STATE)

    def _reached(self) -> Float64:
        state = np.empty((1, mujoco.mj_stateSize(self.model, STATE)))
        mujoco.mj_getState(self.model, self._data, state[0], STATE)
        return state


_ROLLOUT_STEPS, _EPOCHS, _BATCHES = 64, 4, 4
"""Of a rollout. These are near those of configs/; all else are SB3's defaults."""


class Training(Case):
    """One step is one rollout and one update.

    Schedules end with every round; that changes what is learnt, and not what it costs.
    """

    def __init__(self, name: str, model: PPO, simulated_s: float) -> None:
        self._model = model
        super().__init__(name, model.n_envs * model.n_steps, simulated_s)

    def close(self) -> None:
        """Close the environments, which may be processes."""
        assert self._model.env is not None
        self._model.env.close()

    def prepare(self, config: Config) -> None:
        """Do one update unseen; a round is as many as fill it, but one at least."""
        self.run(1)
        self.steps_a_round = max(1, round(config.round_s / self.run(1)))

    def _run(self, steps: int) -> float:
        return timed(lambda: self._model.learn(steps * self.env_steps, reset_num_timesteps=False))


def with_roller_vec_env(name: str, num_envs: int, num_threads: int, **options: Any) -> Training:
    """Return PPO on a `RollerVecEnv`; ``options`` are those of `EnvConfig`."""
    environments = RollerVecEnv(num_envs=num_envs, seed=SEED, num_threads=num_threads, **options)
    return Training(name, _ppo(environments), environments.simulation.duration_s)


def with_subproc_vec_env(name: str, num_envs: int, **options: Any) -> Training:
    """Return PPO as SB3's guide sets it up: `make_vec_env` with a process an environment."""
    # Children of a server that has imported what they need start in milliseconds, not seconds.
    multiprocessing.get_context("forkserver").set_forkserver_preload([__name__])
    environments = make_vec_env(
        "roller_env:Roller/Level-v0",
        num_envs,
        SEED,
        env_kwargs={"num_threads": 1, **options},
        vec_env_cls=SubprocVecEnv,
        vec_env_kwargs={"start_method": "forkserver"},
    )
    return Training(name, _ppo(environments), make_config(**options).control_dt_s)


def as_make_train_does(name: str, config: TrainingConfig) -> Training:
    """Return the learner and environments of a training configuration, without its records."""
    environments = make_environments(config)
    duration_s = config.environment.control_dt_s
    torch.set_num_threads(config.torch_threads)
    return Training(name, new_model(config, environments), duration_s)


def _ppo(environments: VecEnv) -> PPO:
    torch.set_num_threads(1)
    batch = environments.num_envs * _ROLLOUT_STEPS // _BATCHES
    return PPO(
        "MlpPolicy",
        environments,
        n_steps=_ROLLOUT_STEPS,
        batch_size=batch,
        n_epochs=_EPOCHS,
        seed=SEED,
        device="cpu",
    )
