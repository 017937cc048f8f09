"""What fails, what cures it, and what the game's own pieces do to the ball."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import mujoco
import pytest

from roller_env.compile.compiled import compile_level
from roller_env.lab.game import (
    GATE_SPEED_M_S,
    GRAVITY_M_S2,
    PLATE_SPEED_M_S,
    RADIUS_M,
    THROUGH_M,
    Course,
    play,
)
from roller_env.lab.stability import failures, hard_cases, run
from roller_env.lab.stability.failures import FAILURES, hanging_gate_level
from roller_env.lab.stability.hard_cases import HARD_CASES, READERS, REQUIREMENTS
from roller_env.lab.stability.limits import FULL, QUICK, WORDS
from roller_env.lab.stability.run import CASES
from roller_env.lab.table import frame
from roller_env.physics.presets import MUJOCO_PRESETS
from roller_env.units import quants

KNOWN_TO_FAIL = {
    ("lane_of_seams", "fast", "greatest bump, mm"),
    ("lane_of_seams", "fast", "speed lost on the way, %"),
    ("skidding", "fast", "hop at 4 m/s of slip, mm"),
    ("skidding", "default", "hop at 4 m/s of slip, mm"),
}
"""Case, preset and reading, with more starts than a test has; each case's note has the reason."""


@pytest.mark.parametrize("name", HARD_CASES)
def test_a_hard_case_of_the_game_is_within_what_is_acceptable(name: str) -> None:
    found = hard_cases.rows(name, QUICK)
    assert {row["preset"] for row in found} == set(MUJOCO_PRESETS)
    failing = {
        (row["case"], row["preset"], row["quantity"]) for row in found if row["verdict"] == "fails"
    }
    assert failing <= KNOWN_TO_FAIL


def test_what_is_known_to_fail_has_a_note() -> None:
    noted = set(REQUIREMENTS.case[REQUIREMENTS.note != ""])
    assert noted >= {case for case, _, _ in KNOWN_TO_FAIL}


def test_every_hard_case_has_requirements_that_can_be_read() -> None:
    assert list(REQUIREMENTS.case.unique()) == list(HARD_CASES)
    assert set(REQUIREMENTS.quantity) == set(READERS)
    assert REQUIREMENTS.reason.all()


def test_requirements_that_follow_from_the_games_numbers_do() -> None:
    """Half a deck deep the centre is through; a slab at v may lift the ball by v²/2g, and 1 mm."""
    limits = REQUIREMENTS.set_index(["case", "quantity"]).limit
    depth, gain = "deepest contact, mm", "energy gained, as height, mm"
    for case in ("landing_from_the_tube", "gate_closing_on_the_ball"):
        assert limits[case, depth] == pytest.approx(1e3 * THROUGH_M)
    assert limits["riding_a_sinking_gate", depth] == pytest.approx(1e3 * RADIUS_M / 10)
    for case, slab in (
        ("riding_a_sinking_gate", GATE_SPEED_M_S),
        ("pressed_to_a_sinking_gate", GATE_SPEED_M_S),
        ("wedged_between_gate_and_wall", GATE_SPEED_M_S),
        ("plate_sinking_under_the_ball", PLATE_SPEED_M_S),
        ("landing_from_the_tube", 0.0),
    ):
        assert limits[case, gain] == pytest.approx(1.0 + 1e3 * slab**2 / (2.0 * GRAVITY_M_S2))
    assert limits["lane_of_seams", "greatest bump, mm"] == pytest.approx(1e3 * quants(1.0))


@pytest.mark.parametrize("name", FAILURES)
def test_a_failure_fails_and_its_cures_cure_it(name: str) -> None:
    found, curves = failures.rows(name, repeats=1)
    assert [float(series.max()) for _, series in curves] == [row["value"] for row in found]
    assert [row["role"] for row in found] == ["fails", *["cures"] * (len(found) - 1)]
    assert [row["verdict"] for row in found] == ["fails", *["holds"] * (len(found) - 1)]
    assert found[0]["time_ratio"] == found[0]["evaluations_ratio"] == 1.0
    assert all(row["time_ratio"] > 0.0 for row in found)


def test_the_game_experiments_see_every_step_and_no_step_that_they_cause() -> None:
    """Looking at the contacts between two steps changes nothing."""
    compiled = compile_level(hanging_gate_level(0.4), "fast")
    course = Course(compiled, (0.1, 0.0, 0.4064), force_n=(1.0, 2.0, 0.0), movers_m_s=-0.8)
    seen = play(course, 1.0)
    data = mujoco.MjData(compiled.model)
    course.prepare(data)
    mujoco.mj_step(compiled.model, data, len(seen.time_s) - 1)
    assert seen.position[-1].tolist() == data.qpos[course.ball].tolist()
    assert seen.finite
    assert seen.depth.max() > 0.0


def test_a_falling_ball_keeps_its_energy() -> None:
    compiled = compile_level(hanging_gate_level(0.4), "accurate")
    seen = play(Course(compiled, (50.0, 0.0, 30.0), (3.0, 0.0, 4.0), spin=(1.0, 2.0, 3.0)), 1.0)
    assert seen.energy == pytest.approx(seen.energy[0], rel=1e-9)


# The script's side ---------------------------------------------------------------------------


def test_without_names_everything_is_selected() -> None:
    assert run.select((), FULL) == [
        *(("limits", name) for name in CASES),
        *(("failures", name) for name in FAILURES),
        *(("hard_cases", name) for name in HARD_CASES),
    ]


def test_a_quick_run_leaves_out_slow_limits_unless_they_are_named() -> None:
    slow = next(name for name, words in WORDS.items() if not words["quick"])
    assert ("limits", slow) not in run.select((), QUICK)
    assert ("limits", slow) not in run.select((WORDS[slow]["group"],), QUICK)
    assert run.select((slow,), QUICK) == [("limits", slow)]


def test_a_name_that_is_a_group_and_a_failure_means_both() -> None:
    selection = run.select(("tunnelling",), QUICK)
    assert ("failures", "tunnelling") in selection
    assert ("limits", "tunnelling_2ms") in selection
    assert {section for section, _ in selection} == {"limits", "failures"}


@pytest.mark.parametrize(
    ("wrong", "near"),
    [("tunneling", "tunnelling"), ("hard-cases", "hard_cases"), ("servo_rk4_2", "servo_rk4_1")],
)
def test_an_unknown_name_is_refused_with_the_nearest(wrong: str, near: str) -> None:
    with pytest.raises(ValueError, match=f"no case '{wrong}'.*did you mean '{near}'"):
        run.select((wrong,), QUICK)


def test_results_are_written_as_tables_and_pictures(tmp_path: Path) -> None:
    names = ("spin_aliasing_lie_rk4", "servo_discrete_1", "hop_240hz", "bent_heading", "skidding")
    selection = run.select(names, QUICK)
    seen: list[str] = []

    def wrap(all_names: Sequence[str]) -> Iterable[str]:
        seen.extend(all_names)
        return seen

    results = run.run(selection, QUICK, wrap)
    assert seen == [
        "limits/servo_discrete_1",
        "limits/spin_aliasing_lie_rk4",
        "limits/hop_240hz",
        "failures/bent_heading",
        "hard_cases/skidding",
    ]
    written = run.write(results, {"machine": "a test's"}, tmp_path)
    assert all(path.stat().st_size > 0 for path in written)
    assert {path.name for path in (tmp_path / "pictures").iterdir()} == {
        f"{name}.{suffix}"
        for name in ("bent_heading", "limits", "hard_cases")
        for suffix in ("png", "svg")
    }
    document = json.loads((tmp_path / "limits.json").read_text())
    assert document["provenance"] == {"machine": "a test's"}
    # None where there is no limit: strict JSON has no infinity.
    assert [row["measured"] is None for row in document["rows"]] == [True, False, False]
    lines = (tmp_path / "hard_cases.csv").read_text().splitlines()
    assert lines[0].startswith("# machine")
    table = list(csv.DictReader(lines[1:]))
    assert {row["preset"] for row in table} == {"fast", "default", "accurate"}
    assert "none to 20" in (tmp_path / "limits.md").read_text()
    assert "**" in (tmp_path / "hard_cases.md").read_text(), "what is too much is bold"


def test_the_summary_names_what_does_not_hold() -> None:
    results = run.Results({"hard_cases": frame(hard_cases.rows("skidding", QUICK))}, {})
    (line,) = run.summary(results)
    assert "13 of 15" in line
    assert "skidding (default, hop at 4 m/s of slip, mm)" in line
