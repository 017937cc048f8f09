"""A MuJoCo simulation whose path is recorded once, and which is timed in MuJoCo's own loop."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from roller_env.lab.methods import without_warnings
from roller_env.lab.simulate import Float64, Path, record


@dataclass(frozen=True, slots=True)
class Held:
    """Controls that are held for a number of steps.

    Attributes:
        ctrl: (nu,) MuJoCo's controls.
        steps: physics steps.
    """

    ctrl: Float64
    steps: int


class MujocoTrial:
    """One simulation from a given start under a given sequence of controls: a `SteadyTrial`.

    `run` writes down the path, which takes Python; `run_part` repeats the same steps in nothing
    but MuJoCo's loop. SimBenchmark, too, measures error and time in two passes.

    Attributes:
        model: what is simulated.
        data: where it stands after the last `run` or `run_part`.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        start: Callable[[mujoco.MjData], None],
        plan: Sequence[Held],
        judge: Callable[[Path], Mapping[str, float]],
        names: Sequence[str],
        part: slice = slice(None),
    ):
        """Prepare a simulation.

        Args:
            model: what is simulated; not written to.
            start: puts freshly reset data where the motion begins.
            plan: the controls of the whole motion.
            judge: errors of a path by the name of their measure; only ever given finite paths.
            names: the names of those measures.
            part: which pieces of the plan are timed. Its first needs `run` to have passed it.
        """
        self.model = model
        self._start = start
        self._plan = plan
        self._judge = judge
        self._names = names
        self._part = part
        self.data = mujoco.MjData(model)
        self._before_part = np.empty(mujoco.mj_stateSize(model, _STATE))
        self._path: Path | None = None

    @property
    def part_s(self) -> float:
        """Simulated time of what `run_part` simulates, seconds."""
        steps = sum(held.steps for held in self._plan[self._part])
        return float(steps * self.model.opt.timestep)

    def run(self) -> None:
        """Simulate the whole motion and keep its path."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        self._start(data)
        # The number of the step before which each piece of the plan begins.
        begins = np.cumsum([0, *(held.steps for held in self._plan)]).tolist()
        part_begins = self._part.indices(len(self._plan))[0]

        def control(step: int) -> None:
            for number, held in enumerate(self._plan):
                if begins[number] == step:
                    if number == part_begins:
                        mujoco.mj_getState(model, data, self._before_part, _STATE)
                    data.ctrl[:] = held.ctrl

        self._path = record(model, data, begins[-1], before=control)

    def run_part(self) -> None:
        """Simulate the part that is timed."""
        mujoco.mj_setState(self.model, self.data, self._before_part, _STATE)
        for held in self._plan[self._part]:
            self.data.ctrl[:] = held.ctrl
            mujoco.mj_step(self.model, self.data, held.steps)

    @property
    def path(self) -> Path:
        """The path of the last run; the first use runs it."""
        if self._path is None:
            with without_warnings():
                self.run()
        assert self._path is not None
        return self._path

    def errors(self) -> Mapping[str, float]:
        """Return the errors by the name of their measure, NaN where the simulation diverged."""
        path = self.path
        return self._judge(path) if path.finite else dict.fromkeys(self._names, math.nan)


_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def steps_of(seconds: float, dt_s: float) -> int:
    """Return how many steps of ``dt_s`` make ``seconds``.

    Raises:
        ValueError: it is not a whole number of steps, so that the end would be another time.
    """
    if not 0.0 < dt_s <= seconds:
        raise ValueError(f"dt_s: found {dt_s:g}; must be more than 0 and at most {seconds:g} s")
    steps = round(seconds / dt_s)
    if abs(steps * dt_s - seconds) > 1e-9 * seconds:
        raise ValueError(
            f"dt_s: found {dt_s:g}, of which no whole number makes {seconds:g} s; the nearest that "
            f"fits is {seconds / steps:.10g}"
        )
    return steps


def at_most(steps: int, total: int) -> list[int]:
    """Split ``total`` steps into ``steps`` that are timed and the rest, if there is any."""
    return [total] if total <= steps else [steps, total - steps]
