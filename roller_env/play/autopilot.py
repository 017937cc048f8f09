"""Autopilot: a trained agent as the player of a game that somebody watches.

The control step is the agent's own, so that the game is, bit for bit, the one of its evaluation,
until a person takes the ball.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from roller_env.config import EnvConfig, LevelSource
from roller_env.envs.spaces import shape_observation
from roller_env.game.actions import DIRECTIONS
from roller_env.physics.presets import PhysicsPreset, physics_preset
from roller_env.problems import shown
from roller_env.simulation import Simulation
from roller_env.training.files import RunError
from roller_env.training.policy import TrainedPolicy, load_policy


@dataclass(frozen=True, slots=True)
class Insight:
    """What an agent saw and thought at its last decision.

    Attributes:
        entries: the observation by name, as the environment gives it.
        actions: the names of the actions it chooses from; none if they are not of a finite number.
        probabilities: of each of them, in its own judgement.
        value: what it expects to be rewarded with from here on, discounted.
    """

    entries: dict[str, list[float]]
    actions: tuple[str, ...]
    probabilities: list[float]
    value: float


class Autopilot:
    """Asks a policy for actions; a `roller_env.play.session.Player`.

    Attributes:
        policy: the policy.
    """

    def __init__(self, policy: TrainedPolicy):
        """Make a player of a policy."""
        self.policy = policy

    def reset(self) -> None:
        """Nothing: it remembers nothing."""

    def __call__(self, simulation: Simulation) -> Any:
        """Return the action for the next control step."""
        return self.policy(self._observation(simulation))[0]

    def insight(self, simulation: Simulation) -> Insight:
        """Return what it sees and thinks of a game as it stands."""
        probabilities, value = self.policy.judge(self._observation(simulation))
        vector, entries, first = simulation.observe()[0].tolist(), {}, 0
        for entry in simulation.entries:
            entries[entry.name] = vector[first : first + entry.size]
            first += entry.size
        names = tuple(held.upper() or "none" for held in DIRECTIONS)
        return Insight(
            entries=entries,
            actions=names if probabilities is not None else (),
            probabilities=[] if probabilities is None else probabilities[0].tolist(),
            value=float(value[0]),
        )

    def _observation(self, simulation: Simulation) -> Any:
        return shape_observation(simulation.config, simulation.entries, simulation.observe())


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
    config = replace(
        trained,
        level=level or trained.level,
        physics=physics_preset(physics or trained.physics),
        num_threads=1,
    )
    return config, Autopilot(policy)
