"""`roller level`: what is wrong with levels, pictures of them, and one to begin with."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path
from typing import get_args

import mujoco
import pytest

from roller_env.cli.level import Preset, look, main, saves
from roller_env.compile.compiled import level_mjcf
from roller_env.level import level_json_schema, load_level
from roller_env.physics.presets import PRESETS
from roller_env.replay import load_replay
from tests.level.samples import SMALL

ROOT = Path(__file__).parents[2]
HIGH = SMALL + "coins: [{at: [0, 0, 400]}]\n"
BROKEN = SMALL.replace("[500, 0, 16]", "[500, 0]") + "coins: [{at: 3}]\n"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in {"good": SMALL, "high": HIGH, "broken": BROKEN}.items():
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    return tmp_path


def test_shipped_levels_pass_the_check(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "flat", "gate", "--strict"]) == 0
    assert capsys.readouterr().out == ""


def test_all_that_is_wrong_with_all_files_is_said_in_lines_that_editors_read(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = ["broken.yaml", "high.yaml", "good.yaml", "none.yaml", "broken.yaml"]
    assert main(["check", *files]) == 1
    captured = capsys.readouterr()
    lines = captured.out.splitlines()
    broken = [
        "broken.yaml:4:14: error: finish.at: found a list of 2; allowed: a list of 3 numbers",
        "broken.yaml:7:14: error: coins[0].at: found 3; allowed: a list of 3 numbers",
    ]
    assert lines[:2] == broken
    assert lines[2].startswith("high.yaml:7:9: warning: coins[0]: the coin at [0, 0, 400] is out")
    assert lines[3].startswith("none.yaml: error: there is no such file")
    assert lines[4:] == broken
    assert captured.err == "5 levels: 5 errors, 1 warning\n"


def test_a_warning_is_an_error_only_where_one_asks_for_that(here: Path) -> None:
    assert main(["check", "high.yaml"]) == 0
    assert main(["check", "high.yaml", "--strict"]) == 1


def test_what_loading_a_level_warns_of_is_told_too_and_once(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("void.yaml").write_text(SMALL.replace("at: [0, 0, 16]", "at: [0, 900, 16]"))
    assert main(["check", "void.yaml"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith("void.yaml:3:13: warning: start.at: nothing is under the middle")


def test_nothing_to_check_is_no_success(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check"]) == 1
    assert capsys.readouterr().err == "error: no level is named; say which to check\n"


def test_a_new_level_loads_and_passes_the_check(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", "mine.yaml"]) == 0
    assert load_level("mine.yaml").name == "mine"
    assert main(["check", "mine.yaml", "--strict"]) == 0
    before = Path("mine.yaml").read_bytes()
    assert main(["new", "mine.yaml"]) == 1
    assert "which is not overwritten" in capsys.readouterr().err
    assert Path("mine.yaml").read_bytes() == before


@pytest.mark.parametrize("name", ["mine.txt", "1st.yaml", "a b.yaml"])
def test_a_name_that_no_level_can_have_is_refused_and_no_file_is_made(
    here: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", name]) == 1
    assert name in capsys.readouterr().err
    assert not Path(name).exists()


def test_a_map_is_drawn_beside_and_its_name_must_be_a_picture_s(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["draw", "good.yaml"]) == 0
    assert Path("small.png").read_bytes().startswith(b"\x89PNG")
    assert main(["draw", "good.yaml", "-o", "small.yaml"]) == 1
    assert "the name must end in .png" in capsys.readouterr().err


@pytest.mark.usefixtures("opengl")
def test_an_overview_is_drawn(here: Path) -> None:
    assert main(["draw", "flat", "--view", "overview", "-o", "sub/flat.png"]) == 0
    assert Path("sub/flat.png").read_bytes().startswith(b"\x89PNG")


def test_the_schema_is_printed_or_written(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == level_json_schema()
    assert main(["schema", "-o", "schema.json"]) == 0
    assert json.loads(Path("schema.json").read_text()) == level_json_schema()


def test_mjcf_is_what_mujoco_loads_and_what_the_script_writes(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["mjcf", "flat", "-o", "flat.xml", "--physics", "fast"]) == 0
    text = Path("flat.xml").read_text()
    assert text == level_mjcf(load_level("flat"), "fast")
    mujoco.MjModel.from_xml_string(text)
    monkeypatch.setattr(sys, "argv", ["compile_level.py", "flat", "-o", "x.xml", "--physics=fast"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(ROOT / "scripts" / "compile_level.py"), run_name="__main__")
    assert not ended.value.code
    assert Path("x.xml").read_text() == text


def test_a_place_that_cannot_be_written_to_is_told(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["schema", "-o", "nowhere/schema.json"]) == 1
    assert capsys.readouterr().err == "error: nowhere/schema.json: No such file or directory\n"


def test_a_watched_level_is_drawn_and_its_faults_told_on_every_look(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, picture = Path("good.yaml"), Path("good.png")
    look(file, picture, "plan", "default")
    assert picture.exists()
    assert "wrote good.png, 0 warnings" in capsys.readouterr().out
    file.write_text(BROKEN)
    picture.unlink()
    look(file, picture, "plan", "default")
    assert "2 errors\ngood.yaml:4:14: error: finish.at: " in capsys.readouterr().out
    assert not picture.exists()
    file.write_text(HIGH)
    look(file, picture, "plan", "default")
    assert picture.exists()
    assert "good.yaml:7:9: warning: coins[0]: " in capsys.readouterr().out


def test_a_save_is_seen_whether_it_is_written_over_or_put_in_place(here: Path) -> None:
    file = here / "good.yaml"
    seen = saves(file)
    next(seen)
    file.write_text(HIGH)
    next(seen)
    # As an editor that writes aside and then renames: for a moment there is none.
    file.unlink()
    other = here / "aside.yaml"
    other.write_text(SMALL)
    other.replace(file)
    next(seen)


def test_a_save_of_an_included_file_is_seen(here: Path) -> None:
    file, parts = here / "good.yaml", here / "parts.yaml"
    parts.write_text("units: quant\n")
    file.write_text(SMALL + "include: [parts.yaml]\n")
    seen = saves(file)
    next(seen)
    parts.write_text("units: quant\nboxes: []\n")
    next(seen)


def test_a_file_that_is_not_there_yet_is_looked_at_once_and_again_when_it_is(here: Path) -> None:
    file = here / "later.yaml"
    seen = saves(file)
    next(seen)
    file.write_text(SMALL)
    next(seen)


def test_the_presets_offered_are_those_there_are() -> None:
    assert get_args(Preset) == tuple(PRESETS)


def test_solve_writes_a_play_that_ends_at_the_finish(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["solve", "gate", "--robust"]) == 0
    said = capsys.readouterr().out
    assert "finish after" in said
    assert "of 8; " in said
    assert "followed on default from 100 starts" in said
    assert load_replay(here / "gate.replay").result.success


def test_solve_says_that_nothing_was_found_and_not_that_there_is_nothing(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["solve", "classic", "--budget", "1000"]) == 1
    assert "not found in 6,400 steps; there may be a way all the same" in capsys.readouterr().err
    assert not (here / "classic.replay").exists()
    assert main(["solve", "classic", "--budget", "0"]) == 1
    assert "--budget: found 0; must be 1 or more" in capsys.readouterr().err


def test_generate_writes_a_level_that_was_won_and_a_picture_of_it(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["generate", "--seed", "2", "--difficulty", "0.2", "--view", "plan"]) == 0
    said = capsys.readouterr().out
    assert "won in" in said
    (file,) = here.glob("generated-*.yaml")
    assert file.with_suffix(".png").stat().st_size > 0
    assert main(["check", file.name, "--strict"]) == 0
    assert main(["generate", "--difficulty", "2"]) == 1
    assert "difficulty: found 2.0; must be a number from 0 to 1" in capsys.readouterr().err
