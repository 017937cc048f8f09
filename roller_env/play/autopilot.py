"""Autopilot: a trained agent as the player of a person's game.

The game is stepped as finely as for a person, who may take over at any moment; the agent is asked
as often as in its training, and what it answered holds until then. It sees what it saw in training.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from roller_env.config import EnvConfig, LevelSource
from roller_env.envs.spaces import shape_observation
from roller_env.physics.presets import PhysicsPreset, physics_preset
from roller_env.problems import shown
from roller_env.simulation import Simulation
from roller_env.training.files import RunError
from roller_env.training.policy import Policy, TrainedPolicy, load_policy


class Autopilot:
    """Asks a policy for actions; a `roller_env.play.session.Player`."""

    def __init__(self, policy: Policy, steps_per_action: int):
        """Make a player of a policy.

        Args:
            policy: from observations to actions, leading axis of one row.
            steps_per_action: control steps of the game for which an action holds.
        """
        self._policy = policy
        self._steps_per_action = steps_per_action
        self._action: Any = None

    def reset(self) -> None:
        """Forget the action of the episode before."""
        self._action = None

    def __call__(self, simulation: Simulation) -> Any:
        """Return the action for the next control step."""
        if self._action is None or int(simulation.state.steps[0]) % self._steps_per_action == 0:
            observation = shape_observation(
                simulation.config, simulation.entries, simulation.observe()
            )
            self._action = self._policy(observation)[0]
        return self._action


def load_autopilot(
    run: Path,
    level: LevelSource | None = None,
    physics: str | PhysicsPreset | None = None,
    *,
    trust: bool = False,
) -> tuple[EnvConfig, Autopilot]:
    """Return the options of a game that a run's agent can play, and the agent.

    Args:
        run: directory of the run, such as ``runs/ppo_classic-seed0``.
        level: what to play; by default what the agent was trained on.
        physics: likewise; by default the one of its evaluation.
        trust: see `load_policy`.

    Raises:
        RunError: not a run, or an agent that needs pictures.
    """
    policy: TrainedPolicy = load_policy(run, trust=trust)
    trained = policy.config.evaluation_environment
    if trained.observation == "pixels":
        raise RunError(f"{shown(run)}: its agent looks at pictures, which a page does not give it")
    preset = physics_preset(physics or trained.physics)
    per_action = max(1, round(trained.control_dt_s / preset.dt_s))
    limit = trained.max_episode_steps
    config = replace(
        trained,
        level=level or trained.level,
        physics=preset,
        control_dt_s=preset.dt_s,
        # What is counted in control steps: the same time in the finer ones.
        max_episode_steps=None if limit is None else limit * per_action,
        num_threads=1,
    )
    return config, Autopilot(policy, per_action)
