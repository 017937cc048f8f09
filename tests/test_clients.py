"""Other programs use Roller as docs/clients.md says."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import registry
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.wrappers import FlattenObservation

from roller_env.game.observations import STATE_ENTRIES, layout

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "clients.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture
def no_new_ids() -> Any:
    """Forget afterwards what was registered."""
    before = dict(registry)
    yield
    registry.clear()
    registry.update(before)


@pytest.mark.usefixtures("no_new_ids")
@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: str(block).splitlines()[-1][:40])
def test_every_block_of_the_page_runs(
    block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    monkeypatch.chdir(tmp_path)
    if "rgb_array" in block:
        request.getfixturevalue("opengl")
    names: dict[str, Any] = {}
    exec(block, names)  # noqa: S102 - the project's own page
    if "RecordVideo" in block:
        films = list((tmp_path / "films").glob("*.mp4"))
        assert len(films) == 1
        assert films[0].stat().st_size > 1000
    else:
        assert list(tmp_path.iterdir()) == []
    for env in names.values():
        if isinstance(env, (gym.Env, VectorEnv)):
            env.close()


def test_a_program_that_imports_nothing_finds_roller_by_its_name() -> None:
    code = """
import gymnasium as gym
assert not any("roller" in name for name in gym.registry)
print(gym.make("roller_env:Roller/Flat-v0").unwrapped)
print(gym.make_vec("roller_env:Roller/Flat-v0", 2, autoreset_mode="SAME_STEP").unwrapped)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == [
        "<RollerEnv<Roller/Flat-v0>>",
        "RollerVectorEnv(Roller/Flat-v0, num_envs=2)",
    ]


@pytest.mark.usefixtures("no_new_ids")
def test_an_id_of_ones_own_has_its_options_alone_and_in_a_vector() -> None:
    (block,) = [block for block in BLOCKS if "gym.register" in block]
    names: dict[str, Any] = {}
    exec(block, names)  # noqa: S102 - the project's own page
    for env in (names["env"].unwrapped, names["envs"].unwrapped):
        assert (env.config.level, env.config.reward) == ("lift", "shaped")
        assert env.config.observation == "rays"
    assert names["envs"].metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP


def test_a_flattened_dict_is_alphabetical_and_the_state_is_not() -> None:
    by_name = gym.make("Roller/Gate-v0", observation="dict")
    state, _ = gym.make("Roller/Gate-v0", observation="state").reset(seed=1)
    flat, _ = FlattenObservation(by_name).reset(seed=1)
    places = layout(STATE_ENTRIES)
    assert np.array_equal(flat, np.concatenate([state[places[name]] for name in sorted(places)]))
    assert not np.array_equal(flat, state)
