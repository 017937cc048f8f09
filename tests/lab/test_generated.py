"""The table of generated levels goes on where it was stopped."""

from __future__ import annotations

from pathlib import Path

import pandas
import pytest

from roller_env.lab import generated
from roller_env.level.generate import LATEST
from scripts import generated as script


def test_the_script_goes_on_where_it_was_stopped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(generated, "GAMES", 3)
    file = tmp_path / "generated.csv"
    generated.run(file, 1, LATEST, (0.0,))
    (first,) = file.read_text().splitlines()[1:]
    script.main(script.Arguments(quick=True, out=file))
    rows = pandas.read_csv(file)
    assert file.read_text().splitlines()[1] == first
    assert rows.difficulty.tolist() == [0.0, 0.25]
    assert (rows.attempts >= 1).all()
    assert (rows.solids > 3).all()
    table = capsys.readouterr().out
    assert "won at the first attempt" in table
    assert len(table.strip().splitlines()) == 4
