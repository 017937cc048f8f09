"""A training keeps what its games leave behind in its own directory."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from roller_env.divergence import REPORTS_VARIABLE
from roller_env.training import run
from tests.training.small import small_config


def test_games_that_diverge_in_a_training_are_reported_in_its_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(REPORTS_VARIABLE, raising=False)
    asked_for: list[str] = []

    def learn(*_: Any) -> None:
        asked_for.append(os.environ[REPORTS_VARIABLE])
        raise KeyboardInterrupt

    monkeypatch.setattr(run, "learn", learn)
    with pytest.raises(KeyboardInterrupt):
        run.train(small_config(), tmp_path / "run")
    assert asked_for == [str(tmp_path / "run")]
    assert REPORTS_VARIABLE not in os.environ
