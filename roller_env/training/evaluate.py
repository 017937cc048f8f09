"""How good an agent is: whole episodes, each counted once, and intervals that say how sure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import NormalDist
from typing import Final

import numpy as np
from gymnasium.vector import AutoresetMode

from roller_env.envs.vector import RollerVectorEnv
from roller_env.game.actions import forces
from roller_env.game.result import EpisodeResult
from roller_env.level.expand import expand
from roller_env.level.schema import Level
from roller_env.replay import Recorder, Replay, ReplayError, save_replay
from roller_env.replay.contents import check_length
from roller_env.replay.file import SUFFIX
from roller_env.training.files import RunError
from roller_env.training.policy import Policy

CONFIDENCE: Final = 0.95
MAX_ENVS: Final = 256
"""Episodes played together; more are played one after another in the same environments."""

MAX_EPISODES: Final = 1_000_000

_RESAMPLES: Final = 10_000
_BOOTSTRAP_SEED: Final = 0


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean over episodes and its 95 % interval; NaN where no episode qualified."""

    mean: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Evaluation:
    """The episodes of one agent on one level.

    Attributes:
        level: where they were played.
        seed: the environments'.
        episodes_per_env: that every environment played, one after another.
        replays: of the episodes: all of the first environment, then all of the second, and so on.
    """

    level: Level
    seed: int
    episodes_per_env: int
    replays: tuple[Replay, ...]

    @property
    def results(self) -> tuple[EpisodeResult, ...]:
        """How the episodes ended, in their order."""
        return tuple(replay.result for replay in self.replays)

    @property
    def coins_in_level(self) -> int:
        """As many as can be collected."""
        return len(expand(self.level).coins)

    def table(self) -> dict[str, Estimate]:
        """Return the measures by name, in the order in which they are shown."""
        results = self.results
        finished = [result.time_s for result in results if result.success]
        return {
            "success rate": proportion(len(finished), len(self)),
            "score (%)": mean_with_interval([r.score_percent for r in results]),
            "coins": mean_with_interval([r.coins for r in results]),
            "time of an episode (s)": mean_with_interval([r.time_s for r in results]),
            "time to the finish (s)": mean_with_interval(finished),
            "fall rate": proportion(sum(r.fall for r in results), len(self)),
            "total reward": mean_with_interval([r.total_reward for r in results]),
        }

    def save_replays(self, directory: Path) -> list[Path]:
        """Write every episode as a replay and return the files, ``episode-0000.replay`` and so on.

        Raises:
            OSError: one cannot be written.
        """
        return [
            save_replay(replay, directory / f"episode-{number:04d}{SUFFIX}")
            for number, replay in enumerate(self.replays)
        ]

    def __len__(self) -> int:
        return len(self.replays)


def evaluate(
    policy: Policy,
    envs: RollerVectorEnv,
    *,
    seed: int,
    episodes_per_env: int = 1,
    player: str = "",
) -> Evaluation:
    """Play whole episodes, and record them.

    Every environment plays the same number. Taking the first so many episodes that end anywhere
    would favour short ones, and so falls.

    Args:
        policy: what plays.
        envs: where; reset with the seed. They reset in the next step, which leaves what has ended
            where it can be recorded.
        seed: of the environments.
        episodes_per_env: played one after another.
        player: who plays, in words, for whoever reads the replays.

    Raises:
        RunError: an episode may become longer than a replay can be.
        ValueError: the environments do not reset in the next step.
    """
    check_recordable(envs)
    if envs.autoreset_mode is not AutoresetMode.NEXT_STEP:
        raise ValueError(f"envs: found {envs.autoreset_mode}; must be {AutoresetMode.NEXT_STEP}")
    observations, _ = envs.reset(seed=seed)
    recorder = Recorder(envs.simulation, player)
    recorder.begin(np.arange(envs.num_envs))
    ended: list[list[Replay]] = [[] for _ in range(envs.num_envs)]
    to_play = np.full(envs.num_envs, episodes_per_env)
    over = np.zeros(envs.num_envs, dtype=bool)
    while to_play.any():
        actions = policy(observations)
        observations, _, terminated, truncated, _ = envs.step(actions)
        recorder.record(forces(envs.config.action, actions))
        # What was over before this step has begun anew in it.
        recorder.begin(np.flatnonzero(over & (to_play > 0)))
        over = terminated | truncated
        for row in np.flatnonzero(over & (to_play > 0)):
            ended[row].append(recorder.replay(int(row)))
            to_play[row] -= 1
    return Evaluation(
        level=envs.simulation.level,
        seed=seed,
        episodes_per_env=episodes_per_env,
        replays=tuple(replay for one in ended for replay in one),
    )


def check_recordable(envs: RollerVectorEnv) -> None:
    """Refuse environments whose episodes may become longer than a replay can be.

    Raises:
        RunError: they may.
    """
    config, level = envs.config, envs.simulation.level
    steps = math.ceil(level.time_limit_s / config.control_dt_s)
    try:
        check_length(config, min(steps, config.max_episode_steps or steps))
    except ReplayError as error:
        raise RunError(
            f"an evaluation keeps its episodes: {error}; set max_episode_steps"
        ) from None


def envs_and_repeats(episodes: int) -> tuple[int, int]:
    """Return how many environments play how many episodes each, for at least `episodes` in all.

    Raises:
        RunError: it is none, or too many.
    """
    if not 1 <= episodes <= MAX_EPISODES:
        raise RunError(f"episodes: found {episodes}; must be 1 to {MAX_EPISODES}")
    repeats = math.ceil(episodes / MAX_ENVS)
    return math.ceil(episodes / repeats), repeats


def proportion(successes: int, trials: int) -> Estimate:
    """Return a rate with its Wilson score interval.

    Unlike the normal approximation it stays inside [0, 1] and has a width at 0 and at 1.
    """
    if trials == 0:
        return Estimate(math.nan, math.nan, math.nan)
    z = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2.0)
    rate = successes / trials
    centre = (rate + z**2 / (2 * trials)) / (1 + z**2 / trials)
    half = z / (1 + z**2 / trials) * math.sqrt(rate * (1 - rate) / trials + (z / trials) ** 2 / 4)
    return Estimate(rate, max(centre - half, 0.0), min(centre + half, 1.0))


def mean_with_interval(values: Sequence[float]) -> Estimate:
    """Return a mean with its percentile bootstrap interval.

    Scores and times are bounded and skewed, so nothing is assumed about their distribution. The
    resampling is seeded: the same episodes give the same interval.
    """
    if not values:
        return Estimate(math.nan, math.nan, math.nan)
    sample = np.asarray(values, dtype=np.float64)
    rng = np.random.default_rng(_BOOTSTRAP_SEED)
    means = rng.choice(sample, size=(_RESAMPLES, sample.size)).mean(axis=1)
    low, high = np.quantile(means, [0.5 - CONFIDENCE / 2.0, 0.5 + CONFIDENCE / 2.0])
    return Estimate(float(sample.mean()), float(low), float(high))
