"""The rules of Roller, once: what happens in a control step, as kernels over some of N envs.

A control step of the game is: `prepare` says what the motors do, the physics moves the ball along a
path, `conclude` finds what the ball met on it and when, pays for it and draws the consequences;
`observe` writes what an agent is then shown. The rest of it is the pieces', each in its module.

Events at the same moment count in the order of `roller_env.game.kinds.RULES`, which begins with
coins and ends with the finish; the fall comes after that.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from roller_env.arrays import Bool, Float32, Float64, Int64
from roller_env.compiled import compiled_with_packages, part
from roller_env.game.bodies import Bodies, Controls
from roller_env.game.cameras import settle
from roller_env.game.kinds import all_hooks
from roller_env.game.observations import STATE_SIZE, rotated
from roller_env.game.rewards import TERMS, next_waypoint, route_progress, shaping
from roller_env.game.slabs import lowering
from roller_env.game.state import GameState
from roller_env.game.tables import LevelTable
from roller_env.pieces.rules import WORK, After, Before, CameraAsked, Noticed, Seen
from roller_env.pieces.sweep import bounds, meets, time_of_fall, vector, visit

kernel = compiled_with_packages("roller_env.pieces", makes_arrays=False)

SPLASH_S: Final = 1.0
"""`main` freezes the game while it shows the splash screen, a second after loading the level."""

INTRO_S: Final = SPLASH_S + 5.0
"""Time from loading a level to control: the splash screen, then five seconds of the intro panel."""

HANGING_S: Final = SPLASH_S + 10.0 / 60.0
"""Time from loading a level to a physical ball: `roller` waits 10 frames, at the nominal 60 frames
a second, which the splash holds up. Until then nothing moves and nothing happens."""

_COIN, _FINISH, _FALL, _PROGRESS = (TERMS.index(name) for name in TERMS)

_push = all_hooks("push")
_move = all_hooks("move")
_notice = all_hooks("notice")
_react = all_hooks("react")
_show = all_hooks("show")


class Step(NamedTuple):
    """What one control step of N envs leaves behind; written anew in each.

    Attributes:
        moving: (N, M) which slabs go down.
        hanging_s: (N,) time from the step's beginning until the ball is physical, if it is not.
        live: (N, R) which regions could do something.
        entry: (N, R) physics steps until the ball entered each region and it counted; ``inf`` where
            it did not.
        inside: (N, R) which regions it is in at the end.
        end: (N,) physics steps until the finish or the fall; ``inf`` if neither, -``inf`` where the
            step does not count.
        coins: (N, 1) how many coins were collected.
        terms: (N, terms) what the step has earned, by `roller_env.game.rewards.TERMS`.
        reward: (N,) their sum.
        camera: what was asked of the cameras.
        work: (N, `WORK`) numbers for a hook to work with.
    """

    moving: Bool
    hanging_s: Float64
    live: Bool
    entry: Float64
    inside: Bool
    end: Float64
    coins: Int64
    terms: Float64
    reward: Float64
    camera: CameraAsked
    work: Float64


class Game(NamedTuple):
    """N games.

    Attributes:
        levels: what never changes, by level.
        level_of: (N,) each env's row in it.
        state: what varies.
        max_steps: (N,) control steps after which an episode is cut off.
        step: the last step.
    """

    levels: LevelTable
    level_of: Int64
    state: GameState
    max_steps: Int64
    step: Step

    @staticmethod
    def of(levels: LevelTable, level_of: Int64, max_steps: Int64) -> Game:
        """Return games of which no episode has begun, so that there is nothing to step."""
        num_envs, regions = len(level_of), levels.region_radius.shape[1]
        state = GameState.initial(levels, num_envs)
        state.truncated[:] = True
        flags, numbers = np.zeros(num_envs, dtype=bool), np.zeros(num_envs)
        step = Step(
            moving=np.zeros((num_envs, levels.mover_stop.shape[1]), dtype=bool),
            hanging_s=numbers.copy(),
            live=np.ones((num_envs, regions), dtype=bool),
            entry=np.full((num_envs, regions), np.inf),
            inside=np.zeros((num_envs, regions), dtype=bool),
            end=np.full(num_envs, np.inf),
            coins=np.zeros((num_envs, 1), dtype=np.int64),
            terms=np.zeros((num_envs, len(TERMS))),
            reward=numbers,
            camera=CameraAsked(np.full(num_envs, -1), flags.copy(), flags),
            work=np.zeros((num_envs, WORK)),
        )
        return Game(levels, level_of, state, max_steps, step)


class Reward(NamedTuple):
    """What a step is worth.

    Attributes:
        weights: by `roller_env.game.rewards.TERMS`.
        shaped: whether progress along the route pays.
        discount: of the shaping.
    """

    weights: tuple[float, float, float, float]
    shaped: bool
    discount: float


@kernel
def prepare(
    game: Game,
    envs: Int64,
    duration_s: float,
    key_force_n: Float64,
    bodies: Bodies,
    controls: Controls,
) -> None:
    """Write what the motors of some envs do in the next step, given the keys' force.

    Timers that end within the step act for their part of it, so that no impulse depends on the
    length of the control step.

    Args:
        game: the games; ``step.moving`` and ``step.hanging_s`` are written.
        envs: (n,) which of them.
        duration_s: of the step.
        key_force_n: (N, 2) newtons, world x and y.
        bodies: where everything is.
        controls: written.
    """
    state, levels, step = game.state, game.levels, game.step
    for env in envs:
        level, delay_s = game.level_of[env], state.control_delay_s[env]
        # Both delays begin when the level is loaded.
        step.hanging_s[env] = max(delay_s - (INTRO_S - HANGING_S), 0.0)
        held = min(max(1.0 - delay_s / duration_s, 0.0), 1.0)
        force_n, moving = controls.force_n[env], step.moving[env]
        force_n[0] = key_force_n[env, 0] * held
        force_n[1] = key_force_n[env, 1] * held
        force_n[2] = 0.0
        for mover in range(len(moving)):
            moving[mover] = False
        now = Before(level, env, duration_s, state.signals[env], force_n, moving)
        _push(now, levels.kinds, state.kinds, levels.owns)
        _move(now, levels.kinds, state.kinds, levels.owns)
        for mover in range(len(moving)):
            velocity = 0.0
            if moving[mover]:
                velocity = lowering(duration_s, level, env, mover, levels, bodies)
            controls.velocity[env, mover] = velocity


@kernel
def conclude(
    game: Game,
    envs: Int64,
    duration_s: float,
    path: Float64,
    displacement: Float64,
    reward: Reward,
) -> None:
    """Draw the consequences of a step in some envs, and say what it was worth.

    Events are found for the game as it stood when the step began, and what lies behind its end did
    not happen. Where the physics diverged, or the ball hung still, nothing did.

    Args:
        game: the games; their state and ``step`` are written.
        envs: (n,) which of them.
        duration_s: of the step.
        path: (n, S + 1, 3) their balls' centres before the first physics step and after each.
        displacement: (N, M) where the slabs are now.
        reward: what it is worth.
    """
    state, levels, step = game.state, game.levels, game.step
    for number in range(len(envs)):
        env, way = envs[number], path[number]
        level = game.level_of[env]
        _find_events(game, level, env, duration_s, way)
        state.steps[env] += 1
        state.control_delay_s[env] = max(state.control_delay_s[env] - duration_s, 0.0)
        step.coins[env, 0] = 0
        step.camera.trigger[env] = -1
        step.camera.overhead[env] = False
        step.camera.behind[env] = False
        now = After(
            level,
            env,
            duration_s,
            way,
            step.end[env],
            step.entry[env],
            step.inside[env],
            displacement[env],
            step.coins[env],
            state.signals[env],
            step.camera,
        )
        _react(now, levels.kinds, state.kinds, levels.owns)
        settle(env, duration_s, way[-1, 0], step.camera, state.camera)
        for region in range(state.touching.shape[1]):
            state.touching[env, region] = step.inside[env, region]
        finished = state.finished[env]
        over = finished or state.fallen[env] or state.diverged[env]
        state.truncated[env] = not over and state.steps[env] >= game.max_steps[env]
        _pay(game, level, env, way[-1], over, reward)


@part
def _find_events(game: Game, level: int, env: int, duration_s: float, path: Float64) -> None:
    """Write what the ball met on its path before the game's end, and that end."""
    state, levels, step = game.state, game.levels, game.step
    entry, inside = step.entry[env], step.inside[env]
    live = step.live[env]
    for region in range(len(entry)):
        entry[region] = np.inf
        inside[region] = False
        live[region] = True
    if state.diverged[env] or step.hanging_s[env] > duration_s - 1e-9:
        step.end[env] = -np.inf
        return
    _notice(Noticed(level, env, live), levels.kinds, state.kinds, levels.owns)
    low, high = bounds(path)
    for region in range(len(entry)):
        centre = vector(levels.region_centre[level, region])
        half = vector(levels.region_half[level, region])
        radius = levels.region_radius[level, region]
        if live[region] and meets(low, high, centre, half, radius):
            floor, touching = levels.region_floor[level, region], state.touching[env, region]
            entry[region], inside[region] = visit(path, centre, half, radius, floor, touching)
    finish, fall = np.inf, time_of_fall(path, levels.kill_height[level])
    own = levels.owns[-1]
    for region in range(own.region, own.region + own.regions):
        finish = min(finish, entry[region])
    end = min(finish, fall)
    step.end[env] = end
    state.finished[env] |= finish < np.inf and finish <= fall
    state.fallen[env] |= fall < finish
    for region in range(len(entry)):
        if entry[region] > end:
            entry[region] = np.inf


@part
def _pay(game: Game, level: int, env: int, ball: Float64, over: bool, reward: Reward) -> None:
    """Write what a step has earned: the coins, the end, and the way along the route."""
    state, terms = game.state, game.step.terms[env]
    ended = game.step.end[env] > -np.inf
    terms[_COIN] = reward.weights[_COIN] * game.step.coins[env, 0]
    terms[_FINISH] = reward.weights[_FINISH] * (ended and state.finished[env])
    terms[_FALL] = reward.weights[_FALL] * (ended and state.fallen[env])
    total = terms[_COIN] + terms[_FINISH] + terms[_FALL]
    if reward.shaped:
        before = state.shaping.potential[env]
        measure(game, level, env, ball, reward.weights[_PROGRESS])
        after = state.shaping.potential[env]
        terms[_PROGRESS] = shaping(before, after, over, reward.discount)
        total += terms[_PROGRESS]
    for term in range(len(terms)):
        state.earned[env, term] += terms[term]
    game.step.reward[env] = total


@part
def measure(game: Game, level: int, env: int, ball: Float64, weight: float) -> None:
    """Follow the route up to where the ball is, and set the potential to what lies behind it."""
    levels, shape = game.levels, game.state.shaping
    route, length = levels.route[level], levels.route_length[level]
    waypoint = next_waypoint(ball, route, length, levels.route_radius[level], shape.waypoint[env])
    shape.waypoint[env] = waypoint
    progress = route_progress(ball, route, levels.route_arc[level], length, waypoint)
    shape.potential[env] = weight * progress


@kernel
def follow_route(game: Game, envs: Int64, position: Float64, follows: Bool, weight: float) -> None:
    """Set the potential of envs whose ball was put somewhere.

    Args:
        game: the games.
        envs: (n,) which of them.
        position: (N, 3) balls' centres, metres, world frame.
        follows: (n,) whether what lies up to there counts as passed.
        weight: potential of a completed route.
    """
    levels, shape = game.levels, game.state.shaping
    for number in range(len(envs)):
        env = envs[number]
        level = game.level_of[env]
        if follows[number]:
            measure(game, level, env, position[env], weight)
        else:
            route, length = levels.route[level], levels.route_length[level]
            progress = route_progress(
                position[env], route, levels.route_arc[level], length, shape.waypoint[env]
            )
            shape.potential[env] = weight * progress


@kernel
def observe(game: Game, envs: Int64, bodies: Bodies, out: Float32) -> None:
    """Write the state vectors of some envs.

    Args:
        game: the games.
        envs: (n,) which of them.
        bodies: where everything is.
        out: (n, `STATE_SIZE` or more) laid out as `STATE_ENTRIES`; zeros.
    """
    state, levels = game.state, game.levels
    for number in range(len(envs)):
        env, shown = envs[number], out[number]
        level, ball = game.level_of[env], bodies.position[env]
        turned = rotated(bodies.orientation[env], bodies.angular_velocity[env])
        for axis in range(3):
            shown[axis] = ball[axis]
            shown[3 + axis] = bodies.velocity[env, axis]
            shown[6 + axis] = turned[axis]
        now = Seen(
            level,
            env,
            ball,
            levels.region_centre[level],
            levels.region_real[level],
            levels.mover_centre[level],
            levels.mover_stop[level],
            bodies.displacement[env],
            game.step.work[env],
            shown,
        )
        _show(now, levels.kinds, state.kinds, levels.owns)
        shown[STATE_SIZE - 1] = max(1.0 - state.steps[env] / game.max_steps[env], 0.0)
