"""The experiment of generalisation keeps what it has, and never judges on levels it learnt on."""

from __future__ import annotations

from pathlib import Path

import pandas

from roller_env.lab.generalisation import NUMBERS, TESTED, UNSEEN, levels_from
from scripts import generalise as script


def test_unseen_levels_are_none_of_those_learnt_on() -> None:
    assert max(NUMBERS) < UNSEEN
    known = {level.model_dump_json(exclude={"name", "title"}) for level in levels_from(0, 50)}
    assert not known & {
        level.model_dump_json(exclude={"name", "title"}) for level in levels_from(UNSEEN, TESTED)
    }


def test_the_script_goes_on_where_it_was_stopped(tmp_path: Path) -> None:
    file = tmp_path / "generalise.csv"
    script.main(script.Arguments(quick=True, out=file))
    first = file.read_text()
    script.main(script.Arguments(quick=True, out=file))
    assert file.read_text() == first
    rows = pandas.read_csv(file)
    assert rows.levels.tolist() == list(NUMBERS[:2])
    assert rows[["known_finish", "unseen_finish"]].stack().between(0.0, 1.0).all()
    assert file.with_suffix(".png").stat().st_size > 0
