"""How good an agent is: whole episodes, each counted once, and intervals that say how sure."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.game.actions import forces
from roller_env.level.expand import expand
from roller_env.level.schema import Level
from roller_env.training.files import RunError
from roller_env.training.policy import Policy

CONFIDENCE: Final = 0.95
MAX_ROWS: Final = 256
"""Episodes played together; more are played one after another in the same rows."""

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
class Episode:
    """One episode, as it ended.

    Attributes:
        row: environment that played it.
        success: at the finish.
        fall: below the kill height.
        diverged: the physics failed; neither of the above.
        score_percent: coins over the level's coins, by the game's own rule.
        coins: collected.
        time_s: simulated.
        total_reward: undiscounted sum.
        steps: control steps.
        path: (steps, 3) float64 ball centre before every control step, world frame, metres.
        force_n: (steps, 2) float64 newtons of the keys in every control step.
    """

    row: int
    success: bool
    fall: bool
    diverged: bool
    score_percent: float
    coins: int
    time_s: float
    total_reward: float
    steps: int
    path: npt.NDArray[np.float64]
    force_n: npt.NDArray[np.float64]

    @property
    def outcome(self) -> str:
        """One of ``finish``, ``fall``, ``diverged``, ``time limit``."""
        if self.success:
            return "finish"
        if self.fall:
            return "fall"
        return "diverged" if self.diverged else "time limit"


@dataclass(frozen=True, slots=True)
class Evaluation:
    """The episodes of one agent on one level.

    Attributes:
        level: where they were played.
        seed: the environments'.
        episodes: in the order of their rows.
    """

    level: Level
    seed: int
    episodes: tuple[Episode, ...]

    @property
    def coins_in_level(self) -> int:
        """As many as can be collected."""
        return len(expand(self.level).coins)

    def table(self) -> dict[str, Estimate]:
        """Return the measures by name, in the order in which they are shown."""
        finished = [episode.time_s for episode in self.episodes if episode.success]
        return {
            "success rate": proportion(self._count(lambda episode: episode.success), len(self)),
            "score (%)": mean_with_interval([e.score_percent for e in self.episodes]),
            "coins": mean_with_interval([e.coins for e in self.episodes]),
            "time of an episode (s)": mean_with_interval([e.time_s for e in self.episodes]),
            "time to the finish (s)": mean_with_interval(finished),
            "fall rate": proportion(self._count(lambda episode: episode.fall), len(self)),
            "total reward": mean_with_interval([e.total_reward for e in self.episodes]),
        }

    def __len__(self) -> int:
        return len(self.episodes)

    def _count(self, holds: Callable[[Episode], bool]) -> int:
        return sum(map(holds, self.episodes))


def evaluate(
    policy: Policy, environments: RollerVecEnv, *, seed: int, episodes_per_row: int = 1
) -> Evaluation:
    """Play whole episodes.

    Every row plays the same number. Taking the first so many episodes that end anywhere would
    favour short ones, and so falls.

    Args:
        policy: what plays.
        environments: where; reset with the seed.
        seed: of the environments.
        episodes_per_row: played one after another.
    """
    environments.seed(seed)
    observations = environments.reset()
    ended: list[list[Episode]] = [[] for _ in range(environments.num_envs)]
    paths: list[list[npt.NDArray[np.float64]]] = [[] for _ in range(environments.num_envs)]
    pushes: list[list[npt.NDArray[np.float64]]] = [[] for _ in range(environments.num_envs)]
    playing = set(range(environments.num_envs))
    while playing:
        positions = environments.simulation.ball_position.copy()
        actions = policy(observations)
        force_n = forces(environments.simulation.config.action, actions)
        for row in playing:
            paths[row].append(positions[row])
            pushes[row].append(force_n[row])
        observations, _, dones, infos = environments.step(actions)
        for row in playing.intersection(np.flatnonzero(dones)):
            path, push = np.array(paths[row]), np.array(pushes[row])
            ended[row].append(_episode(int(row), infos[row], path, push))
            paths[row], pushes[row] = [], []
            if len(ended[row]) == episodes_per_row:
                playing.remove(row)
    return Evaluation(
        level=environments.level,
        seed=seed,
        episodes=tuple(episode for row in ended for episode in row),
    )


def rows_and_repeats(episodes: int) -> tuple[int, int]:
    """Return how many rows play how many episodes each, for at least `episodes` in all.

    Raises:
        RunError: it is none, or too many.
    """
    if not 1 <= episodes <= MAX_EPISODES:
        raise RunError(f"episodes: found {episodes}; must be 1 to {MAX_EPISODES}")
    repeats = math.ceil(episodes / MAX_ROWS)
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


def _episode(
    row: int,
    info: dict[str, Any],
    path: npt.NDArray[np.float64],
    force_n: npt.NDArray[np.float64],
) -> Episode:
    return Episode(
        row=row,
        success=bool(info["success"]),
        fall=bool(info["fall"]),
        diverged=bool(info["diverged"]),
        score_percent=float(info["score_percent"]),
        coins=int(info["coins"]),
        time_s=float(info["time_s"]),
        total_reward=float(info["episode"]["r"]),
        steps=int(info["episode"]["l"]),
        path=path,
        force_n=force_n,
    )
