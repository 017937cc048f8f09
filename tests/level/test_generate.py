"""Levels without end: the same for ever, playable, and different."""

from __future__ import annotations

import hashlib
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.compile.compiled import compile_level
from roller_env.level import load_level, parse_level
from roller_env.level.expand import expand
from roller_env.level.generate import Knobs, generate
from roller_env.level.text import level_text
from roller_env.solver import won_level


@given(seed=st.integers(0, 2**63 - 1), difficulty=st.floats(0.0, 1.0))
def test_whatever_is_generated_loads_without_a_warning(seed: int, difficulty: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        level = generate(seed, difficulty)
    assert level == generate(seed, difficulty)
    assert parse_level(level_text(level), "generated.yaml") == level


def test_a_generated_level_is_the_same_for_ever() -> None:
    """Whoever has to change this makes another ``VERSION`` of the generator."""
    text = "".join(
        generate(seed, seed / 20).model_dump_json(exclude_defaults=True) for seed in range(21)
    )
    assert (
        hashlib.sha256(text.encode()).hexdigest()
        == "f94dd2cd5d6621d91fd3cf6492098f699bfd1e1815be53db91452ca4c3f0f37e"
    )


def test_generated_levels_compile_for_both_engines() -> None:
    for seed in range(12):
        level = generate(seed, seed / 11)
        assert compile_level(level).model.nbody > 1
        assert len(expand(level).ground) > 0


def test_difficulty_makes_levels_longer_and_ways_narrower() -> None:
    easy, hard = (
        [Knobs.of(d, np.random.default_rng(seed)) for seed in range(50)] for d in (0.1, 0.9)
    )
    assert max(k.platforms for k in easy) < min(k.platforms for k in hard)
    assert min(k.width for k in easy) > max(k.width for k in hard)
    assert len({generate(seed, 0.5).model_dump_json() for seed in range(50)}) == 50


@pytest.mark.parametrize("difficulty", [0.0, 0.3, 0.6])
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
