"""A checkpoint gives back exactly what it was given, or refuses."""

from __future__ import annotations

import errno
import hashlib
import io
import json
import os
import random
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import safetensors.numpy
import torch
from hypothesis import given
from hypothesis import strategies as st
from stable_baselines3 import PPO
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from roller_env.simulation import Snapshot
from roller_env.training.checkpoint import (
    Checkpoint,
    CheckpointError,
    load_checkpoint,
    save_checkpoint,
)
from roller_env.training.curriculum import StartStateCurriculum
from roller_env.training.files import RunError, RunFiles, only_one_process, write_atomically
from roller_env.training.ppo import learn, make_environments, new_model
from tests.training.small import UPDATES, small_config


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> tuple[PPO, Checkpoint, Path]:
    """Return a learner, its last checkpoint, and the checkpoint's file."""
    files = RunFiles(tmp_path_factory.mktemp("run"))
    model, _ = learn(small_config(), files)
    return model, load_checkpoint(files.checkpoint), files.checkpoint


def restored(checkpoint: Checkpoint) -> PPO:
    config = checkpoint.config.model_copy(update={"seed": 9})
    model = new_model(config, make_environments(config))
    checkpoint.restore(model)
    return model


def normaliser(model: PPO) -> VecNormalize:
    found = model.get_vec_normalize_env()
    assert found is not None
    return found


def games(model: PPO) -> Snapshot:
    environments = normaliser(model).venv
    assert isinstance(environments, StartStateCurriculum)
    return environments.environments.simulation.snapshot()


def test_weights_and_optimizer_come_back_bit_for_bit(
    trained: tuple[PPO, Checkpoint, Path],
) -> None:
    model, checkpoint, _ = trained
    again = restored(checkpoint)
    for name, value in model.policy.state_dict().items():
        assert torch.equal(again.policy.state_dict()[name], value), name
    before = model.policy.optimizer.state_dict()["state"]
    after = again.policy.optimizer.state_dict()["state"]
    assert before.keys() == after.keys() != set()
    for number, moments in before.items():
        for name, value in moments.items():
            assert torch.equal(after[number][name], value), (number, name)


def test_normalisation_comes_back_bit_for_bit(trained: tuple[PPO, Checkpoint, Path]) -> None:
    model, checkpoint, _ = trained
    before, after = normaliser(model), normaliser(restored(checkpoint))
    for was, now in ((before.obs_rms, after.obs_rms), (before.ret_rms, after.ret_rms)):
        assert isinstance(was, RunningMeanStd)
        assert isinstance(now, RunningMeanStd)
        assert was.count == now.count > 1
        assert np.array_equal(was.mean, now.mean)
        assert np.array_equal(was.var, now.var)
    assert np.array_equal(before.returns, after.returns)


def test_games_and_counters_come_back_where_they_were(
    trained: tuple[PPO, Checkpoint, Path],
) -> None:
    model, checkpoint, _ = trained
    again = restored(checkpoint)
    assert again.num_timesteps == model.num_timesteps == checkpoint.progress.steps
    assert isinstance(again._last_obs, np.ndarray)
    assert isinstance(model._last_obs, np.ndarray)
    assert np.array_equal(again._last_obs, model._last_obs)
    was, now = games(model), games(again)
    assert np.array_equal(was.physics, now.physics)
    assert was.generators == now.generators
    for name, values in was.game.named().items():
        assert np.array_equal(values, now.game.named()[name]), name


def test_random_generators_come_back_where_they_were(
    trained: tuple[PPO, Checkpoint, Path], tmp_path: Path
) -> None:
    model, checkpoint, _ = trained
    file = tmp_path / "checkpoint.zip"
    save_checkpoint(file, model, checkpoint.config, checkpoint.progress)

    def draw() -> tuple[float, float, float]:
        return random.random(), float(np.random.rand()), float(torch.rand(1))  # noqa: NPY002

    expected = draw()
    restored(load_checkpoint(file))
    assert draw() == expected


def test_what_is_known_of_a_run_needs_no_environment(
    trained: tuple[PPO, Checkpoint, Path],
) -> None:
    _, checkpoint, _ = trained
    assert checkpoint.config == small_config()
    assert checkpoint.progress.steps == 8 * 16 * UPDATES
    assert checkpoint.progress.wall_s > 0.0


@given(data=st.data())
def test_a_checkpoint_with_any_byte_wrong_or_missing_is_refused(
    trained: tuple[PPO, Checkpoint, Path],
    tmp_path_factory: pytest.TempPathFactory,
    data: st.DataObject,
) -> None:
    damaged = bytearray(trained[2].read_bytes())
    place = data.draw(st.integers(0, len(damaged) - 1))
    if data.draw(st.booleans()):
        del damaged[place:]
    else:
        damaged[place] ^= data.draw(st.integers(1, 255))
    file = tmp_path_factory.mktemp("damaged") / "checkpoint.zip"
    file.write_bytes(damaged)
    with pytest.raises(CheckpointError, match=r"checkpoint\.zip: (damaged|not a checkpoint)"):
        load_checkpoint(file)


def packed(facts: Any, arrays: dict[str, npt.NDArray[Any]], compression: int = 0) -> bytes:
    """Return the content of a checkpoint whose hash is right."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", compression) as container:
        container.writestr("state.json", facts if isinstance(facts, str) else json.dumps(facts))
        container.writestr("arrays.safetensors", safetensors.numpy.save(arrays))
    body = archive.getvalue()
    return f"roller-checkpoint-3 sha256 {hashlib.sha256(body).hexdigest()}\n".encode() + body


def unpacked(file: Path) -> tuple[Any, dict[str, npt.NDArray[Any]]]:
    with zipfile.ZipFile(io.BytesIO(file.read_bytes().split(b"\n", 1)[1])) as container:
        facts = json.loads(container.read("state.json"))
        return facts, safetensors.numpy.load(container.read("arrays.safetensors"))


Edit = Callable[[dict[str, Any], dict[str, npt.NDArray[Any]]], object]


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda facts, arrays: arrays.pop("normaliser/returns"), "returns: found nothing"),
        (
            lambda facts, arrays: arrays.update({"normaliser/returns": np.zeros(1)}),
            r"returns: found an array float64\[1\]; wanted an array float64\[8\]",
        ),
        (
            lambda facts, arrays: arrays.update(
                {"environments/games/game/shaping/waypoint": np.full(10, 10**9)}
            ),
            "waypoint: found .*; must be 0 to ",
        ),
        (
            lambda facts, arrays: arrays.update(
                {"environments/games/level_of_row": np.full(10, -1)}
            ),
            "level_of_row: found .*; must be 0 to 0",
        ),
        (
            lambda facts, arrays: arrays.update({"environments/task": np.full(10, 10**6)}),
            "task: found 1000000; must be -1 to ",
        ),
        (
            lambda facts, arrays: arrays.update({"environments/journeys/aim": np.array([0, 13])}),
            "aim: found 13; must be -1 to 12",
        ),
        (
            lambda facts, arrays: arrays.update({"optimizer/0/exp_avg": np.zeros(3, np.float32)}),
            "optimizer/0: found ",
        ),
        (
            lambda facts, arrays: facts["state"].update({"environments/games/generators": []}),
            "generators: found 0; wanted 10",
        ),
        (
            lambda facts, arrays: facts["state"].update({"environments/level": "{}"}),
            "the level 'flat' has been changed",
        ),
        (
            lambda facts, arrays: facts["state"].update({"random/python": [3, [1, 2], None]}),
            "not of a training with this configuration",
        ),
        (lambda facts, arrays: facts["state"].pop("learner/steps"), "learner/steps: found nothing"),
        (lambda facts, arrays: facts.update(config={}), "level: Field required|validation error"),
        (lambda facts, arrays: facts.update(progress={"x": 1}), "damaged"),
        (lambda facts, arrays: facts.update(state={"a": 1, "a/b": 2}), "damaged"),
    ],
)
def test_a_checkpoint_that_does_not_fit_the_learner_is_refused(
    trained: tuple[PPO, Checkpoint, Path], tmp_path: Path, edit: Edit, message: str
) -> None:
    facts, arrays = unpacked(trained[2])
    file = tmp_path / "checkpoint.zip"
    file.write_bytes(packed(facts, arrays))
    restored(load_checkpoint(file))
    edit(facts, arrays)
    file.write_bytes(packed(facts, arrays))
    with pytest.raises(CheckpointError, match=message):
        restored(load_checkpoint(file))


def test_nothing_is_unpacked_that_is_larger_than_its_file(tmp_path: Path) -> None:
    file = tmp_path / "checkpoint.zip"
    file.write_bytes(packed(" " * 10**7, {}, zipfile.ZIP_DEFLATED))
    with pytest.raises(CheckpointError, match=r"state\.json is larger than the file"):
        load_checkpoint(file)


@pytest.mark.parametrize("text", ["[" * 10**5, "", "{", "7"])
def test_a_state_that_is_no_state_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "checkpoint.zip"
    file.write_bytes(packed(text, {}))
    with pytest.raises(CheckpointError, match="damaged"):
        load_checkpoint(file)


def test_a_write_that_fails_leaves_the_old_file_and_no_half_of_the_new(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "checkpoint.zip"
    write_atomically(file, b"whole")

    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"No space left on device.*checkpoint\.zip"):
        write_atomically(file, b"new")
    assert [path.name for path in tmp_path.iterdir()] == ["checkpoint.zip"]
    assert file.read_bytes() == b"whole"


def test_a_half_written_file_never_takes_the_place_of_a_whole_one(tmp_path: Path) -> None:
    file = tmp_path / "checkpoint.zip"
    write_atomically(file, b"whole")
    (tmp_path / "checkpoint.zip.tmp").write_bytes(b"hal")
    assert file.read_bytes() == b"whole"
    write_atomically(file, b"whole again")
    assert [path.name for path in tmp_path.iterdir()] == ["checkpoint.zip"]
    assert file.read_bytes() == b"whole again"


def test_a_run_is_trained_by_one_process_at_a_time(tmp_path: Path) -> None:
    first, second = only_one_process(tmp_path), only_one_process(tmp_path)
    with first, pytest.raises(RunError, match="trained by another process"):
        second.__enter__()
    with only_one_process(tmp_path):
        pass
