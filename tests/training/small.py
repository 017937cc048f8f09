"""A training small enough for a test: seconds, not minutes."""

from __future__ import annotations

from typing import Any

from roller_env.training.config import TrainingConfig

UPDATES = 6


def small_config(**changes: Any) -> TrainingConfig:
    """Return a training of `UPDATES` updates on the flat level with a checkpoint after each."""
    fields: dict[str, Any] = {
        "level": "flat",
        "environment": {"reward": "shaped", "physics": "fast", "max_episode_steps": 40},
        "seed": 3,
        "num_envs": 8,
        "start_state_curriculum": 0.5,
        "total_steps": 8 * 16 * UPDATES,
        "checkpoint_interval_s": 0.0,
        "evaluation_episodes": 4,
        "ppo": {"rollout_steps": 16, "batch_size": 64, "epochs": 2, "hidden_sizes": [8]},
    }
    return TrainingConfig.model_validate(fields | changes)
