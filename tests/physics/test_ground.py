"""What the ball feels of the ground it lies on and rolls over."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from roller_env.physics.materials import contact_parameters
from roller_env.physics.presets import PRESETS
from tests.builders import BALL_RADIUS_M, GRAVITY, Float64, make_level, make_world

presets = pytest.mark.parametrize("physics", PRESETS)


@presets
def test_a_landing_goes_no_deeper_than_the_way_of_two_steps(physics: str) -> None:
    level = make_level(start={"at": (0.0, 0.0, 6.0)})
    world = make_world(level, seconds=2.0, count=8, physics=physics)
    world.position[:, 2] = BALL_RADIUS_M + np.linspace(5.0, 5.15, 8)
    depth = BALL_RADIUS_M - world.path()[:, :, 2].min()
    impact = math.sqrt(2.0 * GRAVITY * 5.15)
    assert 0.0 < depth < 2.0 * impact * world.dt_s


@presets
def test_a_ball_rests_within_a_millimetre_of_the_surface(physics: str) -> None:
    """It is (1 - d) g / K deep: the share 1 - d of its weight that the spring has to carry.

    The overdamped contact pushes it out to there at its slow rate, K / B: 1.8 per second of fast.
    """
    world = make_world(make_level(), seconds=6.0, physics=physics)
    world.path()
    depth = BALL_RADIUS_M - world.position[0, 2]
    parameters = contact_parameters(0.3, 0.0, world.compiled.preset)
    impedance = parameters.solimp[0]
    stiffness = -parameters.solref[0] / impedance  # MuJoCo divides K by d^2, and gives d of it
    assert depth == pytest.approx((1.0 - impedance) * GRAVITY / stiffness, rel=0.05)
    assert depth < 1e-3


@presets
@pytest.mark.parametrize("tiles", [2, 20])
def test_a_floor_of_tiles_is_as_smooth_as_one_slab(physics: str, tiles: int) -> None:
    """Merged, it is one box; unmerged (every other tile is thicker), its seams are hardly felt."""
    length = 60.0 / tiles
    merged = [
        {"at": (-5.0 + (i + 0.5) * length, 0.0, -0.5), "size": (length, 20.0, 1.0)}
        for i in range(tiles)
    ]
    unmerged = [
        tile
        | {
            "at": (*tile["at"][:2], -0.5 - 0.05 * (i % 2)),
            "size": (length, 20.0, 1 + 0.1 * (i % 2)),
        }
        for i, tile in enumerate(merged)
    ]
    slab = rolled_at_5_m_s([{"at": (25.0, 0.0, -0.5), "size": (60.0, 20.0, 1.0)}], physics)
    np.testing.assert_allclose(rolled_at_5_m_s(merged, physics), slab, atol=1e-9)
    rough = rolled_at_5_m_s(unmerged, physics)
    assert rough[-1, 0] == pytest.approx(slab[-1, 0], rel=1e-3), "speed kept"
    assert np.abs(rough[:, 1]).max() < 1e-6, "heading kept"
    assert rough[:, 2].max() - BALL_RADIUS_M < 1e-3, "no bump"


def rolled_at_5_m_s(boxes: list[dict[str, Any]], physics: str) -> Float64:
    """Return the path, (S + 1, 3), of a ball that rolls for 4 s at 5 m/s."""
    world = make_world(make_level(boxes=boxes, kill_height=-100.0), seconds=4.0, physics=physics)
    world.path()
    world.velocity[0, 0] = 5.0
    world.spin[0, 1] = 5.0 / BALL_RADIUS_M
    path: Float64 = world.path()[0]
    return path
