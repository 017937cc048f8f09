"""Contestants that take turns: on a shared machine only what ran side by side can be compared."""

from __future__ import annotations

import statistics
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Pace:
    """How long a race is.

    Attributes:
        rounds: times that every contestant has its turn; medians are over these.
        round_s: about how long one turn lasts, wall seconds.
        warm_up_s: game time before the first round, so that the states have spread.
    """

    rounds: int
    round_s: float
    warm_up_s: float

    def __post_init__(self) -> None:
        """Refuse what measures nothing."""
        if self.rounds < 1:
            raise ValueError(f"rounds: found {self.rounds}; at least 1")
        for name in ("round_s", "warm_up_s"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name}: found {getattr(self, name)}; must be more than 0")


class Contestant(ABC):
    """Something that can be stepped against the clock.

    Attributes:
        name: what tables call it.
        env_steps: environment steps in one of its steps, such as the number of environments.
        simulated_s: simulated time of one environment step; NaN where that means nothing.
        steps_done: its steps so far.
    """

    def __init__(self, name: str, env_steps: int, simulated_s: float) -> None:
        self.name = name
        self.env_steps = env_steps
        self.simulated_s = simulated_s
        self.steps_done = 0

    def run(self, steps: int) -> float:
        """Do ``steps`` steps and return the wall seconds that they took."""
        self.steps_done += steps
        return self._run(steps)

    @abstractmethod
    def _run(self, steps: int) -> float:
        """Do ``steps`` steps; preparations that a user would not pay for are not counted."""

    def prepare(self, pace: Pace) -> int:
        """Warm up, and return the steps of one round."""
        self.run(max(1, round(pace.warm_up_s / self.simulated_s)))
        return self._steps_for(pace.round_s)

    def verify(self) -> None:  # noqa: B027 - most have nothing to verify
        """Raise if what was timed was not what should have been."""

    def _steps_for(self, seconds: float) -> int:
        steps = 1
        while (taken := self.run(steps)) < seconds / 4:
            steps *= 2
        return max(1, round(steps * seconds / taken))


@dataclass(frozen=True, slots=True)
class Result:
    """What one contestant did.

    Attributes:
        contestant: who.
        seconds: of one environment step, round by round.
    """

    contestant: Contestant
    seconds: tuple[float, ...]

    @property
    def env_steps_per_s(self) -> Median:
        """Environment steps a wall second."""
        return Median.of([1.0 / seconds for seconds in self.seconds])


@dataclass(frozen=True, slots=True)
class Median:
    """A median over rounds, with the smallest and the largest."""

    value: float
    low: float
    high: float

    @staticmethod
    def of(values: Sequence[float]) -> Median:
        """Return the median of at least one value."""
        return Median(statistics.median(values), min(values), max(values))

    @property
    def spread(self) -> float:
        """(largest - smallest) / median: how far the machine can be believed."""
        return (self.high - self.low) / self.value


def race(contestants: Sequence[Contestant], pace: Pace) -> dict[str, Result]:
    """Let contestants take turns, round by round; return the results by name.

    A contestant that follows another stands behind it.
    """
    steps = [contestant.prepare(pace) for contestant in contestants]
    seconds: list[list[float]] = [[] for _ in contestants]
    for _ in range(pace.rounds):
        for contestant, count, samples in zip(contestants, steps, seconds, strict=True):
            samples.append(contestant.run(count) / (count * contestant.env_steps))
    for contestant in contestants:
        contestant.verify()
    return {
        contestant.name: Result(contestant, tuple(samples))
        for contestant, samples in zip(contestants, seconds, strict=True)
    }


def speed_ratio(ours: Result, theirs: Result) -> Median:
    """Return how many environment steps ``ours`` does while ``theirs`` does one.

    Round against round, so that a machine that slows down meanwhile slows both.
    """
    pairs = zip(ours.seconds, theirs.seconds, strict=True)
    return Median.of([their_s / our_s for our_s, their_s in pairs])


def simulated_ratio(ours: Result, theirs: Result) -> Median:
    """Return how much simulated time ``ours`` passes while ``theirs`` passes one second."""
    steps = speed_ratio(ours, theirs)
    factor = ours.contestant.simulated_s / theirs.contestant.simulated_s
    return Median(steps.value * factor, steps.low * factor, steps.high * factor)
