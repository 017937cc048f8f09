"""The measurements as Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from roller_env.lab.benchmark.breakdown import PartRow
from roller_env.lab.benchmark.goals import GoalRow
from roller_env.lab.benchmark.ratios import Ratios
from roller_env.lab.benchmark.scale import MemoryRow, ScaleRow
from roller_env.lab.tables import markdown


def of_ratios(measured: Ratios, parts: Sequence[PartRow]) -> str:
    """Return the goals, the contestants and where the time goes, a table each."""
    speeds = [
        (row.contestant, f"{row.env_steps_per_s:,.0f}", f"{row.spread:.0%}", row.simulated_s_per_s)
        for row in measured.speeds
    ]
    shares = [(row.what, row.part, f"{row.share:.1%}", row.us_per_env_step) for row in parts]
    return "\n".join(
        (
            _goals(measured.rows),
            markdown(("contestant", "env steps/s", "spread", "simulated s/s"), speeds),
            markdown(("step", "part", "share", "µs an env step"), shares),
        )
    )


def of_scale(
    goals: Sequence[GoalRow], costs: Sequence[ScaleRow], memory: Sequence[MemoryRow]
) -> str:
    """Return the goals, the cost on every axis and the memory, a table each."""
    places = [
        (
            row.axis,
            f"{row.value:,}",
            row.us_per_env_step,
            f"{row.smallest:.3g} to {row.largest:.3g}",
            f"{1e6 / row.us_per_env_step:,.0f}",
        )
        for row in costs
    ]
    processes = [(f"{row.environments:,}", f"{row.resident_gb:.3f}") for row in memory]
    return "\n".join(
        (
            _goals(goals),
            markdown(("axis", "size", "µs an env step", "range", "env steps/s"), places),
            markdown(("environments", "GB resident"), processes),
        )
    )


def _goals(rows: Sequence[GoalRow]) -> str:
    cells = [
        (row.comparison, f"{row.sense} {row.goal:g}", *_measured(row), row.verdict) for row in rows
    ]
    return markdown(("", "goal", "measured", "range", "verdict"), cells)


def _measured(row: GoalRow) -> tuple[str, str]:
    if row.verdict == "not measured":
        return "", ""
    return f"{row.measured:.3g}", f"{row.smallest:.3g} to {row.largest:.3g}"
