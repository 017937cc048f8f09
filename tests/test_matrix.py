"""What `make matrix` tries is what the project says it supports."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from scripts import matrix

PROJECT = tomllib.loads((matrix.ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SUPPORT = (
    (matrix.ROOT / "CONTRIBUTING.md")
    .read_text(encoding="utf-8")
    .split("## Which versions")[1]
    .split("## ")[0]
)


def test_the_documented_versions_are_the_declared_ones() -> None:
    pythons = matrix.supported_pythons(PROJECT)
    assert f"| Python | {', '.join(pythons)} |" in SUPPORT
    assert PROJECT["requires-python"] == f">={pythons[0]}"
    assert f"| Gymnasium | {matrix.oldest_gymnasium(PROJECT)} and newer |" in SUPPORT
    readme = (matrix.ROOT / "README.md").read_text(encoding="utf-8")
    assert f"Python {pythons[0]} to {pythons[-1]} on Linux" in readme


def test_the_tests_of_the_matrix_are_there() -> None:
    for test in matrix.TESTS:
        assert (matrix.ROOT / test).is_file(), test


def test_the_lowest_python_takes_the_oldest_gymnasium_and_the_others_the_newest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    there = {"3.11": None, "3.12": "/somewhere/python3.12", "3.13": "/elsewhere/python3.13"}
    monkeypatch.setattr(matrix, "find_python", there.__getitem__)
    made, absent = matrix.cases()
    assert absent == ["3.11"]
    assert [case.python for case in made] == ["3.12", "3.13"]
    assert made[0].gymnasium == matrix.oldest_gymnasium(PROJECT)
    assert made[1].gymnasium > made[0].gymnasium


def test_a_door_of_pyenvs_with_nothing_behind_it_is_no_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    door = tmp_path / "python3.12"
    door.write_text("#!/bin/sh\necho 'python3.12: command not found' >&2\nexit 127\n")
    door.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path))
    assert matrix.find_python("3.12") is None


def test_no_python_at_all_is_a_failure(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(matrix, "MATRIX", tmp_path / "matrix")
    monkeypatch.setattr(matrix, "find_python", lambda _: None)
    monkeypatch.setattr(matrix, "build_wheel", lambda _: tmp_path / "roller.whl")
    assert matrix.main() == 1
    assert "Python 3.12: absent from this machine, not tried" in capsys.readouterr().out
