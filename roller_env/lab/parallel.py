"""The parallel cube: the report's rigid body and MuJoCo's free joint through the same flights.

Both get the same mass, inertia, start, gravity, keys, lift, damping and torque, and are compared
with one another and with a **reference**, over time: `roller_env.lab.free.FreeScene.truth`, a
closed form for the linear motion and for every free rotation, and an integration for the rotations
under damping or torque; it was compared with a Taylor series in 40 digits that shares no code with
it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pandas import concat

from roller_env.lab import chart
from roller_env.lab.free import Acting, FreeScene, Vector
from roller_env.lab.game import GRAVITY_M_S2, LIFT_N, LIFT_S
from roller_env.lab.methods import Method, MujocoMethod, RigidBodyMethod
from roller_env.lab.runner import known
from roller_env.lab.table import Frame, markdown
from roller_env.rigid_body import (
    INTEGRATORS,
    Body,
    Integrator,
    PiecewiseConstantForce,
    State,
    key_sequence,
    quaternion,
)
from roller_env.rigid_body.arrays import Float64, positive_time

AGREEMENT: Final = 1e-9
"""The two sides agree when position, m, and attitude, rad, stay within this of one another."""

REFERENCE_ERROR: Final = 5e-13
"""What the reference's position, m, and attitude, rad, may be wrong by in 10 s. Measured against 40
digits: 2.2e-13 rad for the thrown box, whose closed form is next to its separatrix, and at most
1.3e-13 rad else."""

MOMENTS: Final = 100
"""At most so many moments of a flight are compared; the last step always is."""

# --- what is flown ---------------------------------------------------------------------------

WEIGHT_M_S2: Final[Vector] = (0.0, 0.0, -GRAVITY_M_S2)

START_ORIENTATION: Final = (0.8, 0.2, -0.4, 0.4)
"""A unit quaternion with no special direction, so that no axis hides another."""

BODIES: Final[Mapping[str, Body]] = {
    "cube": Body.cube(size=1.0, mass=1.0),
    "box": Body.box(size=(0.1, 0.4, 0.9), mass=10.0),
}
"""The report's cube, and the slender box of the free-body benchmark (scpeters/benchmark)."""


@dataclass(frozen=True)
class Flight:
    """How a flight begins, and what acts."""

    title: str
    velocity_m_s: Vector  # world axes
    spin_rad_s: Vector  # **body** axes: that is where a box's axes differ
    acting: Acting


KEYS_HELD: Final = ((0.0, "W"), (1.0, "WA"), (2.5, "A"), (4.0, "SD"), (6.5, "D"), (8.0, ""))
"""The WASD sequence: every key, singly and in pairs, and none. (time in s, keys from then on)."""

_LIFT: Final = PiecewiseConstantForce(
    np.array([0.0, LIFT_S]), np.array([(0.0, 0.0, LIFT_N), (0.0, 0.0, 0.0)])
)
_WEIGHT: Final = Acting(WEIGHT_M_S2)

FLIGHTS: Final[Mapping[str, Flight]] = {
    "drift": Flight("drift and spin, no gravity", (-0.9, 0.4, 0.1), (3.0, -5.0, 2.0), Acting()),
    "ballistic": Flight(
        "thrown, spun about the box's middle axis", (-2.0, 2.0, 8.0), (0.1, 5.0, 0.1), _WEIGHT
    ),
    "keys": Flight(
        "WASD key sequence in free fall",
        (0.0, 0.0, 5.0),
        (2.0, 3.0, -4.0),
        replace(_WEIGHT, held=key_sequence(KEYS_HELD)),
    ),
    "lift": Flight(
        "lift of 12.7 N for 5 s", (0.5, 0.0, 0.0), (-3.0, 1.0, 5.0), replace(_WEIGHT, held=_LIFT)
    ),
    "damping": Flight(
        "linear and angular damping",
        (5.0, -3.0, 10.0),
        (4.0, -4.0, 3.0),
        replace(_WEIGHT, drag_n_s_m=0.5, spin_damping_nm_s=0.05),
    ),
    "torque": Flight(
        "the report's torque, (1, 0, 0) - 0.1 omega",
        (1.0, 0.0, 0.0),
        (1.0, -2.0, 3.0),
        Acting(torque_nm=(1.0, 0.0, 0.0), spin_damping_nm_s=0.1),
    ),
}
"""Flights by name. The first two start as the benchmark's free boxes do, but the first with a spin
about no principal axis, which is harder than the benchmark's."""


def parsed_keys(events: Iterable[str]) -> PiecewiseConstantForce:
    """Return the key sequence written as ``0=W 1=WA 2.5=``: time in s, and the keys from then on.

    Raises:
        ValueError: on anything else, an unknown key, or times that do not rise.
    """
    sequence = []
    for event in events:
        time, separator, keys = event.partition("=")
        try:
            when = float(time)
        except ValueError:
            when = math.nan
        if not separator or not math.isfinite(when):
            raise ValueError(f"keys: found {event!r}; a time in s and keys, such as 1.5=WA")
        sequence.append((when, keys.upper()))
    return key_sequence(sequence)


@dataclass(frozen=True)
class Settings:
    """What to compare.

    Raises:
        ValueError: when a flight or the time between two jumps is no whole number of steps.
    """

    bodies: tuple[str, ...]  # names in `BODIES`
    flights: Mapping[str, Flight]
    ours: Integrator
    mujoco: MujocoMethod
    dt_s: float  # of both
    duration_s: float  # of every flight

    def __post_init__(self) -> None:
        positive_time("dt", self.dt_s)
        positive_time("duration", self.duration_s)
        for time_s, what in self._ends().items():
            steps = time_s / self.dt_s
            if not _whole(steps):
                raise ValueError(
                    f"dt {self.dt_s:g} s: {what} {time_s:g} s, which is {steps:.6g} steps and has "
                    f"to be a whole number of them; {time_s / math.ceil(steps):.9g} s would do"
                )

    def _ends(self) -> dict[float, str]:
        """Return the times at which a step has to end, s, with what happens then."""
        return {self.duration_s: "a flight ends at"} | {
            float(t): f"the scene {name!r} changes its force at"
            for name, flight in self.flights.items()
            for t in flight.acting.jumps_s
        }

    def steps_s(self) -> list[float]:
        """Return the steps at which other methods are tried, largest first: those that fit."""
        tried = [factor * self.dt_s for factor in (4.0, 2.0, 1.0, 0.5)]
        return [dt for dt in tried if all(_whole(time_s / dt) for time_s in self._ends())]

    def scene(self, body: str, name: str, dt_s: float) -> FreeScene:
        """Return a flight of a body as a scene whose moments a step of ``dt_s`` divides."""
        flight, steps = self.flights[name], round(self.duration_s / dt_s)
        q = np.array([START_ORIENTATION])
        spin = quaternion.rotate(q, np.array([flight.spin_rad_s]))
        return FreeScene(
            name=name,
            title=flight.title,
            start=State.create(
                BODIES[body], orientation=q, velocity=flight.velocity_m_s, angular_velocity=spin
            ),
            quantities=(),
            time_steps_s=(),
            acting=flight.acting,
            horizon_s=self.duration_s,
            moments=max(n for n in range(1, MOMENTS + 1) if steps % n == 0),
        )


def _whole(steps: float) -> bool:
    # 0.3 / 0.1 is not 3.
    return abs(steps - round(steps)) <= 1e-6


# --- how far apart ---------------------------------------------------------------------------

QUANTITIES: Final[Mapping[str, str]] = {
    "position_m": "position, m",
    "attitude_rad": "attitude, rad",
    "momentum_kg_m_s": "momentum, kg m/s",
    "angular_momentum_kg_m2_s": "angular momentum, kg m²/s",
    "energy_j": "energy, J",
}
"""The columns of `apart`, with what people read."""


def flown(scene: FreeScene, method: Method, dt_s: float) -> State:
    """Return a flight's moments as rows."""
    trial = scene.trial(method, dt_s)
    trial.run()
    return trial.reached


def apart(a: State, b: State, gravity_m_s2: Vector) -> dict[str, Float64]:
    """Return how far ``a`` and ``b``, rows of one body's moments, are apart in `QUANTITIES`.

    Vectors by the length of their difference, attitude by the angle, energy (kinetic and potential)
    by its absolute value.
    """
    height = (a.position - b.position) @ np.array(gravity_m_s2)
    energy = a.kinetic_energy() - b.kinetic_energy() - a.body.mass * height
    values = (
        quaternion.norm(a.position - b.position),
        quaternion.angle_between(a.rotation, b.rotation),
        quaternion.norm(a.momentum - b.momentum),
        quaternion.norm(a.angular_momentum - b.angular_momentum),
        np.abs(energy),
    )
    return dict(zip(QUANTITIES, values, strict=True))


def compare(settings: Settings, body: str) -> tuple[Frame, Frame]:
    """Fly every scene three ways with one body.

    Returns:
        The largest differences, a row a scene: body, scene, ours, mujoco, dt_s, duration_s, the
        `QUANTITIES` of ours from MuJoCo, both sides' errors of position and attitude, and the
        verdict in words. And the differences over time: body, scene, pair, time_s, `QUANTITIES`.
    """
    samples = []
    for name, flight in settings.flights.items():
        scene = settings.scene(body, name, settings.dt_s)
        motions = {
            "ours": flown(scene, RigidBodyMethod(settings.ours), settings.dt_s),
            "MuJoCo": flown(scene, settings.mujoco, settings.dt_s),
            "reference": scene.truth,
        }
        for a, b in itertools.combinations(motions, 2):
            where = {"body": body, "scene": name, "pair": f"{a} - {b}", "time_s": scene.times_s}
            found = apart(motions[a], motions[b], flight.acting.gravity_m_s2)
            samples.append(Frame(where | found))
    every = concat(samples, ignore_index=True)
    largest = every.groupby(["pair", "scene"], sort=False)[list(QUANTITIES)].max()
    between, mine, theirs = (
        largest.loc[pair] for pair in ("ours - MuJoCo", "ours - reference", "MuJoCo - reference")
    )
    verdicts = Frame(
        {
            "body": body,
            "scene": between.index,
            "ours": f"ours {settings.ours.name}",
            "mujoco": settings.mujoco.name,
            "dt_s": settings.dt_s,
            "duration_s": settings.duration_s,
            **between,
            "ours_position_error_m": mine.position_m,
            "ours_attitude_error_rad": mine.attitude_rad,
            "mujoco_position_error_m": theirs.position_m,
            "mujoco_attitude_error_rad": theirs.attitude_rad,
        }
    )
    verdicts["verdict"] = [_verdict(row) for row in verdicts.itertuples()]
    return verdicts.reset_index(drop=True), every


def _verdict(row: Any) -> str:
    """Return ``agree``, or which side is further from the truth, by what and how much."""
    if max(row.position_m, row.attitude_rad) <= AGREEMENT:
        return "agree"
    unit = "rad" if row.position_m <= AGREEMENT else "m"
    what = "attitude_error_rad" if unit == "rad" else "position_error_m"
    sides = {row.ours: getattr(row, f"ours_{what}"), row.mujoco: getattr(row, f"mujoco_{what}")}
    right, wrong = sorted(sides, key=sides.__getitem__)
    return f"{wrong} is off by {sides[wrong]:.1e} {unit}, {right} by {sides[right]:.1e}"


REMEDIES: Final[Mapping[str, str]] = {
    "rk4": "the report's: momentum, world axes",
    "lie_rk4": "turns instead of sums of quaternions",
    "rk4_body": "body axes instead of world axes",
    "splitting4": "exact turns about body axes",
}
"""The report's method and what could mend it, each with the one thing that it exchanges."""


def remedies(settings: Settings, body: str) -> Iterator[Frame]:
    """Yield, step by step, how far the attitudes of other methods are from MuJoCo's and the truth.

    Columns: body, scene, method, dt_s, against_mujoco_rad, error_rad, mujoco_error_rad; the
    largest angles of a flight.
    """
    methods = {settings.ours.name: settings.ours} | {name: INTEGRATORS[name] for name in REMEDIES}
    for dt_s in settings.steps_s():
        rows = []
        for name in settings.flights:
            scene = settings.scene(body, name, settings.steps_s()[0])
            theirs = flown(scene, settings.mujoco, dt_s)
            for method, ours in methods.items():
                mine = flown(scene, RigidBodyMethod(ours), dt_s)
                row = {"body": body, "scene": name, "method": method, "dt_s": dt_s}
                row["against_mujoco_rad"] = _angle(mine, theirs)
                row["error_rad"] = _angle(mine, scene.truth)
                row["mujoco_error_rad"] = _angle(theirs, scene.truth)
                rows.append(row)
        yield Frame(rows)


def _angle(a: State, b: State) -> float:
    return float(quaternion.angle_between(a.rotation, b.rotation).max())


def verdict_table(verdicts: Frame) -> str:
    """Return the largest differences and who is wrong, for people, as Markdown."""
    columns = ["body", "scene", *QUANTITIES, "verdict"]
    return markdown(verdicts[columns].rename(columns=QUANTITIES))


def remedy_table(rows: Frame) -> str:
    """Return the largest attitude differences from MuJoCo, rad, by method and step, as Markdown."""
    rows = rows.assign(ours=rows.method, ms=1e3 * rows.dt_s, scene=rows.scene + ", rad")
    wide = rows.pivot_table("against_mujoco_rad", ["ours", "ms"], "scene", sort=False)
    wide = wide.sort_index(level="ms", ascending=False, sort_remaining=False)
    return markdown(wide.reset_index().rename(columns={"ms": "dt, ms"}))


# --- pictures --------------------------------------------------------------------------------

_FLOOR: Final = 1e-17
"""Differences below this, nearly always exactly 0, leave the picture."""
_MARGINS: Final = (0.9, 0.5, 1.0, 1.0)


@chart.styled
def draw_flights(settings: Settings, body: str, samples: Frame) -> Figure:
    """Draw the differences over time: a row for each scene, a panel for each quantity."""
    ours, theirs = f"ours {settings.ours.name}", settings.mujoco.name
    title = f"The {body} in parallel: {theirs} and our {ours[5:]}, dt {1e3 * settings.dt_s:g} ms"
    note = (
        "Thick: how far each side is from the reference. Thin: how far they are from one another; "
        "where a line is missing, it is 0 (under 1e-17)."
    )
    shape, size = (len(settings.flights), len(QUANTITIES)), (3.0, 2.1)
    figure, panels = chart.grid(shape, title, note, panel=size, margins=_MARGINS, sharey="col")
    lines = (
        ("ours - reference", "our own error", chart.colour(ours), 3.6, 0.7),
        ("MuJoCo - reference", "MuJoCo's own error", chart.colour(theirs), 3.6, 0.7),
        ("ours - MuJoCo", "difference between the two", "#222222", 1.1, 1.0),
    )
    for row, (name, flight) in zip(panels, settings.flights.items(), strict=True):
        row[0].set_ylabel(flight.title, fontsize=8)
        for axes, (what, said) in zip(row, QUANTITIES.items(), strict=True):
            if what in ("position_m", "attitude_rad"):
                axes.axhspan(_FLOOR, REFERENCE_ERROR, color="#efefef", lw=0)
                _draw_agreement(axes)
            for pair, label, colour, width, alpha in lines:
                one = samples[(samples.scene == name) & (samples.pair == pair)]
                shown = one[what].where(one[what] > _FLOOR)
                axes.plot(one.time_s, shown, color=colour, lw=width, alpha=alpha, label=label)
            axes.set(yscale="log", xlim=(0.0, settings.duration_s))
            axes.set_title(said, fontsize=9, color="#555555", loc="left")
    chart.legend_of(figure, panels[0, 1])
    return figure


def _draw_agreement(axes: Axes) -> None:
    axes.axhline(AGREEMENT, color="#555555", lw=1.0, ls="--", label="agree to 1e-9")


@chart.styled
def draw_remedies(settings: Settings, body: str, rows: Frame) -> Figure:
    """Draw the attitude error against the time step: a panel for each scene, a line a method."""
    title = f"The {body}: which part of the report's method makes its error"
    note = f"largest attitude error in {settings.duration_s:g} s, rad, against the time step, ms"
    columns, mujoco = min(3, len(settings.flights)), settings.mujoco.name
    shape, size = (math.ceil(len(settings.flights) / columns), columns), (4.6, 3.2)
    figure, panels = chart.grid(shape, title, note, panel=size, margins=_MARGINS, sharey="all")
    for axes in panels.ravel()[len(settings.flights) :]:
        axes.set_visible(False)
    for axes, (name, flight) in zip(panels.ravel(), settings.flights.items(), strict=False):
        own = rows[rows.scene == name].assign(ms=1e3 * rows.dt_s)
        wide = own.pivot_table("error_rad", "ms", "method", sort=False)
        thick = own.groupby("ms").mujoco_error_rad.first()
        axes.plot(thick, lw=5, alpha=0.5, color=chart.colour(mujoco), label=mujoco)
        for method in wide:
            label = f"{method}: {REMEDIES[method]}" if method in REMEDIES else method
            axes.plot(wide[method], "o-", ms=4, color=chart.colour(f"ours {method}"), label=label)
        _draw_agreement(axes)
        axes.set(xscale="log", yscale="log")
        axes.set_xticks(wide.index, [f"{ms:g}" for ms in wide.index])
        axes.minorticks_off()
        axes.set_title(flight.title, fontsize=10, loc="left")
    chart.legend_of(figure, panels[0, 0])
    return figure


def chosen(what: str, name: str, names: Sequence[str]) -> tuple[str, ...]:
    """Return the name asked for, or every name for ``all``; a ValueError names the nearest."""
    return tuple(names) if name == "all" else (known(what, name, [*names, "all"]),)
