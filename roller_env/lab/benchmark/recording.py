"""What the physics of a game was told, step by step, so that physics alone can do it again.

Physics alone is a fair yardstick only for the same balls in the same places: a ball in the air
costs less than one on a ledge. So the yardstick replays the motors' controls of a real game, and
its balls are put back wherever the game's were.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode

from roller_env.envs.vector import RollerVectorEnv
from roller_env.game.actions import DIRECTIONS

Float64 = npt.NDArray[np.float64]
Int64 = npt.NDArray[np.int64]

SEED: Final = 0

STATE: Final = mujoco.mjtState.mjSTATE_INTEGRATION


def random_actions(num_envs: int) -> Iterator[Int64]:
    """Yield the same uniformly random ``directions``, (num_envs,), every time it is called."""
    rng = np.random.default_rng(SEED)
    while True:
        yield rng.integers(len(DIRECTIONS), size=num_envs)


@dataclass(frozen=True, slots=True)
class RecordedStep:
    """What one control step's physics depends on.

    Attributes:
        control: (N, nu) the actuators' controls during the step.
        ended: (n,) rows whose episode it ended.
        fresh: (n, nstate) the integration states that those rows were put into after it.
    """

    control: Float64
    ended: Int64
    fresh: Float64


class Recorder:
    """Plays the games that every environment of the same seed and actions plays."""

    def __init__(self, num_envs: int, **options: Any) -> None:
        """Begin the games; ``options`` are those of `roller_env.config.EnvConfig`."""
        self._env = RollerVectorEnv(num_envs, autoreset_mode=AutoresetMode.DISABLED, **options)
        self._env.reset(seed=SEED)
        self._actions = random_actions(num_envs)
        model = self.model
        # The parts of a state row lie in the order of their bits.
        before = int(STATE) & (int(mujoco.mjtState.mjSTATE_CTRL) - 1)
        begin = mujoco.mj_stateSize(model, before)
        self._control = slice(begin, begin + model.nu)

    @property
    def model(self) -> mujoco.MjModel:
        """The model that the games are played on."""
        return self._env.simulation.compiled.model

    @property
    def substeps(self) -> int:
        """Physics steps of a control step."""
        return self._env.config.substeps

    @property
    def states(self) -> Float64:
        """(N, nstate) copies of the integration states."""
        return self._env.simulation.snapshot().physics

    def record(self, steps: int) -> list[RecordedStep]:
        """Play on for ``steps`` control steps."""
        return [self._record_step() for _ in range(steps)]

    def _record_step(self) -> RecordedStep:
        _, _, terminated, truncated, _ = self._env.step(next(self._actions))
        control = self.states[:, self._control].copy()
        over = terminated | truncated
        rows = np.flatnonzero(over)
        if len(rows):
            self._env.reset(options={"reset_mask": over})
        fresh = self._env.simulation.snapshot(rows).physics
        return RecordedStep(control, rows, fresh)
