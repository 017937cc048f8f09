"""What is flown: every scene three ways, and with what could mend a disagreement."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.lab.methods import MujocoMethod
from roller_env.lab.parallel.differences import (
    Difference,
    Pair,
    Remedy,
    Sample,
    Verdict,
    difference,
)
from roller_env.lab.parallel.motions import mujocos, ours, reference, sampled_steps
from roller_env.lab.parallel.scenes import BODIES, FlightScene
from roller_env.lab.parallel.velocity_form import REMEDIES
from roller_env.rigid_body import Integrator, State, quaternion
from roller_env.rigid_body.arrays import Float64, positive_time

_WHOLE_STEPS: Final = 1e-6
"""Fraction of a step by which a time may miss a step's boundary: 0.3 / 0.1 is not 3."""


@dataclass(frozen=True)
class Settings:
    """What to compare.

    Attributes:
        bodies: names in `BODIES`.
        scenes: flights.
        ours: a method of ours.
        mujoco: a method of MuJoCo's.
        dt_s: step of both, s.
        duration_s: of every flight, s.

    Raises:
        ValueError: when a flight or the time between two jumps is no whole number of steps.
    """

    bodies: tuple[str, ...]
    scenes: tuple[FlightScene, ...]
    ours: Integrator
    mujoco: MujocoMethod
    dt_s: float
    duration_s: float

    def __post_init__(self) -> None:
        positive_time("dt", self.dt_s)
        positive_time("duration", self.duration_s)
        for what, time_s in self._boundaries():
            steps = time_s / self.dt_s
            if not _whole(steps):
                raise ValueError(
                    f"dt {self.dt_s:g} s: {what} {time_s:g} s, which is {steps:.6g} steps and has "
                    f"to be a whole number of them; {time_s / math.ceil(steps):.9g} s would do"
                )

    def _boundaries(self) -> list[tuple[str, float]]:
        """Return the times at which a step has to end, with what happens then."""
        jumps = [
            (f"the scene {scene.name!r} changes its force at", float(t))
            for scene in self.scenes
            for t in scene.switches_s
        ]
        return [("a flight ends at", self.duration_s), *jumps]

    def fits(self, factor: float) -> bool:
        """Say whether a step ``factor`` times as long would end at every jump and at the end."""
        return all(_whole(time_s / (factor * self.dt_s)) for _, time_s in self._boundaries())

    @property
    def steps(self) -> int:
        """Steps of a flight."""
        return round(self.duration_s / self.dt_s)


def _whole(steps: float) -> bool:
    return abs(steps - round(steps)) <= _WHOLE_STEPS


def _seconds(steps: npt.NDArray[np.intp], dt_s: float) -> Float64:
    return steps.astype(np.float64) * dt_s


def compare(settings: Settings, body_name: str) -> tuple[list[Verdict], list[Sample]]:
    """Fly every scene three ways with one body; return the summary and the differences in time."""
    body, dt_s = BODIES[body_name], settings.dt_s
    sampled = sampled_steps(settings.steps)
    times = _seconds(sampled, dt_s)
    verdicts, samples = [], []
    flights = ours(settings.scenes, body, settings.ours, dt_s, sampled)
    for scene, mine in zip(settings.scenes, flights, strict=True):
        theirs = mujocos(scene, body, settings.mujoco, dt_s, sampled)
        truth = reference(scene, body, times)
        pairs: dict[Pair, Difference] = {
            "ours - MuJoCo": difference(mine, theirs, scene.gravity_m_s2),
            "ours - reference": difference(mine, truth, scene.gravity_m_s2),
            "MuJoCo - reference": difference(theirs, truth, scene.gravity_m_s2),
        }
        verdicts.append(_verdict(settings, body_name, scene, pairs))
        for pair, apart in pairs.items():
            samples += [
                Sample(body_name, scene.name, pair, float(t), *(float(v) for v in values))
                for t, *values in zip(times, *apart, strict=True)
            ]
    return verdicts, samples


def _verdict(
    settings: Settings, body_name: str, scene: FlightScene, pairs: Mapping[Pair, Difference]
) -> Verdict:
    mine, theirs = pairs["ours - reference"].largest(), pairs["MuJoCo - reference"].largest()
    return Verdict(
        body_name,
        scene.name,
        f"ours {settings.ours.name}",
        settings.mujoco.name,
        settings.dt_s,
        settings.duration_s,
        *pairs["ours - MuJoCo"].largest(),
        *mine[:2],
        *theirs[:2],
    )


def remedy_steps_s(settings: Settings) -> tuple[float, ...]:
    """Return the steps at which remedies are tried, s, largest first: those that fit a flight."""
    return tuple(factor * settings.dt_s for factor in (4.0, 2.0, 1.0, 0.5) if settings.fits(factor))


def remedies(settings: Settings, body_name: str) -> Iterator[list[Remedy]]:
    """Yield how far the scenes' attitude is from MuJoCo and from truth by other methods and steps.

    The settings' own method takes every step of `remedy_steps_s`; the others spare the smallest,
    which would cost as much as all before it.
    """
    body, steps_s = BODIES[body_name], remedy_steps_s(settings)
    sampled = sampled_steps(round(settings.duration_s / steps_s[0]))
    times = _seconds(sampled, steps_s[0])
    truths = [reference(scene, body, times) for scene in settings.scenes]
    others = [method for method, _ in REMEDIES.values() if method.name != settings.ours.name]
    for dt_s in steps_s:
        here = sampled * round(steps_s[0] / dt_s)
        theirs = [mujocos(scene, body, settings.mujoco, dt_s, here) for scene in settings.scenes]
        for method in (settings.ours, *(others if dt_s >= settings.dt_s else ())):
            mine = ours(settings.scenes, body, method, dt_s, here)
            yield [
                Remedy(body_name, scene.name, method.name, dt_s, *_attitudes_apart(*motions))
                for scene, *motions in zip(settings.scenes, mine, theirs, truths, strict=True)
            ]


def _attitudes_apart(mine: State, theirs: State, truth: State) -> tuple[float, float, float]:
    """Return the largest angles of ours to MuJoCo, ours to the truth and MuJoCo to the truth."""
    pairs = ((mine, theirs), (mine, truth), (theirs, truth))
    angles = [quaternion.angle_between(a.rotation, b.rotation).max() for a, b in pairs]
    return float(angles[0]), float(angles[1]), float(angles[2])
