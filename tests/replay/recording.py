"""Episodes on record, made in a moment."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from roller_env.config import make_config
from roller_env.game.actions import DIRECTIONS, forces
from roller_env.replay import Recorder, Replay, record_episode
from roller_env.simulation import Simulation
from tests.simulation.driving import simulation_of, wandering

Float64 = npt.NDArray[np.float64]


@cache
def wandered(level: str = "flat", seed: int = 0, intro: bool = False, **options: Any) -> Replay:
    """Return a replay of a ball pushed about at random in a level."""
    check_every = options.pop("check_every", None)
    config = make_config(**{"level": level, "physics": "fast", "num_threads": 1} | options)
    pushes = wandering(1, seed)

    def act(_: Simulation) -> Float64:
        return next(pushes)

    return record_episode(
        config, act, seed=seed, intro=intro, player="at random", check_every=check_every
    )


def straight_on(level: Any, steps: int, direction: int = 1, **options: Any) -> Replay:
    """Return a replay of one direction held for some steps, ended or not."""
    simulation = simulation_of(level, num_threads=1, **options)
    recorder = Recorder(simulation)
    recorder.begin()
    for _ in range(steps):
        force = forces("directions", [direction])
        simulation.step(force)
        recorder.record(force)
    return recorder.replay()


def pushed_otherwise(played: Replay, step: int) -> Replay:
    """Return a replay in which one step's direction is not what was recorded."""
    actions = played.actions.copy()
    actions[step] = (actions[step] + 4) % len(DIRECTIONS)
    return replace(played, actions=actions)


def same(one: Replay, other: Replay) -> bool:
    """Say whether two replays are equal in everything, to the bit."""
    plain = ("level", "options", "start", "intro", "result", "versions", "player", "seed")
    sums, others = one.checksums, other.checksums
    return (
        all(getattr(one, name) == getattr(other, name) for name in plain)
        and one.actions.dtype == other.actions.dtype
        and one.actions.tobytes() == other.actions.tobytes()
        and (sums.every, sums.quantities) == (others.every, others.quantities)
        and np.array_equal(sums.table, others.table)
    )
