"""What Gymnasium's specs and Minari's data sets keep of an environment, and what comes back."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.config import EnvConfig, make_config
from roller_env.envs.single import RollerEnv
from roller_env.game.rewards import RewardWeights
from roller_env.level import Level, load_level, parse_level, shipped_levels
from roller_env.level.load import levels_directory
from roller_env.physics.presets import PRESETS, PhysicsPreset
from tests.strategies import levels

WEIGHTS = RewardWeights(coin=2.0, fall=-3.5)
PRESET = PhysicsPreset("mine", dt_s=0.01, integrator="Euler", iterations=33)
OBJECTS: dict[str, Any] = {
    "level": load_level("gate"),
    "reward_weights": WEIGHTS,
    "physics": PRESET,
    "max_episode_steps": np.int64(70),
    "width": np.int32(64),
}


@st.composite
def options(draw: Any) -> dict[str, Any]:
    """Any options, as Python's objects or as plain values."""
    finite = st.floats(-1e6, 1e6)
    weights = draw(st.builds(RewardWeights, coin=finite, finish=finite, fall=finite))
    preset = draw(
        st.builds(
            PhysicsPreset,
            name=st.text(min_size=1, max_size=20),
            dt_s=st.just(0.005),
            integrator=st.sampled_from(["Euler", "RK4", "implicit"]),
            solver=st.sampled_from(["Newton", "PGS", "CG"]),
            iterations=st.integers(1, 1000),
            impratio=st.floats(0.1, 100.0),
            tolerance=st.floats(0.0, 1.0),
        )
    )
    level: Level = draw(st.one_of(st.sampled_from(shipped_levels()).map(load_level), levels()))
    plain = level.model_dump(mode="json", exclude_defaults=True)
    return {
        "level": draw(st.sampled_from([level, plain, "flat", Path("some/level.yaml")])),
        "reward_weights": draw(st.sampled_from([weights, asdict(weights), {"coin": 3}])),
        "physics": draw(st.sampled_from([preset, asdict(preset), *PRESETS])),
        "discount": draw(st.floats(0.0, 1.0)),
        "camera": draw(st.sampled_from(["game", 0, 5])),
        "render_mode": draw(st.sampled_from([None, "rgb_array"])),
        "max_episode_steps": draw(st.none() | st.integers(1, 10**6)),
    }


@settings(max_examples=30)
@given(options())
def test_every_option_comes_back_equal_from_json(given: dict[str, Any]) -> None:
    config = make_config(**given)
    written = json.dumps(config.to_json(), allow_nan=False)
    again = make_config(**json.loads(written))
    assert again == config
    assert json.dumps(again.to_json()) == written
    assert set(config.to_json()) == set(EnvConfig.__dataclass_fields__)


def test_an_environment_comes_back_equal_from_the_json_of_its_spec() -> None:
    made = {name: value for name, value in OBJECTS.items() if name != "max_episode_steps"}
    env = gym.make("Roller/Level-v0", max_episode_steps=70, **made)
    assert env.spec is not None
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.spec == env.spec
    assert same_game(env, again)
    assert again.get_wrapper_attr("config").level == OBJECTS["level"]


@pytest.mark.parametrize("mode", AutoresetMode)
def test_a_vector_comes_back_equal_from_the_json_of_its_spec(mode: AutoresetMode) -> None:
    env = gym.make_vec("Roller/Level-v0", 2, autoreset_mode=mode, **OBJECTS)
    assert env.spec is not None
    again = gym.make_vec(EnvSpec.from_json(env.spec.to_json()))
    assert again.metadata == env.metadata
    assert again.unwrapped.config == env.unwrapped.config  # type: ignore[attr-defined]
    found, _ = again.reset(seed=1)
    expected, _ = env.reset(seed=1)
    assert found.tobytes() == expected.tobytes()


def same_game(one: Any, other: Any) -> bool:
    assert one.unwrapped.config == other.unwrapped.config
    first, second = one.reset(seed=3)[0], other.reset(seed=3)[0]
    steps = [(env.step(1)[0].tobytes()) for env in (one, other)]
    return bool(first.tobytes() == second.tobytes() and steps[0] == steps[1])


def test_a_spec_that_was_registered_is_not_changed_by_the_environments_made_of_it() -> None:
    before = gym.spec("Roller/Level-v0").kwargs.copy()
    env = RollerEnv(level=load_level("gate"))
    spec = EnvSpec("Roller/Mine-v0", entry_point="x:y", kwargs={"level": OBJECTS["level"]})
    env.spec = spec
    assert spec.kwargs == {"level": OBJECTS["level"]}
    env.spec = None
    assert env.spec is None
    assert gym.spec("Roller/Level-v0").kwargs == before


def test_a_level_can_be_given_by_the_fields_of_its_file() -> None:
    text = (levels_directory() / "classic.yaml").read_text(encoding="utf-8")
    fields: dict[str, Any] = json.loads(json.dumps(load_level("classic").model_dump(mode="json")))
    assert make_config(level=fields).level == parse_level(text)
    quants = {
        "name": "small",
        "units": "quant",
        "start": {"at": [0, 0, 16]},
        "finish": {"at": [200, 0, 16], "size": [16, 16, 32]},
        "boxes": [{"at": np.array([0, 0, -8]), "size": (512, 512, np.int64(16))}],
    }
    level = make_config(level=quants).level
    assert isinstance(level, Level)
    assert level.start.at[2] == pytest.approx(0.4064)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"start": {"at": [0, 0, "high"]}}, r"start.at\[2\]: found the text 'high'; allowed"),
        ({"start": {"at": [0, 0, 0.1]}}, r"start.at: the ball, .* would start inside boxes\[0\]"),
        ({"box": []}, r"box: unknown field 'box'; .*did you mean 'boxes'"),
        ({3: []}, r"found 3 as the name of a field; wanted text"),
        ({"title": {"a": object()}}, r"title: found .*; allowed"),
    ],
)
def test_what_is_wrong_in_a_levels_fields_is_told_as_in_its_file(
    change: dict[Any, Any], says: str
) -> None:
    fields: dict[Any, Any] = {
        "name": "small",
        "start": {"at": [0, 0, 0.4064]},
        "finish": {"at": [5, 0, 0.5], "size": [1, 1, 1]},
        "boxes": [{"at": [0, 0, -0.1], "size": [20, 20, 0.2]}],
    }
    make_config(level=fields)
    with pytest.raises(ValueError, match=says):
        make_config(level={**fields, **change})
    nested: dict[str, Any] = {}
    nested["title"] = nested
    with pytest.raises(ValueError, match="nested more than 32 levels deep"):
        make_config(level=nested)
