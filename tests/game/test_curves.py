"""Curved floors: their shape, and how near a ball in them is to one on a smooth surface."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from roller_env.level import Level
from roller_env.level.expand import expand
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.curve import Bowl, HalfPipe, Spiral
from tests.builders import BALL_RADIUS_M, GRAVITY, WEIGHTLESS, Float64, Game, make_level

RADIUS_M = 3.0
ROOM_M = RADIUS_M - BALL_RADIUS_M
"""From a half-pipe's axis to the middle of a ball in it."""


def half_pipe(segments: int) -> dict[str, Any]:
    return {"start": (-5, 0, 0), "end": (5, 0, 0), "radius": RADIUS_M, "segments": segments}


def rolling(level: Level, physics: str, velocity: Float64, out: Float64, dt_s: float) -> Game:
    """Return a game whose ball rolls with a velocity on what lies in the direction ``out``."""
    game = Game(level, physics=physics, control_dt_s=dt_s)
    snapshot = game.simulation.snapshot()
    snapshot.bodies.velocity[:] = velocity
    snapshot.bodies.angular_velocity[:] = np.cross(velocity, out) / BALL_RADIUS_M
    game.simulation.restore(snapshot)
    return game


def clearance(level: Level, places: Float64) -> Float64:
    """Return how far balls are over what is solid, negative inside; (n, 3) places, metres."""
    gaps = []
    for solid in expand(level).solids:
        assert isinstance(solid, ConvexSolid)
        beyond = np.stack([places @ side.normal - side.offset for side in solid.sides], axis=-1)
        gaps.append(np.maximum(beyond.max(axis=-1), solid._distance(places, beyond)))
    clear: Float64 = np.min(gaps, axis=0) - BALL_RADIUS_M
    return clear


# Shape --------------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=20)
@given(
    st.one_of(
        st.builds(
            HalfPipe,
            start=st.just((1.0, 2.0, 3.0)),
            end=st.sampled_from([(4.0, 3.0, 3.0), (1.0, 0.0, 5.0)]),
            radius=st.floats(0.3, 9.0),
            arc_deg=st.floats(10.0, 300.0),
            segments=st.integers(2, 20),
        ),
        st.builds(
            Bowl,
            at=st.just((1.0, 2.0, 3.0)),
            radius=st.floats(0.3, 9.0),
            arc_deg=st.floats(10.0, 180.0),
            rings=st.integers(1, 4),
        ),
        st.builds(
            Spiral,
            centre=st.just((1.0, 2.0, 3.0)),
            radius=st.just(2.0),
            width=st.floats(0.2, 3.3),
            rise=st.floats(-1.0, 1.0),
            turn_deg=st.sampled_from([-350.0, 140.0, 170.0]),
            bank_deg=st.floats(0.0, 60.0),
            segments=st.integers(6, 20),
        ),
    )
)
def test_neighbouring_faces_share_their_edges_to_the_last_bit(piece: Any) -> None:
    solids = [set(map(tuple, solid.corners())) for solid in piece.solids("")]
    assert len(solids) == piece.count().solids
    # The edge in common, and the one behind it.
    joints = [len(one & other) for one, other in combinations(solids, 2)]
    assert sum(common >= 4 for common in joints) == expected_joints(piece)


def expected_joints(piece: Any) -> int:
    """Return how many pairs of faces have an edge in common."""
    if isinstance(piece, Bowl):
        rim = 6 * piece.rings
        return (3 * piece.count().solids - rim) // 2
    return int(piece.count().solids) - 1


SMALLEST = st.floats(0.001, 0.05)


@settings(deadline=None, max_examples=60)
@given(
    st.one_of(
        st.tuples(
            st.just(HalfPipe),
            st.fixed_dictionaries(
                {
                    "start": st.just((0, 0, 0)),
                    "end": st.tuples(SMALLEST, st.just(0), st.floats(-1, 1)),
                    "radius": SMALLEST,
                    "arc_deg": st.floats(10, 300),
                    "segments": st.integers(2, 12),
                    "thickness": SMALLEST,
                }
            ),
        ),
        st.tuples(
            st.just(Bowl),
            st.fixed_dictionaries(
                {
                    "at": st.just((0, 0, 0)),
                    "radius": SMALLEST,
                    "arc_deg": st.floats(10, 180),
                    "rings": st.integers(1, 3),
                    "thickness": SMALLEST,
                }
            ),
        ),
        st.tuples(
            st.just(Spiral),
            st.fixed_dictionaries(
                {
                    "centre": st.just((0, 0, 0)),
                    "radius": SMALLEST,
                    "width": SMALLEST,
                    "rise": st.floats(-0.3, 0.3),
                    "turn_deg": st.floats(-500, 500),
                    "bank_deg": st.floats(0, 60),
                    "segments": st.integers(6, 12),
                    "thickness": SMALLEST,
                }
            ),
        ),
    )
)
def test_however_small_it_is_a_curve_is_refused_or_has_all_its_faces(
    piece: tuple[Any, dict[str, Any]],
) -> None:
    kind, fields = piece
    try:
        curve = kind.model_validate(fields)
    except ValidationError:
        return
    assert len(list(curve.solids(""))) == curve.count().solids


@settings(deadline=None, max_examples=10)
@given(st.floats(0.5, 9.0), st.floats(10.0, 180.0), st.integers(1, 5))
def test_the_corners_of_a_bowl_lie_on_two_spheres(radius: float, arc: float, rings: int) -> None:
    bowl = Bowl(at=(1.0, 2.0, 3.0), radius=radius, arc_deg=arc, rings=rings, thickness=0.2)
    corners = np.concatenate([solid.corners() for solid in bowl.solids("")])
    away = np.linalg.norm(corners - (1.0, 2.0, 3.0 + radius), axis=1)
    on = np.minimum(np.abs(away - radius), np.abs(away - radius - 0.2))
    assert on.max() < 1e-9
    assert corners[:, 2].max() == pytest.approx(
        3.0 + radius * (1.0 - math.cos(math.radians(arc / 2))), abs=0.21
    )


@pytest.mark.parametrize(("bank_deg", "outer_m", "inner_m"), [(0.0, 8.0, 8.0), (45.0, 9.0, 7.0)])
def test_a_spiral_leads_from_its_beginning_to_its_end(
    bank_deg: float, outer_m: float, inner_m: float
) -> None:
    spiral = Spiral(
        centre=(1, 2, 3), radius=4, width=2, rise=5, from_deg=90, turn_deg=-540, bank_deg=bank_deg
    )
    first, *_, last = spiral.solids("")
    for solid, corner in (
        (first, (1, 5, inner_m - 5)),
        (first, (1, 7, outer_m - 5)),
        (last, (1, 5 - 6, inner_m)),
        (last, (1, 7 - 10, outer_m)),
    ):
        assert np.linalg.norm(solid.corners() - corner, axis=1).min() < 1e-9


# A ball in them -----------------------------------------------------------------------------------


@pytest.mark.parametrize("segments", [12, 36])
def test_at_an_edge_a_rolling_ball_keeps_what_the_closed_form_says(segments: int) -> None:
    """Without gravity, on `rigid`: through a quarter of the half-pipe."""
    bend = math.pi / segments
    out = np.array([0.0, math.sin(bend / 2), -math.cos(bend / 2)])
    along = np.array([0.0, math.cos(bend / 2), math.sin(bend / 2)])
    room = RADIUS_M * math.cos(bend / 2) - BALL_RADIUS_M - 1e-9
    start = tuple((np.array([0.0, 0.0, RADIUS_M]) + room * out).tolist())
    level = make_level(
        start={"at": start}, boxes=[], gravity=WEIGHTLESS, half_pipes=[half_pipe(segments)]
    )
    game = rolling(level, "rigid", 6.0 * along, out, 1 / 60)
    speeds = []
    for _ in range(36):
        game.step()
        speeds.append(np.linalg.norm(game.simulation.ball_velocity[0]))
    edges = np.log(np.array(speeds) / 6.0) / math.log((5.0 * math.cos(bend) + 2.0) / 7.0)
    assert round(edges[-1]) >= segments // 3
    # Gravity is not quite nothing.
    assert edges == pytest.approx(edges.round(), abs=0.02)


def test_a_ball_swings_in_a_half_pipe_like_on_a_smooth_one_the_more_the_finer_it_is() -> None:
    off = [abs(swing_s(segments) / smooth_s(20.0) - 1.0) for segments in (36, 72, 180)]
    assert off == pytest.approx([0.0187, 0.0064, 0.0016], abs=5e-4)


def swing_s(segments: int) -> float:
    """Return the period of a ball that starts 20 degrees up, on `rigid`."""
    angle = math.radians(20.0)
    room = RADIUS_M * math.cos(math.pi / segments / 2) - BALL_RADIUS_M - 5e-4
    start = (0.0, room * math.sin(angle), RADIUS_M - room * math.cos(angle))
    level = make_level(start={"at": start}, boxes=[], half_pipes=[half_pipe(segments)])
    game = Game(level, physics="rigid", control_dt_s=1 / 60)
    across = game.play(5.0)[:, 1]
    (first, second) = np.flatnonzero(np.sign(across[1:]) != np.sign(across[:-1]))[:2]
    crossed = [n + across[n] / (across[n] - across[n + 1]) for n in (first, second)]
    return float(2.0 * (crossed[1] - crossed[0]) / 60.0)


def smooth_s(degrees: float) -> float:
    """Return the period on a smooth surface: of a pendulum of length 7/5 (R - r)."""
    correction = 1.0 + math.radians(degrees) ** 2 / 16.0
    return 2.0 * math.pi * math.sqrt(7.0 * ROOM_M / (5.0 * GRAVITY)) * correction


@pytest.mark.parametrize(
    ("physics", "gap", "depth"),
    [
        ("rigid", 1e-8, 1e-8),
        ("accurate", 1e-5, 2e-3),
        ("default", 1e-5, 5e-3),
        ("fast", 1e-5, 0.01),
    ],
)
@pytest.mark.parametrize("curve", ["half_pipes", "bowls"])
def test_a_ball_never_leaves_the_surface_and_hardly_sinks_in(
    curve: str, physics: str, gap: float, depth: float
) -> None:
    pieces: dict[str, Any] = {"half_pipes": [half_pipe(36)]}
    if curve == "bowls":
        pieces = {"bowls": [{"at": (0, 0, 0), "radius": 5.0}]}
    level = make_level(start={"at": (0.0, 0.0, BALL_RADIUS_M + 0.08)}, boxes=[], **pieces)
    down, velocity = np.array([0.0, 0.0, -1.0]), np.array([0.3, 3.0, 0.0])
    game = rolling(level, physics, velocity, down, 1 / 60)
    places = game.play(2.0)
    assert np.ptp(places[:, 2]) > 0.4
    found = clearance(level, places)
    assert found[20:].max() < gap
    assert found.min() > -depth


@pytest.mark.parametrize(
    ("physics", "hop"), [("rigid", 1e-3), ("accurate", 2e-3), ("default", 6e-3), ("fast", 9e-3)]
)
def test_a_ball_on_a_banked_spiral_hops_over_edges_that_bend_away_by_little(
    physics: str, hop: float
) -> None:
    radius, fall, bank, begin = 4.0, 2.0, math.radians(15.0), 0.1
    slope = -fall / (2.0 * math.pi * radius)
    out = np.array([math.cos(begin), math.sin(begin), 0.0])
    across = out + np.array([0.0, 0.0, math.tan(bank)])
    along = np.array([-math.sin(begin), math.cos(begin), slope])
    along /= np.linalg.norm(along)
    up = np.cross(across, along)
    up /= np.linalg.norm(up)
    middle = radius * out + np.array([0.0, 0.0, fall * (1.0 - begin / (2.0 * math.pi))])
    spiral = {"centre": (0, 0, fall), "radius": radius, "width": 2, "rise": -fall, "bank_deg": 15}
    level = make_level(
        start={"at": tuple((middle + (BALL_RADIUS_M + 0.02) * up).tolist())},
        boxes=[],
        spirals=[spiral],
    )
    # As fast as the bank carries it round on the level.
    speed = math.sqrt(GRAVITY * radius * math.tan(bank))
    game = rolling(level, physics, speed * along, -up, 1 / 60)
    places = game.play(1.4)
    assert np.abs(np.hypot(places[:, 0], places[:, 1]) - radius).max() < 0.9
    assert math.atan2(places[-1, 1], places[-1, 0]) > 1.0
    assert clearance(level, places)[25:].max() < hop
