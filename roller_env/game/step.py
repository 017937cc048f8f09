"""The rules of Roller, once: what happens in a control step, as kernels over some of N envs.

A control step of the game is: `prepare` says what the motors do, the physics moves the ball along a
path, `conclude` finds what the ball met on it and when, pays for it and draws the consequences;
`observe` writes what an agent is then shown. The rest of it is the pieces', each in its module.

Events at the same moment count in the order of `roller_env.game.kinds.RULES`, which begins with
coins and ends with the finish; the fall comes after that.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple, get_args

import numpy as np

from roller_env.arrays import Bool, Float32, Float64, Int64
from roller_env.compiled import compiled_with_packages, device_function, inlined
from roller_env.game.cameras import settle
from roller_env.game.kinds import RULES, all_hooks
from roller_env.game.observations import STATE_SIZE, rotated
from roller_env.game.result import REWARD_TERMS
from roller_env.game.rewards import (
    POINTS,
    ROUTE,
    RewardMode,
    RewardWeights,
    nearness,
    next_waypoint,
    route_progress,
    shaping,
)
from roller_env.game.slabs import lowering
from roller_env.game.state import GameState
from roller_env.game.tables import LevelTable, Movers, Regions, Routes
from roller_env.physics.protocol import Columns
from roller_env.pieces.coin import COIN, distance_to_next
from roller_env.pieces.finish import FINISH
from roller_env.pieces.hazard import HAZARD
from roller_env.pieces.rules import WORK, After, Before, CameraAsked, Noticed, Seen, distance2
from roller_env.pieces.sweep import bounds, meets, time_of_fall, vector, visit
from roller_env.units import frames

kernel = compiled_with_packages("roller_env.pieces")

SPLASH_S: Final = 1.0
"""`main` freezes the game while it shows the splash screen, a second after loading the level."""

INTRO_S: Final = SPLASH_S + 5.0
"""Time from loading a level to control: the splash screen, then five seconds of the intro panel."""

HANGING_S: Final = SPLASH_S + frames(10.0)
"""Time from loading a level to a physical ball: `roller` waits 10 frames, which the splash holds
up. Until then nothing moves and nothing happens."""

_COIN, _FINISH, _FALL, _PROGRESS = (REWARD_TERMS.index(name) for name in REWARD_TERMS)
_COINS, _HAZARDS, _FINISHES = (RULES.index(rules) for rules in (COIN, HAZARD, FINISH))

_act = all_hooks("act")
_notice = all_hooks("notice")
_react = all_hooks("react")
_show = all_hooks("show")


class Step(NamedTuple):
    """What one control step of N envs leaves behind; written anew in each.

    Attributes:
        live: (N, R) which regions could do something.
        entry: (N, R) pieces of the path until the ball entered each region and it counted; ``inf``
            where it did not.
        inside: (N, R) which regions it is in at the end.
        end: (N,) pieces of the path until the finish or the fall; ``inf`` if neither, -``inf``
            where the step does not count.
        fell: (N,) whether the ball fell, be the game over or not.
        coins: (N, 1) how many coins were collected.
        terms: (N, terms) what the step has earned, by `roller_env.game.result.REWARD_TERMS`.
        reward: (N,) their sum.
        camera: what was asked of the cameras.
    """

    live: Bool
    entry: Float64
    inside: Bool
    end: Float64
    fell: Bool
    coins: Int64
    terms: Float64
    reward: Float64
    camera: CameraAsked


class Rewarding(NamedTuple):
    """What a step is worth.

    Attributes:
        weights: (terms,) by `roller_env.game.result.REWARD_TERMS`.
        completeness: how much less the finish is worth for each coin left.
        potential: what progress is measured by, if it pays: `POINTS`, `ROUTE` or `NEARNESS`.
        discount: of the shaping.
    """

    weights: Float64
    completeness: float
    potential: int
    discount: float

    @staticmethod
    def of(weights: RewardWeights, reward: RewardMode, discount: float) -> Rewarding:
        """Return what the options of an environment mean."""
        potential = get_args(RewardMode).index(reward)
        return Rewarding(np.array(weights.terms), weights.completeness, potential, discount)


class Preparing(NamedTuple):
    """What `prepare` reads and writes of N games.

    Attributes:
        level_of: (N,) each env's level.
        movers: of the levels.
        tables: of the kinds, by level.
        owns: (kinds, 5) their `Own`s.
        control_delay_s: (N,) of the state.
        signals: (N, S) of the state.
        touching: (N, R) of the state.
        states: of the kinds, by env.
        hanging_s: (N,) written: time from the step's beginning until the ball is physical, if it is
            not.
    """

    level_of: Int64
    movers: Movers
    tables: tuple[Any, ...]
    owns: Int64
    control_delay_s: Float64
    signals: Bool
    touching: Bool
    states: tuple[Any, ...]
    hanging_s: Float64


class Concluding(NamedTuple):
    """What `conclude` reads and writes of N games.

    Attributes:
        level_of: (N,) each env's level.
        regions: of the levels.
        routes: of the levels.
        kill_height: (L,) of the levels.
        comes_back: (L,) of the levels: whether a fall does not end the game.
        start: (L, 3) of the levels.
        tables: of the kinds, by level.
        owns: (kinds, 5) their `Own`s.
        state: written.
        max_steps: (N,) control steps after which an episode is cut off.
        hanging_s: (N,) from `prepare`.
        votes: (N, S) how many of the sources of each receiver are on.
        back_at: (N, 3) where a ball that has fallen is put.
        step: written.
    """

    level_of: Int64
    regions: Regions
    routes: Routes
    kill_height: Float64
    comes_back: Bool
    start: Float64
    tables: tuple[Any, ...]
    owns: Int64
    state: GameState
    max_steps: Int64
    hanging_s: Float64
    votes: Int64
    back_at: Float64
    step: Step


class Showing(NamedTuple):
    """What `observe` reads of N games.

    Attributes:
        level_of: (N,) each env's level.
        regions: of the levels.
        movers: of the levels.
        tables: of the kinds, by level.
        owns: (kinds, 5) their `Own`s.
        steps: (N,) of the state.
        states: of the kinds, by env.
        max_steps: (N,) control steps after which an episode is cut off.
        work: (N, `WORK`) numbers for a hook to work with.
    """

    level_of: Int64
    regions: Regions
    movers: Movers
    tables: tuple[Any, ...]
    owns: Int64
    steps: Int64
    states: tuple[Any, ...]
    max_steps: Int64
    work: Float64


class Games:
    """N games: their levels, their state, and the kernels' views of both.

    Attributes:
        levels: what never changes, by level.
        level_of: (N,) each env's row in it.
        state: what varies. No episode has begun, so that there is nothing to step.
        step: the last step.
        hanging_s: (N,) how long the balls hung still in it.
    """

    def __init__(self, levels: LevelTable, level_of: Int64, max_steps: Int64):
        """Make games of ``levels``, each cut off after so many control steps, (N,)."""
        num_envs, regions = len(level_of), levels.regions.radius.shape[1]
        state = GameState.initial(levels, num_envs)
        state.truncated[:] = True

        def flags(*shape: int) -> Bool:
            return np.zeros((num_envs, *shape), dtype=bool)

        self.levels, self.level_of, self.state = levels, level_of, state
        self.hanging_s = np.zeros(num_envs)
        self.step = Step(
            live=flags(regions),
            entry=np.full((num_envs, regions), np.inf),
            inside=flags(regions),
            end=np.full(num_envs, np.inf),
            fell=flags(),
            coins=np.zeros((num_envs, 1), dtype=np.int64),
            terms=np.zeros((num_envs, len(REWARD_TERMS))),
            reward=np.zeros(num_envs),
            camera=CameraAsked(np.full(num_envs, -1), flags(), flags()),
        )
        self.preparing = Preparing(
            level_of,
            levels.movers,
            levels.kinds,
            levels.owns,
            state.control_delay_s,
            state.signals,
            state.touching,
            state.kinds,
            self.hanging_s,
        )
        self.concluding = Concluding(
            level_of,
            levels.regions,
            levels.routes,
            levels.kill_height,
            levels.comes_back,
            levels.start,
            levels.kinds,
            levels.owns,
            state,
            max_steps,
            self.hanging_s,
            np.zeros((num_envs, levels.signals), dtype=np.int64),
            np.zeros((num_envs, 3)),
            self.step,
        )
        self.showing = Showing(
            level_of,
            levels.regions,
            levels.movers,
            levels.kinds,
            levels.owns,
            state.steps,
            state.kinds,
            max_steps,
            np.zeros((num_envs, WORK)),
        )


@kernel
def prepare(
    games: Preparing,
    physics: Float64,
    at: Columns,
    duration_s: float,
    envs: Int64,
    key_force_n: Float64,
) -> None:
    """Write what the motors of some envs do in the next step, given the keys' force.

    Timers that end within the step act for their part of it, so that no impulse depends on the
    length of the control step.

    Args:
        games: all of them.
        physics: (N, width) the state of the physics; its controls are written.
        at: where everything is in it.
        duration_s: of the step.
        envs: (n,) which of them.
        key_force_n: (N, 2) newtons, world x and y.
    """
    for env in envs:
        level, delay_s = games.level_of[env], games.control_delay_s[env]
        # Both delays begin when the level is loaded.
        games.hanging_s[env] = max(delay_s - (INTRO_S - HANGING_S), 0.0)
        held = min(max(1.0 - delay_s / duration_s, 0.0), 1.0)
        body = physics[env]
        force_n = body[at.force_n : at.force_n + 3]
        force_n[0] = key_force_n[env, 0] * held
        force_n[1] = key_force_n[env, 1] * held
        force_n[2] = 0.0
        pull = body[at.pull : at.pull + at.movers]
        for mover in range(at.movers):
            pull[mover] = 0.0
        now = Before(
            level,
            env,
            duration_s,
            max(duration_s - games.hanging_s[env], 0.0),
            games.signals[env],
            games.touching[env],
            body[at.aim : at.aim + at.movers],
            force_n,
            pull,
        )
        _act(now, games.tables, games.states, games.owns)
        for mover in range(at.movers):
            if pull[mover] < 0.0 and games.movers.along[level, mover, 2] == 1.0:
                speed = -pull[mover]
                pull[mover] = lowering(duration_s, level, mover, games.movers, body, at, speed)


@kernel
def conclude(
    games: Concluding,
    physics: Float64,
    at: Columns,
    duration_s: float,
    rewarding: Rewarding,
    envs: Int64,
    path: Float64,
    knots: Int64,
) -> None:
    """Draw the consequences of a step in some envs, and say what it was worth.

    Events are found for the game as it stood when the step began, and what lies behind its end did
    not happen. Where the physics diverged, or the ball hung still, nothing did. A ball that falls
    where falls do not end the game is put back.

    Args:
        games: all of them.
        physics: (N, width) the state of the physics now; a ball put back is written there.
        at: where everything is in it, and in the path.
        duration_s: of the step.
        rewarding: what it is worth.
        envs: (n,) which of them.
        path: (n, K, p) where their balls went, as `roller_env.physics.protocol.Path` has it.
        knots: (n,) how many knots each path has.
    """
    state, step = games.state, games.step
    for number in range(len(envs)):
        env = envs[number]
        way = path[number, : knots[number], at.path : at.path + at.path_width]
        level = games.level_of[env]
        _find_events(games, level, env, duration_s, way)
        state.steps[env] += 1
        state.control_delay_s[env] = max(state.control_delay_s[env] - duration_s, 0.0)
        returns = step.fell[env] and not state.fallen[env]
        step.coins[env, 0] = 0
        step.camera.trigger[env] = -1
        step.camera.overhead[env] = False
        step.camera.behind[env] = returns
        for axis in range(3):
            games.back_at[env, axis] = games.start[level, axis]
        for signal in range(games.votes.shape[1]):
            games.votes[env, signal] = 0
        now = After(
            level,
            env,
            duration_s,
            way,
            step.end[env],
            step.entry[env],
            step.inside[env],
            physics[env, at.displacement : at.displacement + at.movers],
            step.coins[env],
            games.votes[env],
            state.signals[env],
            step.camera,
            returns,
            games.back_at[env],
            physics[env, at.position : at.position + 3],
            physics[env, at.velocity : at.velocity + 3],
        )
        _react(now, games.tables, state.kinds, games.owns)
        settle(env, duration_s, way[-1, 0], step.camera, state.camera)
        over = state.finished[env] or state.fallen[env] or state.diverged[env]
        for region in range(state.touching.shape[1]):
            state.touching[env, region] = step.inside[env, region] and not returns
        state.truncated[env] = not over and state.steps[env] >= games.max_steps[env]
        if returns:
            _put_back(physics[env], at, games.back_at[env])
        place = physics[env, at.position : at.position + 3]
        _pay(games, level, env, place, over, rewarding)


@inlined
def _find_events(games: Concluding, level: int, env: int, duration_s: float, path: Float64) -> None:
    """Write what the ball met on its path before the game's end, and that end."""
    state, regions, step = games.state, games.regions, games.step
    entry, inside, live = step.entry[env], step.inside[env], step.live[env]
    for region in range(len(entry)):
        entry[region] = np.inf
        inside[region] = False
        live[region] = True
    if state.diverged[env] or games.hanging_s[env] > duration_s - 1e-9:
        step.end[env] = -np.inf
        step.fell[env] = False
        return
    coins = state.kinds[_COINS].collected[env]
    _notice(Noticed(level, env, coins, live), games.tables, state.kinds, games.owns)
    low, high = bounds(path)
    for region in range(len(entry)):
        centre, half = vector(regions.centre[level, region]), vector(regions.half[level, region])
        radius = regions.radius[level, region]
        if live[region] and meets(low, high, centre, half, radius):
            floor, touching = regions.floor[level, region], state.touching[env, region]
            entry[region], inside[region] = visit(path, centre, half, radius, floor, touching)
    finish, fall = np.inf, time_of_fall(path, games.kill_height[level])
    first, count = games.owns[_FINISHES, 0], games.owns[_FINISHES, 1]
    for region in range(first, first + count):
        finish = min(finish, entry[region])
    first, count = games.owns[_HAZARDS, 0], games.owns[_HAZARDS, 1]
    for region in range(first, first + count):
        fall = min(fall, entry[region])
    end = min(finish, fall)
    step.end[env] = end
    state.finished[env] |= finish < np.inf and finish <= fall
    step.fell[env] = fall < finish
    state.fallen[env] |= step.fell[env] and not games.comes_back[level]
    for region in range(len(entry)):
        if entry[region] > end:
            entry[region] = np.inf


@device_function
def _put_back(body: Float64, at: Columns, place: Float64) -> None:
    """Put a ball that has fallen somewhere, at rest and as it was turned at the start.

    Args:
        body: row of the physics' state.
        at: where everything is in it.
        place: (3,) for its centre.
    """
    for axis in range(3):
        body[at.position + axis] = place[axis]
        body[at.velocity + axis] = 0.0
        body[at.angular_velocity + axis] = 0.0
        body[at.orientation + 1 + axis] = 0.0
    body[at.orientation] = 1.0


@inlined
def _pay(
    games: Concluding, level: int, env: int, ball: Float64, over: bool, rewarding: Rewarding
) -> None:
    """Write what a step has earned: the coins, the end, and the way along the route."""
    state, terms, weights = games.state, games.step.terms[env], rewarding.weights
    counts = games.step.end[env] > -np.inf
    terms[_COIN] = weights[_COIN] * games.step.coins[env, 0]
    terms[_FINISH] = weights[_FINISH] * (counts and state.finished[env])
    if rewarding.completeness > 0.0 and games.tables[_COINS].total[level] > 0:
        left = 1.0 - state.kinds[_COINS].collected[env] / games.tables[_COINS].total[level]
        terms[_FINISH] *= 1.0 - rewarding.completeness * left
    terms[_FALL] = weights[_FALL] * games.step.fell[env]
    total = terms[_COIN] + terms[_FINISH] + terms[_FALL]
    if rewarding.potential != POINTS:
        before = state.shaping.potential[env]
        _measure(games, level, env, ball, rewarding, True)
        after = state.shaping.potential[env]
        terms[_PROGRESS] = shaping(before, after, over, rewarding.discount)
        total += terms[_PROGRESS]
    for term in range(len(terms)):
        state.reward_terms[env, term] += terms[term]
    state.total_reward[env] += total
    games.step.reward[env] = total


@inlined
def _measure(
    games: Concluding, level: int, env: int, ball: Float64, rewarding: Rewarding, follows: bool
) -> None:
    """Set the potential of where a ball is, perhaps after following the route up to there."""
    routes, shaping_of = games.routes, games.state.shaping
    if rewarding.potential == ROUTE:
        points, length = routes.points[level], routes.length[level]
        waypoint = shaping_of.waypoint[env]
        if follows:
            waypoint = next_waypoint(ball, points, length, routes.radius[level], waypoint)
            shaping_of.waypoint[env] = waypoint
        progress = route_progress(ball, points, routes.arc[level], length, waypoint)
    else:
        coins = games.state.kinds[_COINS]
        distance = distance_to_next(games.tables[_COINS], coins, level, env, ball)
        if distance == np.inf:
            distance = math.sqrt(
                distance2(games.regions.centre[level, games.owns[_FINISHES, 0]], ball)
            )
        progress = nearness(distance)
    shaping_of.potential[env] = rewarding.weights[_PROGRESS] * progress


@kernel
def measure(
    games: Concluding,
    physics: Float64,
    at: Columns,
    rewarding: Rewarding,
    envs: Int64,
    follows: Bool,
) -> None:
    """Set the potential of envs whose ball was put somewhere.

    Args:
        games: all of them.
        physics: (N, width) the state of the physics.
        at: where everything is in it.
        rewarding: what a step is worth.
        envs: (n,) which of them.
        follows: (n,) whether what lies up to there counts as passed.
    """
    for number in range(len(envs)):
        env = envs[number]
        ball = physics[env, at.position : at.position + 3]
        _measure(games, games.level_of[env], env, ball, rewarding, follows[number])


@kernel
def observe(games: Showing, physics: Float64, at: Columns, envs: Int64, out: Float32) -> None:
    """Write the state vectors of some envs.

    Args:
        games: all of them.
        physics: (N, width) the state of the physics.
        at: where everything is in it.
        envs: (n,) which of them.
        out: (n, `STATE_SIZE` or more) laid out as `STATE_ENTRIES`; zeros.
    """
    for number in range(len(envs)):
        env, shown = envs[number], out[number]
        level, body = games.level_of[env], physics[env]
        ball = body[at.position : at.position + 3]
        turned = rotated(body[at.orientation :], body[at.angular_velocity :])
        for axis in range(3):
            shown[axis] = ball[axis]
            shown[3 + axis] = body[at.velocity + axis]
            shown[6 + axis] = turned[axis]
        now = Seen(
            level,
            env,
            ball,
            games.regions.centre[level],
            games.regions.half[level],
            games.regions.real[level],
            games.movers.centre[level],
            games.movers.along[level],
            games.movers.stop[level],
            body[at.displacement : at.displacement + at.movers],
            games.work[env],
            shown,
        )
        _show(now, games.tables, games.states, games.owns)
        shown[STATE_SIZE - 1] = max(1.0 - games.steps[env] / games.max_steps[env], 0.0)
