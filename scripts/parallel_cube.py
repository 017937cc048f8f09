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
from pandas import concat
from tqdm import tqdm

from roller_env.lab import chart, parallel, table
from roller_env.lab.methods import MUJOCO
from roller_env.lab.parallel import BODIES, FLIGHTS, Settings
from roller_env.lab.runner import header, known, provenance
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
    flights = dict(FLIGHTS)
    if arguments.keys:
        keys = parallel.parsed_keys(arguments.keys)
        flights["keys"] = replace(
            flights["keys"], acting=replace(flights["keys"].acting, held=keys)
        )
    methods = {method.integrator: method for method in MUJOCO}
    mujocos = known("MuJoCo integrator", arguments.integrator, list(methods))
    flown = parallel.chosen("scene", arguments.scene, list(flights))
    return Settings(
        bodies=parallel.chosen("body", arguments.body, list(BODIES)),
        flights={name: flights[name] for name in flown},
        ours=integrator(arguments.method),
        mujoco=next(one for name, one in methods.items() if name == mujocos),
        dt_s=arguments.dt,
        duration_s=_QUICK_S if arguments.quick else arguments.duration,
    )


def main(settings: Settings, out: Path) -> None:
    """Fly, write and draw."""
    facts = provenance()
    print(header(facts))
    verdicts, samples, mended = [], [], []
    for body in settings.bodies:
        summary, course = parallel.compare(settings, body)
        verdicts.append(summary)
        samples.append(course)
        chart.save(parallel.draw_flights(settings, body, course), facts, out / body)
    every = concat(verdicts, ignore_index=True)
    print(f"\nLargest differences between the two:\n\n{parallel.verdict_table(every)}")
    table.write(every, facts, out / "verdicts")
    table.write(concat(samples, ignore_index=True), facts, out / "differences")
    # On a cube angular velocity is angular momentum over a number in any axes: nothing to mend.
    for body in (name for name in settings.bodies if not BODIES[name].isotropic):
        tried = tqdm(parallel.remedies(settings, body), f"the {body}, other methods", unit="step")
        of_body = concat(list(tried), ignore_index=True)
        mended.append(of_body)
        figure = parallel.draw_remedies(settings, body, of_body)
        chart.save(figure, facts, out / f"{body}_remedies")
        print(f"\nThe {body}'s largest attitude differences from {settings.mujoco.name}:\n")
        print(parallel.remedy_table(of_body))
    if mended:
        table.write(concat(mended, ignore_index=True), facts, out / "remedies")
    print(f"Tables and pictures: {out}")


if __name__ == "__main__":
    given = tyro.cli(Arguments, description=__doc__)
    try:
        wanted = settings_of(given)
    except ValueError as error:
        sys.exit(f"error: {error}")
    main(wanted, given.out)
