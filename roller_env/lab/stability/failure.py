"""What a way to fail is, how it is simulated, and what its cures cost."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal

import mujoco
import numpy as np
import numpy.typing as npt

Float64 = npt.NDArray[np.float64]

TIMED_RUNS: Final = 10
"""Simulations that are timed together: a single one is too short for the clock."""


@dataclass(frozen=True)
class Setting:
    """One simulation of a failure's scene.

    Attributes:
        label: what is different about it.
        model: the scene.
        prepare: puts a fresh `MjData` to the beginning.
    """

    label: str
    model: mujoco.MjModel
    prepare: Callable[[mujoco.MjData], None]

    @property
    def dt_s(self) -> float:
        """Time step, s."""
        return float(self.model.opt.timestep)

    @property
    def evaluations_per_s(self) -> float:
        """Evaluations of the forces for a simulated second."""
        stages = 4 if self.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4 else 1
        return stages / self.dt_s


@dataclass(frozen=True)
class Record:
    """A simulation, step by step.

    Attributes:
        time_s: (n,).
        qpos: (n, nq).
        qvel: (n, nv).
    """

    time_s: Float64
    qpos: Float64
    qvel: Float64


@dataclass(frozen=True)
class Failure:
    """A way to fail.

    Attributes:
        name: its key.
        title: what happens, for a picture.
        why: the reason, in a sentence or two.
        x_label: of the picture, with the unit.
        y_label: likewise.
        seconds: simulated.
        settings: the one that fails, then those that cure it.
        curve: what the picture shows of a simulation, x and y.
        quantity: what tells failed from cured, with its unit.
        value: it, of a simulation.
        says: how a picture says the value.
        acceptable: largest value that is no failure.
        limit_reason: why that.
        log_y: whether the picture's y is logarithmic.
    """

    name: str
    title: str
    why: str
    x_label: str
    y_label: str
    seconds: float
    settings: tuple[Setting, ...]
    curve: Callable[[Record], tuple[Float64, Float64]]
    quantity: str
    value: Callable[[Record], float]
    says: str
    acceptable: float
    limit_reason: str
    log_y: bool = False


@dataclass(frozen=True, slots=True)
class FailureRow:
    """One setting of one failure.

    Attributes:
        failure: its name.
        setting: what is different about it.
        role: whether it is to fail or to cure.
        quantity: what was measured, with its unit.
        value: it.
        acceptable: largest value that is no failure.
        verdict: ``fails`` or ``holds``.
        as_expected: whether the verdict is the role's.
        time_ratio: time over that of the failing setting, medians of interleaved runs.
        evaluations_ratio: evaluations of the forces over those of the failing setting.
        why: the reason for the failure.
        limit_reason: the reason for what is acceptable.
    """

    failure: str
    setting: str
    role: Literal["fails", "cures"]
    quantity: str
    value: float
    acceptable: float
    verdict: Literal["fails", "holds"]
    as_expected: bool
    time_ratio: float
    evaluations_ratio: float
    why: str
    limit_reason: str


def record(setting: Setting, seconds: float) -> Record:
    """Simulate and keep every step."""
    data = mujoco.MjData(setting.model)
    setting.prepare(data)
    steps = round(seconds / setting.dt_s)
    qpos = np.empty((steps + 1, setting.model.nq))
    qvel = np.empty((steps + 1, setting.model.nv))
    for index in range(steps + 1):
        qpos[index], qvel[index] = data.qpos, data.qvel
        mujoco.mj_step(setting.model, data)
    return Record(np.arange(steps + 1, dtype=np.float64) * setting.dt_s, qpos, qvel)


def time_ratios(settings: Sequence[Setting], seconds: float, repeats: int) -> list[float]:
    """Return each setting's time over the first's: medians of ratios of interleaved runs.

    It is the time of this thread's own processor: MuJoCo uses one thread, so on a machine that is
    quiet that is the wall time, and on one that is not it is still the method's.
    """
    runs = [partial(_step_all, setting, seconds) for setting in settings]
    ratios: list[list[float]] = [[] for _ in runs]
    for _ in range(repeats):
        times = [_thread_time(run) for run in runs]
        for own, taken in zip(ratios, times, strict=True):
            own.append(taken / times[0])
    return [statistics.median(own) for own in ratios]


def _thread_time(run: Callable[[], None]) -> float:
    start = time.thread_time()
    for _ in range(TIMED_RUNS):
        run()
    return time.thread_time() - start


def _step_all(setting: Setting, seconds: float) -> None:
    data = mujoco.MjData(setting.model)
    setting.prepare(data)
    mujoco.mj_step(setting.model, data, round(seconds / setting.dt_s))


def rows(failure: Failure, records: Sequence[Record], repeats: int) -> list[FailureRow]:
    """Return a row for each setting."""
    ratios = time_ratios(failure.settings, failure.seconds, repeats)
    base = failure.settings[0].evaluations_per_s
    found = []
    for index, (setting, kept) in enumerate(zip(failure.settings, records, strict=True)):
        value = failure.value(kept)
        fails = not value <= failure.acceptable
        found.append(
            FailureRow(
                failure=failure.name,
                setting=setting.label,
                role="cures" if index else "fails",
                quantity=failure.quantity,
                value=value,
                acceptable=failure.acceptable,
                verdict="fails" if fails else "holds",
                as_expected=fails == (index == 0),
                time_ratio=ratios[index],
                evaluations_ratio=setting.evaluations_per_s / base,
                why=failure.why,
                limit_reason=failure.limit_reason,
            )
        )
    return found
