from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from roller_env.compile.compiled import compile_level
from roller_env.config import EnvConfig
from roller_env.divergence import MOST_REPORTS, REPORTS_VARIABLE, reports_in
from roller_env.level import Level
from roller_env.simulation import Simulation, Transition
from tests.builders import coin, make_level, resting
from tests.simulation.driving import bits, plain_data, simulation_of, wandering

POISONS = {
    "nan_velocity": (True, np.nan),
    "infinite_velocity": (True, np.inf),
    "huge_velocity": (True, 1e300),
    "nan_position": (False, np.nan),
    "huge_position": (False, -1e300),
}


@pytest.fixture(autouse=True)
def reports(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The directory that reports of divergence are asked for in; nothing is written elsewhere."""
    elsewhere, directory = tmp_path / "elsewhere", tmp_path / "reports"
    elsewhere.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(elsewhere))
    monkeypatch.chdir(elsewhere)
    monkeypatch.setenv(REPORTS_VARIABLE, str(directory))
    yield directory
    assert list(elsewhere.iterdir()) == []


def poison(simulation: Simulation, row: int, kind: str = "nan_velocity") -> None:
    """Write a number that physics cannot go on from into one row."""
    is_velocity, value = POISONS[kind]
    snapshot = simulation.snapshot()
    bodies = snapshot.bodies
    (bodies.velocity if is_velocity else bodies.position)[row, 0] = value
    simulation.restore(snapshot)


def diverge(simulation: Simulation) -> Transition:
    with pytest.warns(RuntimeWarning, match="diverged"):
        return simulation.step(np.zeros((simulation.num_envs, 2)))


@pytest.mark.parametrize("physics", ["default", "rigid"])
@pytest.mark.parametrize("kind", POISONS)
def test_a_diverging_game_ends_alone(kind: str, physics: str) -> None:
    # A position that is wrong from the start has no potential to begin the shaping with.
    reward = "shaped" if POISONS[kind][0] else "points"
    options: dict[str, Any] = {"reward": reward, "observation": "rays", "num_threads": 2}
    options["physics"] = physics
    poisoned = simulation_of("gate", num_envs=4, **options)
    healthy = simulation_of("gate", num_envs=4, **options)
    for force, _ in zip(wandering(4), range(10), strict=False):
        poisoned.step(force)
        healthy.step(force)
    poison(poisoned, row=1, kind=kind)
    transition = diverge(poisoned)
    healthy.step(np.zeros((4, 2)))

    assert transition.terminated.tolist() == [False, True, False, False]
    assert not transition.truncated.any()
    assert poisoned.results(np.arange(4))["diverged"].tolist() == [False, True, False, False]
    assert poisoned.divergences == 1
    assert np.isfinite(transition.reward).all()
    assert np.isfinite(poisoned.observe()).all()
    neighbours = [0, 2, 3]
    for force, _ in zip(wandering(4, seed=50), range(30), strict=False):
        expected, found = bits(healthy), bits(poisoned)
        assert [found[row] for row in neighbours] == [expected[row] for row in neighbours]
        assert healthy.observe()[neighbours].tobytes() == poisoned.observe()[neighbours].tobytes()
        healthy.step(force)
        poisoned.step(force)


def test_a_game_that_diverged_stays_over_and_a_reset_begins_it_as_if_it_were_new() -> None:
    simulation, fresh = simulation_of("bridge"), simulation_of("bridge")
    poison(simulation, row=0)
    diverge(simulation)
    assert not simulation.step(np.zeros((1, 2))).stepped.any()
    simulation.reset()
    fresh.reset()
    for force, _ in zip(wandering(1), range(60), strict=False):
        assert bits(simulation) == bits(fresh)
        simulation.step(force)
        fresh.step(force)
    assert simulation.divergences == 1


def test_a_game_diverges_in_a_part_of_the_rows_as_it_does_among_all() -> None:
    simulation = simulation_of("bridge", num_envs=3)
    poison(simulation, row=2)
    with pytest.warns(RuntimeWarning, match="1 game"):
        transition = simulation.step(np.zeros((3, 2)), hold=np.array([True, False, False]))
    assert transition.terminated.tolist() == [False, False, True]
    assert transition.stepped.tolist() == [False, True, True]


def test_divergence_is_neither_a_fall_nor_a_success_and_earns_nothing() -> None:
    simulation = simulation_of(make_level(coins=[coin(*resting())]))
    poison(simulation, row=0)
    transition = diverge(simulation)
    results = {name: values[0] for name, values in simulation.results(np.array([0])).items()}
    assert transition.reward.tolist() == [0.0]
    assert (results["coins"], results["fall"], results["success"]) == (0, False, False)


def test_the_report_repeats_the_divergence(reports: Path) -> None:
    simulation = simulation_of("classic", num_envs=3, physics="fast")
    poison(simulation, row=0, kind="huge_velocity")
    poison(simulation, row=2, kind="nan_position")
    with pytest.warns(RuntimeWarning) as caught:
        simulation.step(np.ones((3, 2)))
    (path,) = reports.glob("*.npz")
    assert re.search(re.escape(str(path)), str(caught[0].message))
    with np.load(path, allow_pickle=False) as report:
        state = report["state"]
        level = Level.model_validate_json(str(report["level"]))
        preset = str(report["preset"])
    assert level == simulation.level
    assert preset == repr(simulation.preset)
    assert len(state) == 2
    compiled = compile_level(level, "fast")
    model = compiled.model
    for row in range(2):
        data = plain_data(model, state[row])
        assert data.ctrl[compiled.force_ctrl].tolist() == [1.0, 1.0, 0.0]
        mujoco.mj_step(model, data)
        assert sum(warning.number for warning in data.warning) > 0


def test_a_simulation_that_never_diverged_writes_nothing(reports: Path) -> None:
    simulation = Simulation(EnvConfig(level="bridge"), 2)
    simulation.reset()
    for force, _ in zip(wandering(2), range(20), strict=False):
        simulation.step(force)
    assert (simulation.divergences, reports.exists()) == (0, False)


def diverge_once() -> str:
    """Let a game diverge; return what is said of its state."""
    simulation = simulation_of("bridge")
    poison(simulation, row=0)
    with pytest.warns(RuntimeWarning) as caught:
        simulation.step(np.zeros((1, 2)))
    return str(caught[0].message).partition("ended; ")[2]


def test_nobody_who_did_not_ask_for_reports_gets_a_file(
    reports: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(REPORTS_VARIABLE)
    assert diverge_once() == "ROLLER_REPORTS=DIRECTORY would keep the state before"
    assert not reports.exists()


def test_a_level_that_always_diverges_leaves_a_stated_number_of_reports(reports: Path) -> None:
    said = [diverge_once() for _ in range(MOST_REPORTS + 3)]
    kept = sorted(reports.iterdir())
    assert len(kept) == MOST_REPORTS
    assert sorted(line.rpartition(" ")[2] for line in said[:MOST_REPORTS]) == list(map(str, kept))
    assert set(said[MOST_REPORTS:]) == {f"{reports} has its {MOST_REPORTS} reports already"}


def test_a_report_that_cannot_be_written_is_said_and_the_game_ends_all_the_same(
    reports: Path,
) -> None:
    reports.write_text("a file where the directory should be")
    assert diverge_once().startswith("the state before could not be kept: ")


def test_a_run_keeps_its_reports_beside_its_other_files_and_no_longer_than_it_lasts(
    reports: Path,
) -> None:
    run = reports.parent / "run"
    with reports_in(run):
        diverge_once()
    assert [file.name for file in run.iterdir()] == ["diverged-1.npz"]
    assert not reports.exists()
    diverge_once()
    assert len(list(reports.iterdir())) == len(list(run.iterdir())) == 1


DIVERGE = """
import numpy as np, sys
from roller_env.config import EnvConfig
from roller_env.simulation import Simulation
simulation = Simulation(EnvConfig(level="flat", num_threads=int(sys.argv[1])), 4)
simulation.reset()
snapshot = simulation.snapshot()
snapshot.physics[:, 1] = np.nan
simulation.restore(snapshot)
simulation.step(np.zeros((4, 2)))
"""


@pytest.mark.parametrize("threads", [1, 2])
def test_mujoco_leaves_no_log_file_where_the_user_works(threads: int, tmp_path: Path) -> None:
    directory = tmp_path / "work"
    directory.mkdir()
    root = str(Path(__file__).parents[2])
    done = subprocess.run(
        [sys.executable, "-c", DIVERGE, str(threads)],
        cwd=directory,
        env=os.environ | {"PYTHONPATH": root},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert "4 game(s) of level 'flat' diverged" in done.stderr
    assert "WARNING: Nan" in done.stderr, "what MuJoCo says on the terminal is not lost"
    assert list(directory.iterdir()) == []
