"""Does a graphics card play the games that the CPU plays, and how fast?"""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from roller_env.config import EnvConfig
from roller_env.envs.vector import RollerVectorEnv
from roller_env.game.actions import DIRECTIONS, forces
from roller_env.lab.cuda.compiler import cuda, numba
from roller_env.lab.cuda.games import CudaGames, Player
from roller_env.simulation import Simulation

WARM_UP_STEPS: Final = 100
"""Control steps before anything is timed, for the balls to spread: 5 s of each game."""

_CPU_ENVS: Final = 16_384


@dataclass(frozen=True, slots=True)
class Agreement:
    """How far games on a card are from the same games on the CPU.

    Attributes:
        steps: control steps under the same random actions.
        envs: how many began.
        played: how many of them are in their first episode on both.
        same: how many of those are equal to the last bit, the rules' state and the physics.
        other_rules: of how many the rules' state differs: a coin, a plate, a reward.
        mean_m: between the ball's centres, metres.
        largest_m: likewise.
    """

    steps: int
    envs: int
    played: int
    same: int
    other_rules: int
    mean_m: float
    largest_m: float


def agreement(player: Player, envs: int, after: Sequence[int]) -> Iterator[Agreement]:
    """Play the same games on the card and on the CPU; yield how they compare after some steps."""
    card = CudaGames(player, envs)
    card.step()
    simulation = Simulation(player.simulation.config, envs)
    simulation.reset()
    begun = card.state()
    simulation._physics.state[:] = begun["physics"]
    for name, array in simulation.state.named().items():
        array[:] = begun[name]
    random = np.random.default_rng(0)
    for step in range(1, max(after) + 1):
        force_n = forces("directions", random.integers(0, len(DIRECTIONS), envs))
        card.push(force_n)
        card.step()
        simulation.step(force_n)
        if step in after:
            yield _compared(card, simulation, step)


def _compared(card: CudaGames, simulation: Simulation, step: int) -> Agreement:
    there, here = card.state(), simulation.state.named()
    # A game that is over begins anew on the card and stands still here.
    played = (there["steps"] == step) & (here["steps"] == step)
    other = np.zeros(len(played), dtype=bool)
    for name, array in here.items():
        other |= (there[name] != array).reshape(len(played), -1).any(axis=1)
    bodies = (there["physics"] != simulation._physics.state).any(axis=1)
    apart = np.linalg.norm(there["physics"][:, :3] - simulation.ball_position, axis=1)[played]
    return Agreement(
        steps=step,
        envs=len(played),
        played=int(played.sum()),
        same=int((played & ~other & ~bodies).sum()),
        other_rules=int((played & other).sum()),
        mean_m=float(apart.mean()),
        largest_m=float(apart.max()),
    )


@dataclass(frozen=True, slots=True)
class Speed:
    """How fast games go.

    Attributes:
        device: what plays them.
        threads: of the CPU; 0 on a card, where each env has its own.
        envs: how many are stepped together.
        steps: that were timed.
        seconds: that they took.
        steps_per_s: environment steps a second.
    """

    device: str
    threads: int
    envs: int
    steps: int
    seconds: float
    steps_per_s: float


def card_speeds(player: Player, sizes: Sequence[int], seconds: float) -> Iterator[Speed]:
    """Yield how fast a card plays with random actions, drawn there, resets included."""
    for envs in sizes:
        games = CudaGames(player, envs)

        def step(games: CudaGames = games) -> None:
            games.draw()
            games.step()

        yield _timed(_name(), 0, envs, step, seconds, cuda.synchronize)


def cpu_speeds(asked: EnvConfig, seconds: float, ready: Callable[[], None]) -> Iterator[Speed]:
    """Yield how fast the vector environment plays on 1, 2, 4, ... threads, resets included.

    Args:
        asked: options of the envs.
        seconds: of timing, of each.
        ready: called before the first timing, when everything is compiled.
    """
    cores, threads = os.cpu_count() or 1, 1
    options = {name: getattr(asked, name) for name in ("level", "physics", "reward")}
    while threads <= cores:
        envs = RollerVectorEnv(_CPU_ENVS, num_threads=threads, **options)
        envs.reset(seed=0)
        envs.action_space.seed(0)
        actions = itertools.cycle([envs.action_space.sample() for _ in range(16)])
        if threads == 1:
            envs.step(next(actions))
            ready()

        def step(envs: RollerVectorEnv = envs, actions: Iterator[Any] = actions) -> None:
            envs.step(next(actions))

        yield _timed("cpu", threads, _CPU_ENVS, step, seconds, lambda: None)
        threads *= 2


def _timed(
    device: str,
    threads: int,
    envs: int,
    step: Callable[[], None],
    seconds: float,
    wait: Callable[[], object],
) -> Speed:
    """Return how fast steps go, after `WARM_UP_STEPS` of them."""
    for _ in range(WARM_UP_STEPS):
        step()
    wait()
    steps, begun = 0, time.perf_counter()
    while (taken := time.perf_counter() - begun) < seconds:
        for _ in range(10):
            step()
        wait()
        steps += 10
    return Speed(device, threads, envs, steps, taken, steps * envs / taken)


def _name() -> str:
    """Return the card's name."""
    if numba.config.ENABLE_CUDASIM:
        return "simulator"
    name = cuda.get_current_device().name
    return name.decode() if isinstance(name, bytes) else str(name)
