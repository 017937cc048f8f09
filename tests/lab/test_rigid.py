"""What the rigid engine promises, as the laboratory measures it, in a short form."""

from __future__ import annotations

import pytest

from roller_env.lab.rigid.courses import LAWS, REFERENCE, cap_rows, law_rows
from roller_env.lab.rigid.robustness import box_row, level_rows
from roller_env.physics.rigid.law import COULOMB, RELAXED, ContactLaw

LEVELS = ("flat", "bridge", "lift", "gate", "classic")


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
