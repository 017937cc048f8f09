"""Training end to end as a contest: Stable-Baselines3's PPO on our vector and on its own."""

from __future__ import annotations

import multiprocessing
import time
from types import TracebackType
from typing import Any, Final, Self

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv

from roller_env.config import make_config
from roller_env.envs.sb3 import RollerVecEnv
from roller_env.lab.benchmark.race import Contestant, Pace
from roller_env.lab.benchmark.recording import SEED
from roller_env.training.config import TrainingConfig
from roller_env.training.ppo import make_environments, new_model

_ROLLOUT_STEPS: Final = 64
_EPOCHS: Final = 4
_BATCHES: Final = 4
"""Of a rollout. These are near those of configs/; all else are SB3's defaults."""


class Training(Contestant):
    """One step is one rollout and one update.

    Schedules end with every round; that changes what is learnt, and not what it costs.
    """

    def __init__(self, name: str, model: PPO, simulated_s: float) -> None:
        """Race a learner, its environments inside."""
        self._model = model
        super().__init__(name, model.n_envs * model.n_steps, simulated_s)

    def __enter__(self) -> Self:
        """Return the training."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the environments, which may be processes."""
        assert self._model.env is not None
        self._model.env.close()

    def prepare(self, pace: Pace) -> int:
        """Do one update unseen; a round is as many as fill it, but one at least."""
        self.run(1)
        return max(1, round(pace.round_s / self.run(1)))

    def _run(self, steps: int) -> float:
        start = time.perf_counter()
        self._model.learn(steps * self.env_steps, reset_num_timesteps=False)
        return time.perf_counter() - start


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
    duration_s = make_config(**config.environment_options).control_dt_s
    torch.set_num_threads(config.torch_threads)
    return Training(name, new_model(config, environments), duration_s)


def _ppo(environments: VecEnv) -> PPO:
    torch.set_num_threads(1)
    return PPO(
        "MlpPolicy",
        environments,
        n_steps=_ROLLOUT_STEPS,
        batch_size=environments.num_envs * _ROLLOUT_STEPS // _BATCHES,
        n_epochs=_EPOCHS,
        seed=SEED,
        device="cpu",
    )
