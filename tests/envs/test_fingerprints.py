"""An id stands for the same game for ever; what is another game has another version."""

from __future__ import annotations

import copy
import inspect
import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest
from gymnasium.envs.registration import load_env_creator, registry

from roller_env.lab import fingerprints
from roller_env.level import load_level
from scripts import fingerprints as command

REMEDY = "python scripts/fingerprints.py says what to do"


@pytest.fixture(scope="module")
def known() -> dict[str, Any]:
    kept: dict[str, Any] = json.loads(fingerprints.FILE.read_text(encoding="utf-8"))
    return kept


def test_every_id_is_the_game_that_it_was(known: dict[str, Any]) -> None:
    changed = fingerprints.differences(known, fingerprints.fingerprints())
    assert changed == [], REMEDY


def test_a_ball_that_is_a_thousandth_heavier_makes_another_game(known: dict[str, Any]) -> None:
    level = load_level("flat")
    ball = level.ball.model_copy(update={"mass_kg": level.ball.mass_kg * 1.001})
    changed = level.model_copy(update={"ball": ball})
    own = known["ids"]["Roller/Flat-v0"]["games"]["rigid"]
    actions, dt_s = fingerprints.played("flat")
    options = dict(fingerprints.ASKED["rigid"], physics="rigid", control_dt_s=dt_s)
    same = fingerprints.game("Roller/Flat-v0", actions, **options)
    other = fingerprints.game("Roller/Flat-v0", actions, level=changed, **options)
    assert fingerprints.differences(own, same) == []
    assert fingerprints.differences(own, other)


def test_a_change_is_told_by_the_name_of_what_has_changed(known: dict[str, Any]) -> None:
    now = copy.deepcopy(known)
    now["presets"]["fast"]["dt_s"] = 0.01
    now["ids"]["Roller/Ice-v0"]["level"] = "other"
    del now["ids"]["Roller/Lava-v0"]
    told = fingerprints.differences(known, now)
    assert told[0] == "presets, fast, dt_s: 0.00833333333 before, 0.01 now"
    assert told[1].startswith("ids, Roller/Ice-v0, level: ")
    assert told[2].startswith("ids, Roller/Lava-v0: ")
    assert told[2].endswith(" before, nothing now")


def test_the_command_keeps_new_ids_and_refuses_a_known_one_that_changed(
    known: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, before = tmp_path / "fingerprints.json", copy.deepcopy(known)
    del before["ids"]["Roller/Lava-v0"]
    file.write_text(json.dumps(before))
    monkeypatch.setattr(fingerprints, "fingerprints", lambda: known)
    command.main(command.Arguments(file=file))
    assert json.loads(file.read_text()) == known
    changed = copy.deepcopy(known)
    changed["ids"]["Roller/Ice-v0"]["level"] = "other"
    monkeypatch.setattr(fingerprints, "fingerprints", lambda: changed)
    with pytest.raises(SystemExit, match=r"^ids, Roller/Ice-v0, level: .*\n\nbump the version: "):
        command.main(command.Arguments(file=file))
    assert json.loads(file.read_text()) == known
    command.main(command.Arguments(file=file, unreleased=True))
    assert json.loads(file.read_text()) == changed


def test_every_version_of_every_id_is_in_the_history_of_its_class() -> None:
    specs = [spec for name, spec in registry.items() if name.startswith("Roller/")]
    assert len(specs) > 20
    for spec in specs:
        for entry_point in (spec.entry_point, spec.vector_entry_point):
            assert isinstance(entry_point, str)
            history = inspect.getdoc(load_env_creator(entry_point)) or ""
            _, _, history = history.partition("Version history:")
            assert f"v{spec.version}:" in history, (spec.id, entry_point)
    assert gym.spec("Roller/Classic-v0") in specs
