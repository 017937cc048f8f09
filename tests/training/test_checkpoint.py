"""A checkpoint gives back exactly what it was given, or refuses."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
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
from roller_env.training.files import RunError, RunFiles, only_one_process, write_atomically
from roller_env.training.ppo import learn, make_environments, new_model
from roller_env.training.practice import PracticeStarts
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
    assert isinstance(environments, PracticeStarts)
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
    for name, values in was.game.items():
        assert np.array_equal(values, now.game[name]), name


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
