"""Flares: their life, growth and colours, with the numbers of the original."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.play.effects import FLARE_ALPHA, MAX_FLARES, Flare, Flares
from roller_env.units import quants

LIFE_S = 3.125
COINS = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]])


def flares(coins: np.ndarray = COINS) -> Flares:
    return Flares(coins, np.random.default_rng(1))


def taken(*coins: int, of: int = len(COINS)) -> np.ndarray:
    flags = np.zeros(of, dtype=bool)
    flags[list(coins)] = True
    return flags


def test_a_flare_is_there_for_three_and_an_eighth_seconds() -> None:
    flare = Flare((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), born_s=10.0)
    assert flare.lights(10.0)
    assert flare.lights(10.0 + LIFE_S - 1e-6)
    assert not flare.lights(10.0 + LIFE_S)
    assert not flare.lights(9.9)


@given(st.floats(0.0, LIFE_S - 1e-3))
def test_its_width_grows_by_48_quants_a_second_and_its_alpha_falls_by_32_percent(
    age: float,
) -> None:
    _, coloured = Flare((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), born_s=0.0).lights(age)
    assert 2.0 * coloured.radius_m == pytest.approx(quants(48.0 * age))
    assert coloured.alpha == pytest.approx(FLARE_ALPHA * (1.0 - 0.32 * age))


def test_there_is_a_white_light_in_the_middle_of_it() -> None:
    core, coloured = Flare((1.0, 2.0, 3.0), (0.3, 0.2, 1.0), born_s=0.0).lights(1.0)
    assert core.colour == (1.0, 1.0, 1.0)
    assert core.radius_m < coloured.radius_m
    assert core.position == coloured.position == (1.0, 2.0, 3.0)


def test_a_coin_lights_one_flare_where_it_was() -> None:
    watching = flares()
    assert watching.watch(taken(), 0.0) == 0
    assert watching.watch(taken(1), 1.0) == 1
    assert watching.watch(taken(1), 1.1) == 0
    assert {light.position for light in watching.lights(1.2)} == {(4.0, 5.0, 6.0)}


def test_flares_go_out_one_after_another() -> None:
    watching = flares()
    watching.watch(taken(0), 0.0)
    watching.watch(taken(0, 1), 2.0)
    assert len(watching.lights(2.5)) == 4
    assert len(watching.lights(LIFE_S + 0.1)) == 2
    assert not watching.lights(2.0 + LIFE_S)


def test_a_new_game_puts_all_flares_out() -> None:
    watching = flares()
    watching.watch(taken(0, 1), 0.0)
    watching.watch(taken(), 0.5)
    assert not watching.lights(0.6)
    assert watching.watch(taken(0), 0.7) == 1


def test_colours_are_random_bright_and_differ() -> None:
    coins = np.zeros((40, 3))
    watching = flares(coins)
    watching.watch(np.ones(40, dtype=bool), 0.0)
    colours = {light.colour for light in watching.lights(0.1)} - {(1.0, 1.0, 1.0)}
    assert len(colours) == 40
    assert all(max(colour) == pytest.approx(1.0) for colour in colours)


def test_a_heap_of_coins_does_not_fill_the_picture_with_lights() -> None:
    coins = np.zeros((500, 3))
    watching = flares(coins)
    assert watching.watch(np.ones(500, dtype=bool), 0.0) == 500
    assert len(watching.lights(0.1)) == 2 * MAX_FLARES
