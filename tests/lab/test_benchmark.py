"""The benchmark measures what it says: the same work on both sides, turn by turn."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pandas import Series

from roller_env.compile.compiled import compile_level
from roller_env.envs.vector import RollerVectorEnv
from roller_env.lab.benchmark import scale
from roller_env.lab.benchmark.breakdown import where_the_time_goes
from roller_env.lab.benchmark.cases import (
    BareLoop,
    BatchAlone,
    SingleStep,
    VectorStep,
)
from roller_env.lab.benchmark.peer_worker import serve
from roller_env.lab.benchmark.peers import Peer, PeerError
from roller_env.lab.benchmark.ratios import CASES, GOALS, MANY, RIGID, TRAIN, VECTOR, judge
from roller_env.lab.benchmark.scale import (
    YARD_BOXES,
    level_of_boxes,
    level_of_coins,
    watch,
)
from roller_env.lab.runner import Case, Config, compare
from roller_env.lab.table import frame

SCRIPTS = Path(__file__).parents[2] / "scripts"
BRIEF = Config(rounds=2, round_s=0.01, warm_up_s=0.5)
SHORT_EPISODE = 7
ENDS: dict[str, Any] = {
    "level": "bridge",
    "reward": "shaped",
    "physics": "fast",
    "max_episode_steps": SHORT_EPISODE,
}
"""Options with which episodes end all the time."""


class Clockwork(Case):
    """Takes the time it is told, a step, and writes down whose turn it was."""

    def __init__(self, name: str, step_s: float, turns: list[str], env_steps: int = 1) -> None:
        self._step_s, self._turns = step_s, turns
        super().__init__(name, env_steps, simulated_s=0.05)

    def prepare(self, config: Config) -> None:
        self.steps_a_round = 10

    def _run(self, steps: int) -> float:
        self._turns.append(self.name)
        return steps * self._step_s


def test_cases_take_turns_round_by_round() -> None:
    turns: list[str] = []
    cases = [Clockwork(name, 1.0, turns) for name in "AB"]
    compare(cases, Config(rounds=3, round_s=1.0, warm_up_s=1.0))
    assert turns == ["A", "B"] * 3


def test_twice_the_environments_in_half_the_time_are_four_times_the_speed() -> None:
    fast, slow = Clockwork("fast", 0.5, [], env_steps=2), Clockwork("slow", 1.0, [], env_steps=1)
    seconds = compare([fast, slow], BRIEF)
    assert (seconds.slow / seconds.fast).tolist() == [4.0] * BRIEF.rounds
    assert (1.0 / seconds.fast).tolist() == [4.0] * BRIEF.rounds


def test_goals_are_about_steps_a_second_simulated_time_or_cost() -> None:
    wall = dict.fromkeys(CASES, 1.0) | {
        VECTOR: 0.5,
        RIGID: 0.02,
        MANY: 0.9,
        TRAIN: 1e-4,
    }
    seconds, simulated_s = frame([wall]), dict.fromkeys(CASES, 0.01) | {RIGID: 0.05}
    found = {goal.title: goal.of(seconds, seconds / Series(simulated_s))[0] for goal in GOALS}
    assert found["whole vector step to Batch alone"] == 2.0
    assert found["rigid: whole vector step to the same of MuJoCo"] == pytest.approx(25.0)
    assert found["rigid: environment steps to EnvPool"] == pytest.approx(50.0)
    assert found["rigid: simulated time to EnvPool"] == pytest.approx(250.0)
    assert found["cost an environment step, 1,024 environments to 64"] == 0.9
    assert found["make train's PPO, thousand environment steps/s"] == pytest.approx(10.0)


def test_a_round_is_as_long_as_the_config_says() -> None:
    class Sleeper(Case):
        def _run(self, steps: int) -> float:
            return steps * 1e-3

    sleeper = Sleeper("sleeper", 1, simulated_s=0.05)
    sleeper.prepare(Config(rounds=1, round_s=0.25, warm_up_s=1.0))
    assert sleeper.steps_a_round == 250
    # A second of the game is twenty of its steps, and the length of a round had to be found.
    assert sleeper.steps_done == 20 + (2**7 - 1)


@pytest.mark.parametrize(
    ("sense", "value", "verdict"),
    [
        ("at least", 2.0, "met"),
        ("at least", 1.99, "missed"),
        ("at most", 2.0, "met"),
        ("at most", 2.01, "missed"),
        ("at most", math.nan, "not measured"),
    ],
)
def test_a_goal_is_met_missed_or_not_measured(sense: str, value: float, verdict: str) -> None:
    row = judge("", sense, 2.0, [value] * 3)  # type: ignore[arg-type]
    assert row["verdict"] == verdict
    assert row["rounds"] == (0 if verdict == "not measured" else 3)


@pytest.mark.parametrize("config", [(0, 1.0, 1.0), (1, 0.0, 1.0), (1, 1.0, math.nan)])
def test_a_config_that_measures_nothing_is_refused(config: tuple[int, float, float]) -> None:
    with pytest.raises(ValueError, match="found"):
        Config(*config)


# --- physics alone does the same work --------------------------------------------------------


def test_batch_alone_takes_every_ball_where_the_game_takes_it_resets_included() -> None:
    vector = VectorStep("vector", 5, 1, **ENDS)
    alone = BatchAlone("alone", vector)
    before = vector.simulation.snapshot().physics
    compare([vector, alone], BRIEF)
    assert alone.steps_done == vector.steps_done > SHORT_EPISODE
    assert (vector.simulation.snapshot().physics != before).any(axis=1).all()
    alone.verify()


def test_the_bare_loop_takes_the_ball_where_the_game_takes_it_resets_included() -> None:
    single = SingleStep("single", **ENDS)
    alone = BareLoop("alone", single)
    compare([single, alone], BRIEF)
    assert alone.steps_done == single.steps_done > SHORT_EPISODE
    alone.verify()


def test_physics_that_went_elsewhere_is_not_compared_with() -> None:
    vector = VectorStep("vector", 3, 1, **ENDS)
    alone = BatchAlone("alone", vector)
    vector.run(3)
    alone.run(2)
    with pytest.raises(RuntimeError, match=r"alone: after 3 steps row\(s\) \[0, 1, 2\]"):
        alone.verify()


# --- where the time goes ---------------------------------------------------------------------


def test_the_parts_are_the_whole() -> None:
    vector = VectorStep("vector", 64, 1, level="flat")
    start = time.perf_counter()
    rows = where_the_time_goes("step", lambda: vector.run(60), 60 * 64)
    elapsed_us = 1e6 * (time.perf_counter() - start)
    assert rows.share.sum() == pytest.approx(1.0)
    assert rows.us_per_env_step.sum() == pytest.approx(elapsed_us / 3840, rel=0.1)
    assert rows.share.is_monotonic_decreasing


def test_physics_that_is_made_finer_takes_a_greater_share() -> None:
    def share(control_dt_s: float) -> float:
        # Few environments, so that Python's part, which is as long for many, is seen.
        vector = VectorStep("vector", 4, 1, level="flat", control_dt_s=control_dt_s)
        vector.run(10)
        rows = where_the_time_goes("step", lambda: vector.run(round(20 / control_dt_s)), 1)
        return float(rows[rows.part == "physics: MuJoCo"].share.sum())

    assert share(1 / 240) < 0.6 < share(0.2)


def test_time_outside_the_house_is_all_else() -> None:
    def work() -> None:
        end = time.perf_counter() + 0.05
        while time.perf_counter() < end:
            pass

    rows = where_the_time_goes("waiting", work, 1)
    assert (rows.part.tolist(), rows.share.tolist()) == (["all else"], [1.0])
    assert rows.us_per_env_step[0] == pytest.approx(50_000, rel=0.5)


# --- scale -----------------------------------------------------------------------------------


@pytest.mark.parametrize("boxes", [YARD_BOXES, 60, 600])
def test_a_level_of_boxes_has_as_many_geoms_and_the_ball(boxes: int) -> None:
    assert compile_level(level_of_boxes(boxes)).model.ngeom == boxes + 1


def test_the_same_game_is_played_to_the_bit_among_60_boxes_and_600() -> None:
    rng = np.random.default_rng(0)
    games = [RollerVectorEnv(4, level=level_of_boxes(n), num_threads=1) for n in (60, 600)]
    for game in games:
        game.reset(seed=0)
    for _ in range(200):
        actions = rng.integers(9, size=4)
        few, many = (game.step(actions)[0] for game in games)
        assert few.tobytes() == many.tobytes()
    start = games[0].simulation.table.start
    assert (np.linalg.norm(games[0].simulation.ball_position - start, axis=1) > 1.0).any()


@pytest.mark.parametrize("coins", [0, 9, 10_000])
def test_a_level_of_coins_has_as_many(coins: int) -> None:
    env = RollerVectorEnv(1, level=level_of_coins(coins), num_threads=1)
    assert env.simulation.coins_in_level.tolist() == [coins]


def test_impossible_sizes_are_refused() -> None:
    with pytest.raises(ValueError, match=f"found 10; the yard alone has {YARD_BOXES}"):
        level_of_boxes(10)
    with pytest.raises(ValueError, match="found 10; must be a square number such as 9"):
        level_of_coins(10)


def test_memory_is_seen_to_grow() -> None:
    # In a process of its own: a worker of the tests gives back what earlier ones took, at any time.
    program = """
import numpy as np
from roller_env.lab.benchmark.scale import resident_gb
before = resident_gb()
ballast = np.ones(10**7)
print((resident_gb() - before) / (1e-9 * ballast.nbytes))
"""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
    )
    assert 0.9 < float(done.stdout) < 1.5


def test_a_fresh_process_tells_its_memory_as_it_goes() -> None:
    rows = watch(8, 64, 4, level="flat", num_threads=1)
    assert rows.env_steps.tolist() == [16, 32, 48, 64]
    assert (rows.resident_gb > 0.01).all()


def test_a_process_that_fails_is_no_sample() -> None:
    with pytest.raises(RuntimeError, match="code 1"):
        watch(1, 1, 1, level="nowhere")


@pytest.mark.parametrize(("end_gb", "verdict"), [(0.101, "met"), (0.11, "missed")])
def test_a_leak_is_judged_by_the_end_against_the_first_tenth(end_gb: float, verdict: str) -> None:
    resident = [0.05, 0.1, *[0.1] * 17, end_gb]
    row = scale.judge_leak(frame([{"resident_gb": gb} for gb in resident]))
    assert row["measured"] == pytest.approx(end_gb / 0.1)
    assert row["verdict"] == verdict


def test_what_was_not_tried_is_not_measured() -> None:
    row = judge(*scale.BOXES_GOAL, [])
    assert row["verdict"] == "not measured"


# --- peers -----------------------------------------------------------------------------------


def test_a_peer_says_what_it_is_and_then_how_long_every_request_took() -> None:
    answers = io.StringIO()
    facts = {"env_steps": 4, "simulated_s": 0.01, "versions": {"maze": "1.0"}}
    serve(lambda steps: 0.5 * steps, facts, io.StringIO('{"steps": 3}\n{"steps": 8}\n'), answers)
    lines = [json.loads(line) for line in answers.getvalue().splitlines()]
    assert lines == [facts, {"seconds": 1.5}, {"seconds": 4.0}]


def test_a_peer_that_cannot_be_imported_says_so() -> None:
    with pytest.raises(PeerError, match="No module named 'gymnasium_robotics'"):
        Peer("maze", Path(sys.executable), peer="gymnasium-robotics")


def test_peers_are_pinned_to_one_version_each() -> None:
    lines = (SCRIPTS / "benchmark-peers.txt").read_text().splitlines()
    pins = [line for line in lines if not line.startswith("#")]
    assert all(re.fullmatch(r"[A-Za-z0-9_.-]+==[0-9][0-9A-Za-z.]*", pin) for pin in pins)
    assert {"envpool", "gymnasium-robotics"} <= {pin.partition("==")[0] for pin in pins}


# --- the commands ----------------------------------------------------------------------------


def run(script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPTS / script), *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=SCRIPTS.parent, check=False)


def test_the_benchmark_measures_every_goal_but_the_peers(tmp_path: Path) -> None:
    done = run("benchmark.py", "--quick", "--peers", "none", "--cores", "1", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert "peers: none" in done.stdout
    rows = json.loads((tmp_path / "ratios.json").read_text())["rows"]
    assert [row["comparison"] for row in rows] == [goal.title for goal in GOALS]
    absent = [row["comparison"] for row in rows if row["verdict"] == "not measured"]
    assert absent == [
        "rigid: environment steps to EnvPool",
        "rigid: simulated time to EnvPool",
        "rigid: one environment to gymnasium-robotics",
    ]
    assert all(row["measured"] > 0.0 for row in rows if row["verdict"] != "not measured")
    assert all(row["measured"] is None for row in rows if row["verdict"] == "not measured")
    parts = json.loads((tmp_path / "parts.json").read_text())["rows"]
    assert {row["what"] for row in parts} == {"vector step", "one environment", "make train"}
    for name in ("ratios.png", "ratios.svg", "parts.png", "speeds.csv", "benchmark.md"):
        assert (tmp_path / name).stat().st_size > 0


def test_scale_measures_every_axis(tmp_path: Path) -> None:
    done = run("scale.py", "--quick", "--threads", "1", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    with (tmp_path / "cost.csv").open() as file:
        assert file.readline().startswith("# command scale.py")
        rows = list(csv.DictReader(file))
    axes = {row["axis"] for row in rows}
    assert {"environments", "substeps", "boxes", "coins", "threads of 1 environment"} <= axes
    assert all(float(row["us_per_env_step"]) > 0.0 for row in rows)
    goals = json.loads((tmp_path / "goals.json").read_text())["rows"]
    assert [goal["verdict"] != "not measured" for goal in goals] == [True] * 3
    assert (tmp_path / "scale.png").stat().st_size > 0


def test_more_cores_than_there_are_cannot_be_used() -> None:
    done = run("benchmark.py", "--peers", "none", "--cores", "9999")
    assert done.returncode == 1
    assert done.stderr.startswith("error: cores: found 9999; this machine has 1 to")


@pytest.mark.parametrize(
    ("option", "value", "error"),
    [
        ("level", "clasic", "did you mean 'classic'"),
        ("physics", "defaul", "did you mean 'default'"),
        ("lvel", "flat", "did you mean 'level'"),
    ],
)
def test_options_that_no_environment_takes_are_refused_before_anything_is_measured(
    option: str, value: str, error: str
) -> None:
    options = {"level": "flat", "physics": "fast", option: value}
    with pytest.raises((ValueError, TypeError), match=error):
        scale.Task(BRIEF, scale.SIZES, options, 1, 1, 1)
