"""One game as a `gymnasium.Env`."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from roller_env.config import EnvConfig, make_config
from roller_env.drawing.renderer import GameRenderer
from roller_env.envs import spaces
from roller_env.game.actions import forces
from roller_env.simulation import Simulation


class RollerEnv(gym.Env[Any, Any]):
    """Roll a ball over a level with four keys: coins are points, the finish or a fall ends it.

    The options are the keywords of `roller_env.config.EnvConfig`; the README has them in a table,
    with the observation's entries and the order of events in a step.

    The episode ends (``terminated``) at the finish, after a fall and when the physics diverges,
    and is cut off (``truncated``) at the level's time limit. The last ``info`` holds ``success``,
    ``score_percent``, ``coins``, ``time_s``, ``fall`` and ``diverged``.

    Version history:
        v0: first version.
    """

    # Gymnasium reads the class's before an environment is made, and writes none.
    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012

    def __init__(self, **options: Any):
        """Make the environment; see `roller_env.config.EnvConfig` for the options.

        Raises:
            ValueError: an option is unknown or its value is not allowed.
            LevelError: the level is not valid.
        """
        self.config: EnvConfig = make_config(**{"num_threads": 1, **options})
        self.simulation = Simulation(self.config, num_envs=1)
        self.action_space = spaces.action_space(self.config)
        self.observation_space = spaces.observation_space(self.config)
        self.render_mode = self.config.render_mode
        self.metadata = {**self.metadata, "render_fps": round(1.0 / self.config.control_dt_s)}
        self._renderer: GameRenderer | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: seeds the environment's generator, as Gymnasium says.
            options: ``{"intro": True}`` begins as the original does when it is started: the ball
                hangs still for 1.17 s, and the keys work after 6 s.
        """
        super().reset(seed=seed)
        self.simulation.seed([self.np_random])
        self.simulation.reset(intro=bool((options or {}).get("intro", False)))
        return self._observation(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance by one control step.

        Raises:
            gymnasium.error.ResetNeeded: the episode is over, or none has begun.
            ValueError: the action is not in the action space.
        """
        if self.simulation.state.over[0]:
            raise gym.error.ResetNeeded("step: no episode is under way; call reset() first")
        force = forces(self.config.action, np.asarray(action)[None])
        transition = self.simulation.step(force)
        terminated, truncated = bool(transition.terminated[0]), bool(transition.truncated[0])
        info: dict[str, Any] = {}
        if terminated or truncated:
            results = self.simulation.results(np.array([0]))
            info = {name: value[0].item() for name, value in results.items()}
        return self._observation(), float(transition.reward[0]), terminated, truncated, info

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Return a picture, (height, width, 3) uint8, or None without a render mode."""
        if self.render_mode is None:
            gym.logger.warn("render: make the environment with render_mode='rgb_array'")
            return None
        return self._picture()

    def close(self) -> None:
        """Free the renderer, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def get_keys_to_action(self) -> dict[tuple[str, ...], Any]:
        """Return the actions of held W, A, S, D, as `gymnasium.utils.play.play` asks for them.

        When none is held, `play` takes its argument ``noop``: the default, 0, is right for
        ``directions``; for ``keys`` give it ``np.zeros(4, np.int8)``, for ``force``
        ``np.zeros(2, np.float32)``.
        """
        return spaces.keys_to_action(self.config.action)

    def _observation(self) -> Any:
        if self.config.observation == "pixels":
            return self._picture()
        return spaces.shape_observation(self.config, self.simulation.observe()[0])

    def _picture(self) -> npt.NDArray[np.uint8]:
        if self._renderer is None:
            self._renderer = GameRenderer(self.simulation, self.config.width, self.config.height)
        return self._renderer.render(0, self.config.camera)
