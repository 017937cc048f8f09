"""What one thread of a graphics card does: a control step of one env, by the CPU's own kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np
from numba.cuda.random import xoroshiro128p_uniform_float64

from roller_env.arrays import Bool, Float32, Float64, Int64
from roller_env.compile.rigid import LARGEST
from roller_env.compiled import part
from roller_env.game.rewards import POINTS
from roller_env.game.step import (
    Concluding,
    Preparing,
    Rewarding,
    Showing,
    conclude,
    measure,
    observe,
    prepare,
)
from roller_env.game.tables import Movers
from roller_env.lab.cuda.compiler import cuda
from roller_env.physics.protocol import Columns
from roller_env.physics.rigid.scene import Scenes
from roller_env.physics.rigid.states import Counts
from roller_env.physics.rigid.step import advance
from roller_env.physics.rigid.workspace import SLAB, Workspace, work_record


class Rows(NamedTuple):
    """All that varies of N envs, side by side; everything else is a view of some columns.

    In memory a column's numbers lie one after the other, so that the threads of a warp, which have
    the same column of neighbouring envs before them, read one piece of memory.
    """

    reals: Any  # (N, D) float64, here and on the card
    counts: Any  # (N, C) int64
    flags: Any  # (N, F) bool


class Games(NamedTuple):
    """N envs of one level, and what they are played by.

    Attributes:
        scenes: what the balls meet.
        movers: of the level.
        jitter: (1, 2) of the start, metres.
        physics: (N, width) the engine's state.
        counts: what its steps took.
        at: where everything is in it.
        concluding: the level and the state of the rules.
        work: (N, `WORK`) numbers for hooks to work with.
        rewarding: what a step is worth.
        duration_s: of a control step.
        cap_s: longest step of RK4.
        rows: what the views of envs look at.
        fresh: (1, ...) the same of an env at its start.
        every: (N,) the numbers of the envs.
        unmoved: (1,) False: the route up to the start does not count as passed.
        random: (N,) generators.
    """

    scenes: Scenes
    movers: Movers
    jitter: Float64
    physics: Float64
    counts: Counts
    at: Columns
    concluding: Concluding
    work: Float64
    rewarding: Rewarding
    duration_s: float
    cap_s: float
    rows: Rows
    fresh: Rows
    every: Int64
    unmoved: Bool
    random: Any


@part
def _copy(rows: Any, fresh: Any, env: int) -> None:
    for column in range(fresh.shape[1]):
        rows[env, column] = fresh[0, column]


@part
def _begin(games: Games, env: int) -> None:
    """Put an env back to where the level begins, as `Simulation.reset` does."""
    _copy(games.rows.reals, games.fresh.reals, env)
    _copy(games.rows.counts, games.fresh.counts, env)
    _copy(games.rows.flags, games.fresh.flags, env)
    for axis in range(2):
        share = 2.0 * xoroshiro128p_uniform_float64(games.random, env) - 1.0
        games.physics[env, games.at.position + axis] += share * games.jitter[0, axis]
    if games.rewarding.potential != POINTS:
        envs = games.every[env : env + 1]
        concluding, at = games.concluding, games.at
        measure(concluding, games.physics, at, games.rewarding, envs, games.unmoved)


@part
def _end_diverged(games: Games, env: int, path: Float64, knots: Int64) -> None:
    """Put the physics of an env that diverged back to where it is finite, and end its game."""
    for column in range(games.physics.shape[1]):
        games.physics[env, column] = games.fresh.reals[0, column]
    for axis in range(3):
        path[0, 0, axis] = games.physics[env, games.at.position + axis]
        path[0, 0, 3 + axis] = 0.0
    knots[0] = 1
    games.concluding.state.diverged[env] = True


@part
def _diverged(body: Float64) -> bool:
    wrong = False
    for number in range(len(body)):
        wrong = wrong or not abs(body[number]) <= LARGEST
    return wrong


def step_of(knots: int, slabs: int, most_near: int) -> Callable[[Games, Float64, Float32], None]:
    """Return the kernel of a control step, of as many threads as there are envs, or more.

    An env that is over begins anew instead, as Gymnasium's NEXT_STEP has it. What an observation
    shows is written into the third argument, (N, entries).

    Args:
        knots: room for a path.
        slabs: of the scenes.
        most_near: solids that a cell of them lists.
    """
    work_type = np.dtype((np.record, work_record(most_near)))
    slab_type = np.dtype((np.record, SLAB))
    slab_room = max(slabs, 1)

    def step(games: Games, force_n: Float64, out: Float32) -> None:
        env = cuda.grid(1)
        if env >= len(games.every):
            return
        # A thread's own memory: the card interleaves it as `Rows` is.
        work = cuda.local.array(1, work_type)
        slab = cuda.local.array((1, slab_room), slab_type)
        path = cuda.local.array((1, knots, 6), numba.float64)
        many = cuda.local.array(1, numba.int64)
        c, at, envs = games.concluding, games.at, games.every[env : env + 1]
        state = c.state
        if state.finished[env] or state.fallen[env] or state.diverged[env] or state.truncated[env]:
            _begin(games, env)
        else:
            preparing = Preparing(
                c.level_of,
                games.movers,
                c.tables,
                c.owns,
                state.control_delay_s,
                state.signals,
                state.touching,
                state.kinds,
                c.hanging_s,
            )
            prepare(preparing, games.physics, at, games.duration_s, envs, force_n)
            advance(
                games.scenes,
                c.level_of,
                games.physics,
                games.counts,
                Workspace(work, slab),
                games.duration_s,
                games.cap_s,
                envs,
                path,
                many,
                0,
            )
            if _diverged(games.physics[env]):
                _end_diverged(games, env, path, many)
            conclude(c, games.physics, at, games.duration_s, games.rewarding, envs, path, many)
        showing = Showing(
            c.level_of,
            c.regions,
            games.movers,
            c.tables,
            c.owns,
            state.steps,
            state.kinds,
            c.max_steps,
            games.work,
        )
        for number in range(out.shape[1]):
            out[env, number] = 0.0
        observe(showing, games.physics, at, envs, out[env : env + 1])

    return step


def draw(random: Any, choices: Float64, force_n: Float64) -> None:
    """Draw the forces, (N, 2) newtons, of random actions; a kernel.

    Args:
        random: (N,) generators.
        choices: (A, 2) of each action, newtons.
        force_n: written.
    """
    env = cuda.grid(1)
    if env < len(force_n):
        action = int(xoroshiro128p_uniform_float64(random, env) * len(choices))
        force_n[env, 0] = choices[action, 0]
        force_n[env, 1] = choices[action, 1]
