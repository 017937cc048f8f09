"""Processes forked from one that plays: what `multiprocessing` and vector environments do."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roller_env.simulation import Simulation
from tests.simulation.driving import bits, simulation_of, wandering

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing forks here")

PATIENCE_S = 120.0
"""Whoever has not answered by then hangs."""


def in_a_fork(work: Callable[[], Any]) -> Any:
    """Return what ``work`` returns in a process forked from this one."""
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe(duplex=False)

    def answer(connection: Connection) -> None:
        connection.send(work())

    child = context.Process(target=answer, args=(there,))
    child.start()
    there.close()
    try:
        assert here.poll(PATIENCE_S), "the child hangs"
        return here.recv()
    finally:
        child.kill()
        child.join()


def play_on(simulation: Simulation, steps: int = 30) -> list[Any]:
    """Play games on, one of them begun anew; return the bits of all that can be seen."""
    seen: list[Any] = []
    for force, number in zip(wandering(simulation.num_envs, seed=3), range(steps), strict=False):
        if number == steps // 2:
            simulation.reset(np.array([1]))
        hold = np.arange(simulation.num_envs) == number % simulation.num_envs
        simulation.step(force, hold=hold if number % 3 == 0 else None)
        seen.append((bits(simulation), simulation.observe().tobytes()))
    return seen


@pytest.mark.parametrize(("physics", "num_envs"), [("default", 4), ("rigid", 70)])
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("level", ["gate", "classic"])
def test_a_forked_process_plays_its_parents_games_on_with_the_same_bits(
    level: str, threads: int, physics: str, num_envs: int
) -> None:
    """So many that they are shared among threads."""
    options: dict[str, Any] = {"num_threads": threads, "observation": "rays", "physics": physics}
    simulation = simulation_of(level, num_envs, **options)
    for force, _ in zip(wandering(num_envs), range(20), strict=False):
        simulation.step(force)
    theirs = in_a_fork(lambda: play_on(simulation))
    assert theirs == play_on(simulation)


def test_so_does_a_process_that_was_forked_from_the_forked_one() -> None:
    simulation = simulation_of("flat", num_envs=3, num_threads=2)

    def second_generation() -> Any:
        play_on(simulation, 4)
        return in_a_fork(lambda: play_on(simulation, 4))

    theirs = in_a_fork(second_generation)
    play_on(simulation, 4)
    assert theirs == play_on(simulation, 4)


FORK_AND_END = """
import os, sys
from roller_env.config import EnvConfig
from roller_env.simulation import Simulation
games = Simulation(EnvConfig(level="flat", num_threads=2), 4)
games.reset()
if (child := os.fork()) == 0:
    if sys.argv[1] == "drops":
        del games
    sys.exit(0)  # an ordinary end, with all its destructors
print(os.waitpid(child, 0)[1])
"""


@pytest.mark.parametrize("child", ["keeps", "drops"])
def test_a_forked_process_ends_that_never_played_its_parents_games(child: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", FORK_AND_END, child],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "0\n"), done.stderr
