"""A run leaves everything it promises, and a killed one goes on as if nothing had happened."""

from __future__ import annotations

import base64
import json
import os
import runpy
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import torch

from roller_env.drawing.opengl import missing_opengl
from roller_env.level import LevelError, load_level
from roller_env.training import run
from roller_env.training.checkpoint import Progress
from roller_env.training.config import TrainingConfig, load_config
from roller_env.training.demonstrations import DemonstrationError
from roller_env.training.files import RunError, RunFiles, run_directory
from roller_env.training.logs import STEPS, read_progress
from roller_env.training.policy import TrainedPolicy, load_policy
from roller_env.training.ppo import learn, make_environments, new_model
from roller_env.training.recording import Episodes
from roller_env.training.run import evaluate_policy, learn_to_mastery, train
from roller_env.training.schedule import finality, last_step
from tests.patience import STALLED_S
from tests.training.disk import largest_file
from tests.training.small import UPDATES, small_config

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def _one_thread_of_torch() -> Iterator[None]:
    """Leave torch as it was: a training sets the process's number of threads."""
    threads = torch.get_num_threads()
    yield
    torch.set_num_threads(threads)


def command(config: Path, runs: Path) -> list[str]:
    script = str(ROOT / "scripts" / "train.py")
    options = ["--config", str(config), "--runs", str(runs), "--name", "run", "--resume"]
    return [sys.executable, script, *options]


def start(config: Path, runs: Path) -> subprocess.Popen[str]:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        command(config, runs),
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def finish(process: subprocess.Popen[str]) -> str:
    output, _ = process.communicate(timeout=STALLED_S)
    assert process.returncode == 0, output
    return output


def kill_once(process: subprocess.Popen[str], file: Path, rows: int) -> None:
    """Kill a training, without warning, when its log has so many rows."""
    deadline = time.monotonic() + STALLED_S
    while len(read_progress(file)) < rows:
        assert process.poll() is None, process.communicate()[0]
        assert time.monotonic() < deadline
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert process.returncode == -signal.SIGKILL


def without_clock(file: Path) -> list[dict[str, str]]:
    clocks = ("time/fps", "time/wall_s")
    return [
        {name: value for name, value in row.items() if name not in clocks}
        for row in read_progress(file)
    ]


def test_a_training_killed_and_resumed_ends_with_the_bits_of_one_that_never_stopped(
    tmp_path: Path,
) -> None:
    # Long enough that the kill comes in the middle, whatever the machine does.
    config = small_config(total_steps=8 * 16 * 40)
    config_file = tmp_path / "training.yaml"
    config_file.write_text(config.to_yaml())
    whole = RunFiles(tmp_path / "whole")
    model, _ = learn(config, whole)

    files = RunFiles(tmp_path / "runs" / "run")
    kill_once(start(config_file, tmp_path / "runs"), files.progress, rows=5)
    assert len(read_progress(files.progress)) < 40
    # What a process killed while it writes a checkpoint leaves behind.
    files.checkpoint.with_name("checkpoint.zip.tmp").write_bytes(b"half a check")
    finish(start(config_file, tmp_path / "runs"))

    assert json.loads(files.summary.read_text())["progress"]["steps"] == config.total_steps
    assert without_clock(files.progress) == without_clock(whole.progress)
    assert [int(row[STEPS]) for row in read_progress(files.progress)] == list(
        range(128, config.total_steps + 1, 128)
    )
    resumed = load_policy(files.directory)
    for name, value in model.policy.state_dict().items():
        assert torch.equal(resumed.network.state_dict()[name], value), name

    again = train(config, files.directory, resume=True)
    assert again.was_finished
    assert again.summary == json.loads(files.summary.read_text())


def test_a_little_training_on_the_flat_level_finds_the_way_and_leaves_every_file(
    tmp_path: Path,
) -> None:
    config = TrainingConfig.model_validate(
        {
            "level": "flat",
            "environment": {"reward": "shaped", "physics": "fast"},
            "num_envs": 64,
            "total_steps": 64 * 32 * 24,
            "evaluation_episodes": 20,
            "ppo": {"rollout_steps": 32, "batch_size": 512, "learning_rate": 3e-3},
        }
    )
    run = train(config, tmp_path / "run")
    trained = evaluate_policy(load_policy(run.files.directory), config, 20)
    untrained_model = new_model(config, make_environments(config))
    untrained = evaluate_policy(TrainedPolicy.of(untrained_model, config), config, 20)
    assert trained.table()["success rate"].mean >= 0.9
    assert untrained.table()["success rate"].mean <= 0.5

    files = run.files
    assert json.loads(files.evaluation.read_text())["measures"]["success rate"]["mean"] >= 0.9
    assert files.evaluation_table.read_text().startswith("20 episodes on `flat` (12 coins)")
    assert len(files.episodes.read_text().splitlines()) == 1 + 20
    assert files.learning_curve.read_bytes().startswith(b"\x89PNG")
    assert files.paths.read_bytes().startswith(b"\x89PNG")
    assert len(read_progress(files.progress)) == 24
    assert list(files.tensorboard.iterdir())
    assert run.summary["steps_per_s"] > 0
    if missing_opengl() is None:
        assert b"ftyp" in files.video.read_bytes()[:16]


def recipe(**changes: Any) -> TrainingConfig:
    """Return the shipped recipe with other values."""
    overrides = [f"{name.replace('__', '.')}={value}" for name, value in changes.items()]
    return load_config(ROOT / "configs" / "ppo.yaml", overrides)


def test_the_recipe_finds_most_coins_of_the_flat_level_on_a_tiny_budget(tmp_path: Path) -> None:
    config = recipe(level="flat", num_envs=64, total_steps=450_000, final_steps=100_000, seed=2)
    model, _ = learn(config, RunFiles(tmp_path))
    evaluation = evaluate_policy(TrainedPolicy.of(model, config), config, 20)
    assert evaluation.table()["score (%)"].mean > 50.0


def test_the_recipe_learns_a_level_without_a_route_to_the_same_bits(tmp_path: Path) -> None:
    without = tmp_path / "without.yaml"
    fields = load_level("gate").model_dump(mode="json", exclude_defaults=True)
    del fields["route"]
    without.write_text(json.dumps(fields), encoding="utf-8")
    small = {"num_envs": 32, "total_steps": 32 * 32 * 12}
    networks = [
        learn(recipe(level=level, **small), RunFiles(tmp_path / name))[0].policy.state_dict()
        for name, level in (("with", "gate"), ("without", without))
    ]
    for name, weights in networks[0].items():
        assert torch.equal(networks[1][name], weights), name


def test_a_run_is_not_overwritten_by_another(tmp_path: Path) -> None:
    files = RunFiles(tmp_path)
    files.config.write_text(small_config().to_yaml())
    learn(small_config(total_steps=128), files)
    with pytest.raises(RunError, match="--resume goes on with it"):
        train(small_config(), tmp_path)
    with pytest.raises(RunError, match=r"another configuration[^\n]*\n  seed: 3, 4"):
        train(small_config(seed=4), tmp_path, resume=True)


def test_a_training_whose_disk_was_full_says_what_is_kept_and_goes_on_with_the_same_bits(
    tmp_path: Path,
) -> None:
    config = small_config()
    whole = RunFiles(tmp_path / "whole")
    model, _ = learn(config, whole)
    run = tmp_path / "run"
    with (
        largest_file(100),
        pytest.raises(
            RunError, match=r"config\.yaml: File too large; nothing was kept yet.*--resume"
        ),
    ):
        train(config, run)
    # A checkpoint grows with the games that have reached waypoints.
    first = RunFiles(tmp_path / "first")
    learn(small_config(total_steps=128), first)
    sizes = [files.checkpoint.stat().st_size for files in (first, whole)]
    assert sizes[0] < sizes[1]
    with (
        largest_file(sum(sizes) // 2),
        pytest.raises(RunError, match=r"checkpoint at \d+ steps.*--resume goes on from there"),
    ):
        train(config, run, resume=True)
    resumed, _ = learn(config, RunFiles(run))
    for name, value in model.policy.state_dict().items():
        assert torch.equal(resumed.policy.state_dict()[name], value), name


def test_a_directory_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "runs").write_text("a file")
    with pytest.raises(RunError, match=r"runs/run: Not a directory; nothing was kept yet"):
        train(small_config(), tmp_path / "runs" / "run")


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"level": "flatt"}, LevelError, "did you mean 'flat'"),
        ({"demonstrations": "nowhere"}, DemonstrationError, "nowhere"),
    ],
)
def test_a_start_that_fails_leaves_no_directory(
    tmp_path: Path, changes: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        train(small_config(**changes), tmp_path / "runs" / "typo")
    assert not list(tmp_path.iterdir())


def test_a_directory_in_which_nothing_has_begun_is_no_obstacle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = RunFiles(tmp_path)
    files.config.write_text(small_config(seed=4).to_yaml())
    files.progress.write_text("")

    def interrupted(config: TrainingConfig, files: RunFiles) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("roller_env.training.run.learn", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train(small_config(), tmp_path)
    assert load_config(files.config) == small_config()


@pytest.mark.parametrize(
    "name",
    ["../../x", "..", ".", "", "/tmp/x", "a/b", "a/", ".hidden", "red\x1b[31m", "a\0b", "ä" * 76],
)
def test_a_name_that_leaves_the_directory_of_runs_is_refused(name: str) -> None:
    with pytest.raises(RunError, match="must be a name for a directory inside runs") as caught:
        run_directory(Path("runs"), name)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("name", ["ppo_classic-seed0", "far-sighted", "a b", "Übung.2", "ä" * 75])
def test_a_name_of_one_directory_is_taken(name: str) -> None:
    assert run_directory(Path("runs"), name) == Path("runs") / name


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--name", "../../x"], "name: found '../../x'; must be"),
        (["--name", "typo", "--set", "level=flatt"], "did you mean 'flat'"),
        (["--set", "level=\x1b[31m"], "\\x1b[31m"),
        (["--config", "red\x1b[31m.yaml"], "red\\x1b[31m.yaml': there is no such file"),
    ],
    ids=["name", "level", "escape", "file"],
)
def test_the_command_line_says_in_one_line_what_is_wrong_and_makes_no_directory(
    tmp_path: Path,
    options: list[str],
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    config = tmp_path / "training.yaml"
    config.write_text(small_config().to_yaml())
    monkeypatch.setattr(
        sys, "argv", ["train.py", "--config", str(config), "--runs", str(tmp_path / "r"), *options]
    )
    with pytest.raises(SystemExit) as caught:
        runpy.run_path(str(ROOT / "scripts" / "train.py"), run_name="__main__")
    assert isinstance(caught.value.code, str)
    assert caught.value.code.startswith("error: ")
    assert message in caught.value.code
    assert "\x1b" not in caught.value.code + capsys.readouterr().out
    assert not (tmp_path / "r").exists()


def test_a_training_stops_between_two_updates_when_its_time_is_up(tmp_path: Path) -> None:
    config = small_config(total_steps=10**9, wall_clock_budget_s=0.5)
    model, progress = learn(config, RunFiles(tmp_path))
    assert progress.wall_s >= 0.5
    assert progress.steps == model.num_timesteps
    assert progress.steps % config.steps_per_update == 0
    _, later = learn(config, RunFiles(tmp_path))
    assert later == progress


@pytest.mark.parametrize(
    "changes",
    [
        {"environment": {"observation": "dict", "max_episode_steps": 40}},
        {"environment": {"observation": "rays", "action": "keys", "max_episode_steps": 40}},
        {"environment": {"action": "force", "max_episode_steps": 40}},
        {"normalise_observations": False, "normalise_rewards": False},
    ],
    ids=["dict", "rays and keys", "force", "nothing normalised"],
)
def test_every_kind_of_observation_and_action_can_be_trained(
    tmp_path: Path, changes: dict[str, Any]
) -> None:
    config = small_config(total_steps=8 * 16 * 2, **changes)
    _, progress = learn(config, RunFiles(tmp_path))
    assert progress.steps == 256
    assert UPDATES > 2


UPDATE = 8 * 16
"""Steps between two updates of a small training."""


@pytest.mark.parametrize(
    ("judged", "steps"), [((1.0,), 4 * UPDATE), ((0.2, 1.0), 8 * UPDATE), ((0.2,) * 9, 9 * UPDATE)]
)
def test_a_training_ends_when_the_likeliest_actions_have_mastered_the_level(
    judged: tuple[float, ...],
    steps: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    config = small_config(total_steps=9 * UPDATE, mastery=0.5, final_steps=2 * UPDATE)
    found = iter(judged)

    def played(*_: object) -> SimpleNamespace:
        result = SimpleNamespace(success=True, score_percent=100.0 * next(found))
        return SimpleNamespace(results=[result])

    # As if whoever learns did well from the second update on.
    monkeypatch.setattr(Episodes, "mastery", lambda _, before: before + 0.25)
    monkeypatch.setattr(run, "evaluate_policy", played)
    progress = learn_to_mastery(config, RunFiles(tmp_path))
    assert progress.steps == steps
    goes_on = capsys.readouterr().out.count("by its likeliest actions 20% are mastered: it goes on")
    assert goes_on == sum(share < 0.5 for share in judged[: len(judged) - len(list(found))])


def test_what_stable_baselines_keeps_of_an_agent_opens_without_roller(tmp_path: Path) -> None:
    config = small_config(total_steps=UPDATE, mastery=0.5)
    files = RunFiles(tmp_path)
    learn_to_mastery(config, files)
    with zipfile.ZipFile(files.sb3_policy) as kept:
        fields = json.loads(kept.read("data"))
    pickles = {
        name: base64.b64decode(value[":serialized:"])
        for name, value in fields.items()
        if isinstance(value, dict) and ":serialized:" in value
    }
    assert {"policy_class", "lr_schedule"} <= pickles.keys()
    assert [name for name, pickle in pickles.items() if b"roller_env" in pickle] == []


def test_rates_stay_until_the_end_and_go_to_their_last_values_there() -> None:
    config = small_config(total_steps=1000, mastery=0.9, final_steps=200)
    assert [finality(config, Progress(steps)) for steps in (0, 800, 900, 1000)] == [0, 0, 0.5, 1]
    early = Progress(500, final_from=450)
    assert finality(config, early) == 0.25
    assert last_step(config, early) == 650
    # An end that is longer than the training is all of it.
    short = small_config(total_steps=100, mastery=0.9, final_steps=200)
    assert finality(short, Progress(25)) == 0.25
    plain = small_config(total_steps=1000)
    assert finality(plain, Progress(250)) == 0.25


def test_a_training_to_mastery_goes_on_with_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Episodes, "mastery", lambda _, before: before + 0.25)
    changes = {"mastery": 0.5, "final_steps": 3 * UPDATE}
    whole, _ = learn(small_config(**changes), RunFiles(tmp_path / "whole"))
    files = RunFiles(tmp_path / "parts")
    for budget_s in (1e-9, 1e-9, 1e-9, None):
        model, _ = learn(small_config(wall_clock_budget_s=budget_s, **changes), files)
    for name, value in whole.policy.state_dict().items():
        assert torch.equal(model.policy.state_dict()[name], value), name


def test_a_run_without_a_policy_says_how_to_get_one(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"has no policy\.json; .*--resume"):
        load_policy(tmp_path)
