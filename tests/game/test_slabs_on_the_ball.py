"""A gate or plate that comes down on the ball stops on it, and the ball is never inside it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roller_env.level import Level
from roller_env.pieces.plate import PLATE
from tests.builders import BALL_RADIUS_M, GROUND, Float64, Game, make_level

PRESETS = ("fast", "default", "accurate", "rigid")
SINK_M = 0.002
"""How deep a ball that rests on the ground lies in it with the coarsest preset, twice over."""

GATES: dict[str, dict[str, Any]] = {
    "a block": {"size": (1.0, 2.0, 1.0)},
    "the original's": {"size": (0.4064, 3.2512, 5.6896)},
    "a blade": {"size": (0.05, 2.0, 1.0)},
    "a lid": {"size": (3.0, 3.0, 0.02)},
    "a turned block": {"size": (1.0, 1.6, 1.0), "yaw_deg": 37.0},
    "a post": {"size": (0.1, 0.1, 1.0)},
    "a fast block": {"size": (1.0, 2.0, 1.0), "speed": 30.0},
}


def under(gate: dict[str, Any], **pieces: Any) -> Level:
    """A ball under a gate that hangs a metre over it and is to go down through the ground."""
    hanging = {"name": "gate", "at": (0.0, 0.0, 1.8 + gate["size"][2] / 2), "lowers_to": -9.0}
    plate = {"name": "p", "at": (50.0, 50.0, 2.0), "size": (1.0, 1.0, 3.0), "opens": ["gate"]}
    return make_level(**{"gates": [hanging | gate], "plates": [plate], **pieces})


def around(count: int, reach: float) -> Float64:
    """Return (count, 3) places of a ball on the ground, from under the middle outwards."""
    rng = np.random.default_rng(1)
    places = np.zeros((count, 3))
    places[1:, :2] = rng.uniform(-reach, reach, (count - 1, 2))
    places[:, 2] = BALL_RADIUS_M
    return places


def let_down(
    level: Level, places: Float64, physics: str, seconds: float, force_n: float = 0.0
) -> tuple[Game, Float64]:
    """Play with the gate going down; return the game and each ball's deepest depth in it, (N,).

    Every ball is pushed towards the gate's axis.
    """
    game = Game(level, num_envs=len(places), physics=physics)
    snapshot = game.simulation.snapshot()
    snapshot.bodies.position[:] = places
    game.simulation.restore(snapshot)
    game.state.signals[:] = True
    deepest = np.full(len(places), -np.inf)
    for _ in range(round(seconds / game.simulation.duration_s)):
        push = -np.sign(game.simulation.ball_position[:, :2]) * force_n
        game.simulation.step(push)
        deepest = np.maximum(deepest, depths(game, level))
    return game, deepest


def depths(game: Game, level: Level) -> Float64:
    """Return how deep every ball is inside the gate, (N,) metres; below zero it is outside."""
    gate = level.gates[0]
    ball = game.simulation.ball_position
    slab = game.simulation.gate_displacement[:, 0]
    yaw = np.radians(gate.yaw_deg)
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    local = ball - np.array(gate.at)
    local[:, :2] = local[:, :2] @ turn
    local[:, 2] -= slab
    beyond = np.abs(local) - np.array(gate.size) / 2
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    inside = np.minimum(beyond.max(axis=1), 0.0)
    depth: Float64 = level.ball.radius - outside - inside
    return depth


@pytest.mark.parametrize("physics", PRESETS)
@pytest.mark.parametrize("gate", GATES.values(), ids=GATES)
def test_a_gate_that_comes_down_stops_on_the_ball_wherever_it_is(
    gate: dict[str, Any], physics: str
) -> None:
    level = under(gate)
    reach = gate["size"][0] / 2 + 0.6
    game, deepest = let_down(level, around(12, reach), physics, 3.0)
    assert deepest.max() < SINK_M
    bottom = level.gates[0].at[2] + game.slab("gate") - gate["size"][2] / 2
    assert bottom == pytest.approx(2 * BALL_RADIUS_M, abs=SINK_M), "held up by the ball"


@pytest.mark.parametrize("physics", PRESETS)
def test_a_ball_that_is_driven_under_a_gate_coming_down_is_not_taken_in(physics: str) -> None:
    _, deepest = let_down(under(GATES["a block"]), around(12, 3.0), physics, 4.0, force_n=5.08)
    assert deepest.max() < BALL_RADIUS_M / 10, "no more than what hits a wall"


@pytest.mark.parametrize("physics", PRESETS)
def test_a_small_ball_is_held_up_like_a_large_one(physics: str) -> None:
    radius = 0.02
    level = under(GATES["a block"], ball={"radius": radius}, start={"at": (0.0, 0.0, radius)})
    places = np.array([[0.0, 0.0, radius], [0.51, 0.0, radius]])
    _, deepest = let_down(level, places, physics, 3.0)
    assert deepest.max() < SINK_M


def test_the_gate_goes_on_when_the_ball_has_left() -> None:
    level = under(GATES["a block"])
    game, _ = let_down(level, around(1, 0.0), "default", 2.0)
    held = game.slab("gate")
    game.play(2.0, "w")
    assert game.position[0] > 4.0, "the gate does not press, so the ball rolls out"
    game.play(1.0)
    assert game.slab("gate") < held - 0.7


def test_a_plate_that_sinks_onto_the_ball_stops_on_it() -> None:
    plate = {"name": "p", "at": (0.0, 0.0, 1.9), "size": (2.0, 2.0, 2.0), "opens": ["gate"]}
    gate = {"name": "gate", "at": (50.0, 0.0, 2.0), "size": (1.0, 1.0, 1.0)}
    level = make_level(plates=[plate | {"sinks_to": 0.0, "speed": 0.5}], gates=[gate])
    for physics in PRESETS:
        game = Game(level, physics=physics)
        game.state.of(PLATE).struck[:] = True
        game.play(2.0)
        assert 0.9 + game.slab("p") == pytest.approx(2 * BALL_RADIUS_M, abs=SINK_M)
        assert game.position[2] == pytest.approx(BALL_RADIUS_M, abs=SINK_M)


@pytest.mark.parametrize("physics", PRESETS)
def test_a_ball_between_a_gate_and_its_sinking_plate_is_not_squeezed(physics: str) -> None:
    plate = {"name": "p", "at": (0.0, 0.0, 1.0), "size": (2.0, 2.0, 0.6), "opens": ["gate"]}
    gate = {"name": "gate", "at": (0.0, 0.0, 3.0), "size": (1.0, 1.0, 1.0), "lowers_to": -1.0}
    level = make_level(
        plates=[plate | {"sinks_to": 0.6, "speed": 0.3}],
        gates=[gate],
        start={"at": (0.0, 0.0, 1.3 + BALL_RADIUS_M)},
    )
    _, deepest = let_down(level, np.array([level.start.at]), physics, 6.0)
    assert deepest.max() < SINK_M


def test_a_gate_beside_or_under_the_ball_goes_down_at_its_speed() -> None:
    face = 0.5 + BALL_RADIUS_M
    level = under(
        {"size": (1.0, 2.0, 6.0), "at": (0.0, 0.0, 1.0), "lowers_to": -9.0},
        start={"at": (5.0, 0.0, 1.0)},
    )
    for place in ((face, 0.0, 1.0), (0.0, 0.0, 4.0 + BALL_RADIUS_M)):
        game, _ = let_down(level, np.array([place]), "default", 1.0)
        assert game.slab("gate") == pytest.approx(-0.8128, abs=0.05)


def test_a_ball_of_any_kind_is_held_up() -> None:
    for ball in ({"mass_kg": 0.001}, {"mass_kg": 1000.0}, {"elasticity": 0.95}, {"friction": 0.0}):
        level = under(GATES["a block"], ball=ball, boxes=[GROUND])
        _, deepest = let_down(level, around(8, 1.0), "fast", 3.0)
        assert deepest.max() < SINK_M, ball
