"""Advance N worlds by n physics steps on native threads, and keep every substep's positions."""

from __future__ import annotations

import os
from typing import Final
from weakref import WeakSet

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch

from roller_env.arrays import Float64
from roller_env.forks import never_freed
from roller_env.physics.log_file import no_log_file
from roller_env.physics.profiler import profiler_off

Rows = npt.NDArray[np.int64]


def keeps_poses(model: mujoco.MjModel) -> bool:
    """Say whether fixed geoms are posed once instead of in every step, MuJoCo's ``sleep`` flag.

    `Batch` then needs data of its own for every world (``persistent``): 0.19 MB on the classic
    level.
    """
    return bool(model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP)


_PARTS: Final = ("qpos", "qvel", "act", "ctrl")


def _first_column(model: mujoco.MjModel, name: str) -> int:
    """Return where a part begins in MuJoCo's integration state, whose parts lie in their order."""
    before = int(getattr(mujoco.mjtState, f"mjSTATE_{name.upper()}")) - 1
    columns: int = mujoco.mj_stateSize(model, before & int(mujoco.mjtState.mjSTATE_INTEGRATION))
    return columns


class Stepper:
    """N copies of one model's state, bit-identical to a plain ``mj_step`` loop at any thread count.

    Rows are given to its methods as sorted indices without repetition.

    A process forked from this one can go on with the worlds: it gets threads of its own.

    Attributes:
        qpos: (N, nq) float64, live view of the positions.
        qvel: (N, nv) float64, live view of the velocities.
        act: (N, na) float64, live view of the actuators' activations.
        ctrl: (N, nu) float64, live view of the controls; they hold during `advance`.
        first_columns: where ``qpos``, ``qvel``, ``act`` and ``ctrl`` begin in a row of `state`.
        state: (N, nstate) float64, live view of MuJoCo's integration state: all of the above,
            activations, time and the solver's warm start. Copying a row back restores it exactly.
    """

    def __init__(self, model: mujoco.MjModel, num_envs: int, substeps: int, num_threads: int):
        """Make ``num_envs`` worlds that `advance` moves by ``substeps`` steps of ``model``.

        Args:
            model: the model; not written to.
            num_envs: number of worlds, N.
            substeps: physics steps per `advance`, S.
            num_threads: native threads; 0 means one for each CPU.
        """
        self.model = model
        self.num_envs = num_envs
        self.substeps = substeps
        self._num_threads = num_threads
        no_log_file()
        batch = self._new_batch()
        self._batch: Batch | None = batch
        self.qpos: Float64 = batch.bind("qpos")
        self.qvel: Float64 = batch.bind("qvel")
        # MuJoCo cannot bind what a model has none of.
        self.act: Float64 = batch.bind("act") if model.na else np.empty((num_envs, 0))
        self.ctrl: Float64 = batch.bind("ctrl")
        self.state: Float64 = batch.state
        self.first_columns = {name: _first_column(model, name) for name in _PARTS}
        self._recorded = np.empty((num_envs, substeps, model.nq))
        self._path = np.empty((num_envs, substeps + 1, model.nq))
        _STEPPERS.add(self)

    def advance(self, rows: Rows | None = None) -> Float64:
        """Advance the worlds ``rows`` (all, if None) and return where they went.

        Returns:
            (n, S + 1, nq) float64: ``qpos`` before the first substep and after each. Overwritten
            by the next call.
        """
        batch = self._ready_batch()
        if rows is None:
            path = self._path
            path[:, 0] = self.qpos
            with profiler_off():
                batch.rollout(self.substeps, record=("qpos",), out={"qpos": self._recorded})
            path[:, 1:] = self._recorded
        else:
            path = self._path[: len(rows)]
            path[:, 0] = self.qpos[rows]
            with profiler_off():
                path[:, 1:] = batch.rollout(self.substeps, record=("qpos",), ids=rows)["qpos"]
        self._show_state(batch)
        return path

    def advance_late(self, rows: Rows | None, still: Rows) -> Float64:
        """Advance the worlds as `advance` does, but each only after it has stood still for a while.

        Args:
            rows: the worlds, or None for all.
            still: (n,) substeps at the beginning, 0 to S, in which each does not move.

        Returns:
            (n, S + 1, nq) float64: ``qpos`` as `advance` returns it. Overwritten by the next call.
        """
        batch = self._ready_batch()
        rows = np.arange(self.num_envs) if rows is None else rows
        path = self._path[: len(rows)]
        path[:] = self.qpos[rows][:, None, :]
        for count in np.unique(still[still < self.substeps]).tolist():
            late = still == count
            with profiler_off():
                moved = batch.rollout(self.substeps - count, record=("qpos",), ids=rows[late])
            path[late, count + 1 :] = moved["qpos"]
        self._show_state(batch)
        return path

    def diverged(self) -> npt.NDArray[np.bool_]:
        """Say which worlds, (N,), MuJoCo has given up on since their last `reset`.

        A world of which MuJoCo warned, of whatever, no longer moves.
        """
        bad: npt.NDArray[np.bool_] = (self._ready_batch().warning[:, :, 1] > 0).any(axis=1)
        return bad

    def reset(self, rows: Rows) -> None:
        """Put the worlds ``rows`` back to the model's initial state and forget their warnings."""
        batch = self._ready_batch()
        batch.reset(rows, stage=mujoco.mjtStage.mjSTAGE_NONE)
        self._show_state(batch)

    def rays(
        self, origins: Float64, directions: Float64, exclude_body: int, rows: Rows | None = None
    ) -> Float64:
        """Return the distances, (n, rays) metres, to the first geom along each ray.

        Args:
            origins: (n, rays, 3) metres, world frame.
            directions: (rays, 3) unit vectors, world frame.
            exclude_body: body that the rays pass through.
            rows: the worlds, or None for all.

        Returns:
            Distances; ``inf`` where a ray meets nothing.
        """
        batch = self._ready_batch()
        distance, _ = batch.ray(origins, directions, bodyexclude=exclude_body, ids=rows)
        return np.where(distance < 0.0, np.inf, distance)

    def leave_threads_behind(self) -> None:
        """Go on, in a forked process, without the parent's threads, which are not here.

        The views stay where they are, in memory that the parent's batch had; the batch that is
        made when it is first needed has a state of its own, which is copied to them and from them.
        """
        if self._batch is not None and self._batch.nthread > 1:
            never_freed(self._batch)
            self._batch = None

    def _new_batch(self) -> Batch:
        return Batch(
            self.model, self.num_envs, self._num_threads, persistent=keeps_poses(self.model)
        )

    def _ready_batch(self) -> Batch:
        """Return the batch, in the state that the views show."""
        if self._batch is None:
            self._batch = self._new_batch()
        if self._batch.state is not self.state:
            self._batch.state[:] = self.state
        return self._batch

    def _show_state(self, batch: Batch) -> None:
        """Let the views show the batch's state."""
        if batch.state is not self.state:
            self.state[:] = batch.state


_STEPPERS: Final[WeakSet[Stepper]] = WeakSet()


def _leave_threads_behind() -> None:
    for stepper in list(_STEPPERS):
        stepper.leave_threads_behind()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_threads_behind)
