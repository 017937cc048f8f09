"""Gymnasium alone: its checkers, every vector wrapper, all ways to make a vector, and learning.

The cross-entropy method needs no more than NumPy: of many linear policies the best few say where
the next ones are drawn, one policy a row of a vector.
"""

from __future__ import annotations

import json
import os
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import wrappers as single
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import vector

ID = "roller_env:Roller/Flat-v0"
PICTURE = {"render_mode": "rgb_array", "width": 32, "height": 32}
PIXELS = {"observation": "pixels", "width": 32, "height": 32}

WRAPPERS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "ArrayConversion": ({}, {"env_xp": np, "target_xp": np}),
    "ClipAction": ({"action": "force"}, {}),
    "ClipReward": ({}, {"min_reward": -1.0, "max_reward": 1.0}),
    "DictInfoToList": ({}, {}),
    "DtypeObservation": ({}, {"dtype": np.float64}),
    "FilterObservation": ({"observation": "dict"}, {"filter_keys": ["position", "velocity"]}),
    "FlattenObservation": ({"observation": "dict"}, {}),
    "GrayscaleObservation": (PIXELS, {}),
    "HumanRendering": (PICTURE, {}),
    "NormalizeObservation": ({}, {}),
    "NormalizeReward": ({}, {}),
    "NumpyToTorch": ({}, {}),
    "RecordEpisodeStatistics": ({}, {}),
    "RecordVideo": (PICTURE, {"video_folder": ".", "step_trigger": lambda step: step == 1}),
    "RescaleAction": ({"action": "force"}, {"min_action": -2.0, "max_action": 2.0}),
    "RescaleObservation": (PIXELS, {"min_obs": 0, "max_obs": 1}),
    "ReshapeObservation": ({}, {"shape": (5, 9)}),
    "ResizeObservation": (PIXELS, {"shape": (16, 16)}),
    "TransformAction": ({}, {"func": lambda actions: actions}),
    "TransformObservation": ({}, {"func": lambda observations: observations}),
    "TransformReward": ({}, {"func": lambda rewards: 2.0 * rewards}),
    "VectorizeTransformAction": (
        {"action": "force"},
        {"wrapper": single.RescaleAction, "min_action": -2.0, "max_action": 2.0},
    ),
    "VectorizeTransformObservation": (
        {},
        {"wrapper": single.DtypeObservation, "dtype": np.float64},
    ),
    "VectorizeTransformReward": (
        {},
        {"wrapper": single.ClipReward, "min_reward": -1.0, "max_reward": 1.0},
    ),
}
"""Of every wrapper the options of an environment that it is for, and what it wants to be told."""

FOR_OTHERS = {"JaxToNumpy", "JaxToTorch"}
"""For environments that are written in JAX."""

OUTSIDE = {"NumpyToTorch"}
"""Whose observations are not in the space that they name: tensors."""
if gym.__version__.startswith("1.2."):
    # It keeps the bounds of what it normalises, CartPole's too.
    OUTSIDE.add("NormalizeObservation")


def check_makers() -> None:
    """Make one environment and all kinds of vectors, and hold the first to Gymnasium's checker."""
    check_env(gym.make(ID).unwrapped, skip_render_check=True)
    for mode in (None, "sync", "async", "vector_entry_point"):
        for autoreset in gym.vector.AutoresetMode:
            told = {"autoreset_mode": autoreset}
            by_mode = {"vector_kwargs": told} if mode in ("sync", "async") else told
            envs = gym.make_vec(ID, 2, mode, max_episode_steps=3, **by_mode)
            envs.action_space.seed(0)
            envs.reset(seed=0)
            for _ in range(3):
                *_, truncations, _ = envs.step(envs.action_space.sample())
            assert truncations.all()
            envs.close()


def check_wrappers() -> list[str]:
    """Step a vector in every wrapper that Gymnasium has, and return their names."""
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
    names = sorted(set(vector.__all__) - FOR_OTHERS)
    for name in names:
        options, arguments = WRAPPERS[name]
        envs = getattr(vector, name)(gym.make_vec(ID, 3, **options), **arguments)
        observations, _ = envs.reset(seed=0)
        for _ in range(3):
            observations, rewards, *_ = envs.step(envs.action_space.sample())
        assert len(rewards) == 3
        if name not in OUTSIDE:
            assert envs.observation_space.contains(observations), name
        envs.close()
    return names


def learn(policies: int = 64, elite: int = 8, generations: int = 12) -> list[float]:
    """Search linear policies by the cross-entropy method; return every policy's return."""
    envs: Any = gym.make_vec(
        ID, policies, reward="shaped", physics="rigid", control_dt_s=0.1, max_episode_steps=100
    )
    envs = vector.NormalizeObservation(vector.RecordEpisodeStatistics(envs, buffer_length=10**6))
    rng = np.random.default_rng(0)
    shape = (envs.single_observation_space.shape[0], envs.single_action_space.n)
    every: list[float] = []
    mean, spread = np.zeros(shape), np.ones(shape)
    for _ in range(generations):
        weights = mean + spread * rng.standard_normal((policies, *shape))
        returns = np.full(policies, np.nan)
        observations, _ = envs.reset(seed=int(rng.integers(2**31)))
        while np.isnan(returns).any():
            actions = np.einsum("ps,psa->pa", observations, weights).argmax(axis=1)
            observations, _, _, _, infos = envs.step(actions)
            if "episode" in infos:
                ended = infos["_episode"] & np.isnan(returns)
                returns[ended] = infos["episode"]["r"][ended]
        best = weights[np.argsort(returns)[-elite:]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + 0.1
        every.extend(returns.tolist())
    envs.close()
    return every


if __name__ == "__main__":
    check_makers()
    wrapped = check_wrappers()
    used = f"check_env, all ways of make_vec, {len(wrapped)} vector wrappers; cross-entropy method"
    print(json.dumps({"used": used, "returns": learn()}))
