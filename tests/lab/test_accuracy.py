"""The accuracy script: its answers, its charts, its files, and what it refuses."""

from __future__ import annotations

import csv
import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from roller_env.lab.accuracy import (
    QUICK,
    QUICK_SCENES,
    SCENES,
    Results,
    accurate_steps,
    cheapest,
    page,
    run,
    scenes_named,
    time_steps,
    write,
)
from roller_env.lab.chart import COLOURS, duration
from roller_env.lab.free import DRAG, FREE_SCENES, FreeScene
from roller_env.lab.methods import FREE
from roller_env.lab.scene import pareto
from roller_env.lab.table import Frame, frame

ROOT = Path(__file__).parents[2]


Point = dict[str, Any]


def point(method: str, dt_s: float, error: float, wall: float, *, failed: bool = False) -> Point:
    return {
        "scene": "scene",
        "method": method,
        "measure": "error",
        "kind": "discretisation",
        "dt_s": dt_s,
        "error": error,
        "failed": failed,
        "cpu_s_per_s": wall,
        "cpu_spread": 0.1,
        "evaluations_per_s": 1.0 / dt_s,
    }


def rows(table: Frame) -> list[Any]:
    return list(table.itertuples())


SLOW_AND_GOOD = [point("good", 0.1, 1e-4, 1e-2), point("good", 0.01, 1e-8, 1e-1)]
FAST_AND_BAD = [point("bad", 0.1, 5e-2, 1e-4), point("bad", 0.01, 5e-4, 1e-3)]


# --- answers ---------------------------------------------------------------------------------


def test_the_cheapest_method_depends_on_the_error_that_is_allowed() -> None:
    by_wall = {
        one.tolerance: one
        for one in rows(cheapest(frame([*SLOW_AND_GOOD, *FAST_AND_BAD])))
        if one.cost == "CPU time"
    }
    assert (by_wall[1e-3].method, by_wall[1e-3].dt_s) == ("bad", 0.01)
    assert (by_wall[1e-6].method, by_wall[1e-6].dt_s) == ("good", 0.01)
    assert by_wall[1e-6].times_real_time == pytest.approx(10.0)
    assert (by_wall[1e-9].method, by_wall[1e-9].also) == ("", "")


def test_a_cost_that_no_clock_can_tell_apart_is_a_tie() -> None:
    twin = [
        one | {"method": "twin", "cpu_s_per_s": 1.1 * one["cpu_s_per_s"]} for one in FAST_AND_BAD
    ]
    found = rows(cheapest(frame([*FAST_AND_BAD, *twin])))
    assert {one.also for one in found if one.tolerance == 1e-3} == {"twin"}


def test_a_large_step_that_is_right_by_luck_is_not_accurate() -> None:
    lucky = [
        point("lucky", 0.1, 1e-9, 1e-4),
        *(one | {"method": "lucky"} for one in FAST_AND_BAD[1:]),
    ]
    (found,) = rows(accurate_steps(frame([*lucky, point("lucky", 0.05, 0.5, 2e-4)])))
    assert found.largest_dt_s == 0.01
    assert found.first_failing_dt_s == math.inf
    assert all(
        one.method != "lucky" for one in rows(cheapest(frame(lucky))) if one.tolerance == 1e-9
    )


def test_a_step_beyond_a_failing_one_is_luck() -> None:
    curve = [
        point("some", 0.4, 1e-3, 1e-4),
        point("some", 0.2, 30.0, 2e-4, failed=True),
        point("some", 0.1, 1e-3, 4e-4),
    ]
    (found,) = rows(accurate_steps(frame(curve)))
    assert (found.largest_dt_s, found.first_failing_dt_s) == (0.1, 0.2)
    assert pareto(frame(curve), "cpu_s_per_s").dt_s.tolist() == [0.1]


def test_an_error_that_is_no_number_is_a_failure() -> None:
    curve = [point("some", 0.2, math.nan, 1.0), point("some", 0.1, 1e-3, 1.0)]
    (found,) = rows(accurate_steps(frame(curve)))
    assert found.first_failing_dt_s == 0.2


def test_nothing_on_the_pareto_front_is_beaten_and_everything_off_it_is() -> None:
    every = [*SLOW_AND_GOOD, *FAST_AND_BAD, point("worse", 0.1, 6e-2, 2e-4)]
    front = pareto(frame(every), "cpu_s_per_s")
    assert front.method.tolist() == ["bad", "bad", "good", "good"]
    for number, one in enumerate(every):
        beaten = any(
            other["error"] < one["error"] and other["cpu_s_per_s"] < one["cpu_s_per_s"]
            for other in every
        )
        assert beaten != (number in front.index)


def test_exact_is_exact_however_many_digits_more_a_dearer_step_has() -> None:
    exact = [point("one", 0.1, 5e-15, 1e-3), point("other", 0.1, 1e-16, 1e-2)]
    assert pareto(frame(exact), "cpu_s_per_s").method.tolist() == ["one"]


# --- what is run -----------------------------------------------------------------------------


def test_every_scene_has_its_name_and_every_method_its_colour() -> None:
    names = [scene.name for scene in SCENES]
    assert len(set(names)) == len(names)
    assert set(QUICK_SCENES) <= set(names)
    assert {method.name for method in FREE} <= set(COLOURS)


def test_an_unknown_scene_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ValueError, match=r"no scene 'complx-box': .* did you mean 'complex-box'"):
        scenes_named(["drag", "complx-box"])


def test_scenes_come_as_they_are_named_and_all_of_them_when_none_is() -> None:
    assert [one.name for one in scenes_named(["drag", "push", "drag"])] == ["drag", "push"]
    assert scenes_named([]) == list(SCENES)


def test_every_free_scene_has_enough_time_steps_when_quick() -> None:
    for scene in scenes_named([one.name for one in FREE_SCENES], QUICK):
        assert isinstance(scene, FreeScene)
        assert scene.horizon_s == 1.0
        for method in scene.methods:
            assert time_steps(scene, method, QUICK), (scene.name, method.name)


def test_a_time_step_is_written_with_its_unit() -> None:
    written = [duration(dt) for dt in (2.0, 0.5, 0.001, 1e-4, 2e-6)]
    assert written == ["2 s", "500 ms", "1 ms", "100 µs", "2 µs"]


# --- files -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def quick() -> Results:
    return run(scenes_named(["drag", "push"], QUICK), replace(QUICK, repeats=1))


@pytest.fixture(scope="module")
def files(quick: Results, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("accuracy")
    write(quick, out)
    return out


def test_there_is_a_chart_for_each_kind_of_error_and_never_both_in_one(files: Path) -> None:
    for name in ("drag-discretisation", "push-discretisation", "push-model"):
        assert (files / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert "<svg" in (files / f"{name}.svg").read_text(encoding="utf-8")
    assert not (files / "drag-model.png").exists()


def test_the_tables_hold_every_point_with_its_provenance(quick: Results, files: Path) -> None:
    document = json.loads((files / "points.json").read_text(encoding="utf-8"))
    assert {"machine", "mujoco", "numpy", "python", "command"} <= set(document["provenance"])
    assert len(document["rows"]) == len(quick.points)
    first, *rest = (files / "points.csv").read_text(encoding="utf-8").splitlines()
    assert first.startswith("# command")
    rows = list(csv.DictReader(rest))
    tried = {(row["scene"], row["method"], float(row["dt_s"])) for row in rows}
    for scene in quick.scenes:
        for method in scene.methods:
            for dt_s in time_steps(scene, method, QUICK):
                assert (scene.name, method.name, dt_s) in tried


def test_the_page_answers_the_readers_questions(quick: Results, files: Path) -> None:
    text = (files / "accuracy.md").read_text(encoding="utf-8")
    assert "# Orders" in text
    assert "MuJoCo RK4" in text
    for tolerance in ("1e-03", "1e-06", "1e-09"):
        assert tolerance in text
    assert "Not as theory expects" not in text
    assert page(quick, {"machine": "here"}).startswith("# Accuracy against cost\n\nmachine here")


def test_a_chart_shows_only_its_own_scenes_points(quick: Results) -> None:
    plot = quick.charted("discretisation")["drag"]
    own = quick.points[(quick.points.scene == "drag") & (quick.points.measure == "position")]
    shown = {error for curve in plot.curves().values() for error in curve.error}
    assert shown
    assert shown <= set(own[~own.failed].error)
    assert plot.limits_s == DRAG.limits_s


def test_a_wrong_command_line_is_refused_before_anything_runs(tmp_path: Path) -> None:
    script = str(ROOT / "scripts" / "accuracy.py")
    command = [sys.executable, script, "--out", str(tmp_path), "--scene", "brag"]
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    assert result.returncode != 0
    assert result.stderr.startswith("error: no scene 'brag': there are")
    assert list(tmp_path.iterdir()) == []
