"""Behaviour cloning: a policy that begins by doing what was demonstrated (Pomerleau 1991).

Supervised learning of actions from observations, on the policy that PPO then goes on with.
"""

from __future__ import annotations

import copy
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize
from tqdm import tqdm

from roller_env.arrays import Bool, Float64, Int64
from roller_env.training.checkpoint import Progress, save_checkpoint
from roller_env.training.config import CloningConfig, TrainingConfig
from roller_env.training.demonstrations import Demonstration, chosen
from roller_env.training.files import RunFiles
from roller_env.training.normalisation import WHOLE, statistics
from roller_env.training.ppo import make_environments, new_model

STATISTICS_ROLLOUTS: Final = 10
"""The demonstrations' mean and variance of the observations weigh as much as those of so many
rollouts. Left at their own number of samples, the first rollout would move them so far that the
cloned network would see another world."""


@dataclass(frozen=True, slots=True)
class Cloning:
    """What was learnt.

    Attributes:
        samples: decisions learnt from.
        held_out: decisions of the episodes that were held out.
        accuracy: share of those in which the policy's best action is the demonstrated one; a force
            counts as that of the keys it is nearest to.
        chance: what always doing the most frequent action would reach.
        epochs: after which the policy was best on the episodes held out; it is that one.
    """

    samples: int
    held_out: int
    accuracy: float
    chance: float
    epochs: int

    def __str__(self) -> str:
        """Say it in a line."""
        return (
            f"cloned {self.samples:,} decisions: {self.accuracy:.1%} of {self.held_out:,} held out "
            f"are the demonstrated ones after {self.epochs} epochs (always the commonest: "
            f"{self.chance:.1%})"
        )


def start_from_demonstrations(
    config: TrainingConfig, demonstrations: Sequence[Demonstration], files: RunFiles
) -> Cloning:
    """Write the checkpoint of a training that has made no step yet and knows its demonstrations.

    Args:
        config: of the training.
        demonstrations: two episodes or more.
        files: of the run.
    """
    begin_s = time.monotonic()
    torch.set_num_threads(config.torch_threads)
    environments = make_environments(config)
    model = new_model(config, environments)
    cloning = clone(model, demonstrations, config.cloning, config.seed)
    weigh_statistics(model, STATISTICS_ROLLOUTS * config.steps_per_update)
    # The seeds count from the first reset on, and the checkpoint holds generators, not seeds.
    environments.reset()
    progress = Progress(wall_s=time.monotonic() - begin_s)
    save_checkpoint(files.checkpoint, model, config, progress)
    return cloning


def clone(
    model: PPO, demonstrations: Sequence[Demonstration], config: CloningConfig, seed: int
) -> Cloning:
    """Teach a learner's policy, and its normalisation, what was demonstrated.

    The value network learns the demonstrations' returns, where their rewards are known. They are
    better than its policy's own will be, but PPO's first updates, led by a network that knows
    nothing, would undo what was cloned.

    Args:
        model: with its environments inside a VecNormalize; changed in place.
        demonstrations: two episodes or more.
        config: how to learn.
        seed: of the choice of the episodes held out and of the samples' order.
    """
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(demonstrations))
    count = max(1, round(config.held_out_fraction * len(demonstrations)))
    learnt = [demonstrations[i] for i in order[count:]]
    normaliser = model.get_vec_normalize_env()
    assert normaliser is not None
    _learn_statistics(normaliser, learnt)
    train = _samples(model, normaliser, learnt)
    test = _samples(model, normaliser, [demonstrations[i] for i in order[:count]])
    optimizer = torch.optim.Adam(model.policy.parameters(), lr=config.learning_rate)
    best_loss, best_epoch, best = np.inf, 0, copy.deepcopy(model.policy.state_dict())
    with tqdm(range(1, config.epochs + 1), desc="cloning", unit=" epochs") as bar:
        for epoch in bar:
            for batch in np.array_split(
                rng.permutation(len(train)), -(-len(train) // config.batch_size)
            ):
                samples = train.rows(batch)
                loss = _policy_loss(model, samples) + model.vf_coef * _value_loss(model, samples)
                optimizer.zero_grad()
                loss.backward()  # type: ignore[no-untyped-call]
                torch.nn.utils.clip_grad_norm_(model.policy.parameters(), model.max_grad_norm)
                optimizer.step()
            with torch.no_grad():
                test_loss = float(_policy_loss(model, test))
            bar.set_postfix_str(f"held out: loss {test_loss:.3f}, {_accuracy(model, test):.1%}")
            if test_loss < best_loss:
                best_loss, best_epoch = test_loss, epoch
                best = copy.deepcopy(model.policy.state_dict())
    model.policy.load_state_dict(best)
    return Cloning(
        samples=len(train),
        held_out=len(test),
        accuracy=_accuracy(model, test),
        chance=_chance(model.action_space, train.actions.numpy(), test.actions.numpy()),
        epochs=best_epoch,
    )


def weigh_statistics(model: PPO, samples: float) -> None:
    """Let the statistics that were learnt weigh as much as those of so many samples, or more."""
    normaliser = model.get_vec_normalize_env()
    assert normaliser is not None
    for known in (*statistics(normaliser).values(), normaliser.ret_rms):
        # Nothing was learnt of what still has the count it begins with.
        if known.count > 1.0:
            known.count = max(known.count, samples)


@dataclass(frozen=True, slots=True)
class _Samples:
    """Decisions: normalised observations, actions, and normalised returns, NaN where unknown."""

    observations: Any
    actions: torch.Tensor
    returns: torch.Tensor

    def __len__(self) -> int:
        return len(self.actions)

    def rows(self, numbers: Int64) -> _Samples:
        rows = torch.from_numpy(numbers)
        return _Samples(chosen(self.observations, rows), self.actions[rows], self.returns[rows])


def _samples(
    model: PPO, normaliser: VecNormalize, demonstrations: Sequence[Demonstration]
) -> _Samples:
    seen = normaliser.normalize_obs(_joined([d.observations for d in demonstrations]))
    returns = [_returns(d, normaliser) for d in demonstrations]
    # What the likelihoods of SB3's distributions are computed with.
    kind = torch.long if isinstance(model.action_space, spaces.Discrete) else torch.float32
    return _Samples(
        observations=model.policy.obs_to_tensor(seen)[0],
        actions=torch.as_tensor(np.concatenate([d.actions for d in demonstrations]), dtype=kind),
        returns=torch.as_tensor(np.concatenate(returns), dtype=torch.float32),
    )


def _returns(demonstration: Demonstration, normaliser: VecNormalize) -> Float64:
    """Return what was still to come at each step, as PPO sees rewards, (T,); NaN if not known."""
    if demonstration.rewards is None:
        return np.full(len(demonstration), np.nan)
    returns = normaliser.normalize_reward(demonstration.rewards.copy()).astype(np.float64)
    for step in range(len(returns) - 2, -1, -1):
        returns[step] += normaliser.gamma * returns[step + 1]
    return returns


def _policy_loss(model: PPO, samples: _Samples) -> torch.Tensor:
    """Return the mean negative log-likelihood of the demonstrated actions."""
    likelihood = model.policy.get_distribution(samples.observations).log_prob(samples.actions)
    return -likelihood.mean()


def _value_loss(model: PPO, samples: _Samples) -> torch.Tensor:
    """Return the mean squared error of the returns that are known."""
    error = model.policy.predict_values(samples.observations).flatten() - samples.returns
    return torch.nan_to_num(error).square().mean()


def _accuracy(model: PPO, data: _Samples) -> float:
    with torch.no_grad():
        actions = model.policy.get_distribution(data.observations).get_actions(deterministic=True)
    return float(_same(model.action_space, actions.numpy(), data.actions.numpy()).mean())


def _same(space: spaces.Space[Any], one: npt.NDArray[Any], other: npt.NDArray[Any]) -> Bool:
    """Say which actions, (n,), are the same; of forces, which are nearest to the same keys."""
    if isinstance(space, spaces.Box):
        one, other = (np.round(np.clip(actions, -1.0, 1.0)) for actions in (one, other))
    same: Bool = (one == other).reshape(len(other), -1).all(axis=1)
    return same


def _chance(
    space: spaces.Space[Any], learnt: npt.NDArray[Any], held_out: npt.NDArray[Any]
) -> float:
    kinds, counts = np.unique(learnt, axis=0, return_counts=True)
    commonest = np.broadcast_to(kinds[counts.argmax()], held_out.shape)
    return float(_same(space, commonest, held_out).mean())


def _joined(parts: Sequence[Any]) -> Any:
    if isinstance(parts[0], dict):
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return np.concatenate(parts)


def _learn_statistics(normaliser: VecNormalize, demonstrations: Sequence[Demonstration]) -> None:
    """Learn mean and variance of the observations, and the variance of the discounted rewards.

    As `VecNormalize` does, of which the rewards' running sum is.
    """
    seen = _joined([demonstration.observations for demonstration in demonstrations])
    parts = seen if isinstance(seen, dict) else {WHOLE: seen}
    for name, known in statistics(normaliser).items():
        known.update(parts[name])
    for demonstration in demonstrations:
        if demonstration.rewards is not None and normaliser.norm_reward:
            sums = demonstration.rewards.copy()
            for step in range(1, len(sums)):
                sums[step] += normaliser.gamma * sums[step - 1]
            normaliser.ret_rms.update(sums)
