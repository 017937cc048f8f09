"""What the ball meets on its way, however fast it is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.game.tables import LevelTable
from roller_env.level import Level
from roller_env.pieces.coin import COIN, COIN_REACH_M
from roller_env.pieces.lift_pad import LIFT_PAD
from roller_env.pieces.plate import PLATE, PLATE_HIT_HEIGHT_M
from roller_env.pieces.sweep import visit
from tests.builders import BALL_RADIUS_M, Float64, Vector
from tests.game.rails import Rails

SUBSTEP_S = 1 / 240


def level_of(**pieces: object) -> Level:
    """A level without ground, unchecked."""
    plain = {
        "name": "regions",
        "start": {"at": (0.0, 0.0, 0.0)},
        "finish": {"at": (900.0, 0.0, 0.0), "size": (1.0, 1.0, 1.0)},
    }
    return Level.model_validate(plain | pieces)


def table_of(**pieces: object) -> LevelTable:
    """A table of one level that holds regions and nothing else."""
    return LevelTable.of_levels([level_of(**pieces)])


def entries(
    path: Float64, table: LevelTable, touching: np.ndarray | None = None
) -> tuple[Float64, np.ndarray]:
    """Return entry times and whether the end lies inside, (M,) each, of one path (S + 1, 3)."""
    regions = table.regions
    count = regions.radius.shape[1]
    before = np.zeros(count, dtype=bool) if touching is None else touching
    found = [
        visit(
            path,
            tuple(regions.centre[0, number]),
            tuple(regions.half[0, number]),
            float(regions.radius[0, number]),
            float(regions.floor[0, number]),
            bool(before[number]),
        )
        for number in range(count)
    ]
    return np.array([time for time, _ in found]), np.array([inside for _, inside in found])


def inside_region(points: Float64, table: LevelTable, index: int) -> np.ndarray:
    """Say which points lie in a region, from its description: independent of the sweep."""
    relative = points - table.regions.centre[0, index]
    nearest = np.clip(relative, -table.regions.half[0, index], table.regions.half[0, index])
    near = ((relative - nearest) ** 2).sum(axis=-1) <= table.regions.radius[0, index] ** 2
    return np.asarray(near & (relative[:, 2] >= table.regions.floor[0, index]))


def coordinates(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


def points(reach: float) -> st.SearchStrategy[Vector]:
    return st.tuples(*[coordinates(-reach, reach)] * 3)


sizes = st.tuples(*[coordinates(0.05, 3.0)] * 3)


@st.composite
def regions(draw: st.DrawFn) -> LevelTable:
    """Coins, plates, pads, triggers and a finish within a few metres of the origin."""

    def some(piece: st.SearchStrategy[Any]) -> list[dict[str, Any]]:
        return draw(st.lists(piece, max_size=3))

    at = points(4.0)
    plates = st.fixed_dictionaries({"at": at, "size": sizes})
    return table_of(
        plates=[plate | {"name": f"p{i}", "opens": ["g"]} for i, plate in enumerate(some(plates))],
        lift_pads=some(st.fixed_dictionaries({"at": at, "size": sizes})),
        camera_triggers=some(
            st.fixed_dictionaries(
                {"at": at, "kind": st.just("first_person"), "reach": coordinates(0.05, 2.0)}
            )
        ),
        finish={"at": draw(at), "size": draw(sizes)},
    )


@st.composite
def paths(draw: st.DrawFn) -> Float64:
    """Up to eight substeps, at up to 200 m/s, turning anywhere: also back and on the spot."""
    start = np.array(draw(points(5.0)))
    speed = draw(st.sampled_from([0.0, 0.1, 5.0, 50.0, 200.0]))
    turns = draw(st.lists(points(1.0), min_size=1, max_size=8))
    steps = np.array(turns) * speed * SUBSTEP_S
    return np.concatenate([start[None], start + np.cumsum(steps, axis=0)])


SAMPLES = 100_000


@settings(max_examples=40, deadline=None)
@given(regions(), paths(), st.booleans())
def test_entries_are_those_that_dense_sampling_finds(
    table: LevelTable, path: Float64, was_touching: bool
) -> None:
    """Sampling may miss the shortest visits; the sweep may not miss what sampling finds."""
    count = table.regions.radius.shape[1]
    touching = np.full(count, was_touching)
    times, ends_inside = entries(path, table, touching)
    clock = np.linspace(0.0, len(path) - 1, SAMPLES)
    dense = np.stack([np.interp(clock, range(len(path)), path[:, axis]) for axis in range(3)], 1)
    tick = clock[1]
    for index in range(count):
        inside = inside_region(dense, table, index)
        assert ends_inside[index] == inside_region(path[-1:], table, index)[0]
        entered = np.flatnonzero(inside & ~np.concatenate([[was_touching], inside[:-1]]))
        sampled = clock[entered[0]] if len(entered) else np.inf
        assert times[index] <= sampled + 1e-9
        if times[index] < sampled - tick:
            assert is_a_visit_between_samples(path, table, index, times[index])


def is_a_visit_between_samples(path: Float64, table: LevelTable, index: int, time: float) -> bool:
    """Say whether the ball is in the region at that time, to a nanometre's rounding."""
    at = np.array([np.interp(time, range(len(path)), path[:, axis]) for axis in range(3)])
    directions = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    diagonal = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    return bool(
        inside_region(at + 2e-9 * np.concatenate([directions, diagonal]), table, index).any()
    )


COIN_AT = (10.0, 0.0, 0.0)
SPHERE = {"at": COIN_AT, "kind": "first_person", "reach": COIN_REACH_M}
"""A region of a coin's place and shape, whose moment of entry can be asked for."""


def straight(start: Vector, end: Vector, substeps: int = 12) -> Float64:
    return np.linspace(start, end, substeps + 1)


@pytest.mark.parametrize("speed_m_s", [1.0, 30.0, 200.0, 3000.0])
@pytest.mark.parametrize("substeps", [1, 3, 12, 48])
def test_no_speed_and_no_frame_skip_jumps_over_a_region(speed_m_s: float, substeps: int) -> None:
    table = table_of(camera_triggers=[SPHERE])
    way = speed_m_s * substeps * SUBSTEP_S
    start = 10.0 - COIN_REACH_M - 0.3 * way
    path = straight((start, 0.0, 0.0), (start + way, 0.0, 0.0), substeps)
    times, _ = entries(path, table)
    assert times[0] == pytest.approx(0.3 * substeps, rel=1e-9)


@pytest.mark.parametrize(("miss_m", "meets"), [(-1e-6, True), (1e-6, False)])
def test_a_ball_that_grazes_a_region_enters_it_and_one_that_just_misses_does_not(
    miss_m: float, meets: bool
) -> None:
    table = table_of(camera_triggers=[SPHERE])
    aside = COIN_REACH_M + miss_m
    path = straight((0.0, aside, 0.0), (23.0, aside, 0.0), substeps=1)
    times, inside = entries(path, table)
    assert np.isfinite(times[0]) == meets
    if meets:
        assert times[0] == pytest.approx(10.0 / 23.0, abs=1e-3)
    assert not inside[0]


def test_a_ball_that_grazes_the_corner_of_a_pad_touches_it() -> None:
    """The region's edges are round: the corner is reached from the radius, not from a box."""
    pad = {"at": (0.0, 0.0, 0.0), "size": (2.0, 2.0, 2.0)}
    table = table_of(lift_pads=[pad])
    for distance, meets in ((BALL_RADIUS_M - 1e-3, True), (BALL_RADIUS_M + 1e-3, False)):
        corner = 1.0 + distance / np.sqrt(2.0)
        start, end = (corner + 5.0, corner - 5.0, 0.0), (corner - 5.0, corner + 5.0, 0.0)
        times, _ = entries(straight(start, end, substeps=1), table)
        assert np.isfinite(times[table.own(LIFT_PAD).region]) == meets


def test_a_ball_that_starts_inside_enters_at_once_if_it_was_not_there_before() -> None:
    table = table_of(camera_triggers=[SPHERE])
    times, inside = entries(straight((10.2, 0.0, 0.0), (10.3, 0.0, 0.0)), table)
    assert times[0] == 0.0
    assert inside[0]


def test_a_ball_that_was_there_before_does_not_enter_again() -> None:
    table = table_of(camera_triggers=[SPHERE])
    count = table.regions.radius.shape[1]
    touching = np.ones(count, dtype=bool)
    times, inside = entries(straight((10.2, 0.0, 0.0), (10.3, 0.0, 0.0)), table, touching)
    assert times[0] == np.inf
    assert inside[0]


def test_a_ball_that_leaves_and_comes_back_in_one_step_enters_again() -> None:
    table = table_of(camera_triggers=[SPHERE])
    touching = np.ones(table.regions.radius.shape[1], dtype=bool)
    path = np.array([[10.0, 0, 0], [20.0, 0, 0], [10.0, 0, 0]])
    times, inside = entries(path, table, touching)
    assert times[0] == pytest.approx(2.0 - COIN_REACH_M / 10.0)
    assert inside[0]


def test_the_first_of_several_entries_counts() -> None:
    table = table_of(camera_triggers=[SPHERE])
    path = np.array([[0.0, 0, 0], [20.0, 0, 0], [0.0, 0, 0], [20.0, 0, 0]])
    times, _ = entries(path, table)
    assert times[0] == pytest.approx((10.0 - COIN_REACH_M) / 20.0)


def test_a_plate_that_sinks_is_not_entered_again() -> None:
    plate = {"name": "p", "at": (10.0, 0.0, 0.0), "size": (2.0, 2.0, 1.6), "opens": ["g"]}
    rails = Rails(level_of(plates=[plate], kill_height=-99.0))
    rails.put(0.0, 0.0, 1.0)
    region = rails.table.own(PLATE).region
    assert np.isfinite(rails.go((20.0, 0.0, 1.0)).entry[0, region])
    again = rails.go((0.0, 0.0, 1.0))
    assert np.isinf(again.entry[0, region])
    assert not again.inside[0, region]


def test_a_plates_region_begins_25_quants_over_it() -> None:
    plate = {"name": "p", "at": (0.0, 0.0, 0.0), "size": (2.0, 2.0, 0.6), "opens": ["g"]}
    table = table_of(plates=[plate])
    index = table.own(PLATE).region
    below, above = PLATE_HIT_HEIGHT_M - 1e-6, PLATE_HIT_HEIGHT_M + 1e-6
    side, _ = entries(straight((9.0, 0.0, below), (-9.0, 0.0, below)), table)
    top, _ = entries(straight((9.0, 0.0, above), (-9.0, 0.0, above)), table)
    assert np.isinf(side[index])
    assert np.isfinite(top[index])


def test_envs_are_swept_each_for_itself() -> None:
    rails = Rails(*[level_of(camera_triggers=[SPHERE], kill_height=-99.0)] * 3)
    path = np.stack(
        [
            straight((0.0, 0.0, 0.0), (20.0, 0.0, 0.0)),
            straight((0.0, 5.0, 0.0), (20.0, 5.0, 0.0)),
            straight((20.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ]
    )
    times = rails.follow(path).entry
    reach = (10.0 - COIN_REACH_M) / 20.0 * 12
    np.testing.assert_allclose(times[:, 0], [reach, np.inf, reach])


# Coins --------------------------------------------------------------------------------------------

crowded = st.tuples(*[st.integers(-6, 6).map(lambda place: place / 2)] * 3)
"""Places on a grid, so that many coins share an x."""


@settings(deadline=None)
@given(st.lists(crowded, min_size=1, max_size=40), paths(), st.data())
def test_the_coins_taken_are_those_whose_own_region_is_entered(
    places: list[Vector], path: Float64, data: st.DataObject
) -> None:
    """However they lie, and whichever of them are gone already."""
    sphere = {"kind": "first_person", "reach": COIN_REACH_M}
    spheres = table_of(camera_triggers=[sphere | {"at": at} for at in places])
    entered = np.isfinite(entries(path, spheres)[0][: len(places)])
    gone = np.array(data.draw(st.lists(st.booleans(), min_size=len(places), max_size=len(places))))
    rails = Rails(level_of(coins=[{"at": at} for at in places], kill_height=-99.0))
    rails.state.of(COIN).taken[0] = gone
    events = rails.follow(path[None])
    np.testing.assert_array_equal(events.coins[0], entered & ~gone)
    assert events.collected[0] == (entered & ~gone).sum()


def test_a_game_whose_physics_diverged_meets_nothing() -> None:
    rails = Rails(level_of(coins=[{"at": COIN_AT}], camera_triggers=[SPHERE], kill_height=5.0))
    rails.state.diverged[:] = True
    path = straight((0.0, 0.0, 9.0), COIN_AT)[None]
    events = rails.follow(path)
    assert np.isinf(events.entry).all()
    for met in (events.coins, events.inside, events.finished, events.fallen):
        assert not met.any()
    rails.state.diverged[:] = False
    events = rails.follow(path)
    assert events.fallen[0]
