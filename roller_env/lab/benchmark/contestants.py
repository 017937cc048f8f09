"""Our environments, and the physics alone that they are measured against."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode
from mujoco.batch import Batch

from roller_env.config import make_config
from roller_env.envs.single import RollerEnv
from roller_env.envs.vector import RollerVectorEnv
from roller_env.lab.benchmark.race import Contestant, Pace
from roller_env.lab.benchmark.recording import SEED, STATE, Recorder, random_actions
from roller_env.level import load_level
from roller_env.physics.profiler import profiler_off
from roller_env.physics.stepper import keeps_poses
from roller_env.simulation import Simulation

Float64 = npt.NDArray[np.float64]


class ReplayError(RuntimeError):
    """The physics alone did not go where the game went, so its time says nothing."""


def check_options(options: Mapping[str, Any]) -> None:
    """Raise what making an environment with these options would raise, before anything runs.

    Raises:
        ValueError: an option is unknown or its value is not allowed.
        LevelError: the level is not valid.
    """
    load_level(make_config(**options).level)


class VectorStep(Contestant):
    """Whole steps of the vector environment: rules, observation, reward and autoreset."""

    def __init__(self, name: str, num_envs: int, num_threads: int, **options: Any) -> None:
        """Begin the games; ``options`` are those of `roller_env.config.EnvConfig`."""
        self.options = {"num_threads": num_threads, **options}
        self._env = RollerVectorEnv(
            num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **self.options
        )
        self._env.reset(seed=SEED)
        self._actions = random_actions(num_envs)
        self.steps_a_round = 0
        super().__init__(name, num_envs, self._env.config.control_dt_s)

    @property
    def simulation(self) -> Simulation:
        """The games."""
        return self._env.simulation

    def prepare(self, pace: Pace) -> int:
        """Warm up, and return the steps of one round."""
        self.steps_a_round = super().prepare(pace)
        return self.steps_a_round

    def _run(self, steps: int) -> float:
        actions = [next(self._actions) for _ in range(steps)]
        step = self._env.step
        start = time.perf_counter()
        for action in actions:
            step(action)
        return time.perf_counter() - start


class BatchAlone(Contestant):
    """`mujoco.batch.Batch` doing the physics of a `VectorStep` again, and nothing else.

    Only `Batch.step` is timed: neither controls nor resets are. MuJoCo's profiler is off, as in the
    game's own steps, which makes physics alone faster than one would find it.
    """

    def __init__(self, name: str, leader: VectorStep) -> None:
        """Do what ``leader`` does, behind it."""
        num_envs, simulation = leader.env_steps, leader.simulation
        self._leader = leader
        self._recorder = Recorder(num_envs, **leader.options)
        model = self._recorder.model
        threads = simulation.config.num_threads
        # As the game's stepper opens it.
        self._batch = Batch(model, num_envs, threads, persistent=keeps_poses(model))
        self._batch.state[:] = self._recorder.states
        self._control = self._batch.bind("ctrl")
        super().__init__(name, num_envs, leader.simulated_s)

    def prepare(self, pace: Pace) -> int:
        """Catch up with the leader, and return the steps of its rounds."""
        self.run(self._leader.steps_done)
        return self._leader.steps_a_round

    def _run(self, steps: int) -> float:
        substeps, seconds = self._recorder.substeps, 0.0
        for recorded in self._recorder.record(steps):
            self._control[:] = recorded.control
            with profiler_off():
                start = time.perf_counter()
                self._batch.step(nstep=substeps)
                seconds += time.perf_counter() - start
            if len(recorded.ended):
                self._batch.reset(recorded.ended, stage=mujoco.mjtStage.mjSTAGE_NONE)
                self._batch.state[recorded.ended] = recorded.fresh
        return seconds

    def verify(self) -> None:
        """Raise unless every ball is, to the bit, where the leader's is.

        Raises:
            ReplayError: one is not.
        """
        _compare(self.name, self._batch.state, self._leader)


class SingleStep(Contestant):
    """Steps of one environment as `gymnasium.make` makes it, wrappers and resets included."""

    def __init__(self, name: str, **options: Any) -> None:
        """Begin the game; ``options`` are those of `roller_env.config.EnvConfig`."""
        self.options = {"num_threads": 1, **options}
        self._env: gym.Env[Any, Any] = gym.make("roller_env:Roller/Level-v0", **self.options)
        self._env.reset(seed=SEED)
        self._actions = random_actions(1)
        self.steps_a_round = 0
        super().__init__(name, 1, self._game.config.control_dt_s)

    @property
    def _game(self) -> RollerEnv:
        game = self._env.unwrapped
        assert isinstance(game, RollerEnv)
        return game

    @property
    def simulation(self) -> Simulation:
        """The game."""
        return self._game.simulation

    def prepare(self, pace: Pace) -> int:
        """Warm up, and return the steps of one round."""
        self.steps_a_round = super().prepare(pace)
        return self.steps_a_round

    def _run(self, steps: int) -> float:
        actions = [next(self._actions)[0] for _ in range(steps)]
        env = self._env
        start = time.perf_counter()
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return time.perf_counter() - start


class BareLoop(Contestant):
    """A Python loop of `mj_step` doing the physics of a `SingleStep` again.

    Setting the controls is timed as well, as no loop can do without; resets are not. MuJoCo's
    profiler is off, as in the game's own steps.
    """

    def __init__(self, name: str, leader: SingleStep) -> None:
        """Do what ``leader`` does, behind it."""
        self._leader = leader
        self._recorder = Recorder(1, **leader.options)
        self._data = mujoco.MjData(self._recorder.model)
        self._put(self._recorder.states[0])
        super().__init__(name, 1, leader.simulated_s)

    def prepare(self, pace: Pace) -> int:
        """Catch up with the leader, and return the steps of its rounds."""
        self.run(self._leader.steps_done)
        return self._leader.steps_a_round

    def _run(self, steps: int) -> float:
        model, data, seconds = self._recorder.model, self._data, 0.0
        substeps = range(self._recorder.substeps)
        for recorded in self._recorder.record(steps):
            control = recorded.control[0]
            with profiler_off():
                start = time.perf_counter()
                data.ctrl[:] = control
                for _ in substeps:
                    mujoco.mj_step(model, data)
                seconds += time.perf_counter() - start
            if len(recorded.ended):
                self._put(recorded.fresh[0])
        return seconds

    def _put(self, state: Float64) -> None:
        mujoco.mj_resetData(self._recorder.model, self._data)
        mujoco.mj_setState(self._recorder.model, self._data, state, STATE)

    def verify(self) -> None:
        """Raise unless the ball is, to the bit, where the leader's is.

        Raises:
            ReplayError: it is not.
        """
        state = np.empty((1, mujoco.mj_stateSize(self._recorder.model, STATE)))
        mujoco.mj_getState(self._recorder.model, self._data, state[0], STATE)
        _compare(self.name, state, self._leader)


def _compare(name: str, states: Float64, leader: VectorStep | SingleStep) -> None:
    wrong = np.flatnonzero((states != leader.simulation.snapshot().physics).any(axis=1))
    if len(wrong):
        raise ReplayError(
            f"{name}: after {leader.steps_done} steps row(s) {wrong[:5].tolist()} are not where "
            f"those of {leader.name} are; the two did not do the same work"
        )
