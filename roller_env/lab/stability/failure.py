"""What a way to fail is, how it is simulated, and what its cures cost."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import mujoco

from roller_env.lab.runner import interleaved, timed
from roller_env.lab.simulate import Float64, Path, record, settled, started

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
    curve: Callable[[Path], tuple[Float64, Float64]]
    quantity: str
    value: Callable[[Path], float]
    says: str
    acceptable: float
    limit_reason: str
    log_y: bool = False


def simulated(setting: Setting, seconds: float) -> Path:
    """Simulate and keep every step."""
    data = started(setting.model, setting.prepare)
    return record(setting.model, data, round(seconds / setting.dt_s))


def time_ratios(settings: Sequence[Setting], seconds: float, repeats: int) -> list[float]:
    """Return each setting's time over the first's: medians of ratios of interleaved runs.

    It is the time of this thread's own processor: MuJoCo uses one thread, so on a machine that is
    quiet that is the wall time, and on one that is not it is still the method's.
    """

    def run(setting: Setting) -> None:
        for _ in range(TIMED_RUNS):
            settled(setting.model, seconds, setting.prepare)

    turns = {one.label: partial(timed, partial(run, one), time.thread_time) for one in settings}
    taken = interleaved(turns, repeats)
    first = taken[settings[0].label]
    return [
        statistics.median(own / base for own, base in zip(taken[one.label], first, strict=True))
        for one in settings
    ]


def rows(failure: Failure, paths: Sequence[Path], repeats: int) -> list[dict[str, Any]]:
    """Return a row for each setting.

    Returns:
        ``failure``, ``setting``, its ``role`` (fails or cures), the ``quantity``, its ``value`` and
        what is ``acceptable``, the ``verdict`` (fails or holds) and whether it is ``as_expected``,
        ``time_ratio`` and ``evaluations_ratio`` to the failing setting, ``why``, ``limit_reason``.
    """
    ratios = time_ratios(failure.settings, failure.seconds, repeats)
    base = failure.settings[0].evaluations_per_s
    found = []
    for index, (setting, path) in enumerate(zip(failure.settings, paths, strict=True)):
        value = failure.value(path)
        fails = not value <= failure.acceptable
        found.append(
            {
                "failure": failure.name,
                "setting": setting.label,
                "role": "cures" if index else "fails",
                "quantity": failure.quantity,
                "value": value,
                "acceptable": failure.acceptable,
                "verdict": "fails" if fails else "holds",
                "as_expected": fails == (index == 0),
                "time_ratio": ratios[index],
                "evaluations_ratio": setting.evaluations_per_s / base,
                "why": failure.why,
                "limit_reason": failure.limit_reason,
            }
        )
    return found
