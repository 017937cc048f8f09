"""A live environment in a notebook."""

from __future__ import annotations

import html

import gymnasium as gym
import pytest

import roller_env  # noqa: F401 - registers the ids
from roller_env.play.notebook import NotebookRender
from roller_env.replay import verify


def test_a_cell_shows_the_episode_so_far_as_it_was() -> None:
    env = NotebookRender(gym.make("Roller/Flat-v0", physics="rigid"))
    with pytest.raises(gym.error.ResetNeeded, match="no episode has begun"):
        env.render()
    env.reset(seed=3)
    for _ in range(20):
        env.step(1)
    shown = env.render()
    assert len(shown.replay) == 20
    assert verify(shown.replay).is_exact
    frame = shown._repr_html_()
    assert frame.startswith("<iframe srcdoc=")
    page = html.unescape(frame.partition('srcdoc="')[2].partition('" width')[0])
    assert page.startswith("<!doctype html>")
    assert "window.ROLLER" in page
    env.step(1)
    assert len(env.render().replay) == 21
    assert len(shown.replay) == 20
    env.reset(seed=4)
    assert len(env.render().replay) == 0


def test_another_environment_is_refused() -> None:
    with pytest.raises(TypeError, match="must be one of the Roller environments"):
        NotebookRender(gym.make("CartPole-v1"))
