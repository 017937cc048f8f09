"""What each engine promises, as the laboratory measures it, in a short form."""

from __future__ import annotations

import math
import re
import shutil
from pathlib import Path

import pytest

from roller_env.lab.engines import agreement, report, speed
from roller_env.lab.engines.cases import CASES, Case, readings
from roller_env.lab.engines.courses import LAWS, REFERENCE, cap_rows, law_rows
from roller_env.lab.engines.curves import catalogue
from roller_env.lab.engines.robustness import box_row, level_rows
from roller_env.physics.presets import PRESETS, RIGID, PhysicsPreset
from roller_env.physics.rigid.law import COULOMB, RELAXED, ContactLaw
from scripts import engines as script

LEVELS = ("flat", "bridge", "lift", "gate", "classic")

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_a_rigid_ball_does_what_the_textbook_says(case: Case) -> None:
    lowest, highest = readings(case, RIGID)
    if math.isinf(case.exact):
        assert lowest == highest == math.inf
        return
    # Bounces end in hops of 1e-3 m/s; a skid's time is read from steps between which it is even.
    near = 1e-6 if case.kind == "Impacts" else 1e-9
    assert lowest == pytest.approx(case.exact, abs=near)
    assert highest == pytest.approx(case.exact, abs=near)


@pytest.mark.parametrize(
    ("case", "preset", "low", "high"),
    [
        ("elasticity 0.2, dropped 0.1 m", "default", 0.0, 0.22),
        ("elasticity 0.2, dropped 0.1 m", "accurate", 0.03, 0.06),
        ("elasticity 0.8, arriving at (4, -4): speed along", "default", 1.85, 1.98),
        ("elasticity 0.8, arriving at (4, -4): speed along", "accurate", 3.5, 3.65),
        ("elasticity 0, arriving at (8, -2)", "default", 0.9, 1.4),
        ("skid at 4 m/s, friction 2", "default", 1.6, 1.9),
        ("rolls at 4 m/s into a wall without friction", "default", 0.85, 0.95),
        ("W for 3 s, ball of 0.1 kg", "default", 6.0, 8.0),
        ("W for 3 s, ball of 0.1 kg", "accurate", 2.5, 3.5),
    ],
)
def test_what_mujoco_makes_of_it_is_as_the_docs_say(
    case: str, preset: str, low: float, high: float
) -> None:
    (own,) = [each for each in CASES if each.name.startswith(case)]
    lowest, highest = readings(own, PRESETS[preset])
    assert low <= lowest <= highest <= high


def test_curved_motions_are_of_the_fourth_order_in_the_cap() -> None:
    for curve in catalogue():
        coarse, usual = curve.error(1 / 60), curve.error(1 / 120)
        assert usual < 2e-8, curve.name
        assert coarse < report.EXACT_M or math.log2(coarse / usual) > 3.0, curve.name


def test_on_a_face_mujoco_approaches_the_rigid_ball() -> None:
    coarse, fine = (
        PhysicsPreset(f"RK4 1/{hz}", 1 / hz, "RK4", iterations=100, tolerance=1e-14)
        for hz in (960, 3840)
    )
    far, near = (agreement.row("gate", preset, 16, 1.0) for preset in (coarse, fine))
    assert far.balls == near.balls == 16
    assert near.worst_m < 1e-6
    assert near.worst_rad < 3e-6
    assert near.worst_m < far.worst_m / 4.0


def test_relaxed_is_where_mujoco_is_and_what_is_left_has_its_causes() -> None:
    rows = {row.one: row for row in law_rows(["classic"], count=16, references=[REFERENCE])[:4]}
    coulomb, plastic, preset, rk4 = (rows[law].mean for law in LAWS)
    assert preset < 3e-4
    assert coulomb > 2.0 * plastic > 2.0 * preset > 2.0 * rk4 / 1.5


@pytest.mark.parametrize("law", [COULOMB, RELAXED])
def test_no_step_is_forced_and_no_ball_is_in_anything(law: ContactLaw) -> None:
    for row in (*level_rows(LEVELS, 20_000, 100, law), box_row(20, law)):
        assert row.forced == row.unsolved == 0, row
        assert row.depth_m < (1e-6 if row.scene == "turned boxes" else 1e-7), row
        assert row.gained_j < 1e-7, row


def test_a_finer_cap_changes_next_to_nothing() -> None:
    for row in cap_rows(LEVELS, count=64):
        assert row.median < 1e-6, row
        assert row.mean < 3e-5, row


def test_the_rigid_engine_is_many_times_cheaper_than_mujoco() -> None:
    points = {point.preset: point for point in speed.points(8, 3, 64, report.QUICK.reference, ())}
    assert points["default"].ms_per_s > 20.0 * points["rigid"].ms_per_s
    assert points["default"].ms_per_s > 20.0 * points["relaxed"].ms_per_s
    assert points["rigid"].from_rigid < 1e-6


def test_the_script_writes_tables_and_a_chart_and_brings_the_docs_up_to_date(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    script.main(script.Arguments(quick=True, out=tmp_path / "run"))
    assert "a second of rigid costs 1/" in capsys.readouterr().out
    shutil.copytree(DOCS, tmp_path / "docs", ignore=shutil.ignore_patterns("api", "results"))
    report.publish(tmp_path / "run", tmp_path / "docs")
    page = (tmp_path / "docs" / "engines.md").read_text(encoding="utf-8")
    measured = (tmp_path / "run" / "engines.md").read_text(encoding="utf-8")
    assert measured in page.partition(report.COMMAND)[2]
    assert all(case.name in measured for case in CASES)


def test_the_docs_have_every_case() -> None:
    page = (DOCS / "engines.md").read_text(encoding="utf-8")
    assert re.search(r"command engines\.py --docs docs", page)
    for case in CASES:
        assert f"| {case.name}" in page


def test_quick_results_do_not_get_into_the_docs() -> None:
    with pytest.raises(ValueError, match="publishes full runs"):
        script.main(script.Arguments(quick=True, docs=DOCS))
