"""An environment is a value: copied, pickled, put back to a state, begun where it is told."""

from __future__ import annotations

import copy
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import RecordEpisodeStatistics
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.envs.single import RollerEnv
from roller_env.envs.vector import RollerVectorEnv
from roller_env.level import load_level
from roller_env.level.load import levels_directory
from roller_env.physics.presets import PhysicsPreset
from roller_env.simulation import Simulation, Snapshot
from tests.envs.playing import bytes_of, row_of, wandering_actions
from tests.simulation.driving import bits, simulation_of, wandering

OPTIONS: dict[str, Any] = {
    "level": "bridge",
    "physics": "fast",
    "max_episode_steps": 60,
    "reward": "shaped",
}

COPIES: dict[str, Callable[[Any], Any]] = {
    "copied": copy.deepcopy,
    "pickled": lambda env: pickle.loads(pickle.dumps(env)),
}


def play(env: Any, actions: list[Any]) -> list[bytes]:
    """Step a single environment through these actions and its resets; return what was seen."""
    seen = []
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        info.pop("episode", None)  # has the wall clock's time
        seen.append(bytes_of(observation) + repr((reward, terminated, truncated, info)).encode())
        if terminated or truncated:
            seen.append(bytes_of(env.reset()[0]))
    return seen


def actions_of_one(count: int, seed: int) -> list[Any]:
    return [action[0] for action, _ in zip(wandering_actions(1, seed), range(count), strict=False)]


@pytest.fixture(scope="module")
def bare() -> Any:
    return RollerEnv(**OPTIONS)


@pytest.fixture(scope="module")
def wrapped() -> Any:
    return RecordEpisodeStatistics(gym.make("Roller/Level-v0", **OPTIONS))


@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("kind", ["bare", "wrapped"])
@settings(max_examples=5)
@given(data=st.data())
def test_an_environment_that_was_copied_goes_on_with_the_same_bits(
    request: pytest.FixtureRequest, kind: str, how: str, data: st.DataObject
) -> None:
    """After any number of steps, through resets, and each on its own."""
    env = request.getfixturevalue(kind)
    env.reset(seed=data.draw(st.integers(0, 2**40)))
    before, seed = data.draw(st.integers(0, 130)), data.draw(st.integers(0, 99))
    play(env, actions_of_one(before, seed))
    other = COPIES[how](env)
    assert other.unwrapped.np_random is not env.unwrapped.np_random
    assert other.unwrapped.np_random is other.unwrapped.simulation.generators[0]
    assert other.unwrapped.np_random_seed == env.unwrapped.np_random_seed
    assert other.spec == env.spec
    actions = actions_of_one(90, seed + 1)
    expected = play(env, actions)
    assert play(other, actions) == expected


@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("mode", AutoresetMode)
@settings(max_examples=3)
@given(before=st.integers(0, 130), seed=st.integers(0, 99))
def test_a_vector_that_was_copied_goes_on_with_the_same_bits(
    how: str, mode: AutoresetMode, before: int, seed: int
) -> None:
    """Its autoreset too: some rows are over when it is copied, and come back in both."""
    env = gym.make_vec("Roller/Level-v0", 4, autoreset_mode=mode, **OPTIONS)
    env.reset(seed=seed)
    actions = wandering_actions(4, seed)
    for action, _ in zip(actions, range(before), strict=False):
        step(env, action)
    other = COPIES[how](env)
    assert other.unwrapped.np_random_seed == env.unwrapped.np_random_seed
    assert other.metadata == env.metadata
    for action, _ in zip(actions, range(70), strict=False):
        assert step(other, action) == step(env, action)


def step(env: Any, action: Any) -> bytes:
    """Step a vector, and reset what is over where it does not do so itself; return what is seen."""
    observation, reward, terminated, truncated, info = env.step(action)
    seen: bytes = bytes_of(observation) + reward.tobytes() + (terminated | truncated).tobytes()
    done = terminated | truncated
    if env.metadata["autoreset_mode"] is AutoresetMode.DISABLED and done.any():
        observation, _ = env.reset(options={"reset_mask": done})
        seen += bytes_of(observation)
    return seen + bytes_of({name: info[name] for name in ("time_s", "coins")})


@pytest.mark.parametrize("how", COPIES)
def test_an_environment_can_be_copied_before_its_first_reset(how: str) -> None:
    env = RollerEnv(**OPTIONS)
    other = COPIES[how](env)
    with pytest.raises(gym.error.ResetNeeded):
        other.step(0)
    assert bytes_of(other.reset()[0]) == bytes_of(env.reset()[0])
    vector = RollerVectorEnv(2, **OPTIONS)
    with pytest.raises(gym.error.ResetNeeded):
        COPIES[how](vector).step(np.zeros(2, int))


def test_a_copy_needs_no_level_file_any_more(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_bytes((levels_directory() / "flat.yaml").read_bytes())
    env = RollerEnv(level=file)
    env.reset(seed=1)
    pickled = pickle.dumps(env)
    file.unlink()
    assert play(pickle.loads(pickled), [1] * 5) == play(env, [1] * 5)


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("how", COPIES)
def test_a_copy_draws_its_own_game(how: str) -> None:
    """The picture's OpenGL context is not copied but made anew."""
    env: Any = RollerEnv(level="flat", render_mode="rgb_array", width=48, height=40)
    env.reset(seed=0)
    first = env.render()
    other = COPIES[how](env)
    play(env, [1] * 30)
    assert np.array_equal(other.render(), first)
    assert not np.array_equal(env.render(), first)
    other.close()
    env.close()


@pytest.mark.parametrize("how", COPIES)
def test_a_simulation_can_be_copied_in_the_middle_of_games(how: str) -> None:
    one = simulation_of("classic", num_envs=3, reward="shaped", observation="rays")
    forces = wandering(3)
    for force, _ in zip(forces, range(25), strict=False):
        one.step(force)
    two = COPIES[how](one)
    for force, _ in zip(forces, range(25), strict=False):
        first, second = one.step(force), two.step(force)
        assert first.reward.tobytes() == second.reward.tobytes()
        assert bits(one) == bits(two)
        assert one.observe().tobytes() == two.observe().tobytes()


def test_a_state_brings_back_the_same_future_in_any_environment_of_the_game() -> None:
    env, other = RollerEnv(**OPTIONS), RollerEnv(**{**OPTIONS, "observation": "dict"})
    env.reset(seed=4)
    play(env, actions_of_one(25, 1))
    state = pickle.loads(pickle.dumps(env.get_state()))
    actions = actions_of_one(100, 2)
    expected = play(env, actions)
    env.set_state(state)
    assert play(env, actions) == expected
    other.set_state(state)
    assert play(other, actions)[0] != expected[0], "it observes a dict"
    other.set_state(state)
    for action in actions[:10]:
        env.set_state(other.get_state())
        assert env.step(action)[1:] == other.step(action)[1:]


def test_a_state_goes_into_any_rows_of_a_vector_and_leaves_the_others_alone() -> None:
    single, vector = RollerEnv(**OPTIONS), RollerVectorEnv(3, **OPTIONS)
    single.reset(seed=4)
    vector.reset(seed=9)
    play(single, actions_of_one(25, 1))
    others = vector.get_state([0, 2])
    vector.set_state(single.get_state(), [1])
    assert vector.get_state([0, 2]).physics.tobytes() == others.physics.tobytes()
    for action in actions_of_one(30, 2):
        found, expected = vector.step(np.full(3, action)), single.step(action)
        assert row_of(found[0], 1).tobytes() == expected[0].tobytes()
    vector.set_state(others, [2, 0])
    everywhere = single.get_state().take([0, 0, 0])
    vector.set_state(everywhere)
    assert len({row.tobytes() for row in vector.step(np.ones(3, int))[0]}) == 1
    mask = vector.get_state().take(np.array([True, False, True]))
    assert len(mask) == 2


def test_a_vector_that_was_never_reset_goes_on_from_a_state() -> None:
    one, two = RollerVectorEnv(2, **OPTIONS), RollerVectorEnv(2, **OPTIONS)
    one.reset(seed=1)
    two.set_state(one.get_state())
    action = np.ones(2, int)
    assert two.step(action)[0].tobytes() == one.step(action)[0].tobytes()


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"level": "flat"}, r"snapshot: found one of level 'bridge'; this simulation plays 'flat'"),
    ({"physics": "default"}, r"snapshot: found one of the physics .*'fast'.*'default'"),
    ({"control_dt_s": 0.1}, r"snapshot: found one with control_dt_s 0.05; .* has 0.1"),
]


@pytest.mark.parametrize(("options", "says"), REFUSED, ids=str)
def test_a_state_of_another_game_is_refused_before_anything_changes(
    options: dict[str, Any], says: str
) -> None:
    env = RollerEnv(**OPTIONS)
    env.reset(seed=0)
    state = env.get_state()
    other = RollerEnv(**{**OPTIONS, **options})
    other.reset(seed=0)
    before = other.get_state()
    for refused in (
        lambda: other.set_state(state),
        lambda: other.reset(seed=8, options={"state": state}),
    ):
        with pytest.raises(ValueError, match=says):
            refused()
        after = other.get_state()
        assert after.physics.tobytes() == before.physics.tobytes()
        assert after.generators == before.generators


def test_what_is_no_state_or_not_of_as_many_rows_is_refused() -> None:
    vector = RollerVectorEnv(3, **OPTIONS)
    vector.reset(seed=0)
    with pytest.raises(ValueError, match="rows: found 3 for a snapshot of 2"):
        vector.set_state(vector.get_state([0, 1]))
    with pytest.raises(ValueError, match=r"rows: found .* from 0 to 2"):
        vector.get_state([3])
    with pytest.raises(TypeError, match="snapshot: found"):
        vector.set_state([1, 2, 3])  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="snapshot: found"):
        vector.set_state(None)  # type: ignore[arg-type]
    single = RollerEnv(**OPTIONS)
    with pytest.raises(ValueError, match="rows: found 1 for a snapshot of 3"):
        single.set_state(vector.get_state())


def test_a_reset_to_a_state_begins_there_with_the_environments_own_chance() -> None:
    env = RollerEnv(**OPTIONS)
    env.reset(seed=4)
    play(env, actions_of_one(20, 1))
    state = env.get_state()
    seen = []
    for seed in (5, 6):
        observation, info = env.reset(seed=seed, options={"state": state})
        assert info["time_s"] == pytest.approx(1.0)
        seen.append((bytes_of(observation), bytes_of(env.reset()[0])))
    assert seen[0][0] == seen[1][0]
    assert seen[0][1] != seen[1][1]
    vector = RollerVectorEnv(2, **OPTIONS)
    observation, _ = vector.reset(seed=5, options={"state": state})
    assert [bytes_of(row) for row in observation] == [seen[0][0]] * 2
    assert [bytes_of(row) for row in vector.reset()[0]] == [seen[0][1], seen[1][1]]


def test_an_episode_cannot_begin_in_one_that_is_over() -> None:
    env = RollerEnv(**{**OPTIONS, "max_episode_steps": 2})
    env.reset(seed=0)
    env.step(0)
    env.step(0)
    with pytest.raises(ValueError, match=r"options\['state'\]: found rows \[0\] over"):
        env.reset(options={"state": env.get_state()})
    env.set_state(env.get_state())
    with pytest.raises(gym.error.ResetNeeded):
        env.step(0)


def test_an_episode_begins_where_it_is_told() -> None:
    env = RollerEnv(level="flat", observation="dict")
    count = int(env.simulation.coins_in_level[0])
    start = {"position": (1.0, 0.5, 0.45), "velocity": (0.5, -1.0, 0.0), "coins": [0, 2]}
    observation, info = env.reset(seed=1, options={**start, "angular_velocity": [0.0, 3.0, 1.0]})
    np.testing.assert_allclose(observation["position"], [1.0, 0.5, 0.45], rtol=1e-6)
    np.testing.assert_allclose(observation["velocity"], [0.5, -1.0, 0.0])
    np.testing.assert_allclose(observation["angular_velocity"], [0.0, 3.0, 1.0])
    assert observation["coins_present"].sum() == 2.0
    assert observation["coins_left"] == pytest.approx(2 / count)
    assert info["coins"] == count - 2
    left = np.isin(np.arange(count), [0, 2])
    again, _ = env.reset(seed=1, options={**start, "coins": left})
    assert again["coins"].tobytes() == observation["coins"].tobytes()
    # The generator has drawn what it draws in any reset.
    following = env.reset()[0]
    env.reset(seed=1)
    assert bytes_of(env.reset()[0]) == bytes_of(following)


def test_the_rows_of_a_vector_begin_where_each_is_told() -> None:
    env = RollerVectorEnv(3, level="flat", observation="dict")
    single = RollerEnv(level="flat", observation="dict")
    places = np.array([[0.5, 0.0, 0.45], [1.0, 0.5, 0.45], [1.5, -0.5, 0.45]])
    left = np.zeros((3, int(env.simulation.coins_in_level[0])), dtype=bool)
    left[1, :2] = True
    observation, info = env.reset(seed=7, options={"position": places, "coins": left})
    for row in range(3):
        options = {"position": places[row], "coins": left[row]}
        alone, alone_info = single.reset(seed=7 + row, options=options)
        assert bytes_of(row_of(observation, row)) == bytes_of(alone)
        assert alone_info == {name: info[name][row] for name in alone_info}
    mask = np.array([True, False, True])
    before = env.simulation.ball_position
    env.reset(options={"position": (2.0, 0.0, 0.45), "reset_mask": mask})
    moved = env.simulation.ball_position
    assert moved[mask].tolist() == [[2.0, 0.0, 0.45]] * 2
    assert moved[1].tolist() == before[1].tolist()


def test_a_start_on_the_way_is_paid_no_progress_that_lies_behind_it() -> None:
    env = RollerEnv(**OPTIONS)
    route = env.simulation.table.routes.points[0]
    env.reset(seed=0, options={"position": route[2] + [0.0, 0.0, 0.3]})
    assert env.simulation.state.shaping.waypoint[0] >= 2
    _, reward, *_ = env.step(0)
    assert abs(reward) < 0.5


def test_a_state_without_a_way_finds_it_where_progress_is_paid() -> None:
    """The route is followed only where it is rewarded; a state of elsewhere catches up."""
    points, shaped = (RollerEnv(**{**OPTIONS, "reward": r}) for r in ("points", "shaped"))
    for env in (points, shaped):
        env.reset(seed=3)
        for _ in range(22):
            env.step(1)
    waypoint = shaped.simulation.state.shaping.waypoint[0]
    assert points.simulation.state.shaping.waypoint[0] == 0 < waypoint
    other = RollerEnv(**OPTIONS)
    other.set_state(points.get_state())
    assert other.simulation.state.shaping.waypoint[0] == waypoint
    assert other.step(1)[1] == shaped.step(1)[1]


BAD_STARTS: list[tuple[Any, type[Exception], str]] = [
    (5, TypeError, r"options: found 5; must be None or a mapping"),
    ({"positon": (0, 0, 1)}, ValueError, r"the unknown key 'positon'; .*mean 'position'"),
    ({"intro": "yes"}, TypeError, r"options\['intro'\]: found 'yes'; must be True or False"),
    (
        {"position": (0, 0)},
        ValueError,
        r"options\['position'\]: found shape \(2,\); must be \(3,\)",
    ),
    ({"position": "here"}, TypeError, r"options\['position'\]: found 'here'; must be an array"),
    ({"position": [[1, 2], [3]]}, TypeError, r"options\['position'\]: found .* of numbers"),
    ({"position": (1j, 0, 0)}, TypeError, r"options\['position'\]: found .* of numbers"),
    ({"position": (0, 0, np.nan)}, ValueError, r"position: found .*nan.*; must be -5000 to 5000 m"),
    ({"position": (1e300, 0, 1)}, ValueError, r"position: found .*; must be -5000 to 5000 m"),
    ({"position": (0, 0, 0.1)}, ValueError, r"position: .* is inside .*; must be free space"),
    ({"position": (0, 0, -100)}, ValueError, r"position: found .*; must be above .*kill height"),
    ({"velocity": (np.inf, 0, 0)}, ValueError, r"velocity: found .*; must be .* m/s"),
    ({"angular_velocity": (0, 9e9, 0)}, ValueError, r"angular_velocity: found .*rad/s"),
    ({"coins": [-1]}, ValueError, r"options\['coins'\]: found \[-1\]; must be numbers from 0 to"),
    ({"coins": [10**6]}, ValueError, r"options\['coins'\]: found \[1000000\]; must be"),
    ({"coins": [0.5]}, TypeError, r"options\['coins'\]: found \[0.5\]; must be an array of bools"),
    ({"coins": [True]}, ValueError, r"options\['coins'\]: found shape \(1,\); must be"),
    ({"coins": "all"}, TypeError, r"options\['coins'\]: found 'all'"),
    ({"state": {}}, TypeError, r"options\['state'\]: found .*; must be what get_state\(\) returns"),
]


@pytest.mark.parametrize(
    ("options", "error", "says"), BAD_STARTS, ids=lambda value: str(value)[:30]
)
def test_a_reset_that_cannot_be_is_refused_before_anything_changes(
    options: Any, error: type[Exception], says: str
) -> None:
    for env in (RollerEnv(level="flat"), RollerVectorEnv(2, level="flat")):
        env.reset(seed=1)
        before = env.get_state()
        with pytest.raises(error) as refused:
            env.reset(seed=9, options=options)
        if isinstance(env, RollerEnv):
            assert re.search(says, str(refused.value))
        after: Snapshot = env.get_state()
        assert after.physics.tobytes() == before.physics.tobytes()
        assert after.generators == before.generators


def test_a_ball_does_not_begin_inside_the_finish() -> None:
    env = RollerEnv(level="flat")
    at = env.simulation.level.finish.at
    with pytest.raises(ValueError, match="is inside the finish; must be free space"):
        env.reset(options={"position": at})


def test_a_state_has_all_of_it() -> None:
    env = RollerEnv(level="flat")
    env.reset(seed=0)
    others: list[dict[str, Any]] = [{"position": (0, 0, 1)}, {"intro": True}, {"coins": []}]
    for other in others:
        with pytest.raises(ValueError, match=r"options\['state'\]: found with '\w+'; a state has"):
            env.reset(options={"state": env.get_state(), **other})


def test_a_level_without_coins_can_be_told_that_none_are_left() -> None:
    fields = load_level("flat").model_dump(mode="json", exclude_defaults=True)
    floor = {"at": (0.0, 0.0, -0.1), "size": (40.0, 40.0, 0.2)}
    level = {**fields, "coins": [], "floors": [], "boxes": [floor]}
    env = RollerEnv(level=level)
    nothing: list[Any] = [[], (), np.zeros(0, dtype=bool)]
    for none in nothing:
        assert env.reset(options={"coins": none})[1]["coins"] == 0


def test_a_copy_keeps_a_preset_of_ones_own() -> None:
    preset = PhysicsPreset("mine", dt_s=0.01, integrator="Euler")
    env = RollerEnv(level="flat", physics=preset)
    other: Simulation = pickle.loads(pickle.dumps(env.simulation))
    assert other.preset == preset
    assert other.duration_s == env.simulation.duration_s
