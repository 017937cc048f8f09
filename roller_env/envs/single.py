"""One game as a `gymnasium.Env`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec

from roller_env.arrays import UInt8
from roller_env.config import EnvConfig, LevelSource, make_config
from roller_env.envs import spaces
from roller_env.envs.arguments import reset_of, seed_of
from roller_env.envs.infos import single_info
from roller_env.envs.specs import plain_options, plain_spec
from roller_env.game.actions import forces
from roller_env.simulation import Simulation, Snapshot

if TYPE_CHECKING:
    from roller_env.drawing.renderer import GameRenderer


class RollerEnv(gym.Env[Any, Any]):
    """Roll a ball over a level with four keys: coins are points, the finish or a fall ends it.

    The options are the keywords of `roller_env.config.EnvConfig`; docs/environments.md has them and
    the observation's entries in tables, docs/rules.md the order of events in a step.

    The episode ends (``terminated``) at the finish, after a fall and when the physics diverges,
    and is cut off (``truncated``) at the level's time limit. Every ``info`` holds how the game
    stands: ``success`` (and ``is_success``, as Stable-Baselines3 calls it), ``score_percent``,
    ``coins``, ``time_s``, ``fall`` and ``diverged``.

    An environment is a value: it can be copied and pickled in the middle of an episode, and the
    copy goes on with the same bits, its random generator included. A picture's OpenGL context is
    not copied; the copy makes its own.

    Version history:
        v0: of every id, the first version. docs/baselines.md says what makes the next one.
    """

    # Gymnasium reads the class's before an environment is made, and writes none.
    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012

    def __init__(self, *, levels: Sequence[LevelSource] | None = None, **options: Any):
        """Make the environment; see `roller_env.config.EnvConfig` for the options.

        Args:
            levels: instead of the option ``level``: every reset draws one of them, and
                ``info["level"]`` says which; only with ``physics="rigid"`` or ``"relaxed"``.
            options: of the environment.

        Raises:
            TypeError: there is no option of that name.
            ValueError: an option's value is not allowed.
            LevelError: a level is not valid.
        """
        self.config: EnvConfig = make_config(**{"num_threads": 1, **options})
        self._spec: EnvSpec | None = None
        self.simulation = Simulation(self.config, 1, levels)
        self.action_space = spaces.action_space(self.config)
        self.observation_space = spaces.observation_space(self.config, self.simulation.entries)
        self.render_mode = self.config.render_mode
        self.metadata = {**self.metadata, "render_fps": round(1.0 / self.config.control_dt_s)}
        self._renderer: GameRenderer | None = None
        self.simulation.seed([self.np_random])

    @property
    def spec(self) -> EnvSpec | None:
        """What Gymnasium made it from; `EnvSpec.to_json` can write it."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = plain_spec(spec, plain_options(self.simulation))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: seeds the environment's generator, as Gymnasium says.
            options: of how the episode begins; docs/environments.md has them: ``intro``, ``state``,
                ``position``, ``velocity``, ``angular_velocity``, ``coins``.

        Raises:
            TypeError: the seed's or an option's type is wrong.
            ValueError: an option is unknown, or its or the seed's value is not allowed. Nothing
                has changed then.
        """
        wanted = reset_of(options, self.simulation, batched=False)
        super().reset(seed=seed_of(seed))
        self.simulation.seed([self.np_random])
        wanted.apply(self.simulation)
        return self._observation(), single_info(self.simulation)

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
        info = single_info(self.simulation)
        return self._observation(), float(transition.reward[0]), terminated, truncated, info

    def get_state(self) -> Snapshot:
        """Return all that the future depends on, the generator included; it can be pickled."""
        return self.simulation.snapshot()

    def set_state(self, state: Snapshot) -> None:
        """Go back to a state of this or of another environment that plays the same game.

        The same actions then give the same bits, also through later resets. For a new episode that
        begins in a state, with this environment's own generator, see ``reset(options=...)``.

        Raises:
            TypeError: it is no state.
            ValueError: it is of another level, physics preset or control step, or of more rows.
        """
        self.simulation.restore(state, np.array([0]))

    def render(self) -> UInt8 | None:
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
        return spaces.shape_observation(
            self.config, self.simulation.entries, self.simulation.observe()[0]
        )

    def _picture(self) -> UInt8:
        if self._renderer is None:
            # Not above: what is not drawn needs no MuJoCo on the rigid engine.
            from roller_env.drawing.renderer import GameRenderer

            self._renderer = GameRenderer(self.simulation, self.config.width, self.config.height)
        return self._renderer.render(0, self.config.camera)
