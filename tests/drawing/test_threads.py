"""Pictures from other threads than the one that made the environment, and from several at once."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from roller_env.drawing.canvas import Picture
from roller_env.envs.single import RollerEnv

pytestmark = pytest.mark.usefixtures("opengl")

Elsewhere = Callable[[Callable[[], Any]], Any]

SMALL: dict[str, Any] = {"width": 96, "height": 64}


def environment(level: str = "flat") -> RollerEnv:
    """Return an environment at the start of a game that is always the same."""
    env = RollerEnv(level=level, render_mode="rgb_array", **SMALL)
    env.reset(seed=0)
    return env


def picture(env: RollerEnv) -> Picture:
    drawn = env.render()
    assert drawn is not None
    return drawn


@pytest.fixture
def elsewhere() -> Iterator[Elsewhere]:
    """Run something in another thread, always the same one, and return its result."""
    with ThreadPoolExecutor(1) as thread:
        yield lambda work: thread.submit(work).result(60.0)


def test_an_environment_is_drawn_by_whatever_thread_asks(elsewhere: Elsewhere) -> None:
    env = environment()
    here = picture(env)
    assert np.array_equal(elsewhere(lambda: picture(env)), here)
    assert np.array_equal(picture(env), here)
    env.close()


def test_an_environment_is_closed_by_another_thread_than_has_drawn_it(elsewhere: Elsewhere) -> None:
    env, other = environment(), environment()
    expected = picture(other)
    elsewhere(lambda: picture(env))
    env.close()
    picture(env)
    elsewhere(env.close)
    assert np.array_equal(picture(other), expected)
    other.close()


def test_threads_that_draw_at_the_same_time_see_their_own_games() -> None:
    levels = ("flat", "bridge", "flat", "bridge")
    envs = [environment(level) for level in levels]
    expected = [picture(env) for env in envs]
    assert not np.array_equal(expected[0], expected[1])
    with ThreadPoolExecutor(len(envs)) as threads:
        rounds = [threads.map(picture, envs, timeout=60.0) for _ in range(5)]
        for pictures in rounds:
            assert all(map(np.array_equal, pictures, expected))
    for env in envs:
        env.close()


def test_threads_that_draw_one_game_at_the_same_time_see_it_whole() -> None:
    env = environment()
    expected = picture(env)
    with ThreadPoolExecutor(4) as threads:
        drawn = list(threads.map(lambda _: picture(env), range(12), timeout=60.0))
    assert all(np.array_equal(one, expected) for one in drawn)
    env.close()


def test_an_environment_that_nobody_closed_spoils_no_other_ones_pictures() -> None:
    forgotten, kept = environment(), environment()
    picture(forgotten)
    expected = picture(kept)
    del forgotten
    gc.collect()
    assert np.array_equal(picture(kept), expected)
    kept.close()
