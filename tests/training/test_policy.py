"""A policy is kept so that it plays as it was trained, and so that no file of it can do harm."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import runpy
import shutil
import zipfile
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import safetensors.torch
import torch
from hypothesis import given
from hypothesis import strategies as st
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.level import LevelError
from roller_env.play.autopilot import load_autopilot
from roller_env.replay import ReplayError, load_replay
from roller_env.training.checkpoint import CheckpointError, load_checkpoint
from roller_env.training.config import TrainingConfig, load_config
from roller_env.training.config_source import ConfigError
from roller_env.training.demonstrations import DemonstrationError, load_demonstrations
from roller_env.training.files import RunError, RunFiles
from roller_env.training.policy import load_policy, save_policy
from roller_env.training.ppo import learn, make_environments, new_model
from roller_env.training.run import train
from tests.training.small import small_config

KNOWN_ERRORS = (
    CheckpointError,
    ConfigError,
    DemonstrationError,
    LevelError,
    ReplayError,
    RunError,
)
KINDS: dict[str, dict[str, Any]] = {
    "state and directions": {},
    "dict and keys": {"environment": {"observation": "dict", "action": "keys"}},
    "rays and force": {"environment": {"observation": "rays", "action": "force"}},
    "nothing normalised": {"normalise_observations": False, "normalise_rewards": False},
    "three layers of elu": {
        "ppo": {
            "rollout_steps": 16,
            "batch_size": 64,
            "hidden_sizes": [5, 7, 3],
            "activation": "elu",
        }
    },
}


class Harm:
    """Pickled, it makes a file when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Callable[[str], int], tuple[str]]:
        return os.system, (f"touch '{self.mark}'",)


@dataclass(frozen=True)
class Hostile:
    """Contents of files, each of which makes a file when it is unpickled.

    Attributes:
        mark: the file that is made.
        contents: a pickle, and archives that hold it as torch and Stable-Baselines3 do.
    """

    mark: Path
    contents: tuple[bytes, ...]


@pytest.fixture
def hostile(tmp_path: Path) -> Hostile:
    mark = tmp_path / "harmed"
    plain = pickle.dumps(Harm(mark))
    torch.save(Harm(mark), tmp_path / "harm.pt")
    with zipfile.ZipFile(tmp_path / "harm.zip", "w") as archive:
        archive.writestr("data", json.dumps({"policy_class": {":serialized:": ""}}))
        for name in ("policy.pth", "state.json", "arrays.safetensors", "data.pkl"):
            archive.writestr(name, plain)
    return Hostile(
        mark, (plain, (tmp_path / "harm.pt").read_bytes(), (tmp_path / "harm.zip").read_bytes())
    )


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the directory of a run that has all its files but the pictures."""
    config = small_config(total_steps=128)
    files = RunFiles(tmp_path_factory.mktemp("runs") / "run")
    model, _ = learn(config, files)
    files.config.write_text(config.to_yaml())
    save_policy(model, config, files)
    return files.directory


@pytest.fixture
def copy(run: Path, tmp_path: Path) -> RunFiles:
    """Return a copy of the run that a test may spoil."""
    return RunFiles(shutil.copytree(run, tmp_path / "copy"))


def without_safe_files(files: RunFiles) -> RunFiles:
    """Return a run as older versions left it."""
    files.policy.unlink()
    files.weights.unlink()
    return files


def observations(config: TrainingConfig) -> list[Any]:
    """Return what eight games show while they are pushed about at random."""
    environments = RollerVecEnv(num_envs=8, seed=5, **config.environment.keywords())
    environments.action_space.seed(5)
    seen: list[Any] = [environments.reset()]
    for _ in range(30):
        actions = np.array([environments.action_space.sample() for _ in range(8)])
        seen.append(environments.step(actions)[0])
    environments.close()
    return seen


def edited(files: RunFiles, edit: Callable[[dict[str, Any]], None]) -> RunFiles:
    """Change policy.json, and let it name the weights' hash."""
    said = json.loads(files.policy.read_text())
    edit(said)
    said["weights_sha256"] = hashlib.sha256(files.weights.read_bytes()).hexdigest()
    files.policy.write_text(json.dumps(said))
    return files


@pytest.mark.parametrize("changes", KINDS.values(), ids=KINDS)
def test_a_loaded_policy_acts_with_the_bits_of_the_trained_one(
    tmp_path: Path, changes: dict[str, Any]
) -> None:
    config = small_config(**changes)
    model = new_model(config, make_environments(config))
    model.learn(128)
    normaliser = model.get_vec_normalize_env()
    assert normaliser is not None
    save_policy(model, config, RunFiles(tmp_path))
    policy = load_policy(tmp_path)
    assert policy.config == config
    for name, weights in model.policy.state_dict().items():
        assert torch.equal(policy.network.state_dict()[name], weights), name
    for seen in observations(config):
        as_sb3 = model.policy.predict(normaliser.normalize_obs(seen), deterministic=True)[0]
        assert policy(seen).tobytes() == as_sb3.tobytes()
        assert policy(seen).dtype == as_sb3.dtype


def test_two_files_are_a_policy(run: Path, tmp_path: Path) -> None:
    for name in ("policy.json", "policy.safetensors"):
        shutil.copy(run / name, tmp_path)
    seen = observations(small_config())[-1]
    assert np.array_equal(load_policy(tmp_path)(seen), load_policy(run)(seen))


def test_loading_a_policy_draws_no_random_numbers(run: Path) -> None:
    torch.manual_seed(3)
    expected = torch.rand(3)
    torch.manual_seed(3)
    load_policy(run)
    assert torch.equal(torch.rand(3), expected)


def test_a_pickle_under_any_name_of_a_run_is_never_executed(
    run: Path, tmp_path: Path, hostile: Hostile
) -> None:
    names = [path.name for path in run.iterdir() if path.is_file()]
    assert {"policy.json", "policy.safetensors", "policy.zip", "checkpoint.zip"} < set(names)
    for number, content in enumerate(hostile.contents):
        for spoilt in [names, *([name] for name in names)]:
            files = RunFiles(shutil.copytree(run, tmp_path / f"{number}-{len(spoilt)}-{spoilt[0]}"))
            for name in spoilt:
                (files.directory / name).write_bytes(content)
            for read in readers(files):
                assert complaint(read).isprintable()
            shutil.rmtree(files.directory)
    assert not hostile.mark.exists()


def complaint(read: Callable[[], object]) -> str:
    """Return what is said against reading; nothing if it can be read."""
    try:
        read()
    except KNOWN_ERRORS as error:
        return str(error)
    return ""


def readers(files: RunFiles) -> list[Callable[[], object]]:
    """Return everything that reads files which others may have made."""
    config = small_config(total_steps=128)
    return [
        lambda: load_policy(files.directory),
        lambda: load_autopilot(files.directory),
        lambda: load_checkpoint(files.checkpoint),
        lambda: load_checkpoint(files.checkpoint).restore(
            new_model(config, make_environments(config))
        ),
        lambda: load_config(files.config),
        lambda: load_replay(files.policy),
        lambda: load_demonstrations(str(files.policy), config),
        lambda: load_demonstrations(str(files.directory), config),
    ]


def test_a_run_that_has_only_pickles_is_refused_unless_it_is_trusted(
    copy: RunFiles, run: Path
) -> None:
    files = without_safe_files(copy)
    with pytest.raises(RunError, match=r"has no policy\.json, only .*pickles.*--trust"):
        load_policy(files.directory)
    with pytest.raises(RunError, match="--trust"):
        load_autopilot(files.directory)
    policy = load_policy(files.directory, trust=True)
    for seen in observations(small_config()):
        assert policy(seen).tobytes() == load_policy(run)(seen).tobytes()


def test_trust_is_what_lets_a_pickle_do_harm(copy: RunFiles, hostile: Hostile) -> None:
    files = without_safe_files(copy)
    files.sb3_normaliser.write_bytes(hostile.contents[0])
    with pytest.raises(RunError, match=r"vecnormalize\.pkl: not a usable policy: found a int"):
        load_policy(files.directory, trust=True)
    assert hostile.mark.exists()


def test_trust_does_not_make_a_pickle_be_preferred(copy: RunFiles, hostile: Hostile) -> None:
    for file in (copy.sb3_normaliser, copy.sb3_policy):
        file.write_bytes(hostile.contents[0])
    load_policy(copy.directory, trust=True)
    assert not hostile.mark.exists()


@pytest.mark.parametrize("name", ["policy.zip", "vecnormalize.pkl"])
@pytest.mark.parametrize("content", [b"", b"\x80\x04", b"PK\x03\x04", b"words"])
def test_a_damaged_pickle_is_named(copy: RunFiles, name: str, content: bytes) -> None:
    files = without_safe_files(copy)
    (files.directory / name).write_bytes(content)
    with pytest.raises(RunError, match=f"{name}: not a usable policy: "):
        load_policy(files.directory, trust=True)


@given(data=st.data())
def test_weights_with_any_byte_wrong_or_missing_are_refused(
    run: Path, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    files = RunFiles(tmp_path_factory.mktemp("damaged"))
    shutil.copy(run / "policy.json", files.policy)
    files.weights.write_bytes(damaged((run / "policy.safetensors").read_bytes(), data))
    with pytest.raises(RunError, match=r"policy\.safetensors: .*does not match the hash"):
        load_policy(files.directory)


@given(data=st.data())
def test_a_description_with_any_byte_wrong_is_a_policy_or_a_clear_error(
    run: Path, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    files = RunFiles(tmp_path_factory.mktemp("damaged"))
    shutil.copy(run / "policy.safetensors", files.weights)
    files.policy.write_bytes(damaged((run / "policy.json").read_bytes(), data))
    said = complaint(lambda: load_policy(files.directory))
    assert not said or said.startswith(f"{files.directory}/policy.")


def damaged(content: bytes, data: st.DataObject) -> bytes:
    spoilt = bytearray(content)
    place = data.draw(st.integers(0, len(spoilt) - 1))
    if data.draw(st.booleans()):
        del spoilt[place:]
    else:
        spoilt[place] ^= data.draw(st.integers(1, 255))
    return bytes(spoilt)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda said: said.pop("training"), "policy.json: .*training: Field required"),
        (lambda said: said.update(format=2), "policy.json: .*format: Input should be 1"),
        (lambda said: said.update(code="x"), "policy.json: .*code: Extra inputs are not permitted"),
        (
            lambda said: said["training"].update(level="a/../b\x1b[2J"),
            "training.level: .*text that can be printed",
        ),
        (
            lambda said: said["training"]["environment"].update(action="force"),
            r"policy.json: .*action_space: not the one that this version of Roller",
        ),
        (
            lambda said: said["normalisation"]["mean"][""].pop(),
            "policy.json: .*normalisation.mean: found {'': 44} numbers; wanted {'': 45}",
        ),
        (
            lambda said: said["normalisation"].update(mean={"x": [1.0]}),
            "normalisation.mean: found {'x': 1} numbers",
        ),
        (
            lambda said: said["training"]["ppo"].update(hidden_sizes=[9]),
            r"policy.safetensors: .*policy_net.0.weight: found shape \(8, 45\); .* 0 has 9 units",
        ),
        (
            lambda said: said["training"]["ppo"].update(hidden_sizes=[16384] * 16),
            "policy.safetensors: .*hidden layer 0 has 16384 units",
        ),
        (
            lambda said: said["training"]["ppo"].update(hidden_sizes=[8, 8]),
            "policy.safetensors: .*policy_net.2.weight: found shape None",
        ),
    ],
)
def test_a_policy_that_does_not_fit_together_is_refused(
    copy: RunFiles, edit: Callable[[dict[str, Any]], None], message: str
) -> None:
    with pytest.raises(RunError, match=message):
        load_policy(edited(copy, edit).directory)


@pytest.mark.parametrize(
    "tensors",
    [
        lambda weights: weights | {"code": torch.zeros(1)},
        lambda weights: {name: w.double() for name, w in weights.items()},
        lambda weights: {name: w for name, w in weights.items() if "value" not in name},
    ],
    ids=["one more", "other numbers", "some missing"],
)
def test_weights_of_another_network_are_refused(
    copy: RunFiles, tensors: Callable[[dict[str, torch.Tensor]], dict[str, torch.Tensor]]
) -> None:
    weights = safetensors.torch.load(copy.weights.read_bytes())
    copy.weights.write_bytes(safetensors.torch.save(tensors(weights)))
    with pytest.raises(RunError, match=r"policy\.safetensors: .*: found .*; wanted "):
        load_policy(edited(copy, lambda said: None).directory)


def test_what_is_no_file_is_not_waited_for(copy: RunFiles) -> None:
    copy.weights.unlink()
    with pytest.raises(RunError, match=r"policy\.safetensors: there is none"):
        load_policy(copy.directory)
    os.mkfifo(copy.weights)
    with pytest.raises(RunError, match=r"policy\.safetensors: not a file"):
        load_policy(copy.directory)
    copy.policy.unlink()
    os.mkfifo(copy.policy)
    with pytest.raises(RunError, match=r"policy\.json: not a file"):
        load_policy(copy.directory)


def test_a_directory_that_is_not_there_is_named_without_what_a_terminal_obeys(
    tmp_path: Path,
) -> None:
    with pytest.raises(RunError, match=r"red\\x1b\[31m.*: there is no such directory"):
        load_policy(tmp_path / "red\x1b[31m")


def test_stable_baselines3_loads_the_export_as_the_documentation_says(run: Path) -> None:
    environment = RollerVecEnv(
        "flat", num_envs=8, reward="shaped", physics="fast", max_episode_steps=40
    )
    normaliser = VecNormalize.load(str(run / "vecnormalize.pkl"), environment)
    normaliser.training = False
    model = PPO.load(run / "policy.zip", env=normaliser, device="cpu")
    policy = load_policy(run)
    for seen in observations(small_config()):
        actions: npt.NDArray[Any]
        actions, _ = model.predict(normaliser.normalize_obs(seen), deterministic=True)
        assert np.array_equal(policy(seen), actions)


@pytest.mark.parametrize("name", ["config.yaml", "progress.csv", "run.json", "checkpoint.zip"])
def test_a_run_with_a_damaged_file_is_not_gone_on_with(
    copy: RunFiles, hostile: Hostile, name: str
) -> None:
    config = small_config(total_steps=256 if name == "progress.csv" else 128)
    copy.config.write_text(config.to_yaml())
    for content in (hostile.contents[0], b"[" * 10**5):
        # What has no end of line is taken for a last row that was not finished.
        (copy.directory / name).write_bytes(content + b"\n")
        with pytest.raises(KNOWN_ERRORS) as caught:
            train(config, copy.directory, resume=True)
        assert str(caught.value).startswith(str(copy.directory / name))
    assert not hostile.mark.exists()


@pytest.mark.parametrize("trust", [False, True])
def test_the_command_that_evaluates_needs_to_be_told_to_trust(
    copy: RunFiles,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    trust: bool,
) -> None:
    directory = str(without_safe_files(copy).directory)
    options = ["--episodes", "2", *(["--trust"] if trust else [])]
    monkeypatch.setattr("sys.argv", ["evaluate.py", directory, *options])
    script = str(Path(__file__).parents[2] / "scripts" / "evaluate.py")
    with nullcontext() if trust else pytest.raises(SystemExit, match=r"^error: .*--trust"):
        runpy.run_path(script, run_name="__main__")
    assert ("success rate" in capsys.readouterr().out) == trust


def test_a_checkpoint_of_the_old_kind_is_refused_and_not_begun_anew(
    copy: RunFiles, hostile: Hostile
) -> None:
    body = hostile.contents[2]
    header = f"roller-checkpoint-1 sha256 {hashlib.sha256(body).hexdigest()}\n".encode()
    copy.checkpoint.write_bytes(header + body)
    with pytest.raises(CheckpointError, match="not a checkpoint of this version of Roller"):
        train(small_config(total_steps=128), copy.directory, resume=True)
    assert not hostile.mark.exists()
