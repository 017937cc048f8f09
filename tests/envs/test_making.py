"""What can be asked for when an environment is made, and what is said when it cannot."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from roller_env import ENV_IDS
from roller_env.config import EnvConfig, make_config
from roller_env.envs.single import RollerEnv
from roller_env.envs.vector import RollerVectorEnv
from roller_env.game.result import REWARD_TERMS
from roller_env.game.rewards import RewardWeights
from roller_env.level import load_level, shipped_levels
from roller_env.level.load import levels_directory
from roller_env.physics.presets import PhysicsPreset


def level_of(env: Any) -> str:
    return str(env.unwrapped.simulation.level.name)


def test_there_is_an_id_for_every_shipped_level_and_one_for_any() -> None:
    fixed = {options["level"] for options in ENV_IDS.values() if options}
    assert fixed == set(shipped_levels())
    for env_id, options in ENV_IDS.items():
        assert level_of(gym.make(env_id)) == options.get("level", "classic")


@pytest.mark.parametrize("kind", ["name", "string", "path", "level"])
def test_any_level_is_made_from_its_name_its_path_or_itself(kind: str) -> None:
    path = levels_directory() / "lift.yaml"
    source = {"name": "lift", "string": str(path), "path": path, "level": load_level("lift")}[kind]
    assert level_of(gym.make("Roller/Level-v0", level=source)) == "lift"
    assert level_of(gym.make_vec("Roller/Level-v0", 2, level=source)) == "lift"


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize("spelling", ["mode", "name", "value"])
def test_make_vec_takes_the_autoreset_mode_as_a_keyword(mode: AutoresetMode, spelling: str) -> None:
    given = {"mode": mode, "name": mode.name, "value": mode.value}[spelling]
    env = gym.make_vec("Roller/Flat-v0", 3, autoreset_mode=given)
    assert isinstance(env.unwrapped, RollerVectorEnv)
    assert env.metadata["autoreset_mode"] is mode


def test_make_vec_takes_every_option_and_keeps_it_in_the_spec() -> None:
    env = gym.make_vec(
        "Roller/Level-v0",
        num_envs=2,
        vectorization_mode="vector_entry_point",
        level="gate",
        max_episode_steps=4,
        control_dt_s=0.1,
        reward_weights=RewardWeights(coin=2.0),
    )
    assert env.spec is not None
    again = gym.make_vec(env.spec)
    for made in (env, again):
        made.reset(seed=0)
        ends = [made.step(np.zeros(2, int))[3].tolist() for _ in range(4)]
        assert ends == [[False] * 2] * 3 + [[True] * 2]
        assert made.unwrapped.num_envs == 2
        assert level_of(made) == "gate"


def test_max_episode_steps_of_gym_make_truncates_like_that_of_a_vector() -> None:
    single = gym.make("Roller/Flat-v0", max_episode_steps=4)
    single.reset(seed=0)
    ends = [single.step(0)[3] for _ in range(4)]
    assert ends == [False, False, False, True]


def test_the_longest_episode_is_the_levels_time_limit() -> None:
    env = gym.make("Roller/Flat-v0", max_episode_steps=10**6)
    env.reset(seed=0)
    steps = 1
    while not env.step(0)[3]:
        steps += 1
    assert steps * 0.05 == pytest.approx(load_level("flat").time_limit_s)


def test_a_control_step_of_another_length_is_as_many_physics_steps() -> None:
    env = RollerEnv(level="flat", control_dt_s=1 / 60, physics="fast")
    assert env.config.substeps == 2
    assert env.metadata["render_fps"] == 60
    custom = EnvConfig(physics=PhysicsPreset("mine", dt_s=0.001), control_dt_s=0.02)
    assert custom.substeps == 20


BAD: list[tuple[dict[str, Any], str]] = [
    ({"action": "direction"}, r"action: found 'direction'; .*'force'; did you mean 'directions'"),
    ({"action": ["keys"]}, r"action: found \['keys'\]; allowed"),
    ({"observation": "ray"}, r"observation: found 'ray'; .*did you mean 'rays'"),
    ({"reward": "point"}, r"reward: found 'point'; .*did you mean 'points'"),
    ({"reward": None}, r"reward: found None; allowed are 'points', 'shaped'"),
    ({"render_mode": "human"}, r"render_mode: found 'human'; allowed are None, 'rgb_array'"),
    ({"camera": 6}, r"camera: found 6; allowed are 'game', 0, 1, 2, 3, 4, 5"),
    ({"camera": True}, r"camera: found True; allowed"),
    ({"camera": "gane"}, r"camera: found 'gane'; .*did you mean 'game'"),
    ({"reward_weights": 3}, r"reward_weights: found 3; must be a RewardWeights or a mapping"),
    ({"reward_weights": {"coins": 1}}, r"reward_weights: .*'coins'; .*did you mean 'coin'"),
    ({"reward_weights": {"coin": True}}, r"reward_weights.coin: found True; must be a finite"),
    ({"physics": {"name": "mine"}}, r"physics: found no dt_s; must have it"),
    ({"physics": {"name": "mine", "dt_s": 0}}, r"physics.dt_s: found 0; must be .* 1e-05 to 1"),
    ({"physics": {"dt": 0.01}}, r"physics: found the unknown key 'dt'; .*did you mean 'dt_s'"),
    ({"level": {"name": "mine", "start": {"at": [0, 0, 1]}}}, r"finish: missing; wanted"),
    ({"level": b"flat"}, r"level: found b'flat'; must be"),
    ({"discount": 1.5}, r"discount: found 1.5; must be .*0 to 1"),
    ({"discount": float("nan")}, r"discount: found nan; must be .*0 to 1"),
    ({"discount": "0.9"}, r"discount: found '0.9'; must be .*0 to 1"),
    ({"control_dt_s": 0.003}, r"control_dt_s: found 0.003, .*nearest is 0.004166666667"),
    ({"control_dt_s": 0.0}, r"control_dt_s: found 0.0; must be .*more than 0"),
    ({"control_dt_s": -0.05}, r"control_dt_s: found -0.05; must be .*more than 0"),
    ({"control_dt_s": float("inf")}, r"control_dt_s: found inf; must be .*more than 0"),
    ({"control_dt_s": "0.05"}, r"control_dt_s: found '0.05'; must be .*more than 0"),
    ({"physics": "defualt"}, r"physics: found 'defualt'; .*did you mean 'default'"),
    ({"physics": 3}, r"physics: found 3; allowed are 'fast'"),
    ({"discount": np.array([0.5])}, r"discount: found array\(\[0.5\]\); must be"),
    ({"discount": 10**400}, r"discount: found 1000.*; must be"),
    ({"max_episode_steps": 0}, r"max_episode_steps: found 0; must be .*from 1"),
    ({"max_episode_steps": 2.0}, r"max_episode_steps: found 2.0; must be a whole number"),
    ({"width": 8}, r"width: found 8; must be a whole number from 16 to 4096"),
    ({"height": 10**6}, r"height: found 1000000; must be"),
    ({"num_threads": -1}, r"num_threads: found -1; must be"),
    ({"num_threads": True}, r"num_threads: found True; must be"),
    ({"level": "clasic"}, r"'clasic'.*'classic'"),
    ({"level": None}, r"level: found None"),
    ({"level": 3}, r"level: found 3"),
    ({"reward": np.array(["points"])}, r"reward: found array"),
]

UNKNOWN: list[tuple[dict[str, Any], str]] = [
    (
        {"observaton": "rays"},
        r"got an unexpected keyword argument 'observaton'; .*did you mean 'observation'",
    ),
    # What TorchRL offers every environment, and looks for in the answer.
    ({"frameskip": 4}, r"got an unexpected keyword argument 'frameskip'; options are level, "),
]


@pytest.mark.parametrize(("options", "says"), BAD, ids=lambda value: str(value)[:40])
def test_a_bad_option_is_one_error_that_says_what_and_what_would_be_right(
    options: dict[str, Any], says: str
) -> None:
    for make in makers(options):
        with pytest.raises(ValueError, match=says) as caught:
            make()
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("options", "says"), UNKNOWN)
def test_an_unknown_keyword_is_told_in_pythons_own_words(
    options: dict[str, Any], says: str
) -> None:
    for make in makers(options):
        with pytest.raises(TypeError, match=says):
            make()


def makers(options: dict[str, Any]) -> list[Callable[[], Any]]:
    """Return all ways of making an environment with these options."""
    ways: list[Callable[[], Any]] = [
        lambda: RollerEnv(**options),
        lambda: RollerVectorEnv(2, **options),
        lambda: gym.make_vec("Roller/Level-v0", 2, **options),
    ]
    if "render_mode" not in options and "max_episode_steps" not in options:
        ways.append(lambda: gym.make("Roller/Level-v0", **options))
    return ways


@pytest.mark.parametrize("name", REWARD_TERMS)
@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_weight_that_is_no_finite_number_is_refused(name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"reward_weights.{name}: found .*; must be a finite"):
        RewardWeights(**{name: value})


@pytest.mark.parametrize("num_envs", [0, -1, 2.0, "2", True])
def test_a_number_of_games_that_is_none_is_refused(num_envs: Any) -> None:
    with pytest.raises(ValueError, match=r"num_envs: found .*; must be"):
        RollerVectorEnv(num_envs)


def test_numpys_numbers_are_numbers_in_every_option() -> None:
    number: Any = np.int64
    config = make_config(
        max_episode_steps=np.int64(5),
        width=np.int32(64),
        height=np.uint8(48),
        camera=np.int64(2),
        num_threads=np.int16(1),
        discount=np.float64(0.5),
        control_dt_s=np.float64(0.1),
        action=np.str_("keys"),
        reward_weights=RewardWeights(coin=np.float64(2.0)),
        physics=PhysicsPreset("mine", dt_s=np.float64(0.01), iterations=number(30)),
    )
    plain = make_config(
        max_episode_steps=5,
        width=64,
        height=48,
        camera=2,
        num_threads=1,
        discount=0.5,
        control_dt_s=0.1,
        action="keys",
        reward_weights=RewardWeights(coin=2.0),
        physics=PhysicsPreset("mine", dt_s=0.01, iterations=30),
    )
    assert config == plain
    assert json.dumps(config.to_json()) == json.dumps(plain.to_json())
    assert RollerVectorEnv(number(2), level="flat").num_envs == 2


BAD_PRESETS: list[tuple[dict[str, Any], str]] = [
    ({"dt_s": 0}, r"dt_s: found 0; must be a number of seconds from 1e-05 to 1"),
    ({"dt_s": -0.01}, r"dt_s: found -0.01; must be"),
    ({"dt_s": float("nan")}, r"dt_s: found nan; must be"),
    ({"dt_s": float("inf")}, r"dt_s: found inf; must be"),
    ({"dt_s": True}, r"dt_s: found True; must be"),
    ({"dt_s": "0.01"}, r"dt_s: found '0.01'; must be"),
    ({"dt_s": None}, r"dt_s: found None; must be"),
    ({"integrator": "rk4"}, r"integrator: found 'rk4'; allowed are .*; did you mean 'RK4'"),
    ({"integrator": "verlet"}, r"integrator: found 'verlet'; allowed are 'Euler', "),
    ({"cone": "elliptical"}, r"cone: found 'elliptical'; .*did you mean 'elliptic'"),
    ({"solver": "newton"}, r"solver: found 'newton'; .*did you mean 'Newton'"),
    ({"solver": 2}, r"solver: found 2; allowed are 'Newton'"),
    ({"impratio": 0.0}, r"impratio: found 0.0; must be"),
    ({"impratio": float("nan")}, r"impratio: found nan; must be"),
    ({"iterations": 0}, r"iterations: found 0; must be a whole number from 1 to 1000"),
    ({"iterations": True}, r"iterations: found True; must be"),
    ({"iterations": 20.0}, r"iterations: found 20.0; must be"),
    ({"iterations": 10**9}, r"iterations: found 1000000000; must be"),
    ({"tolerance": -1e-9}, r"tolerance: found -1e-09; must be"),
    ({"tolerance": float("nan")}, r"tolerance: found nan; must be"),
    ({"name": ""}, r"name: found ''; must be text"),
    ({"name": 3}, r"name: found 3; must be text"),
]


@pytest.mark.parametrize(("values", "says"), BAD_PRESETS, ids=lambda value: str(value)[:30])
def test_a_preset_is_checked_like_a_level(values: dict[str, Any], says: str) -> None:
    given: dict[str, Any] = {"name": "mine", "dt_s": 0.01, **values}
    with pytest.raises(ValueError, match=rf"^physics\.{says}"):
        PhysicsPreset(**given)
    with pytest.raises(ValueError, match=rf"^physics\.{says}"):
        make_config(physics=given)


def test_an_unknown_autoreset_mode_is_refused_with_those_there_are() -> None:
    with pytest.raises(
        ValueError, match=r"autoreset_mode: found 'Same'; .*did you mean 'SAME_STEP'"
    ):
        gym.make_vec("Roller/Flat-v0", 2, autoreset_mode="Same")


WRONG_ACTIONS: list[tuple[str, Any, str]] = [
    ("directions", 9, "found 9 to 9; 'directions' takes 0 to 8"),
    ("directions", -1, "takes 0 to 8"),
    ("directions", 1.0, "takes .* integers"),
    ("keys", np.zeros(3), r"'keys' takes \(N, 4\)"),
    ("keys", np.array([np.nan, 0, 0, 7]), "found nan; 'keys' takes 0 and 1"),
    ("force", np.array([np.nan, 0.0]), "found nan; 'force' takes -1 to 1"),
    ("force", np.array([1.5, 0.0]), "found 1.5; 'force' takes -1 to 1"),
    ("force", np.array([1j, 0.0]), "of complex128; 'force' takes"),
]


@pytest.mark.parametrize(("mode", "action", "says"), WRONG_ACTIONS)
def test_an_action_outside_the_space_is_refused_before_any_physics(
    mode: str, action: Any, says: str
) -> None:
    env = RollerEnv(level="flat", action=mode)
    env.reset(seed=0)
    before = env.simulation.snapshot().physics
    with pytest.raises(ValueError, match=says):
        env.step(action)
    assert env.simulation.snapshot().physics.tobytes() == before.tobytes()
    batch = np.array([action, action])
    vector = RollerVectorEnv(2, level="flat", action=mode)
    vector.reset(seed=0)
    with pytest.raises(ValueError, match=says):
        vector.step(batch)


def test_as_many_actions_as_rows_are_needed() -> None:
    env = RollerVectorEnv(3, level="flat")
    env.reset(seed=0)
    with pytest.raises(ValueError, match="found 2 rows; needed are 3"):
        env.step(np.zeros(2, int))


def test_a_level_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    missing = tmp_path / "nowhere.yaml"
    with pytest.raises(ValueError, match=r"nowhere\.yaml"):
        gym.make("Roller/Level-v0", level=missing)
