"""The tables of an accuracy run as Markdown: for the terminal and for the documentation."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import groupby
from operator import attrgetter
from typing import Final

from roller_env.lab.answers import COSTS, TRUSTED_ERROR, Answer, Trust
from roller_env.lab.charts import duration
from roller_env.lab.crowd import BODIES
from roller_env.lab.experiment import ERROR_KINDS
from roller_env.lab.orders import EXACT, HORIZON_S, Order
from roller_env.lab.provenance import header
from roller_env.lab.results import Results
from roller_env.lab.tables import markdown

_SUITED: Final = (
    ("position", "drag", "position"),
    ("momentum", "drag", "velocity"),
    ("attitude", "asymmetric-top", "attitude"),
    ("angular momentum", "damped-spin", "angular_momentum"),
    ("energy", "asymmetric-top", "energy"),
)
"""What the short table of orders shows: a title, and a scene on which no method is exact in it."""

_NONE: Final = "-"


def page(results: Results, facts: dict[str, str]) -> str:
    """Return everything that was measured but the points, as one Markdown page."""
    sections = [
        ("Orders", orders_section(results)),
        ("The cheapest method for an error", answers_section(results)),
        ("Up to which time step a method can be trusted", trust_section(results)),
        ("What a step costs", crowd_section(results)),
    ]
    text = "".join(f"## {title}\n\n{body}\n" for title, body in sections if body)
    return f"# Accuracy against cost\n\n{header(facts)}\n\n{text}"


# --- orders ----------------------------------------------------------------------------------


def orders_section(results: Results) -> str:
    """Return the table of orders, and the reasons of those that are not the method's own."""
    if not results.orders:
        return ""
    number, wrong = len(results.orders), len(results.disagreeing)
    parts = [
        f"The power of dt with which an error falls, measured over the last three halvings above "
        f"rounding, in motions of {HORIZON_S:g} s. Of {number} slopes {number - wrong} are within "
        "0.15 of what theory expects.\n",
        _short_table(results.orders),
    ]
    if results.disagreeing:
        parts.append("Not as theory expects:\n\n" + _disagreeing(results.disagreeing))
    parts.append("Where theory does not expect the method's own order, and why:\n")
    parts.append(_reasons(results.orders))
    return "\n".join(part for part in parts if part)


def _short_table(orders: Sequence[Order]) -> str:
    found = {(one.scene, one.measure, one.method): one for one in orders}
    columns = [
        column for column in _SUITED if any(one.scene == column[1] for one in found.values())
    ]
    rows: list[list[object]] = []
    for method in dict.fromkeys(one.method for one in orders):
        cells = [_order(found.get((scene, measure, method))) for _, scene, measure in columns]
        theory = next((found[scene, m, method].theory for _, scene, m in columns), math.nan)
        rows.append([method, f"{theory:g}", *cells])
    titles = [f"{title} ({scene})" for title, scene, _ in columns]
    return markdown(["method", "theory", *titles], rows) if columns else ""


def _order(order: Order | None) -> str:
    if order is None or math.isnan(order.measured):
        return _NONE
    return "exact" if order.measured == EXACT else f"{order.measured:.2f}"


def _disagreeing(orders: Sequence[Order]) -> str:
    rows = [[one.scene, one.measure, one.method, one.theory, _order(one)] for one in orders]
    return markdown(["scene", "error", "method", "theory", "measured"], rows)


def _reasons(orders: Iterable[Order]) -> str:
    """Return a list of the reasons with the cases that each is about."""
    key = attrgetter("reason")
    lines = []
    for reason, group in groupby(sorted((o for o in orders if o.reason), key=key), key):
        cases = list(group)
        scenes = ", ".join(dict.fromkeys(one.scene for one in cases))
        measures = ", ".join(dict.fromkeys(one.measure.replace("_", " ") for one in cases))
        measured = ", ".join(sorted({_order(one) for one in cases}))
        methods = ", ".join(dict.fromkeys(one.method for one in cases))
        lines.append(f"- **{measures}** on {scenes}: {measured}. {reason}. ({methods})\n")
    return "".join(lines)


# --- answers ---------------------------------------------------------------------------------


def answers_section(results: Results) -> str:
    """Return the table of the cheapest method for each tolerance."""
    labels = {
        (scene.name, one.name): f"{one.label} ({kind})"
        for kind in ERROR_KINDS
        for scene, one in results.charted(kind)
    }
    cases: dict[tuple[str, str], dict[float, dict[str, Answer]]] = {}
    for answer in results.answers:
        case = cases.setdefault((answer.scene, answer.measure), {})
        case.setdefault(answer.tolerance, {})[answer.cost] = answer
    rows: list[list[object]] = []
    for key, by_tolerance in cases.items():
        names = [key[0], labels[key]]
        for tolerance, by_cost in by_tolerance.items():
            rows.append([*names, f"{tolerance:.0e}", *(_answer(by_cost[cost]) for cost in COSTS)])
            names = ["", ""]
    titles = ["scene", "error", "at most", "least wall time", "fewest evaluations of the forces"]
    return markdown(titles, rows) if rows else ""


def _answer(answer: Answer) -> str:
    if not answer.method:
        return "none that was tried"
    price = (
        f"{answer.times_real_time:,.0f} times real time"
        if answer.cost == "wall time"
        else f"{answer.evaluations_per_s:,.0f} a second"
    )
    also = f"; as cheap: {answer.also}" if answer.also else ""
    edge = ", the largest tried" if answer.largest_tried else ""
    return f"{answer.method} at {duration(answer.dt_s)}{edge} ({price}){also}"


def trust_section(results: Results) -> str:
    """Return the tables of the largest trustworthy time steps, MuJoCo's and ours."""
    intro = (
        f"The largest time step that was tried with which the scene's first error stays under "
        f"{TRUSTED_ERROR:g}, as with every smaller one; in brackets the smallest that fails.\n"
    )
    tables = [
        _trust_table([one for one in results.trusts if one.method.startswith(family)], family)
        for family in ("MuJoCo ", "ours ")
    ]
    return "\n".join([intro, *tables]) if results.trusts else ""


def _trust_table(trusts: Sequence[Trust], family: str) -> str:
    if not trusts:
        return ""
    methods = list(dict.fromkeys(one.method for one in trusts))
    found = {(one.scene, one.method): one for one in trusts}
    rows: list[list[object]] = [
        [scene, *(_trust(found.get((scene, method))) for method in methods)]
        for scene in dict.fromkeys(one.scene for one in trusts)
    ]
    return markdown(["scene", *(method.removeprefix(family) for method in methods)], rows)


def _trust(trust: Trust | None) -> str:
    if trust is None:
        return ""
    largest = duration(trust.largest_dt_s) if trust.largest_dt_s else _NONE
    if math.isinf(trust.first_failing_dt_s):
        return largest
    return f"{largest} ({duration(trust.first_failing_dt_s)})"


def crowd_section(results: Results) -> str:
    """Return what a step costs each of one body and of a thousand."""
    if not results.crowd:
        return ""
    cost = {(one.method, one.bodies): one for one in results.crowd}
    rows: list[list[object]] = [
        [
            method,
            *(cost[method, n].us_per_body_step if (method, n) in cost else "" for n in BODIES),
            min(one.us_per_body_evaluation for one in results.crowd if one.method == method),
        ]
        for method in dict.fromkeys(one.method for one in results.crowd)
    ]
    titles = ["method", *(f"µs a step, {n:,} at a time" for n in BODIES), "least µs an evaluation"]
    return (
        "Per body, on the thrown box. MuJoCo is C; ours is NumPy, whose overhead many bodies "
        "share.\n\n" + markdown(titles, rows)
    )
