"""A player made by hand: it follows a level's route, collects the coins beside it, and brakes.

It holds keys as a person does, one of the nine directions at a time, and sees what a person sees:
where the ball is and how fast, which coins are left, whether the gate is open.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from roller_env import checks
from roller_env.arrays import Float64, Int64
from roller_env.game.actions import DIRECTIONS, forces
from roller_env.game.observations import STATE_ENTRIES, layout
from roller_env.level import Level
from roller_env.level.expand import expand
from roller_env.pieces.coin import COIN
from roller_env.pieces.gate import GATE
from roller_env.pieces.lift_pad import LIFT_PAD
from roller_env.pieces.plate import PLATE
from roller_env.replay.contents import Replay
from roller_env.replay.playback import Playback
from roller_env.simulation import Simulation

PLAYER: Final = "scripted player"
"""Who played, in a replay's words."""

CRUISE_M_S: Final = 3.0
"""Speed on a straight way."""

CORNER_M_S: Final = 0.6
"""Speed at which it comes to a stop beyond which the way turns back."""

BRAKING_M_S2: Final = 2.0
"""Deceleration it counts on: a key's force stops a rolling ball at 3.6 m/s^2."""

RESPONSE_S: Final = 0.25
"""Time in which it tries to mend its velocity."""

REACH_M: Final = 0.4
"""A waypoint is reached when the ball's centre is within this of it, seen from above."""

STOREY_M: Final = 2.0
"""What is further up or down than this is not reached."""

SHAFT_M: Final = 1.5
"""Thrown up past what is within this of it, seen from above, it cannot go back there."""

PATIENCE_S: Final = 8.0
"""After this long it gives a coin up."""

NOISE_STEPS: Final = 5
"""Control steps for which an action that is noise is held: a quarter of a second at 20 a second."""

_OPEN_M: Final = 0.02
"""A gate that is this near to where it goes counts as open."""

_VELOCITY: Final = layout(STATE_ENTRIES)["velocity"]
_PUSHES: Final = forces("directions", np.arange(len(DIRECTIONS)))


@dataclass(frozen=True, slots=True)
class Stop:
    """A place to go to.

    Attributes:
        at: (3,) metres.
        coin: number of the coin that lies there; None for a waypoint of the route.
        plate: number of the plate that the waypoint lies on, if it does.
    """

    at: Float64
    coin: int | None = None
    plate: int | None = None


class ScriptedPlayer:
    """Plays the game in row 0 of a simulation, from its start."""

    def __init__(self, level: Level, action_noise: float = 0.0, seed: int = 0):
        """Make a plan for a level.

        Args:
            level: to play.
            action_noise: fraction of the steps, 0 to 1, in which it holds any keys at all, as the
                seed says; each time for `NOISE_STEPS`.
            seed: of the noise.

        Raises:
            ValueError: the level has no route.
        """
        self._action_noise = checks.number(
            "action_noise", action_noise, 0.0, 1.0, "a fraction from 0 to 1"
        )
        self._noise_left = self._noise = 0
        self._rng = np.random.default_rng(seed)
        self._level = level
        self._stops = itinerary(level)
        self._next = 1
        self._since_s = 0.0

    def __call__(self, simulation: Simulation) -> Float64:
        """Return the force of the keys to hold now, (1, 2) newtons."""
        ball = simulation.ball_position[0]
        velocity = simulation.observe()[0, _VELOCITY][:2].astype(np.float64)
        self._go_on(simulation, ball)
        stop = self._stops[self._next]
        final_speed = self._speed_through(self._next)
        if self._is_shut_off(simulation, ball, stop.at):
            stop, final_speed = self._stops[self._next - 1], 0.0
            self._since_s = float(simulation.time_s[0])
        way = stop.at[:2] - ball[:2]
        mass_kg = simulation.level.ball.mass_kg
        best = self._with_noise(int(steering(way[None], velocity[None], mass_kg, final_speed)[0]))
        return _PUSHES[best : best + 1].copy()

    def _with_noise(self, direction: int) -> int:
        """Return the direction chosen, or any one where noise takes its place."""
        if self._action_noise > 0.0 and self._noise_left == 0:
            if self._rng.random() >= self._action_noise / NOISE_STEPS:
                return direction
            self._noise, self._noise_left = int(self._rng.integers(len(_PUSHES))), NOISE_STEPS
        if self._noise_left == 0:
            return direction
        self._noise_left -= 1
        return self._noise

    def _go_on(self, simulation: Simulation, ball: Float64) -> None:
        """Turn to the next stop when this one is done with."""
        time_s = float(simulation.time_s[0])
        while self._next < len(self._stops) - 1 and self._is_done(simulation, ball, time_s):
            self._next += 1
            self._since_s = time_s

    def _is_done(self, simulation: Simulation, ball: Float64, time_s: float) -> bool:
        stop, state = self._stops[self._next], simulation.state
        away = np.abs(stop.at - ball)
        beside = math.hypot(away[0], away[1])
        is_thrown = bool((state.of(LIFT_PAD).thrust_s[0] > 0.0).any())
        if is_thrown and beside < SHAFT_M and ball[2] > stop.at[2] + STOREY_M:
            return True
        if stop.plate is not None:
            return bool(state.of(PLATE).struck[0, stop.plate])
        if stop.coin is not None:
            return bool(state.of(COIN).taken[0, stop.coin]) or time_s > self._since_s + PATIENCE_S
        return beside < REACH_M and bool(away[2] < STOREY_M)

    def _speed_through(self, number: int) -> float:
        """Return the speed at which to come to a stop, given where it goes from there."""
        here = self._stops[number].at[:2]
        if number + 1 == len(self._stops):
            return CRUISE_M_S
        before, after = self._stops[number - 1].at[:2], self._stops[number + 1].at[:2]
        come, go = here - before, after - here
        lengths = math.hypot(*come) * math.hypot(*go)
        straight = float(come @ go) / lengths if lengths > 0.0 else 0.0
        return CORNER_M_S + (CRUISE_M_S - CORNER_M_S) * max(straight, 0.0) ** 4

    def _is_shut_off(self, simulation: Simulation, ball: Float64, target: Float64) -> bool:
        """Say whether a gate that is not open yet stands on the way."""
        own = simulation.table.own(GATE)
        moved = simulation.gate_displacement[0]
        stops = simulation.table.movers.stop[0, own.mover : own.mover + own.movers]
        for gate, place, end in zip(self._level.gates, moved, stops, strict=True):
            if place <= end + _OPEN_M:
                continue
            yaw = math.radians(gate.yaw_deg)
            axes = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
            begin, finish = ((axes @ (p[:2] - np.array(gate.at[:2]))) for p in (ball, target))
            half = np.array(gate.size[:2]) / 2 + self._level.ball.radius
            if _meets(begin, finish, half):
                return True
        return False


def steering(
    way: Float64, velocity: Float64, mass_kg: float, final_speed: float = CORNER_M_S
) -> Int64:
    """Return which of `DIRECTIONS` to hold, (n,), to come to places at a speed.

    Args:
        way: (n, 2) from the balls to the places, metres, world x and y.
        velocity: (n, 2) of the balls, m/s, world x and y.
        mass_kg: of a ball.
        final_speed: at which to be there, m/s.
    """
    distance = np.linalg.norm(way, axis=1, keepdims=True)
    speed = np.minimum(CRUISE_M_S, np.sqrt(final_speed**2 + 2.0 * BRAKING_M_S2 * distance))
    wanted = way / np.maximum(distance, 1e-9) * speed
    push = mass_kg * (wanted - velocity) / RESPONSE_S
    best: Int64 = np.linalg.norm(_PUSHES - push[:, None], axis=2).argmin(axis=1)
    return best


def relabelled(replay: Replay) -> Float64:
    """Return the force of the keys that the player, asked again, holds in every step of a replay.

    Of its own replays that is what it did but for the action noise. To learn an expert's actions in
    states that noise has led to is DART (Laskey et al. 2017).

    Args:
        replay: of a level with a route, by whomever.

    Returns:
        (T, 2) newtons.
    """
    playback, player = Playback(replay), ScriptedPlayer(replay.level)
    forces_n = np.zeros_like(replay.force_n)
    for step in range(len(replay)):
        playback.seek(step)
        forces_n[step] = player(playback.simulation)[0]
    return forces_n


def itinerary(level: Level) -> list[Stop]:
    """Return where to go in a level, from the start: the route, and each coin on the leg it is by.

    Raises:
        ValueError: the level has no route.
    """
    if level.route is None:
        raise ValueError(f"level {level.name!r} has no route, which is what the player follows")
    route = np.array(level.route.points)
    coins = expand(level).coins
    legs = np.array([_nearest_leg(coin, route) for coin in coins], dtype=np.int64)
    stops = [Stop(route[0])]
    for leg, (begin, end) in enumerate(itertools.pairwise(route)):
        numbers = np.flatnonzero(legs == leg)
        order = shortest_way(np.concatenate([begin[None], coins[numbers], end[None]]))
        stops += [Stop(coins[numbers[i - 1]], coin=int(numbers[i - 1])) for i in order[1:-1]]
        stops.append(Stop(end, plate=_plate_under(level, end)))
    return stops


def shortest_way(points: Float64) -> list[int]:
    """Return an order of ``points``, (n, 3), from the first to the last that no reversal shortens.

    That is 2-opt (Croes 1958), begun with the order along the line from the first to the last.
    """
    along = (points - points[0]) @ (points[-1] - points[0])
    inner = sorted(range(1, len(points) - 1), key=lambda i: float(along[i]))
    order = [0, *inner, len(points) - 1]

    def length(way: list[int]) -> float:
        return float(np.linalg.norm(np.diff(points[way], axis=0), axis=1).sum())

    best, is_better = length(order), True
    while is_better:
        is_better = False
        for i in range(1, len(order) - 2):
            for j in range(i + 2, len(order)):
                other = order[:i] + order[i:j][::-1] + order[j:]
                if length(other) < best - 1e-9:
                    order, best, is_better = other, length(other), True
    return order


def _nearest_leg(point: Float64, route: Float64) -> int:
    begin, way = route[:-1], np.diff(route, axis=0)
    length2 = np.maximum((way**2).sum(axis=1), 1e-12)
    share = np.clip(((point - begin) * way).sum(axis=1) / length2, 0.0, 1.0)
    return int(np.linalg.norm(begin + share[:, None] * way - point, axis=1).argmin())


def _plate_under(level: Level, point: Float64) -> int | None:
    for number, plate in enumerate(level.plates):
        away = np.abs(point - np.array(plate.at))
        if (away[:2] <= np.array(plate.size[:2]) / 2).all() and away[2] < STOREY_M:
            return number
    return None


def _meets(begin: Float64, end: Float64, half: Float64) -> bool:
    """Say whether the line between two points meets the rectangle of ``half`` sizes round 0."""
    way = end - begin
    first, last = 0.0, 1.0
    for place, step, reach in zip(begin, way, half, strict=True):
        if abs(step) < 1e-12:
            if abs(place) > reach:
                return False
            continue
        one, other = sorted(((-reach - place) / step, (reach - place) / step))
        first, last = max(first, one), min(last, other)
    return first <= last
