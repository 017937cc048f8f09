"""The rigid engine's curved motions against DOP853 with events, and against closed forms."""

from __future__ import annotations

import math

import pytest

from roller_env.lab.engines.curves import Curve, on_floor_and_wall, over_an_edge, tipping
from roller_env.physics.rigid.scene import SolidBox
from tests.physics.rigid.world import CAP_S, RESTING_M, World

FINE_S = 1 / 960
"""A cap at which velocities are as near as places are at the usual one."""


def is_as_dop853_has_it(curve: Curve) -> bool:
    """Say whether places are at the preset's cap, and velocities too at a finer one."""
    return all(
        curve.played(cap_s)[:exact] == pytest.approx(curve.end[:exact], abs=1e-8)
        for cap_s, exact in ((CAP_S, 3), (FINE_S, 9))
    )


@pytest.mark.parametrize(
    ("velocity", "friction", "duration", "phases"),
    [
        ((0.5, 0.0, 0.0), 0.3, 0.5, ["rolls", "slips", "flies"]),
        ((0.5, 0.0, 0.0), 2.0, 0.5, ["rolls", "slips", "flies"]),
        ((0.5, 0.0, 0.0), 5.0, 0.5, ["rolls", "slips", "flies"]),
        ((0.4, 0.7, 0.0), 0.3, 0.35, ["rolls"]),
        ((0.2, -1.5, 0.0), 0.8, 0.4, ["rolls"]),
    ],
)
def test_a_ball_rolls_over_an_edge_as_dop853_has_it(
    velocity: tuple[float, float, float], friction: float, duration: float, phases: list[str]
) -> None:
    curve, went_through = over_an_edge(velocity, friction, duration)
    assert went_through == phases
    assert is_as_dop853_has_it(curve)


@pytest.mark.parametrize("corner", [False, True], ids=["edge", "corner"])
@pytest.mark.parametrize("slips", [False, True], ids=["rolls", "slips"])
def test_a_ball_tips_over_an_edge_or_a_corner_as_dop853_has_it(corner: bool, slips: bool) -> None:
    curve, phases = tipping(corner, slips)
    assert phases == ["slips" if slips else "rolls"]
    assert is_as_dop853_has_it(curve)


@pytest.mark.parametrize("degrees", [20.0, 45.0, 60.0])
def test_a_ball_rolls_in_a_v_about_the_line_through_both_contacts(degrees: float) -> None:
    angle = math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    # Both sides rise from the x axis; each lies on the inside of the V, a metre thick.
    sides = [
        SolidBox((0.0, y * s, -c), (500.0, 50.0, 1.0), ((1, 0, 0), (0, c, -y * s), (0, y * s, c)))
        for y in (1.0, -1.0)
    ]
    world = World(sides).put((0.0, 0.0, RESTING_M / c)).run(2.0, (1.0, 0.0, 0.0))
    # The line is r cos(angle) under the centre.
    way = 0.5 * 1.0 / (1.0 + 0.4 / c**2) * 2.0**2
    assert world.states.position[0] == pytest.approx([way, 0.0, RESTING_M / c], abs=1e-8)


def test_a_ball_slips_on_floor_and_wall_as_dop853_has_it() -> None:
    assert is_as_dop853_has_it(on_floor_and_wall())
