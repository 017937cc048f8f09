"""Fly the report's rigid body and MuJoCo's free joint side by side, and show where they part.

Examples::

    python scripts/parallel_cube.py
    python scripts/parallel_cube.py --body cube --scene keys --keys 0=W 1=WA 2.5=
    python scripts/parallel_cube.py --body box --scene torque --method splitting4 --dt 0.002
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import tyro
from tqdm import tqdm

from roller_env.lab import style
from roller_env.lab.parallel import charts, names
from roller_env.lab.parallel.differences import Remedy, Sample, Verdict
from roller_env.lab.parallel.experiments import Settings, compare, remedies
from roller_env.lab.parallel.scenes import BODIES, SCENES
from roller_env.lab.provenance import header, provenance
from roller_env.lab.tables import write_rows
from roller_env.rigid_body import integrator

_QUICK_S = 0.5
"""Seconds of flight of a quick run."""


@dataclass(frozen=True, slots=True)
class Arguments:
    """Fly the report's rigid body and MuJoCo's free joint side by side."""

    body: str = "all"
    """cube, box or all."""

    scene: str = "all"
    """drift, ballistic, keys, lift, damping, torque or all."""

    dt: float = 1e-3
    """Time step of both, seconds."""

    duration: float = 10.0
    """Of every flight, seconds."""

    keys: Annotated[tuple[str, ...], tyro.conf.arg(metavar="TIME=KEYS")] = ()
    """Another sequence for the scene keys: time in seconds and what is held from then on."""

    method: str = "rk4"
    """Ours: an integrator of roller_env.rigid_body."""

    integrator: str = "RK4"
    """MuJoCo's: Euler, implicit, implicitfast, discrete or RK4."""

    out: Path = Path("runs/parallel_cube")
    """Directory of the tables and pictures."""

    quick: bool = False
    """Fly for half a second."""


def settings_of(arguments: Arguments) -> Settings:
    """Return what the command line asks for.

    Raises:
        ValueError: when it asks for something that does not exist or does not fit together.
    """
    scenes = dict(SCENES)
    if arguments.keys:
        scenes["keys"] = replace(scenes["keys"], held=names.parsed_keys(arguments.keys))
    flown = names.chosen_several("scene", arguments.scene, scenes)
    return Settings(
        bodies=names.chosen_several("body", arguments.body, BODIES),
        scenes=tuple(scenes[name] for name in flown),
        ours=integrator(arguments.method),
        mujoco=names.mujoco_method(arguments.integrator),
        dt_s=arguments.dt,
        duration_s=_QUICK_S if arguments.quick else arguments.duration,
    )


def main(settings: Settings, out: Path) -> None:
    """Fly, write and draw."""
    facts = provenance()
    print(header(facts))
    verdicts: list[Verdict] = []
    samples: list[Sample] = []
    mended: list[Remedy] = []
    for body in settings.bodies:
        summary, course = compare(settings, body)
        verdicts += summary
        samples += course
        style.save(charts.draw_flights(settings, body, course), facts, out / body)
    print(f"\nLargest differences between the two:\n\n{charts.verdict_table(verdicts)}")
    write_rows(verdicts, facts, out / "verdicts")
    write_rows(samples, facts, out / "differences")
    # On a cube angular velocity is angular momentum over a number in any axes: nothing to mend.
    for body in (name for name in settings.bodies if not BODIES[name].isotropic):
        tried = tqdm(remedies(settings, body), f"the {body}, other methods", unit="run")
        of_body = [row for rows in tried for row in rows]
        mended += of_body
        style.save(charts.draw_remedies(settings, body, of_body), facts, out / f"{body}_remedies")
        print(f"\nThe {body}'s largest attitude differences from {settings.mujoco.name}:\n")
        print(charts.remedy_table(of_body))
    if mended:
        write_rows(mended, facts, out / "remedies")
    print(f"Tables and pictures: {out}")


if __name__ == "__main__":
    given = tyro.cli(Arguments, description=__doc__)
    try:
        wanted = settings_of(given)
    except ValueError as error:
        sys.exit(f"error: {error}")
    main(wanted, given.out)
