"""`roller`: every command answers, quickly where it can, and says in one line what is wrong."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import roller_env
from roller_env.cli import COMMANDS, main, replay
from roller_env.cli.train import recipe, what_to_train
from roller_env.level import shipped_levels
from roller_env.training import ConfigError, load_config

HEAVY = ("torch", "stable_baselines3", "mujoco", "matplotlib", "numba", "tensorboard")


def run(*words: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    """Give a command; return its status and what it wrote."""
    try:
        status = main(words)
    except SystemExit as ended:
        code = ended.code
        if isinstance(code, str):
            captured = capsys.readouterr()
            return 1, captured.out, f"{captured.err}{code}\n"
        status = int(code or 0)
    captured = capsys.readouterr()
    return status, captured.out, captured.err


@pytest.mark.parametrize("words", ["--help", "--version", "level check flat", "level --help"])
def test_what_needs_neither_physics_nor_training_does_not_wait_for_them(words: str) -> None:
    program = (
        "import sys, roller_env.cli\n"
        "try:\n    status = roller_env.cli.main(sys.argv[1:])\n"
        "except SystemExit as ended:\n    status = ended.code\n"
        f"print([name for name in {HEAVY} if name in sys.modules], file=sys.stderr)\n"
        "sys.exit(status)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *words.split()], capture_output=True, text=True, check=True
    )
    assert done.stderr.splitlines()[-1] == "[]"


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    status, output, _ = run("--help", capsys=capsys)
    assert status == 0
    assert [name for name in COMMANDS if f"  {name}" not in output] == []


def test_no_command_is_told_which_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    status, output, _ = run(capsys=capsys)
    assert status == 2
    assert output.startswith("usage: roller COMMAND")


def test_the_version_is_the_package_s(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--version", capsys=capsys)[:2] == (0, f"roller {roller_env.__version__}\n")


def test_a_command_that_is_misspelt_is_told_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    status, output, error = run("relpay", capsys=capsys)
    assert (status, output) == (2, "")
    assert error == (
        "error: no command is called 'relpay'; there are train, evaluate, play, replay, level; "
        "did you mean 'replay'?\n"
    )


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_its_own_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    status, output, _ = run(name, "--help", capsys=capsys)
    assert status == 0
    assert output.startswith(f"usage: roller {name}")
    assert "scripts/" not in output


@pytest.mark.parametrize(
    ("package", "extra"), [("torch", "train"), ("stable_baselines3", "train"), ("minari", "demos")]
)
def test_a_package_that_is_missing_is_told_with_what_brings_it(
    package: str,
    extra: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(name: str) -> None:
        raise ModuleNotFoundError(name=f"{package}.nn")

    monkeypatch.setattr("roller_env.cli.import_module", fail)
    status, _, error = run("train", capsys=capsys)
    assert status == 1
    assert error == (
        f"error: 'roller train' needs the package '{package}'; "
        f"pip install 'roller-env[{extra}]' brings it\n"
    )


def test_a_fault_of_our_own_is_not_taken_for_a_missing_package(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(name: str) -> None:
        raise ModuleNotFoundError(name="roller_env.nowhere")

    monkeypatch.setattr("roller_env.cli.import_module", fail)
    with pytest.raises(ModuleNotFoundError):
        main(["train"])


def test_every_shipped_level_is_trained_by_its_name_with_one_recipe() -> None:
    for name in shipped_levels():
        assert what_to_train(name, None) == (recipe(), name)
    assert what_to_train(None, None) == (recipe(), "classic")
    assert load_config(recipe()).level == "classic"


def test_what_is_trained_is_a_level_or_a_configuration_of_ones_own() -> None:
    assert what_to_train("mine.yaml", None) == (Path("mine.yaml"), None)
    assert what_to_train(None, Path("mine")) == (Path("mine"), None)
    with pytest.raises(ConfigError, match=r"'clasic'; there are .* \(did you mean 'classic'\?\)"):
        what_to_train("clasic", None)
    with pytest.raises(ConfigError, match="give one of the two"):
        what_to_train("classic", Path("mine.yaml"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("train clasic", "no level is called 'clasic'"),
        ("train classic --set total_steps=-1", "total_steps: "),
        ("evaluate nowhere", "nowhere"),
        ("play flat --level classic", "found it twice"),
        ("play flat --port 99999", "port: found 99999"),
        ("replay clasic", "there is no such file"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(
    words: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    status, output, error = run(*words.split(), capsys=capsys)
    assert (status, output) == (1, "")
    assert error.startswith("error: ")
    assert error.count("\n") == 1
    assert message in error


@pytest.mark.parametrize("option", ["--sheet", "--convert"])
def test_a_replay_that_cannot_be_written_is_one_line_that_names_the_file(
    option: str, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("not a directory")
    suffix = ".png" if option == "--sheet" else ".replay"
    target = tmp_path / "file" / f"x{suffix}"
    with pytest.raises(SystemExit, match=r"^error: .*/file.*: [A-Z][a-z ]+$"):
        replay.main(["flat", option, str(target)])
