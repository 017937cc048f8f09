"""The experiment of ``scripts/accuracy.py``: every method on every scene, what it costs, how wrong.

Each scene is run with each method and each time step. The points become charts, a table of the
cheapest method for an error, a table of the largest accurate steps, and, from runs of their own in
which the time step is halved, the table of orders.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, get_args

import pandas as pd

from roller_env.lab import chart
from roller_env.lab.chart import duration
from roller_env.lab.contact import CONTACT_SCENES
from roller_env.lab.contact.scene import ContactScene
from roller_env.lab.free import COMPLEX_BOX, FREE_SCENES, FreeScene
from roller_env.lab.methods import FREE, Method, RigidBodyMethod
from roller_env.lab.orders import EXACT, HORIZON_S, measured_orders
from roller_env.lab.runner import REPEATS, header, interleaved, known, provenance, timed
from roller_env.lab.scene import CURVE, ERROR, ErrorKind, failures, measure, sound
from roller_env.lab.table import Frame, markdown

Scene = FreeScene | ContactScene
SCENES: Final[tuple[Scene, ...]] = (*FREE_SCENES, *CONTACT_SCENES)
"""Everything there is to measure on, free motion first."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How much a run does."""

    quick: bool  # shorter free motions and coarser orders
    repeats: int  # timings of which the median is taken
    rigid_body_evaluations: int  # most of a run of our own integrators; smaller steps are left out
    time_steps: int | None = None  # most of a scene of contact, the largest ones


FULL: Final = Effort(quick=False, repeats=REPEATS, rigid_body_evaluations=400_000)
QUICK: Final = Effort(quick=True, repeats=3, rigid_body_evaluations=40_000, time_steps=3)

QUICK_SCENES: Final = ("complex-box", "asymmetric-top", "damped-spin", "drag", "push")
"""What a quick run does unless told otherwise: the scenes that the table of orders needs."""


def scenes_named(names: Sequence[str], effort: Effort = FULL) -> list[Scene]:
    """Return the scenes of these names, or all that the effort has when there are none.

    Raises:
        ValueError: when a scene does not exist, with the nearest name.
    """
    found = {scene.name: scene for scene in SCENES}
    wanted = names or (QUICK_SCENES if effort.quick else tuple(found))
    chosen = [found[known("scene", name, list(found))] for name in dict.fromkeys(wanted)]
    if not effort.quick:
        return chosen
    return [scene.over(HORIZON_S) if isinstance(scene, FreeScene) else scene for scene in chosen]


def time_steps(scene: Scene, method: Method, effort: Effort) -> list[float]:
    """Return the time steps that the effort allows, largest first."""
    if isinstance(scene, FreeScene) and isinstance(method, RigidBodyMethod):
        least = method.evaluations * scene.horizon_s / (1.01 * effort.rigid_body_evaluations)
        return [dt for dt in scene.time_steps_s if dt >= least]
    return list(scene.time_steps_s)[: None if isinstance(scene, FreeScene) else effort.time_steps]


def tries(scenes: Iterable[Scene], effort: Effort) -> list[tuple[Scene, Method, float]]:
    """Return every scene with each of its methods and time steps."""
    return [
        (scene, method, dt_s)
        for scene in scenes
        for method in scene.methods
        for dt_s in time_steps(scene, method, effort)
    ]


# --- answers ---------------------------------------------------------------------------------

TOLERANCES: Final = (1e-3, 1e-6, 1e-9)
ACCURATE: Final = 1e-2
"""A time step is accurate when it and every smaller one keep the error under this."""

TIE: Final = 0.15
"""Costs within this of the cheapest count as the same: a shared machine's clock knows no better."""

_COSTS: Final = {"CPU time": "cpu_s_per_s", "force evaluations": "evaluations_per_s"}
_ANSWER: Final = ("dt_s", "error", "times_real_time", "evaluations_per_s")


def cheapest(points: Frame) -> Frame:
    """Return the cheapest method for each tolerance, by each cost; NaN where none was tried."""
    points = points.assign(times_real_time=1.0 / points.cpu_s_per_s)
    largest, rows = points.groupby(CURVE).dt_s.max(), []
    for (scene, error), own in points.groupby(ERROR, sort=False):
        for tolerance in TOLERANCES:
            for cost, column in _COSTS.items():
                best = sound(own, tolerance).sort_values([column, "error"])
                best = best.drop_duplicates("method")
                near = best[best[column] <= best[column].min() * (1.0 + TIE)]
                first = near.iloc[0] if len(near) else dict.fromkeys(_ANSWER, math.nan)
                method = near.method.iloc[0] if len(near) else ""
                row = {"scene": scene, "measure": error, "tolerance": tolerance, "cost": cost}
                row |= {key: first[key] for key in _ANSWER}
                row |= {"method": method, "also": ", ".join(near.method[1:])}
                tried = largest.get((scene, error, method))
                rows.append(row | {"largest_tried": first["dt_s"] == tried})
    return Frame(rows)


def accurate_steps(points: Frame) -> Frame:
    """Return each method's largest accurate step, 0 for none, and the first that fails, or inf."""
    steps = Frame(
        {
            "largest_dt_s": sound(points, ACCURATE).groupby(CURVE).dt_s.max(),
            "first_failing_dt_s": failures(points).groupby(CURVE).dt_s.min(),
        }
    )
    curves = pd.MultiIndex.from_frame(points[CURVE].drop_duplicates())
    steps = steps.reindex(curves).fillna({"largest_dt_s": 0.0, "first_failing_dt_s": math.inf})
    return steps.reset_index()


# --- what a step costs -----------------------------------------------------------------------

BATCHES: Final = (1, 1000)
"""Bodies that advance in one call of ours."""
_COST_STEPS: Final = 20_000


def step_costs(repeats: int) -> Frame:
    """Return the CPU time of a step of every method on the thrown box, in interleaved runs.

    Returns:
        ``method``, ``bodies`` that advance in one call, ``us_per_body_step`` (median) and
        ``us_per_body_evaluation``.
    """
    turns: dict[tuple[Method, int], Callable[[], float]] = {}
    for method in FREE:
        for bodies in BATCHES if isinstance(method, RigidBodyMethod) else (1,):
            thrown = replace(COMPLEX_BOX, start=COMPLEX_BOX.start.take([0] * bodies))
            work = partial(thrown.trial(method, 1e-3).simulate, _COST_STEPS // bodies, 1)
            work()
            turns[method, bodies] = partial(timed, work, time.thread_time)
    rows = []
    for (method, bodies), seconds in interleaved(turns, repeats).items():
        us = 1e6 * statistics.median(seconds) / _COST_STEPS
        row = {"method": method.name, "bodies": bodies, "us_per_body_step": us}
        rows.append(row | {"us_per_body_evaluation": us / method.evaluations})
    return Frame(rows)


def draw_step_costs(costs: Frame) -> Any:
    """Draw what a step costs a body, against MuJoCo's Runge-Kutta."""
    theirs = float(costs[costs.method == "MuJoCo RK4"].us_per_body_step.iloc[0])
    note = (
        "On the thrown box, one thread. The line is MuJoCo's RK4; at the right how many steps of "
        "each are done while it does one."
    )
    rows = []
    for one in costs.itertuples():
        us, label = one.us_per_body_step, f"{one.method}, {one.bodies:,} at a time"
        rows.append(chart.Row(label, us, good=us <= theirs, said=f"{theirs / us:.2g}x"))
    said = ("What a step of a free body costs", note, "CPU µs a step of a body")
    return chart.against_limits(rows, *said, (0.05, 100.0), limit=theirs, label_in=3.2)


# --- results ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Results:
    """What was measured of some scenes."""

    scenes: Sequence[Scene]  # as they were run
    points: Frame  # of `roller_env.lab.scene.measure`
    orders: Frame  # of `roller_env.lab.orders.measured_orders`, of the free scenes
    costs: Frame  # of `step_costs`; empty without free scenes

    def charted(self, kind: ErrorKind) -> dict[str, chart.Plot]:
        """Return the first error of a kind of every scene that has one, by the scene's name."""
        plots = {}
        for scene in self.scenes:
            for error in [one for one in scene.measures if one.kind == kind][:1]:
                own = self.points[self.points.scene == scene.name]
                own = own[own.measure == error.name]
                limits_s = scene.limits_s if isinstance(scene, FreeScene) else {}
                plots[scene.name] = chart.Plot(scene.title, error.label, own, limits_s)
        return plots

    @property
    def cheapest(self) -> Frame:
        """The cheapest method for each tolerance, of every error that is charted."""
        plots = [plot for kind in get_args(ErrorKind) for plot in self.charted(kind).values()]
        return cheapest(pd.concat([plot.points for plot in plots]))

    @property
    def accurate(self) -> Frame:
        """The largest accurate step of each method for the first error of each scene."""
        first = self.points.groupby("scene").measure.transform("first")
        return accurate_steps(self.points[self.points.measure == first])


def run(
    scenes: Sequence[Scene], effort: Effort, watched: Callable[[Any], Iterable[Any]] = iter
) -> Results:
    """Measure every method on every scene; ``watched`` goes over a list and shows progress."""
    points: list[dict[str, Any]] = []
    for scene, method, dt_s in watched(tries(scenes, effort)):
        points += measure(scene, method, dt_s, effort.repeats)
    free = [scene for scene in scenes if isinstance(scene, FreeScene)]
    orders = [row for scene in watched(free) for row in measured_orders(scene, quick=effort.quick)]
    costs = step_costs(effort.repeats) if free else Frame()
    return Results(scenes, Frame(points), Frame(orders), costs)


def write(results: Results, out: Path) -> list[Path]:
    """Write the tables and the charts of ``results`` into a directory, and return their paths."""
    facts = provenance()
    tables = {
        "points": results.points,
        "orders": results.orders,
        "cheapest": results.cheapest,
        "accurate_steps": results.accurate,
        "step_costs": results.costs,
    }
    figures = {"step-costs": draw_step_costs(results.costs)} if len(results.costs) else {}
    free = [scene.name for scene in results.scenes if isinstance(scene, FreeScene)]
    for kind in get_args(ErrorKind):
        plots = results.charted(kind)
        figures |= {f"{name}-{kind}": chart.draw_scene(plot) for name, plot in plots.items()}
        for where in ("free", "contact"):
            some = [plot for name, plot in plots.items() if (name in free) == (where == "free")]
            if len(some) > 1:
                figures[f"overview-{where}-{kind}"] = chart.draw_overview(some)
    return chart.write(out, facts, tables, figures, ("accuracy", page(results, facts)))


# --- the page --------------------------------------------------------------------------------

_SUITED: Final = {
    "position (drag)": ("drag", "position"),
    "momentum (drag)": ("drag", "velocity"),
    "attitude (asymmetric-top)": ("asymmetric-top", "attitude"),
    "angular momentum (damped-spin)": ("damped-spin", "angular_momentum"),
    "energy (asymmetric-top)": ("asymmetric-top", "energy"),
}
"""What the short table of orders shows: scenes on which no method is exact in the quantity."""


def page(results: Results, facts: Mapping[str, str]) -> str:
    """Return everything that was measured but the points, as one Markdown page."""
    sections = {
        "Orders": orders_section(results),
        "The cheapest method for an error": cheapest_section(results),
        "The largest accurate step": accurate_section(results),
        "What a step costs": costs_section(results),
    }
    text = "".join(f"## {title}\n\n{body}\n" for title, body in sections.items() if body)
    return f"# Accuracy against cost\n\n{header(facts)}\n\n{text}"


def orders_section(results: Results) -> str:
    """Return the table of orders, and the reasons of those that are not the method's own."""
    if results.orders.empty:
        return ""
    orders = results.orders.assign(shown=results.orders.measured.map(_order))
    wrong, odd = orders[~orders.agrees], orders[orders.reason != ""]
    wide = orders.pivot_table("shown", "method", ERROR, "first", sort=False).fillna("-")
    columns = {title: wide[key] for title, key in _SUITED.items() if key in wide}
    theory = orders.groupby("method", sort=False).theory.first().map("{:g}".format)
    slopes = orders[orders.measured.map(math.isfinite)]
    worst = (slopes.measured - slopes.theory).abs().max()
    parts = [
        f"The power of dt with which an error falls, measured over the last three halvings above "
        f"rounding, in motions of {HORIZON_S:g} s. Of {len(orders)} errors "
        f"{(orders.measured == EXACT).sum()} are rounding at every step and have no slope; of the "
        f"{len(slopes)} others {slopes.agrees.sum()} have one within 0.15 of what theory expects, "
        f"the worst off by {worst:.3f}. {len(wrong)} are not as expected. Theory is the method's "
        f"own order but in {len(odd)} rows, for {odd.reason.nunique()} reasons.\n"
    ]
    if columns:
        parts.append(markdown(Frame({"theory": theory} | columns).reset_index()))
    if len(wrong):
        titles = {"measure": "error", "shown": "measured"}
        unlike = wrong[[*CURVE, "theory", "shown"]].rename(columns=titles)
        parts.append("Not as theory expects:\n\n" + markdown(unlike))
    parts.append("Where theory does not expect the method's own order, and why:\n")
    reasons = ""
    for reason, own in odd.groupby("reason"):
        scenes, measures, methods = (", ".join(own[key].unique()) for key in CURVE)
        found = ", ".join(sorted(set(own.shown)))
        measures = measures.replace("_", " ")
        reasons += f"- **{measures}** on {scenes}: {found}. {reason}. ({methods})\n"
    return "\n".join([*parts, reasons])


def _order(order: float) -> str:
    return "-" if math.isnan(order) else "exact" if order == EXACT else f"{order:.2f}"


def cheapest_section(results: Results) -> str:
    """Return the table of the cheapest method for each tolerance."""
    answers = results.cheapest
    answers["said"] = [_answer(answer) for answer in answers.itertuples()]
    said = answers.groupby([*ERROR, "tolerance"]).said.agg(list)
    rows = []
    for kind in get_args(ErrorKind):
        for scene, plot in results.charted(kind).items():
            names = [scene, f"{plot.label} ({kind})"]
            for tolerance in TOLERANCES:
                both = said[scene, plot.points.measure.iloc[0], tolerance]
                rows.append([*names, f"{tolerance:.0e}", *both])
                names = ["", ""]
    titles = ["scene", "error", "at most", "least CPU time", "fewest evaluations of the forces"]
    return markdown(titles, rows)


def _answer(answer: Any) -> str:
    if not answer.method:
        return "none that was tried"
    price = f"{answer.evaluations_per_s:,.0f} a second"
    if answer.cost == "CPU time":
        price = f"{answer.times_real_time:,.0f} times real time"
    also = f"; as cheap: {answer.also}" if answer.also else ""
    edge = ", the largest tried" if answer.largest_tried else ""
    return f"{answer.method} at {duration(answer.dt_s)}{edge} ({price}){also}"


def accurate_section(results: Results) -> str:
    """Return the tables of the largest accurate steps, MuJoCo's and ours."""
    text = (
        f"The largest time step that was tried with which the scene's first error stays under "
        f"{ACCURATE:g}, as with every smaller one; in brackets the smallest that fails.\n"
    )
    steps = results.accurate
    steps["shown"] = [_accurate(row) for row in steps.itertuples()]
    for family in ("MuJoCo ", "ours "):
        own = steps[steps.method.str.startswith(family)]
        if len(own):
            wide = own.pivot_table("shown", "scene", "method", "first", sort=False).fillna("")
            wide.columns = wide.columns.str.removeprefix(family)
            text += "\n" + markdown(wide.reset_index())
    return text


def _accurate(row: Any) -> str:
    largest = duration(row.largest_dt_s) if row.largest_dt_s else "-"
    failing = row.first_failing_dt_s
    return largest if math.isinf(failing) else f"{largest} ({duration(failing)})"


def costs_section(results: Results) -> str:
    """Return what a step costs each of one body and of a thousand."""
    if results.costs.empty:
        return ""
    costs = results.costs.pivot_table("us_per_body_step", "method", "bodies", sort=False)
    steps = costs.loc["MuJoCo RK4", 1] / costs.min(axis=1)
    wide = costs.astype(object).where(costs.notna(), "")
    wide.columns = [f"µs a step, {n:,} at a time" for n in BATCHES]
    wide["least µs an evaluation"] = results.costs.groupby("method").us_per_body_evaluation.min()
    wide["steps while MuJoCo RK4 does one"] = steps.map("{:.2g}".format)
    return "Per body, on the thrown box, one thread.\n\n" + markdown(wide.reset_index())
