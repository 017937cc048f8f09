"""How presets are chosen: the measures tell what is known, and presets meet the requirements."""

from __future__ import annotations

import json
import math
import re
import shutil
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.lab.presets import costs, report
from roller_env.lab.presets.errors import (
    Errors,
    course,
    course_paths,
    driving,
    elasticity,
    errors_of,
    friction,
    landing,
    lane,
    movers,
    recordings,
    seams,
    squeeze,
    violations,
)
from roller_env.lab.presets.report import front
from roller_env.lab.presets.settings import FEW, SETTINGS, Setting, set_flag
from roller_env.level import load_level
from roller_env.physics.presets import MUJOCO_PRESETS
from scripts import presets as script

COARSE_HZ = 1920
"""Of the converged model in tests: it is 4e-4 of the way from the published one."""


@pytest.fixture(scope="module", params=MUJOCO_PRESETS)
def of_preset(request: pytest.FixtureRequest) -> tuple[str, Errors]:
    return request.param, errors_of(SETTINGS[request.param], COARSE_HZ)


def test_default_and_accurate_meet_every_requirement_and_fast_all_but_a_lane_of_seams(
    of_preset: tuple[str, Errors],
) -> None:
    name, errors = of_preset
    allowed = {"lane_share"} if name == "fast" else set()
    assert {one.name for one in violations(errors)} == allowed


def test_driving_is_wrong_in_proportion_to_the_step() -> None:
    """The Euler family's lead of h / T, T being the time of an even push."""
    fast, default = (driving(SETTINGS[name])["path"] for name in ("fast", "default"))
    assert fast / default == pytest.approx(2.0, rel=0.05)


def test_rk4_drives_without_the_euler_familys_lead() -> None:
    assert driving(SETTINGS["RK4 1/240"])["path"] < 0.05 * driving(SETTINGS["default"])["path"]


def test_the_pyramidal_cone_bends_a_skid_and_takes_a_third_of_the_friction_at_45_degrees() -> None:
    measured = friction(SETTINGS["pyramidal"])
    assert measured["skid_heading_deg"] > 0.5
    assert measured["friction"] == pytest.approx(0.3 * (1.0 - math.sqrt(0.5)), rel=0.05)
    assert friction(SETTINGS["default"])["skid_heading_deg"] < 1e-6


def test_a_ball_passes_a_deck_once_a_step_takes_its_centre_past_the_middle() -> None:
    """Radius and half the deck are 0.61 m: 36.6 m/s at 1/60 s, or 24 m/s for a whole deck and a
    ball that arrives late; speculative contacts stop it at any speed."""
    plain, speculative = (landing(SETTINGS[name]) for name in ("1/60", "1/60 speculative"))
    assert plain["tunnels_at_m_s"] <= 36.6 + 5.0
    assert plain["fastest_share"] > 1.0
    assert math.isinf(speculative["tunnels_at_m_s"])
    assert speculative["fastest_share"] < 0.5


def test_softer_friction_cures_the_hop_and_costs_the_course() -> None:
    soft, default = SETTINGS["friction ×0.33"], SETTINGS["default"]
    assert friction(soft)["hop_mm"] < 0.2 * friction(default)["hop_mm"]
    assert course(soft, COARSE_HZ)["course"] > 1.5 * course(default, COARSE_HZ)["course"]


def test_contacts_of_one_step_bounce_only_with_the_step_they_were_made_for() -> None:
    assert elasticity(SETTINGS["default"])["elasticity"] < 0.02
    assert elasticity(SETTINGS["1/480, contacts of 1/240"])["elasticity"] > 0.5


def test_a_higher_impedance_smooths_the_seams() -> None:
    before, after = (seams(SETTINGS[name])["seam_mm"] for name in ("impedance 0.99", "default"))
    assert before > 1.0 > 0.2 > after


def test_plate_and_gate_keep_the_levels_speed_with_the_ball_on_them() -> None:
    measured = movers(SETTINGS["default"])
    assert measured["movers"] < 1e-6
    assert measured["ringing"] < 1e-6


def test_euler_rings_at_the_default_step_since_the_servos_are_past_its_limit() -> None:
    """Damping in the actuator: h w must be under 0.828, and it is 200 / 240 = 0.833."""
    assert movers(SETTINGS["Euler"])["ringing"] > 0.01


def test_projected_gauss_seidel_needs_many_sweeps_when_a_gate_presses_the_ball() -> None:
    newton, few, many = (
        squeeze(SETTINGS[name])["squeeze_mm"]
        for name in ("default", "solver PGS", "PGS, 500 iterations")
    )
    assert few > 10.0 * newton
    assert many == pytest.approx(newton, rel=1e-3)


def test_seams_in_a_row_throw_the_ball_at_fewer_speeds_with_smaller_steps() -> None:
    thrown = [lane(SETTINGS[name])["lane_share"] for name in ("1/80", "fast", "default", "1/480")]
    assert thrown[0] > thrown[1] > 0.2
    assert thrown[2] < 0.1
    assert thrown[3] < 0.01


def test_projected_gauss_seidel_leaves_a_ball_thrown_at_more_speeds() -> None:
    assert lane(SETTINGS["fast"])["lane_share"] > lane(SETTINGS["1/120 Newton"])["lane_share"]


def test_too_few_iterations_violate_a_requirement() -> None:
    assert violations(errors_of(SETTINGS["iterations 1"], COARSE_HZ))


def test_a_recorded_course_is_the_same_every_time() -> None:
    recorded = recordings()
    recordings.cache_clear()
    for before, after in zip(recorded, recordings(), strict=True):
        for one, other in zip(before, after, strict=True):
            np.testing.assert_array_equal(one, other)
    some = course_paths(SETTINGS["fast"])
    np.testing.assert_array_equal(course_paths(SETTINGS["fast"]), some)


def test_recorded_courses_reach_the_plate_and_let_it_sink() -> None:
    plate = SETTINGS["default"].compile(load_level("classic")).plate_ctrl
    assert any((ctrl[:, plate] < 0.0).any() for _, ctrl in recordings())


@pytest.mark.parametrize("name", ["speculative", "sleep", "island", "midphase"])
def test_a_flag_can_be_turned_on_and_off(name: str) -> None:
    option = mujoco.MjSpec().option
    seen = []
    for on in (True, False, True):
        set_flag(option, name, on)
        seen.append((int(option.enableflags), int(option.disableflags)))
    assert seen[0] == seen[2] != seen[1]


def test_contacts_can_be_kept_while_the_step_changes() -> None:
    level = load_level("classic")
    kept, own, default = (
        SETTINGS[name].compile(level).model
        for name in ("1/480, contacts of 1/240", "1/480", "default")
    )
    assert kept.opt.timestep == own.opt.timestep == 1 / 480
    np.testing.assert_array_equal(kept.geom_solref, default.geom_solref)
    assert not np.array_equal(own.geom_solref, default.geom_solref)


def test_a_setting_that_changes_nothing_is_the_product() -> None:
    level = load_level("gate")
    model = Setting("default", "").compile(level).model
    from_product = SETTINGS["default"].compile(level).model
    np.testing.assert_array_equal(model.geom_solref, from_product.geom_solref)
    assert model.opt.disableflags == from_product.opt.disableflags


points = st.dictionaries(
    st.text(min_size=1), st.tuples(st.floats(0.0, 1e3), st.floats(0.0, 1e3)), max_size=12
)


@given(points)
def test_nothing_beats_what_is_on_the_front_and_something_beats_the_rest(
    points: dict[str, tuple[float, float]],
) -> None:
    best = front(points)
    assert best or not points
    for name, (x, y) in points.items():
        beaten = any(
            a <= x and b <= y and (a < x or b < y) for other, (a, b) in points.items() if other
        )
        assert beaten != (name in best)


def test_what_the_compiler_leaves_out_does_not_change_the_way_of_the_ball() -> None:
    rows = {
        row.what: row
        for row in costs.ablations(rounds=1, boxes=(200,), games=2).itertuples()
        if not row.boxes
    }
    same = ("explicit pairs", "coins as geoms", "coins as sites", "midphase on", "fixed geoms")
    for what, row in rows.items():
        if what.startswith(same):
            assert row.same_bits, what
    cells = rows["every floor cell a geom"]
    assert cells.geoms > 3 * rows[costs.AS_CHOSEN].geoms


def test_the_script_leaves_tables_and_charts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    script.main(script.Arguments(quick=True, only=("default", "1/60"), out=tmp_path))
    said = capsys.readouterr().out
    assert re.search(r"default: 0\.\d+ % of the way .* meets every requirement", said)
    for name in ("front", "requirements", "ablations"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
        assert (tmp_path / f"{name}.svg").exists()
    document = json.loads((tmp_path / "settings.json").read_text(encoding="utf-8"))
    rows = {row["setting"]: row for row in document["rows"]}
    assert "landing at 36 m/s" in rows["1/60"]["violations"]
    assert rows["default"]["front"] is True
    assert "mujoco" in document["provenance"]
    assert "| **default** |" in (tmp_path / "presets.md").read_text(encoding="utf-8")


def test_a_measured_page_replaces_the_one_in_the_documentation(tmp_path: Path) -> None:
    out, docs = tmp_path / "out", tmp_path / "docs"
    (docs / "images").mkdir(parents=True)
    out.mkdir()
    (out / "presets.md").write_text("measured\n", encoding="utf-8")
    for name in ("front", "requirements", "ablations"):
        (out / f"{name}.png").write_bytes(name.encode())
    published = Path(__file__).parents[2] / "docs" / "presets.md"
    shutil.copyfile(published, docs / "presets.md")
    changed = report.publish(out, docs)
    assert (docs / "images" / "presets-requirements.png").read_bytes() == b"requirements"
    text, before = (docs / "presets.md").read_text("utf-8"), published.read_text("utf-8")
    assert re.search(r"-->\n\nmeasured\n\n<!--", text)
    assert text.partition("<!--")[0] == before.partition("<!--")[0]
    assert changed == [docs / "presets.md", *sorted((docs / "images").iterdir(), key=changed.index)]
    assert report.publish(out, docs) == changed
    assert (docs / "presets.md").read_text("utf-8") == text, "again changes nothing"


def test_documentation_without_a_place_for_the_tables_is_refused(tmp_path: Path) -> None:
    (tmp_path / "presets.md").write_text("# Presets\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"presets\.md: must have one line '<!-- measured"):
        report.publish(tmp_path, tmp_path)


@pytest.mark.parametrize("less", [{"quick": True}, {"only": ("default",)}])
def test_less_than_all_settings_are_not_published(tmp_path: Path, less: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="--docs: publishes all settings"):
        script.main(script.Arguments(docs=tmp_path, **less))


def test_an_unknown_setting_is_refused_with_the_nearest_one() -> None:
    with pytest.raises(ValueError, match=r"no setting 'defualt'.*did you mean 'default'"):
        script.main(script.Arguments(only=("defualt",)))


def test_the_quick_settings_exist() -> None:
    assert set(FEW) <= SETTINGS.keys()
