"""Levels without end: the same for ever, playable, and different."""

from __future__ import annotations

import hashlib
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.compile.compiled import compile_level
from roller_env.game.actions import forces
from roller_env.level import load_level, parse_level
from roller_env.level.generate import VERSIONS, generate
from roller_env.level.generate.draft import Draft, Frame, Span
from roller_env.level.generate.joints import JOINTS
from roller_env.level.generate.version_2 import Knobs
from roller_env.level.schema import PIECE_FIELDS
from roller_env.level.text import level_text
from roller_env.simulation import Simulation
from roller_env.solver import won_level
from roller_env.solver.search import solver_config
from tests.builders import make_level


@given(
    seed=st.integers(0, 2**63 - 1), difficulty=st.floats(0.0, 1.0), version=st.sampled_from([1, 2])
)
def test_whatever_is_generated_loads_without_a_warning(
    seed: int, difficulty: float, version: int
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        level = generate(seed, difficulty, version=version)
    assert level == generate(seed, difficulty, version=version)
    assert parse_level(level_text(level), "generated.yaml") == level


@pytest.mark.parametrize(
    ("version", "checksum"),
    [
        (1, "f94dd2cd5d6621d91fd3cf6492098f699bfd1e1815be53db91452ca4c3f0f37e"),
        (2, "1c98f253dd3d2902a8e250991770251ef0c7cf81d1592ceb83848fcad6a838fc"),
    ],
)
def test_a_generated_level_is_the_same_for_ever(version: int, checksum: str) -> None:
    """Whoever has to change this makes another version of the generator."""
    text = "".join(
        generate(seed, seed / 20, version=version).model_dump_json(exclude_defaults=True)
        for seed in range(21)
    )
    assert hashlib.sha256(text.encode()).hexdigest() == checksum


@pytest.mark.parametrize("version", VERSIONS)
def test_generated_levels_compile_for_both_engines(version: int) -> None:
    for seed in range(8):
        level = generate(seed, seed / 7, version=version)
        assert compile_level(level).model.nbody > 1
        Simulation(solver_config(level)).reset()


def test_difficulty_makes_levels_longer_and_ways_narrower() -> None:
    def knobs(difficulty: float) -> list[Knobs]:
        return [Knobs.of(difficulty, Draft(np.random.default_rng(seed))) for seed in range(50)]

    easy, hard = knobs(0.1), knobs(0.9)
    assert max(k.decks for k in easy) < min(k.decks for k in hard)
    assert min(k.width for k in easy) > max(k.width for k in hard)


def test_all_kinds_of_pieces_appear_and_levels_differ() -> None:
    levels = [generate(seed, 0.6) for seed in range(60)]
    kinds = {field for level in levels for field in PIECE_FIELDS if getattr(level, field)}
    moving = {"platforms", "springs", "fans", "bumpers", "teleporters", "hazards"}
    assert kinds >= moving | {"boxes", "ramps", "wedges", "walls", "plates", "switches", "gates"}
    routes = {level.route.points for level in levels if level.route is not None}
    assert len(routes) == len(levels)


@pytest.mark.parametrize("name", ["spring", "portal"])
def test_a_joint_that_throws_or_moves_the_ball_brings_it_to_the_next_deck(name: str) -> None:
    """From the deck before, with one key held until it acts, and none after."""
    for seed in range(20):
        draft, joint = Draft(np.random.default_rng(seed)), JOINTS[name]
        span = Span(Frame((1.5, 0.0, 0.0), 0), 3.4, draft.between(*joint.rise), 2.0, 1.5, 1.5, "0")
        joint.build(span, draft)
        level = make_level(
            start={"at": (-0.5, 0.0, 0.4064)},
            boxes=[
                {"at": (0.0, 0.0, -0.2), "size": (3.0, 3.0, 0.4)},
                {"at": (6.4, 0.0, span.rise - 0.2), "size": (3.0, 3.0, 0.4)},
            ],
            finish={"at": (6.4, 0.0, span.rise + 0.3), "size": (3.0, 3.0, 0.6)},
            **draft.fields,
        )
        game = Simulation(solver_config(level))
        game.reset()
        held = 1
        for _ in range(40):
            if game.ball_position[0, 0] > 1.0:
                held = 0
            game.step(forces("directions", [held]))
        assert game.state.finished[0], f"{name}, rise {span.rise:.2f}"


@pytest.mark.parametrize("difficulty", [0.0, 0.3])
def test_a_level_that_is_handed_out_has_been_won(difficulty: float) -> None:
    won = won_level(3, difficulty)
    assert won.replay.result.success
    assert won.replay.level == won.level == load_level(won.level)
    assert won_level(3, difficulty).level == won.level


@pytest.mark.parametrize(
    ("seed", "difficulty", "error", "message"),
    [
        (-1, 0.5, ValueError, "seed: found -1; must be"),
        (0.5, 0.5, ValueError, "seed: found 0.5; must be a whole number"),
        (0, 1.5, ValueError, r"difficulty: found 1\.5; must be a number from 0 to 1"),
    ],
)
def test_what_is_out_of_range_is_refused(
    seed: int, difficulty: float, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        generate(seed, difficulty)
