"""Held keys in, actions out."""

from __future__ import annotations

import os
import warnings
from typing import Any, get_args

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils import env_checker
from hypothesis import given
from hypothesis import strategies as st

from roller_env.envs.single import RollerEnv
from roller_env.game.actions import KEY_AXES, KEYS, ActionMode, forces
from roller_env.play.keyboard import ARROWS, Keyboard, KeyboardWrapper, letters
from tests.envs.checking import no_warnings_but_of_unbounded_observations

KEY_N = 5.08
MODES = get_args(ActionMode)
NAMES = (*KEYS, *ARROWS)


def wrapped(mode: Any) -> KeyboardWrapper:
    return KeyboardWrapper(gym.make("Roller/Flat-v0", action=mode))


@pytest.mark.parametrize("mode", MODES)
@given(held=st.lists(st.integers(0, 1), min_size=4, max_size=4))
def test_held_keys_become_the_action_that_pushes_as_they_do(mode: Any, held: list[int]) -> None:
    env = wrapped(mode)
    action = env.action(np.array(held))
    assert action in env.env.action_space
    assert forces(mode, np.asarray(action)[None])[0] == pytest.approx(
        KEY_N * np.array(held) @ KEY_AXES
    )


@pytest.mark.parametrize("mode", MODES)
def test_letters_and_numbers_say_the_same(mode: Any) -> None:
    env = wrapped(mode)
    assert np.array_equal(env.action("wd"), env.action([1, 0, 0, 1]))
    assert np.array_equal(env.action(""), env.action([0, 0, 0, 0]))


@pytest.mark.parametrize("mode", MODES)
def test_observations_rewards_and_infos_are_not_touched(mode: Any) -> None:
    env = wrapped(mode)
    plain = RollerEnv(level="flat", action=mode)
    first, _ = env.reset(seed=3)
    assert np.array_equal(first, plain.reset(seed=3)[0])
    done = False
    while not done:
        mine = env.step(np.array([1, 1, 0, 0], np.int8))
        bare = plain.step(env.action("wa"))
        assert np.array_equal(mine[0], bare[0])
        assert mine[1:] == bare[1:]
        done = mine[2] or mine[3]
    assert "score_percent" in mine[4]


def test_its_action_space_is_four_keys() -> None:
    env = wrapped("directions")
    assert env.action_space == gym.spaces.MultiBinary(4)
    env.reset(seed=0)
    env.step(env.action_space.sample())


@pytest.mark.parametrize("wrong", ["x", "wasdx", [1, 0, 0], [2, 0, 0, 0], [[1, 0, 0, 0]]])
def test_what_is_no_key_is_refused(wrong: Any) -> None:
    with pytest.raises(ValueError, match="keys: found"):
        wrapped("keys").action(wrong)


def test_an_environment_of_another_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="KeyboardWrapper: found"):
        KeyboardWrapper(gym.make("CartPole-v1"))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kept", ["as it is", "as JSON"])
def test_a_wrapped_environment_is_made_again_from_its_spec(kept: str, mode: Any) -> None:
    env = wrapped(mode)
    assert env.spec is not None
    spec = env.spec if kept == "as it is" else EnvSpec.from_json(env.spec.to_json())
    again = gym.make(spec)
    assert isinstance(again, KeyboardWrapper)
    assert again.spec == env.spec
    assert np.array_equal(env.reset(seed=5)[0], again.reset(seed=5)[0])
    for held in ([1, 0, 0, 0], [1, 0, 0, 1], [0, 0, 0, 0]):
        assert np.array_equal(env.step(held)[0], again.step(held)[0])


@pytest.mark.parametrize("mode", MODES)
def test_gymnasiums_checker_finds_nothing_wrong_with_a_wrapped_environment(mode: Any) -> None:
    with no_warnings_but_of_unbounded_observations():
        # The checker would rather have the bare environment, which `tests.envs` gives it.
        warnings.filterwarnings("ignore", message=".*is different from the unwrapped version.*")
        env_checker.check_env(wrapped(mode), skip_render_check=True)


@given(st.lists(st.tuples(st.booleans(), st.sampled_from(NAMES)), max_size=30))
def test_a_direction_is_held_while_its_letter_or_its_arrow_is(
    events: list[tuple[bool, str]],
) -> None:
    keyboard, down = Keyboard(), set()
    for pressed, key in events:
        if pressed:
            keyboard.press(key)
            down.add(key)
        else:
            keyboard.release(key)
            down.discard(key)
        expected = {ARROWS.get(key, key) for key in down}
        assert set(keyboard.held) == expected
        assert len(keyboard.held) == len(expected)


def test_all_keys_are_let_go_when_the_focus_is_lost() -> None:
    keyboard = Keyboard()
    for key in ("w", "left", "D"):
        keyboard.press(key)
    assert keyboard.held == "wad"
    keyboard.release_all()
    assert keyboard.held == ""


def test_keys_that_do_not_steer_are_no_directions() -> None:
    keyboard = Keyboard()
    for key in ("r", "c", "escape", ""):
        keyboard.press(key)
    assert keyboard.held == ""
    assert letters(["up", "a", "w"]) == "wa"


@pytest.mark.usefixtures("opengl")
def test_gymnasiums_own_play_drives_the_ball(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame = pytest.importorskip("pygame", reason="pygame is not installed")
    monkeypatch.setitem(os.environ, "SDL_VIDEODRIVER", "dummy")
    from gymnasium.utils.play import play

    env = RollerEnv(level="flat", render_mode="rgb_array", width=64, height=48)
    places: list[float] = []

    def watch(before: Any, after: Any, action: Any, *_: Any) -> None:
        places.append(float(env.simulation.ball_position[0, 0]))
        if len(places) == 1:
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=ord("w"), unicode="w"))
        if len(places) == 15:
            pygame.event.post(pygame.event.Event(pygame.QUIT))

    play(env, fps=1000, seed=0, callback=watch)
    # 0.7 s of one key: a t^2 / 2 with a = F / (1.4 m).
    assert places[-1] - places[0] == pytest.approx(KEY_N / 1.4 * 0.7**2 / 2, rel=0.2)
