"""The scripted player's plan visits what there is, and what it did is shipped and still true."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.level import load_level, shipped_levels
from roller_env.level.expand import expand
from roller_env.replay import Versions, load_replay, record_episode, shipped_replays, verify
from roller_env.replay.scripted import ScriptedPlayer, itinerary, relabelled, shortest_way
from tests.builders import ORIGINALS, make_level
from tests.replay.recording import wandered

MAX_BYTES = 20_000
REMEDY = (
    "if that is meant, raise RULES_VERSION or PHYSICS_VERSION and make them anew with "
    "scripts/make_demonstrations.py"
)

places = st.tuples(*(3 * [st.floats(-50.0, 50.0)]))


@pytest.mark.parametrize("level", shipped_levels())
def test_every_level_has_a_demonstration_that_gets_all_coins_and_the_finish(level: str) -> None:
    file = shipped_replays()[level]
    played = load_replay(file)
    assert played.level == load_level(level), f"{level} was changed since; {REMEDY}"
    assert played.result.success
    assert played.result.score_percent == 100.0
    scripted = played.level.route is not None
    assert played.player == ("scripted player" if scripted else "solver")
    assert file.stat().st_size < MAX_BYTES


@pytest.mark.parametrize("level", shipped_levels())
def test_every_demonstration_is_played_again_bit_for_bit(level: str) -> None:
    played = load_replay(shipped_replays()[level])
    verification = verify(played)
    differences = played.versions.differences(Versions.here())
    if differences and not verification.is_exact:
        # What another MuJoCo, NumPy, C library or processor computes may differ in the last bit.
        pytest.skip(f"{level}: {verification}; {REMEDY}")
    assert verification.is_exact, f"{level}: {verification}; {REMEDY}"


@pytest.mark.parametrize("level", ORIGINALS)
def test_the_plan_has_every_coin_once_and_the_route_in_its_order(level: str) -> None:
    loaded = load_level(level)
    stops = itinerary(loaded)
    coins = [stop.coin for stop in stops if stop.coin is not None]
    assert sorted(coins) == list(range(len(expand(loaded).coins)))
    assert loaded.route is not None
    route = [tuple(stop.at) for stop in stops if stop.coin is None]
    assert route == list(loaded.route.points)


def test_a_level_without_a_route_has_no_plan() -> None:
    with pytest.raises(ValueError, match="has no route"):
        ScriptedPlayer(make_level())


@given(st.lists(places, min_size=2, max_size=9))
def test_the_way_visits_every_point_between_its_ends_and_no_reversal_shortens_it(
    points: list[tuple[float, float, float]],
) -> None:
    table = np.array(points)
    way = shortest_way(table)
    assert (way[0], way[-1]) == (0, len(points) - 1)
    assert sorted(way) == list(range(len(points)))

    def length(order: list[int]) -> float:
        return math.fsum(np.linalg.norm(np.diff(table[order], axis=0), axis=1))

    for i in range(1, len(way) - 1):
        for j in range(i + 2, len(way)):
            assert length(way) <= length(way[:i] + way[i:j][::-1] + way[j:]) + 1e-6


def test_a_player_recovers_from_action_noise() -> None:
    level = load_level("bridge")
    config = wandered("bridge").config()
    steady = record_episode(config, ScriptedPlayer(level), seed=1)
    noisy = record_episode(config, ScriptedPlayer(level, action_noise=0.15, seed=1), seed=1)
    assert steady.result.success
    assert noisy.result.success
    assert len(noisy) > len(steady)


@pytest.mark.parametrize("level", ["bridge", "gate"])
def test_relabelled_is_what_the_player_did_but_for_the_noise(level: str) -> None:
    config, loaded = wandered(level).config(), load_level(level)
    steady = record_episode(config, ScriptedPlayer(loaded), seed=1)
    assert np.array_equal(relabelled(steady), steady.force_n)
    noisy = record_episode(config, ScriptedPlayer(loaded, action_noise=0.3, seed=1), seed=1)
    done_otherwise = (relabelled(noisy) != noisy.force_n).any(axis=1)
    # One in nine of the noise's actions is what the player would have done.
    assert 0.1 < done_otherwise.mean() < 0.4


def test_action_noise_is_a_fraction() -> None:
    with pytest.raises(ValueError, match="a fraction from 0 to 1"):
        ScriptedPlayer(load_level("flat"), action_noise=1.5)
