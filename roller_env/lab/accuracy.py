"""The experiment of ``scripts/accuracy.py``: every method on every scene, what it costs, how wrong.

Each scene is run with each method and each time step. The points become charts, a table of the
cheapest method for an error, a table of the largest accurate steps, and, from runs of their own in
which the time step is halved, the table of orders.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
import pandas as pd

from roller_env.lab import chart, table
from roller_env.lab.chart import COSTS, ROUNDING, Cost, duration
from roller_env.lab.contact import CONTACT_SCENES
from roller_env.lab.free import COMPLEX_BOX, FREE_SCENES, FreeScene, free_model
from roller_env.lab.methods import MUJOCO, RIGID_BODY, Method, RigidBodyMethod
from roller_env.lab.orders import EXACT, HORIZON_S, Order, measured_orders
from roller_env.lab.runner import REPEATS, Median, header, interleaved, known, provenance, timed
from roller_env.lab.scene import ERROR_KINDS, ErrorKind, Measure, Scene, measure
from roller_env.lab.table import Frame, markdown
from roller_env.rigid_body import advance

SCENES: Final[tuple[Scene, ...]] = (*FREE_SCENES, *CONTACT_SCENES)
"""Everything there is to measure on, free motion first."""

Progress = Callable[[str], None]
"""Is told what has been done after each piece of work."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How much a run does.

    Attributes:
        quick: shorter free motions and coarser orders.
        repeats: timings of which the median is taken.
        rigid_body_evaluations: most evaluations of the forces in a run of our own integrators;
            smaller time steps are left out.
        time_steps: most time steps of a scene of contact, the largest ones.
    """

    quick: bool
    repeats: int
    rigid_body_evaluations: int
    time_steps: int | None = None


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
    for name in names:
        known("scene", name, list(found))
    wanted = names or (QUICK_SCENES if effort.quick else tuple(found))
    chosen = [found[name] for name in dict.fromkeys(wanted)]
    if not effort.quick:
        return chosen
    return [scene.over(HORIZON_S) if isinstance(scene, FreeScene) else scene for scene in chosen]


def time_steps(scene: Scene, method: Method, effort: Effort) -> list[float]:
    """Return the time steps that the effort allows, largest first."""
    if isinstance(scene, FreeScene):
        steps = list(scene.time_steps_s)
    else:
        steps = list(scene.time_steps_s)[: effort.time_steps]
    if isinstance(method, RigidBodyMethod):
        evaluations = method.evaluations * scene.horizon_s
        return [dt for dt in steps if evaluations / dt <= 1.01 * effort.rigid_body_evaluations]
    return steps


def pieces(scenes: Sequence[Scene], effort: Effort) -> int:
    """Return how often `run` will report progress."""
    points = sum(
        len(time_steps(scene, method, effort)) for scene in scenes for method in scene.methods
    )
    return points + sum(isinstance(scene, FreeScene) for scene in scenes)


# --- answers ---------------------------------------------------------------------------------

TOLERANCES: Final = (1e-3, 1e-6, 1e-9)
ACCURATE: Final = 1e-2
"""A time step is accurate when it and every smaller one keep the error under this."""

TIE: Final = 0.15
"""Costs within this of the cheapest count as the same: a shared machine's clock knows no better."""

COST_COLUMN: Final[dict[Cost, str]] = {
    "CPU time": "cpu_s_per_s",
    "force evaluations": "evaluations_per_s",
}


def sound(curve: Frame, tolerance: float = math.inf) -> Frame:
    """Return the points before the first that fails or errs more as time steps grow.

    Later ones are luck: a larger step that happens to land near the answer is no method that has
    the error.

    Args:
        curve: one method's points.
        tolerance: largest error.
    """
    curve = curve.sort_values("dt_s", kind="stable")
    bad = curve.failed | ~np.isfinite(curve.error) | (curve.error > tolerance)
    return curve[~bad.cummax()]


def failures(curve: Frame) -> Frame:
    """Return the points at which one method failed, or gave no number, smallest step first."""
    curve = curve.sort_values("dt_s", kind="stable")
    return curve[curve.failed | ~np.isfinite(curve.error)]


def curves(points: Frame, *keys: str) -> Iterable[tuple[Any, Frame]]:
    """Return the points grouped by ``keys``, in the order in which they were measured."""
    groups: Iterable[tuple[Any, Frame]] = points.groupby(list(keys), sort=False)
    return groups


def cheapest(points: Frame) -> Frame:
    """Return the cheapest method for each tolerance, by each cost; NaN where none was tried.

    Args:
        points: of one measure a scene.
    """
    rows = []
    for (scene, error), own in curves(points, "scene", "measure"):
        for tolerance in TOLERANCES:
            kept = [sound(curve, tolerance) for _, curve in curves(own, "method")]
            for cost in COSTS:
                best = pd.concat(
                    [one.nsmallest(1, COST_COLUMN[cost]) for one in kept if len(one)] or [own[:0]]
                ).sort_values([COST_COLUMN[cost], "error"])
                rows.append(
                    {"scene": scene, "measure": error, "tolerance": tolerance, "cost": cost}
                    | _best(best, own, COST_COLUMN[cost])
                )
    return table.frame(rows)


def _best(best: Frame, every: Frame, column: str) -> dict[str, Any]:
    if best.empty:
        return dict.fromkeys(
            ("dt_s", "error", "times_real_time", "evaluations_per_s"), math.nan
        ) | {
            "method": "",
            "also": "",
            "largest_tried": False,
        }
    first = best.iloc[0]
    ties = best[1:][best[1:][column] <= first[column] * (1.0 + TIE)]
    return {
        "dt_s": first.dt_s,
        "error": first.error,
        "times_real_time": 1.0 / first.cpu_s_per_s,
        "evaluations_per_s": first.evaluations_per_s,
        "method": first.method,
        "also": ", ".join(ties.method),
        "largest_tried": bool(first.dt_s == every[every.method == first.method].dt_s.max()),
    }


def accurate_steps(points: Frame) -> Frame:
    """Return each method's largest accurate step, 0 for none, and the first that fails, or inf."""
    rows = []
    for (scene, error, method), curve in curves(points, "scene", "measure", "method"):
        failed = failures(curve)
        rows.append(
            {
                "scene": scene,
                "method": method,
                "measure": error,
                "largest_dt_s": sound(curve, ACCURATE).dt_s.max() if len(curve) else 0.0,
                "first_failing_dt_s": failed.dt_s.min() if len(failed) else math.inf,
            }
        )
    return table.frame(rows).fillna({"largest_dt_s": 0.0})


def pareto(points: Frame, cost: Cost) -> Frame:
    """Return the points that no other beats in both error and cost, cheapest first.

    All errors under `ROUNDING` are alike: none is better than exact.
    """
    candidates = pd.concat([sound(curve) for _, curve in curves(points, "method")])
    candidates = candidates.sort_values([COST_COLUMN[cost], "error"])
    least = candidates.error.cummin().shift(fill_value=math.inf)
    return candidates[candidates.error.clip(lower=ROUNDING) < least]


# --- what a step costs -----------------------------------------------------------------------

BATCHES: Final = (1, 1000)
"""Bodies that advance in one call of ours."""


def step_costs(repeats: int) -> Frame:
    """Return the CPU time of a step of every method on the thrown box, in interleaved runs.

    Returns:
        ``method``, ``bodies`` that advance in one call, ``us_per_body_step`` (median) and
        ``us_per_body_evaluation``.
    """
    start, acting, dt_s = COMPLEX_BOX.start, COMPLEX_BOX.acting, 1e-3
    runs: dict[str, Callable[[], object]] = {}
    cases: dict[str, tuple[Method, int, int]] = {}
    for method in MUJOCO:
        model = free_model(start.body, method, dt_s)
        data = mujoco.MjData(model)
        acting.apply(model, data)
        runs[method.name] = partial(mujoco.mj_step, model, data, 2000)
        cases[method.name] = (method, 1, 2000)
    for ours in RIGID_BODY:
        for bodies in BATCHES:
            name, steps, batch = f"{ours.name} {bodies}", 20_000 // bodies, start.take([0] * bodies)
            load = acting.load()
            runs[name] = partial(advance, batch, ours.integrator, dt_s, steps, load=load)
            cases[name] = (ours, bodies, steps)
    for run in runs.values():
        run()
    turns = {name: partial(timed, run, time.thread_time) for name, run in runs.items()}
    taken = interleaved(turns, repeats)
    rows = []
    for name, (case, bodies, steps) in cases.items():
        us = 1e6 * Median.of(taken[name]).value / (steps * bodies)
        rows.append(
            {
                "method": case.name,
                "bodies": bodies,
                "us_per_body_step": us,
                "us_per_body_evaluation": us / case.evaluations,
            }
        )
    return table.frame(rows)


def draw_step_costs(costs: Frame) -> Any:
    """Draw what a step costs a body, against MuJoCo's Runge-Kutta."""
    theirs = float(costs[costs.method == "MuJoCo RK4"].us_per_body_step.iloc[0])
    rows = [
        chart.Row(
            f"{one.method}, {one.bodies:,} at a time",
            one.us_per_body_step,
            good=one.us_per_body_step <= theirs,
            said=f"{theirs / one.us_per_body_step:.2g}x",
        )
        for one in costs.itertuples()
    ]
    return chart.against_limits(
        rows,
        "What a step of a free body costs",
        "On the thrown box, one thread. The line is MuJoCo's RK4; at the right how many steps of "
        "each are done while it does one.",
        "CPU µs a step of a body",
        (0.05, 100.0),
        limit=theirs,
        label_in=3.2,
    )


# --- results ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Results:
    """What was measured of some scenes.

    Attributes:
        scenes: as they were run.
        points: rows of `roller_env.lab.scene.measure`.
        orders: of the free scenes.
        costs: of a step, for many bodies at a time; empty without free scenes.
    """

    scenes: Sequence[Scene]
    points: Frame
    orders: Sequence[Order]
    costs: Frame

    def charted(self, kind: ErrorKind) -> list[tuple[Scene, Measure]]:
        """Return the error of this kind that stands for each scene: its first. Not all have one."""
        return [
            (scene, next(one for one in scene.measures if one.kind == kind))
            for scene in self.scenes
            if any(one.kind == kind for one in scene.measures)
        ]

    def of(self, errors: Iterable[tuple[Scene, Measure]]) -> Frame:
        """Return the points of some scenes' errors."""
        wanted = pd.MultiIndex.from_tuples([(scene.name, one.name) for scene, one in errors])
        own = pd.MultiIndex.from_frame(self.points[["scene", "measure"]])
        return self.points[own.isin(wanted)]

    @cached_property
    def cheapest(self) -> Frame:
        """The cheapest method for each tolerance, of every error that is charted."""
        return cheapest(self.of([*self.charted("discretisation"), *self.charted("model")]))

    @cached_property
    def accurate(self) -> Frame:
        """The largest accurate step of each method on each scene."""
        return accurate_steps(self.of([(scene, scene.measures[0]) for scene in self.scenes]))

    @property
    def disagreeing(self) -> list[Order]:
        """The orders that are not as theory expects."""
        return [order for order in self.orders if not order.agrees]

    def plot(self, scene: Scene, error: Measure) -> chart.Plot:
        """Return what is drawn of one scene's error."""
        own = self.of([(scene, error)])
        found = {method: curve for (method,), curve in curves(own, "method")}
        return chart.Plot(
            title=scene.title,
            label=error.label,
            kind=error.kind,
            curves={
                method: [(p.dt_s, p.error, _costs(p)) for p in sound(curve).itertuples()]
                for method, curve in found.items()
            },
            fronts={
                cost: [
                    (p.method, p.dt_s, p.error, _costs(p)[cost])
                    for p in pareto(own, cost).itertuples()
                ]
                for cost in COSTS
            },
            failures={
                method: (p.dt_s, _costs(p))
                for method, curve in found.items()
                for p in failures(curve)[:1].itertuples()
            },
            limits_s=getattr(scene, "limits_s", {}),
        )


def _costs(point: Any) -> Mapping[Cost, float]:
    return {cost: getattr(point, column) for cost, column in COST_COLUMN.items()}


def run(scenes: Sequence[Scene], effort: Effort, progress: Progress) -> Results:
    """Measure every method on every scene.

    Args:
        scenes: as `scenes_named` gives them.
        effort: how much to do.
        progress: is told of each of the `pieces`.
    """
    points: list[dict[str, Any]] = []
    orders: list[Order] = []
    for scene in scenes:
        for method in scene.methods:
            for dt_s in time_steps(scene, method, effort):
                points += measure(scene, method, dt_s, effort.repeats)
                progress(f"{scene.name}, {method.name}")
        if isinstance(scene, FreeScene):
            orders += measured_orders(scene, quick=effort.quick)
            progress(f"{scene.name}, orders")
    free = any(isinstance(scene, FreeScene) for scene in scenes)
    return Results(
        scenes, table.frame(points), orders, step_costs(effort.repeats) if free else Frame()
    )


def write(results: Results, out: Path) -> list[Path]:
    """Write the tables and the charts of ``results`` into a directory, and return their paths."""
    facts = provenance()
    files: list[Path] = []
    orders = table.frame(results.orders) if results.orders else Frame()
    for name, rows in (
        ("points", results.points),
        ("orders", orders),
        ("cheapest", results.cheapest),
        ("accurate_steps", results.accurate),
        ("step_costs", results.costs),
    ):
        if len(rows):
            files += table.write(rows, facts, out / name)
    if len(results.costs):
        files += chart.save(draw_step_costs(results.costs), facts, out / "step-costs")
    for kind in ERROR_KINDS:
        plots = [(scene, results.plot(scene, one)) for scene, one in results.charted(kind)]
        for scene, plot in plots:
            files += chart.save(chart.draw_scene(plot), facts, out / f"{scene.name}-{kind}")
        for where in ("free", "contact"):
            some = [p for s, p in plots if isinstance(s, FreeScene) == (where == "free")]
            if len(some) > 1:
                figure = chart.draw_overview(some)
                files += chart.save(figure, facts, out / f"overview-{where}-{kind}")
    text = out / "accuracy.md"
    text.write_text(page(results, facts), encoding="utf-8")
    return [*files, text]


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
    if not results.orders:
        return ""
    number, wrong = len(results.orders), results.disagreeing
    found = {(one.scene, one.measure, one.method): one for one in results.orders}
    columns = {
        t: key for t, key in _SUITED.items() if any(o.scene == key[0] for o in results.orders)
    }
    cells = []
    for method in dict.fromkeys(one.method for one in results.orders):
        own = [found.get((*key, method)) for key in columns.values()]
        theory = next((one.theory for one in own if one), math.nan)
        cells.append([method, f"{theory:g}", *map(_order, own)])
    parts = [
        f"The power of dt with which an error falls, measured over the last three halvings above "
        f"rounding, in motions of {HORIZON_S:g} s. Of {number} slopes {number - len(wrong)} are "
        "within 0.15 of what theory expects.\n",
        markdown(["method", "theory", *columns], cells) if columns else "",
    ]
    if wrong:
        rows = [[one.scene, one.measure, one.method, one.theory, _order(one)] for one in wrong]
        titles = ["scene", "error", "method", "theory", "measured"]
        parts.append("Not as theory expects:\n\n" + markdown(titles, rows))
    parts.append("Where theory does not expect the method's own order, and why:\n")
    parts.append(_reasons(results.orders))
    return "\n".join(part for part in parts if part)


def _order(order: Order | None) -> str:
    if order is None or math.isnan(order.measured):
        return "-"
    return "exact" if order.measured == EXACT else f"{order.measured:.2f}"


def _reasons(orders: Sequence[Order]) -> str:
    """Return a list of the reasons with the cases that each is about."""
    lines = []
    for reason in sorted({one.reason for one in orders if one.reason}):
        cases = [one for one in orders if one.reason == reason]
        scenes = ", ".join(dict.fromkeys(one.scene for one in cases))
        measures = ", ".join(dict.fromkeys(one.measure.replace("_", " ") for one in cases))
        measured = ", ".join(sorted({_order(one) for one in cases}))
        methods = ", ".join(dict.fromkeys(one.method for one in cases))
        lines.append(f"- **{measures}** on {scenes}: {measured}. {reason}. ({methods})\n")
    return "".join(lines)


def cheapest_section(results: Results) -> str:
    """Return the table of the cheapest method for each tolerance."""
    labels = {
        (scene.name, one.name): f"{one.label} ({kind})"
        for kind in ERROR_KINDS
        for scene, one in results.charted(kind)
    }
    rows: list[list[object]] = []
    said = None
    for (scene, error, tolerance), own in curves(results.cheapest, "scene", "measure", "tolerance"):
        names = ["", ""] if said == (scene, error) else [scene, labels[scene, error]]
        said = scene, error
        rows.append([*names, f"{tolerance:.0e}", *(_answer(one) for one in own.itertuples())])
    titles = ["scene", "error", "at most", "least CPU time", "fewest evaluations of the forces"]
    return markdown(titles, rows) if rows else ""


def _answer(answer: Any) -> str:
    if not answer.method:
        return "none that was tried"
    price = (
        f"{answer.times_real_time:,.0f} times real time"
        if answer.cost == "CPU time"
        else f"{answer.evaluations_per_s:,.0f} a second"
    )
    also = f"; as cheap: {answer.also}" if answer.also else ""
    edge = ", the largest tried" if answer.largest_tried else ""
    return f"{answer.method} at {duration(answer.dt_s)}{edge} ({price}){also}"


def accurate_section(results: Results) -> str:
    """Return the tables of the largest accurate steps, MuJoCo's and ours."""
    parts = [
        f"The largest time step that was tried with which the scene's first error stays under "
        f"{ACCURATE:g}, as with every smaller one; in brackets the smallest that fails.\n"
    ]
    for family in ("MuJoCo ", "ours "):
        own = results.accurate[results.accurate.method.str.startswith(family)]
        found = {(one.scene, one.method): _accurate(one) for one in own.itertuples()}
        methods = list(dict.fromkeys(own.method))
        rows = [
            [scene, *(found.get((scene, method), "") for method in methods)]
            for scene in dict.fromkeys(own.scene)
        ]
        titles = ["scene", *(method.removeprefix(family) for method in methods)]
        parts.append(markdown(titles, rows) if rows else "")
    return "\n".join(parts)


def _accurate(row: Any) -> str:
    largest = duration(row.largest_dt_s) if row.largest_dt_s else "-"
    failing = row.first_failing_dt_s
    return largest if math.isinf(failing) else f"{largest} ({duration(failing)})"


def costs_section(results: Results) -> str:
    """Return what a step costs each of one body and of a thousand."""
    if results.costs.empty:
        return ""
    costs = results.costs.pivot_table("us_per_body_step", "method", "bodies", sort=False)
    least = results.costs.groupby("method").us_per_body_evaluation.min()
    theirs = costs.loc["MuJoCo RK4", 1]
    rows = [
        [
            method,
            *("" if math.isnan(us) else us for us in own),
            float(least[method]),
            f"{theirs / own.min():.2g}",
        ]
        for method, own in costs.iterrows()
    ]
    titles = ["method", *(f"µs a step, {n:,} at a time" for n in BATCHES)]
    return "Per body, on the thrown box, one thread.\n\n" + markdown(
        [*titles, "least µs an evaluation", "steps while MuJoCo RK4 does one"], rows
    )
