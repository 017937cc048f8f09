"""An environment in a notebook: the episode so far, as the page shows it, drawn by the browser."""

from __future__ import annotations

import html
from typing import Any

import gymnasium as gym
import numpy as np

from roller_env.envs.single import RollerEnv
from roller_env.game.actions import forces
from roller_env.play.html import replay_html
from roller_env.replay import Recorder, Replay

HEIGHT_PIXELS = 480


class Shown:
    """An episode that a notebook shows when it is a cell's value.

    Attributes:
        replay: the episode.
    """

    def __init__(self, replay: Replay):
        """Show ``replay``."""
        self.replay = replay

    def _repr_html_(self) -> str:
        """Return a frame with a page of its own, as Jupyter asks for it."""
        page = html.escape(replay_html(self.replay))
        return (
            f'<iframe srcdoc="{page}" width="100%" height="{HEIGHT_PIXELS}" '
            'style="border: 0" allow="fullscreen"></iframe>'
        )


class NotebookRender(gym.Wrapper[Any, Any, Any, Any]):
    """Lets ``env.render()`` return the episode so far as a thing that Jupyter draws.

    Nothing is drawn here, and no OpenGL is needed: the browser draws what was recorded. It can be
    played, dragged through and looked at from every camera, also after the environment is gone.
    """

    def __init__(self, env: gym.Env[Any, Any]):
        """Wrap an environment of this package, or one that is wrapped already.

        Raises:
            TypeError: it is none.
        """
        super().__init__(env)
        inner = env.unwrapped
        if not isinstance(inner, RollerEnv):
            raise TypeError(f"env: found {env}; must be one of the Roller environments")
        self._inner = inner
        self._recorder = Recorder(inner.simulation)
        self._began = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode, and its record.

        Raises:
            ValueError: by ``options`` it begins in another state than the level's, of which no
                replay can tell.
        """
        found = super().reset(seed=seed, options=options)
        self._recorder.begin(seed=seed)
        self._began = True
        return found

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Make a step of it."""
        found = super().step(action)
        self._recorder.record(forces(self._inner.config.action, np.asarray(action)[None]))
        return found

    def render(self) -> Any:
        """Return the episode so far, a `Shown`.

        Raises:
            gymnasium.error.ResetNeeded: none has begun.
        """
        if not self._began:
            raise gym.error.ResetNeeded("render: no episode has begun; call reset() first")
        return Shown(self._recorder.replay())
