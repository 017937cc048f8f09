"""What `roller level check` warns of: each warning has a level, and sound levels have none."""

from __future__ import annotations

import math
import re
import time
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from roller_env.game.actions import KEY_FORCE_N
from roller_env.level import Level, load_level, parse_level, shipped_levels
from roller_env.level.lint import lint
from roller_env.level.reach import Play, reach
from roller_env.level.template import new_level
from roller_env.physics.presets import PRESETS
from roller_env.pieces.coin import Coins
from roller_env.problems import FieldPath, Problem
from roller_env.replay import frames, load_replay, shipped_replays
from roller_env.units import quants
from tests.builders import ORIGINALS
from tests.level.samples import SMALL, small_level
from tests.level.test_docs import EXAMPLES, LEFT_OUT, completed
from tests.replay.recording import wandered
from tests.strategies import levels

SOLID_KINDS = (
    *("floors", "boxes", "ramps", "walls", "hulls", "wedges", "tubes"),
    *("half_pipes", "bowls", "spirals", "lift_pads", "bumpers"),
)
RADIUS = quants(16.0)
PLATE = {"name": "plate", "at": (3.0, 0.0, 0.25), "size": (1.0, 1.0, 0.5), "sinks_to": 0.1}
GATE = {"name": "gate", "at": (6.0, 0.0, 1.0), "size": (0.2, 40.0, 2.0), "lowers_to": -1.1}
LINKED = {"plates": [PLATE | {"opens": ["gate"]}], "gates": [GATE]}
FLOOR = {"at": (8.0, 0.0, -0.5), "size": (20.0, 6.0, 1.0)}
"""The floor of the small level, whose upper face is at 0 from x = -2 to 18, y = -3 to 3."""


def play(preset: str = "default") -> Play:
    dt_s = PRESETS[preset].dt_s if PRESETS[preset].engine == "mujoco" else 0.0
    return Play(dt_s, math.hypot(KEY_FORCE_N, KEY_FORCE_N))


def warned(level: Level | None = None, preset: str = "default", **changes: Any) -> list[Problem]:
    return lint(small_level(**changes) if level is None else level, play(preset))


def fields(**changes: Any) -> list[FieldPath]:
    return [problem.path for problem in warned(**changes)]


def finish_at(x: float, y: float, z: float) -> dict[str, Any]:
    return {"at": (x, y, z), "size": (1.0, 1.0, 1.0)}


@pytest.mark.parametrize("name", shipped_levels())
def test_no_shipped_level_is_warned_of(name: str) -> None:
    assert warned(load_level(name), "fast") == []


def test_a_new_level_is_not_warned_of() -> None:
    assert warned(parse_level(new_level("mine"))) == []


@pytest.mark.filterwarnings("ignore::roller_env.level.LevelWarning")
@pytest.mark.parametrize("example", EXAMPLES)
def test_no_example_of_the_page_is_warned_of_what_it_says_itself(example: str) -> None:
    found = warned(parse_level(completed(example)))
    # An example without a floor has none; and what the test adds lies where nothing leads.
    if all(f"{kind}:" not in example for kind in SOLID_KINDS):
        assert [problem.path for problem in found] == [()]
    elif re.search(r"^start:", example, re.MULTILINE):
        assert found == []
    else:
        assert {str(problem.path[0]) for problem in found} <= LEFT_OUT.keys()


def test_a_level_without_any_floor_is_told_so_and_nothing_else() -> None:
    (problem,) = warned(boxes=[])
    assert problem.path == ()
    assert "there is no floor" in problem.message


def test_a_finish_beyond_a_gap_that_is_too_wide_is_out_of_reach() -> None:
    island = {"at": (40.0, 0.0, -0.5), "size": (4.0, 4.0, 1.0)}
    assert fields(boxes=[FLOOR, island], finish=finish_at(40, 0, 0.5)) == [("finish", "at")]
    # Two metres, after a run of twenty: one can fly over that.
    beside = {"at": (22.0, 0.0, -0.5), "size": (4.0, 4.0, 1.0)}
    assert fields(boxes=[FLOOR, beside], finish=finish_at(22, 0, 0.5)) == []


def test_an_island_that_lies_deep_enough_can_be_flown_to() -> None:
    island = {"at": (40.0, 0.0, -15.0), "size": (8.0, 8.0, 1.0)}
    assert fields(boxes=[FLOOR, island], finish=finish_at(40, 0, -14.0)) == []


def test_a_beam_narrower_than_the_ball_is_a_way() -> None:
    beam = {"at": (28.0, 0.31, -0.5), "size": (20.0, 0.05, 1.0)}
    island = {"at": (40.0, 0.0, -0.5), "size": (4.0, 4.0, 1.0)}
    assert fields(boxes=[FLOOR, beam, island], finish=finish_at(40, 0, 0.5)) == []


def test_a_coin_that_hangs_too_high_is_out_of_reach_without_anything_to_rise_on() -> None:
    high = [{"at": (8.0, 0.0, 2.5)}, {"at": (8.0, 0.0, RADIUS)}]
    (problem,) = warned(coins=high)
    assert problem.path == ("coins", 0)
    assert problem.message.startswith("the coin at [8, 0, 2.5] is out of reach")
    ramp = {"start": (9.0, 2.0, 0.0), "end": (12.0, 2.0, 1.5), "width": 2.0}
    assert fields(coins=high, ramps=[ramp]) == []
    kerb = {"at": (9.0, 0.0, 0.05), "size": (1.0, 1.0, 0.1)}
    assert fields(coins=high, boxes=[FLOOR, kerb]) == [], "a fast ball leaves a kerb upwards"
    assert fields(coins=high, lift_pads=[{"at": (9.0, 0.0, 0.02), "size": (1, 1, 0.04)}]) == []


def test_the_first_of_a_row_of_coins_out_of_reach_is_named() -> None:
    line = {"line": {"start": (12.0, 0.0, 0.4), "end": (32.0, 0.0, 0.4), "count": 11}}
    (problem,) = warned(coins=[line])
    assert problem.message.startswith("the coin at [30, 0, 0.4] (the first of 2) is out of reach")


def test_a_deck_to_which_nothing_leads_up_is_out_of_reach() -> None:
    deck = {"at": (14.0, 0.0, 4.0), "size": (4.0, 6.0, 0.2)}
    up = finish_at(15, 0, 4.6)
    assert fields(boxes=[FLOOR, deck], finish=up) == [("finish", "at")]
    ramp = {"start": (3.0, 0.0, 0.0), "end": (12.0, 0.0, 4.1), "width": 2.0}
    assert fields(boxes=[FLOOR, deck], ramps=[ramp], finish=up) == []
    pad = {"at": (9.0, 0.0, 0.02), "size": (1.0, 1.0, 0.04)}
    assert fields(boxes=[FLOOR, deck], lift_pads=[pad], finish=up) == []


def walls(height: float) -> dict[str, Any]:
    """A wall across the floor, and so far beyond it that no ball flies round its end."""
    return {"at": (6.0, 0.0, height / 2), "size": (0.2, 40.0, height)}


def test_a_finish_behind_a_wall_is_out_of_reach_and_one_behind_a_doorway_is_not() -> None:
    assert fields(boxes=[FLOOR, walls(2.0)]) == [("finish", "at")]
    left = {"at": (6.0, 10.5, 1.0), "size": (0.2, 20.0, 2.0)}
    right = {"at": (6.0, -10.5, 1.0), "size": (0.2, 20.0, 2.0)}
    assert fields(boxes=[FLOOR, left, right]) == []


def test_a_room_whose_wall_is_turned_is_closed_too() -> None:
    wall = {"at": (6.0, 0.0, 1.0), "size": (0.05, 60.0, 2.0), "yaw_deg": 37.0}
    assert fields(boxes=[FLOOR, wall]) == [("finish", "at")]


def test_a_gate_is_a_way_if_its_plate_can_be_struck() -> None:
    assert fields(**LINKED) == []
    # Behind the gate that it opens.
    behind = PLATE | {"opens": ["gate"], "at": (9.0, 0.0, 0.25)}
    tall = GATE | {"at": (6.0, 0.0, 20.0), "size": (0.2, 40.0, 40.0), "lowers_to": -20.1}
    assert fields(plates=[behind], gates=[tall]) == [("finish", "at"), ("plates", 0, "at")]


def test_a_plate_in_the_air_is_out_of_reach() -> None:
    high = PLATE | {"opens": ["gate"], "at": (3.0, 2.0, 8.0)}
    away = GATE | {"at": (6.0, 5.0, 1.0), "size": (0.2, 2.0, 2.0)}
    assert fields(plates=[high], gates=[away]) == [("plates", 0, "at")]


def test_a_gate_that_still_stands_out_when_it_is_open_is_warned_of() -> None:
    half_open = GATE | {"lowers_to": 0.0}
    (problem,) = warned(plates=LINKED["plates"], gates=[half_open])
    assert problem.path == ("gates", 0, "lowers_to")
    assert "the open gate still stands 1 metre over the ground" in problem.message
    assert "wanted at most -1 metres" in problem.message
    # As much as a ball rolls over.
    assert fields(**LINKED | {"gates": [GATE | {"lowers_to": -0.7}]}) == []
    # Over the deck of a bridge, under which it hangs when it is open.
    assert fields(**LINKED | {"gates": [GATE | {"lowers_to": -4.0}]}) == []


def test_a_gate_that_is_left_to_find_its_height_leaves_the_way_free_on_any_deck() -> None:
    text = SMALL + (
        "plates: [{name: p, at: [100, 0, 10], size: [48, 48, 20], opens: [g]}]\n"
        "gates: [{name: g, at: [300, 0, 100], size: [16, 400, 200]}]\n"
    )
    assert lint(parse_level(text), play(), "quant") == []
    # With a sill under its middle it does so for whoever rolls over the sill.
    text = text.replace("boxes:\n", "boxes:\n  - {at: [300, 0, 20], size: [16, 32, 40]}\n")
    (problem,) = lint(parse_level(text), play(), "quant")
    assert problem.path == ("gates", 0, "lowers_to")
    assert problem.message.startswith("not given, so it is found -60 quants, where the open gate")
    assert "still stands 40 quants over the ground; wanted at most -100 quants" in problem.message


def test_a_light_ball_that_slips_is_warned_of_since_mujoco_throws_it_up() -> None:
    (problem,) = warned(ball={"mass_kg": 0.1})
    assert problem.path == ("ball", "mass_kg")
    assert "push with 7.2 N and friction on default holds 0.29 N: the ball slips" in problem.message
    assert warned(preset="rigid", ball={"mass_kg": 0.1}) == []
    # It slips on ice as well, which lifts a ball of 1 kg by a centimetre.
    assert warned(ball={"friction": 0.03}) == []


def test_friction_that_mujoco_ends_a_skid_late_with_is_warned_of_on_its_material() -> None:
    rubber = {"rubber": {"friction": 4.0}}
    floor = {"at": (0.0, 0.0, -0.5), "size": (20.0, 20.0, 1.0), "material": "rubber"}
    changes: dict[str, Any] = {"boxes": [floor], "finish": finish_at(4.0, 0.0, 0.5)}
    (problem,) = warned(materials=rubber, **changes)
    assert problem.path == ("ball", "friction")
    assert "friction on rubber is 1.2: " in problem.message
    assert warned(preset="relaxed", materials=rubber, **changes) == []


def test_a_floor_too_thin_for_the_falls_onto_it_is_warned_of() -> None:
    ball = {"radius": 0.05}
    tower = {"at": (0.0, 0.0, 19.5), "size": (2.0, 2.0, 1.0)}
    thin = {"at": (2.0, 0.0, -0.005), "size": (6.0, 2.0, 0.01)}
    changes: dict[str, Any] = {"ball": ball, "finish": finish_at(4.0, 0.0, 0.5)}
    changes["start"] = {"at": (0.0, 0.0, 20.05)}
    (problem,) = warned(boxes=[tower, thin], **changes)
    assert problem.path == ("boxes", 1)
    assert "from 20 metres up, comes in at 20 m/s" in problem.message
    assert "in a physics step of 4.17 ms; wanted at least 0.09 metres" in problem.message
    assert warned(preset="accurate", boxes=[tower, thin], **changes) == []
    assert warned(boxes=[tower, thin | {"size": (6.0, 2.0, 0.1)}], **changes) == []
    # Of two slabs on one another it does not matter where one ends.
    under = {"at": (2.0, 0.0, -0.5), "size": (6.0, 2.0, 0.99)}
    assert warned(boxes=[tower, thin, under], **changes) == []


@pytest.mark.parametrize("name", ORIGINALS)
def test_wherever_a_ball_has_been_a_coin_is_within_reach(name: str) -> None:
    """Coins are put where the ball was in the shipped demonstration, in the air as well."""
    replay = load_replay(shipped_replays()[name])
    path = [frame.qpos[:3].tolist() for frame in frames(replay)][::5]
    level = replay.level.model_copy(update={"coins": tuple(Coins(at=tuple(at)) for at in path)})
    found = reach(level, play())
    assert found is not None
    assert [at for at, is_found in zip(path, found.coins, strict=False) if not is_found] == []
    assert found.plates.all()


@pytest.mark.parametrize("seed", range(3))
def test_a_ball_that_is_driven_off_the_edge_was_within_reach_all_the_way_down(seed: int) -> None:
    replay = wandered("bridge", seed, max_episode_steps=2_000)
    path = [frame.qpos[:3].tolist() for frame in frames(replay)]
    path = [at for at in path if at[2] > replay.level.kill_height][::3]
    assert path[-1][2] < -1.0
    level = replay.level.model_copy(update={"coins": tuple(Coins(at=tuple(at)) for at in path)})
    found = reach(level, play())
    assert found is not None
    assert found.coins.all()


@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow])
@given(levels())
def test_every_valid_level_can_be_looked_at(level: Level) -> None:
    for problem in lint(level, play(), "quant"):
        assert problem.message
        assert not problem.path or problem.path[0] in Level.model_fields


def test_the_strangest_forces_do_no_harm() -> None:
    pad = {"at": (9.0, 0.0, 0.02), "size": (1, 1, 0.04), "force_n": 1e6, "duration_s": 86_400.0}
    ball = {"mass_kg": 0.001, "elasticity": 0.95}
    found = set(fields(ball=ball, lift_pads=[pad], gravity=0.001))
    assert found == {("ball", "mass_kg"), ("boxes", 0), ("lift_pads", 0)}


def test_a_level_too_large_to_search_is_left_alone() -> None:
    wide = {"at": (0.0, 0.0, -0.5), "size": (4_000.0, 4_000.0, 1.0)}
    assert reach(small_level(boxes=[wide]), play()) is None
    assert fields(boxes=[wide]) == []


def test_the_largest_level_that_is_searched_takes_seconds() -> None:
    generator = np.random.default_rng(3)
    places = generator.uniform([-40.0, -40.0, 2.0], [40.0, 40.0, 30.0], (2_000, 3))
    turns = generator.uniform(-180.0, 180.0, (2_000, 2))
    boxes = [
        {"at": tuple(at), "size": (1.0, 1.0, 0.3), "yaw_deg": yaw, "pitch_deg": pitch}
        for at, (yaw, pitch) in zip(places.tolist(), turns.tolist(), strict=True)
    ]
    ground = {"at": (0.0, 0.0, -0.5), "size": (100.0, 100.0, 1.0)}
    level = small_level(boxes=[ground, *boxes], start={"at": (0.0, 0.0, 0.4064)})
    began = time.perf_counter()
    assert lint(level, play()) == []
    assert time.perf_counter() - began < 60.0
