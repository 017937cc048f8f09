"""Balls on the hulls and wedges of levels, on both engines."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest

from roller_env.pieces.piece import rotation_matrix
from tests.builders import BALL_RADIUS_M, GRAVITY, GROUND, Float64, Game, Vector, make_level

both = pytest.mark.parametrize("physics", ["rigid", "default"])

BOX: dict[str, Any] = {"at": (4.0, 0.0, -0.1), "size": (3.0, 4.0, 1.0)}
"""A block in the lane whose upper face is 0.4 m over it."""


def corners(box: dict[str, Any]) -> list[list[float]]:
    """Return the corners of a box of a level as the points of a hull, metres."""
    own = np.array(list(product((-0.5, 0.5), repeat=3))) * box["size"]
    rotation = rotation_matrix(box.get("yaw_deg", 0.0), box.get("pitch_deg", 0.0))
    found: list[list[float]] = (own @ np.array(rotation).T + box["at"]).tolist()
    return found


def roll(game: Game, velocity: Vector) -> None:
    """Let the first game's ball roll with a velocity, without slipping on level ground."""
    snapshot = game.simulation.snapshot()
    snapshot.bodies.velocity[:] = velocity
    snapshot.bodies.angular_velocity[:] = np.array([-velocity[1], velocity[0], 0.0]) / BALL_RADIUS_M
    game.simulation.restore(snapshot)


# Hulls that are boxes -----------------------------------------------------------------------------


@both
@pytest.mark.parametrize("turned", [{}, {"yaw_deg": 30.0, "pitch_deg": 10.0}])
def test_a_hull_with_the_corners_of_a_box_is_met_as_that_box_is(
    physics: str, turned: dict[str, float]
) -> None:
    """Struck while rolling, rolled over, and left over its far edge."""
    ways = []
    for pieces in (
        {"boxes": [GROUND, BOX | turned]},
        {"hulls": [{"points": corners(BOX | turned)}]},
    ):
        game = Game(make_level(**pieces), physics=physics)
        roll(game, (9.0, 0.2, 0.0))
        ways.append(game.play(2.0, "w"))
    assert ways[0][:, 2].max() > BALL_RADIUS_M + 0.1
    # MuJoCo keeps the points of a mesh in single precision.
    assert np.abs(ways[1] - ways[0]).max() < {"rigid": 1e-9, "default": 1e-4}[physics]


@both
def test_a_ball_rests_on_a_hull_as_high_as_on_a_box(physics: str) -> None:
    block: dict[str, Any] = {"at": (0.0, 0.0, -1.0), "size": (4.0, 4.0, 2.0)}
    heights = []
    for pieces in ({"boxes": [block]}, {"boxes": [], "hulls": [{"points": corners(block)}]}):
        game = Game(make_level(start={"at": (0.3, -0.2, 0.9)}, **pieces), physics=physics)
        heights.append(game.play(3.0)[-1, 2])
    assert heights[0] == pytest.approx(BALL_RADIUS_M, abs=1e-4)
    assert heights[1] == pytest.approx(heights[0], abs={"rigid": 1e-9, "default": 1e-6}[physics])


@both
def test_rays_meet_a_hull_where_they_meet_the_box(physics: str) -> None:
    ball, seen = {"at": (0.0, 0.0, 0.9)}, []
    for pieces in ({"boxes": [GROUND, BOX]}, {"hulls": [{"points": corners(BOX)}]}):
        level = make_level(start=ball, **pieces)
        game = Game(level, physics=physics, observation="rays")
        seen.append(game.simulation.observe())
    np.testing.assert_allclose(seen[1], seen[0], atol=1e-6)


# Wedges -------------------------------------------------------------------------------------------


@both
@pytest.mark.parametrize("yaw_deg", [0.0, 90.0, -160.0])
def test_a_ball_rolls_down_a_wedge_with_five_sevenths_of_gravity(
    physics: str, yaw_deg: float
) -> None:
    run, rise = 20.0, 5.0
    slope = math.atan2(rise, run)
    turn = np.array(rotation_matrix(yaw_deg))
    down = turn @ [-math.cos(slope), 0.0, -math.sin(slope)]
    normal = turn @ [-math.sin(slope), 0.0, math.cos(slope)]
    # On the middle line of the face, 8 m from its middle.
    start = np.array([0.0, 0.0, rise / 2]) - 8.0 * down + BALL_RADIUS_M * normal
    wedge = {"at": (0.0, 0.0, rise / 2), "size": (run, 6.0, rise), "yaw_deg": yaw_deg}
    level = make_level(start={"at": tuple(start.tolist())}, wedges=[wedge])
    game = Game(level, physics=physics)
    game.play(1.5)
    expected = 5 / 7 * GRAVITY * math.sin(slope) * 1.5
    velocity = game.simulation.ball_velocity[0]
    accuracy = {"rigid": 1e-12, "default": 1e-4}[physics]
    assert velocity @ down == pytest.approx(expected, rel=accuracy)
    assert np.linalg.norm(velocity) == pytest.approx(expected, rel=accuracy)


@both
def test_a_wedge_is_rolled_up_like_a_ramp(physics: str) -> None:
    ways = []
    for pieces in (
        {"wedges": [{"at": (6.0, 0.0, 1.0), "size": (8.0, 6.0, 2.0)}]},
        {"ramps": [{"start": (2.0, 0.0, 0.0), "end": (10.0, 0.0, 2.0), "width": 6.0}]},
    ):
        game = Game(make_level(**pieces), physics=physics)
        roll(game, (7.0, 0.3, 0.0))
        ways.append(game.play(2.0, "w"))
    assert ways[0][:, 2].max() > 2.0 + BALL_RADIUS_M
    assert np.abs(ways[1] - ways[0]).max() < {"rigid": 1e-9, "default": 1e-6}[physics]


# Seams --------------------------------------------------------------------------------------------


def velocities(game: Game, seconds: float) -> Float64:
    """Return the ball's velocity after each control step."""
    found = []
    for _ in range(round(seconds / game.simulation.duration_s)):
        game.step()
        found.append(game.simulation.ball_velocity[0].copy())
    return np.array(found)


@pytest.mark.parametrize(
    ("physics", "upwards", "lost"),
    [
        ("rigid", 1e-12, 1e-9),
        ("accurate", 1e-5, 1e-5),
        ("default", 1e-4, 1e-4),
        ("fast", 0.08, 2e-3),
    ],
)
def test_seams_between_boxes_and_hulls_on_level_ground(
    physics: str, upwards: float, lost: float
) -> None:
    """Nine of them in 18 m at 3 m/s."""
    blocks: list[dict[str, Any]] = [
        {"at": (2.0 * number, 0.0, -1.0), "size": (2.0, 6.0, 2.0)} for number in range(-1, 12)
    ]
    level = make_level(
        boxes=blocks[::2], hulls=[{"points": corners(block)} for block in blocks[1::2]]
    )
    game = Game(level, physics=physics)
    game.play(0.5)
    roll(game, (3.0, 0.0, 0.0))
    found = velocities(game, 6.0)
    assert game.position[0] == pytest.approx(18.0, abs=3e-3)
    assert np.abs(found[:, 2]).max() < upwards
    assert np.linalg.norm(found, axis=1) == pytest.approx(3.0, abs=lost)


@pytest.mark.parametrize(
    ("physics", "accuracy"), [("rigid", 1e-9), ("accurate", 5e-5), ("default", 1e-3)]
)
def test_the_seam_between_a_wedge_and_the_ramp_that_goes_on_from_it(
    physics: str, accuracy: float
) -> None:
    slope = math.atan2(2.0, 8.0)
    up = np.array([math.cos(slope), 0.0, math.sin(slope)])
    normal = np.array([-math.sin(slope), 0.0, math.cos(slope)])
    start = np.array([4.0, 0.0, 1.0]) + BALL_RADIUS_M * normal
    level = make_level(
        start={"at": tuple(start.tolist())},
        boxes=[],
        wedges=[{"at": (4.0, 0.0, 1.0), "size": (8.0, 6.0, 2.0)}],
        ramps=[{"start": (8.0, 0.0, 2.0), "end": (24.0, 0.0, 6.0), "width": 6.0}],
    )
    game = Game(level, physics=physics)
    snapshot = game.simulation.snapshot()
    snapshot.bodies.velocity[:] = 9.0 * up
    snapshot.bodies.angular_velocity[:] = (0.0, 9.0 / BALL_RADIUS_M, 0.0)
    game.simulation.restore(snapshot)
    found = velocities(game, 1.5)
    assert game.position[0] > 12.0
    times = np.arange(1, len(found) + 1) * game.simulation.duration_s
    expected = 9.0 - 5 / 7 * GRAVITY * math.sin(slope) * times
    assert found @ up == pytest.approx(expected, abs=accuracy)
    assert np.abs(found @ normal).max() < accuracy
