"""Advance N worlds by n physics steps on native threads, and keep every substep's positions."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch

from roller_env.physics.profiler import profiler_off

Float64 = npt.NDArray[np.float64]
Rows = npt.NDArray[np.int64]


def keeps_poses(model: mujoco.MjModel) -> bool:
    """Say whether fixed geoms are posed once instead of in every step, MuJoCo's ``sleep`` flag.

    `Batch` then needs data of its own for every world (``persistent``): 0.19 MB on the classic
    level.
    """
    return bool(model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP)


class Stepper:
    """N copies of one model's state, bit-identical to a plain ``mj_step`` loop at any thread count.

    Rows are given to its methods as sorted indices without repetition.

    Attributes:
        qpos: (N, nq) float64, live view of the positions.
        qvel: (N, nv) float64, live view of the velocities.
        act: (N, na) float64, live view of the actuators' activations.
        ctrl: (N, nu) float64, live view of the controls; they hold during `advance`.
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
        self._batch = Batch(model, num_envs, num_threads, persistent=keeps_poses(model))
        self.qpos: Float64 = self._batch.bind("qpos")
        self.qvel: Float64 = self._batch.bind("qvel")
        # MuJoCo cannot bind what a model has none of.
        self.act: Float64 = self._batch.bind("act") if model.na else np.empty((num_envs, 0))
        self.ctrl: Float64 = self._batch.bind("ctrl")
        self.state: Float64 = self._batch.state
        self._recorded = np.empty((num_envs, substeps, model.nq))
        self._path = np.empty((num_envs, substeps + 1, model.nq))

    def advance(self, rows: Rows | None = None) -> Float64:
        """Advance the worlds ``rows`` (all, if None) and return where they went.

        Returns:
            (n, S + 1, nq) float64: ``qpos`` before the first substep and after each. Overwritten
            by the next call.
        """
        if rows is None:
            self._path[:, 0] = self.qpos
            with profiler_off():
                self._batch.rollout(self.substeps, record=("qpos",), out={"qpos": self._recorded})
            self._path[:, 1:] = self._recorded
            return self._path
        path = self._path[: len(rows)]
        path[:, 0] = self.qpos[rows]
        with profiler_off():
            path[:, 1:] = self._batch.rollout(self.substeps, record=("qpos",), ids=rows)["qpos"]
        return path

    def advance_late(self, rows: Rows | None, still: Rows) -> Float64:
        """Advance the worlds as `advance` does, but each only after it has stood still for a while.

        Args:
            rows: the worlds, or None for all.
            still: (n,) substeps at the beginning, 0 to S, in which each does not move.

        Returns:
            (n, S + 1, nq) float64: ``qpos`` as `advance` returns it. Overwritten by the next call.
        """
        rows = np.arange(self.num_envs) if rows is None else rows
        path = self._path[: len(rows)]
        path[:] = self.qpos[rows][:, None, :]
        for count in np.unique(still[still < self.substeps]).tolist():
            late = still == count
            with profiler_off():
                moved = self._batch.rollout(
                    self.substeps - count, record=("qpos",), ids=rows[late]
                )["qpos"]
            path[late, count + 1 :] = moved
        return path

    def diverged(self) -> npt.NDArray[np.bool_]:
        """Say which worlds, (N,), MuJoCo has given up on since their last `reset`.

        A world of which MuJoCo warned, of whatever, no longer moves.
        """
        bad: npt.NDArray[np.bool_] = (self._batch.warning[:, :, 1] > 0).any(axis=1)
        return bad

    def reset(self, rows: Rows) -> None:
        """Put the worlds ``rows`` back to the model's initial state and forget their warnings."""
        self._batch.reset(rows, stage=mujoco.mjtStage.mjSTAGE_NONE)

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
        distance, _ = self._batch.ray(origins, directions, bodyexclude=exclude_body, ids=rows)
        return np.where(distance < 0.0, np.inf, distance)
