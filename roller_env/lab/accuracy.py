"""The experiment of ``scripts/accuracy.py``: every method on every scene, what it costs, how wrong.

Each scene is run with each method and each time step. The points become charts, a table of the
cheapest method for an error, a table of the time steps that can be trusted, and, from runs of their
own in which the time step is halved, the table of orders.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Final

from roller_env.lab import crowd, report
from roller_env.lab.charts import Plot, draw_overview, draw_scene
from roller_env.lab.contact import CONTACT_SCENES
from roller_env.lab.experiment import ERROR_KINDS, Point, Scene, measure
from roller_env.lab.free import FREE_SCENES, FreeScene
from roller_env.lab.methods import Method, RigidBodyMethod
from roller_env.lab.orders import HORIZON_S, Order, measured_orders
from roller_env.lab.provenance import provenance
from roller_env.lab.results import Results
from roller_env.lab.tables import write_rows
from roller_env.lab.timing import REPEATS

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

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
        rigid_body_evaluations: most evaluations of the forces in a run of our own integrators,
            which NumPy makes slow; smaller time steps are left out.
        time_steps: most time steps of a scene of contact, the largest ones.
    """

    quick: bool
    repeats: int
    rigid_body_evaluations: int
    time_steps: int | None = None


FULL: Final = Effort(quick=False, repeats=REPEATS, rigid_body_evaluations=10_000)
QUICK: Final = Effort(quick=True, repeats=3, rigid_body_evaluations=400, time_steps=3)

QUICK_SCENES: Final = ("complex-box", "asymmetric-top", "damped-spin", "drag", "push")
"""What a quick run does unless told otherwise: the scenes that the table of orders needs."""


def scenes_named(names: Sequence[str], effort: Effort = FULL) -> list[Scene]:
    """Return the scenes of these names, or all that the effort has when there are none.

    Raises:
        ValueError: when a scene does not exist, with the nearest name.
    """
    known = {scene.name: scene for scene in SCENES}
    for name in names:
        if name not in known:
            near = get_close_matches(name, known, n=1, cutoff=0.0)[0]
            raise ValueError(
                f"--scene: no scene {name!r}; the nearest is {near!r}, and there are "
                f"{', '.join(known)}"
            )
    wanted = names or (QUICK_SCENES if effort.quick else tuple(known))
    found = [known[name] for name in dict.fromkeys(wanted)]
    if not effort.quick:
        return found
    return [scene.over(HORIZON_S) if isinstance(scene, FreeScene) else scene for scene in found]


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


def run(scenes: Sequence[Scene], effort: Effort, progress: Progress) -> Results:
    """Measure every method on every scene.

    Args:
        scenes: as `scenes_named` gives them.
        effort: how much to do.
        progress: is told of each of the `pieces`.
    """
    points: list[Point] = []
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
    return Results(scenes, points, orders, crowd.costs(effort.repeats) if free else [])


def write(results: Results, out: Path) -> list[Path]:
    """Write the tables and the charts of ``results`` into a directory, and return their paths."""
    facts = provenance()
    files: list[Path] = []
    tables: list[tuple[str, Sequence[DataclassInstance]]] = [
        ("points", results.points),
        ("orders", results.orders),
        ("answers", results.answers),
        ("trust", results.trusts),
        ("crowd", results.crowd),
    ]
    for name, rows in tables:
        if rows:
            files += write_rows(rows, facts, out / name)
    for kind in ERROR_KINDS:
        plots = [Plot.of(scene, one, results.points) for scene, one in results.charted(kind)]
        for plot in plots:
            files += draw_scene(plot, facts, out / f"{plot.scene.name}-{kind}")
        for where in ("free", "contact"):
            some = [p for p in plots if isinstance(p.scene, FreeScene) == (where == "free")]
            if len(some) > 1:
                files += draw_overview(some, facts, out / f"overview-{where}-{kind}")
    text = out / "accuracy.md"
    text.write_text(report.page(results, facts), encoding="utf-8")
    return [*files, text]
