"""The solver: what can be won is won, and what was won is won again."""

from __future__ import annotations

import numpy as np
import pytest

from roller_env.level import Level, load_level, shipped_levels
from roller_env.replay import verify
from roller_env.simulation import Simulation
from roller_env.solver import Search, prove, robustness, solve
from roller_env.solver.archive import MOST_CELLS, Archive, Node
from roller_env.solver.reference import Reference
from roller_env.solver.search import solver_config
from roller_env.solver.tracker import Tracker
from tests.builders import make_level

BUDGET = 1_000_000


def without_route(name: str) -> Level:
    return load_level(load_level(name).model_copy(update={"route": None}))


@pytest.mark.parametrize("name", shipped_levels())
def test_every_shipped_level_is_won_without_its_route(name: str) -> None:
    replay = solve(without_route(name), BUDGET)
    assert replay is not None
    assert replay.result.success
    assert replay.player == "solver"
    verify(replay)


@pytest.mark.parametrize("name", ["bridge", "flat", "gate", "lift"])
def test_given_time_every_coin_is_collected(name: str) -> None:
    replay = solve(without_route(name), 2 * BUDGET, all_coins=True)
    assert replay is not None
    assert replay.result.success
    assert replay.result.score_percent == 100.0


def test_the_same_search_finds_the_same_play() -> None:
    one, other = (solve("gate", BUDGET, seed=3) for _ in range(2))
    assert one is not None
    assert other is not None
    assert one.actions.tolist() == other.actions.tolist()


def test_what_is_not_found_in_the_budget_is_told_as_that() -> None:
    # The finish hangs where no ball comes.
    level = make_level(finish={"at": (30.0, 0.0, 30.0), "size": (1.0, 1.0, 1.0)})
    search = Search(level)
    assert search.run(50_000) is None
    assert search.steps >= 50_000
    assert solve(level, 50_000) is None
    assert prove(level, 50_000) is None


def test_a_proof_holds_from_other_starts_on_both_engines() -> None:
    proof = prove("gate", BUDGET, games=20)
    assert proof is not None
    assert proof.finished >= 0.9
    assert [one.physics for one in proof.robustness] == ["rigid", "default"]
    again = robustness(proof.replay, "gate", "rigid", 20)
    assert again == proof.robustness[0]


def test_a_ball_that_comes_too_late_waits_for_the_ferry() -> None:
    level = make_level(
        start={"at": (0.0, 0.0, 0.4064), "jitter": (0.3, 0.3)},
        boxes=[
            {"at": (0.0, 0.0, -0.2), "size": (3.0, 3.0, 0.4)},
            {"at": (10.0, 0.0, -0.2), "size": (3.0, 3.0, 0.4)},
        ],
        platforms=[
            {
                "name": "ferry",
                "at": (2.52, 0.0, -0.2),
                "to": (7.48, 0.0, -0.2),
                "size": (2.0, 2.0, 0.4),
                "speed": 2.0,
            }
        ],
        finish={"at": (10.0, 0.0, 0.6), "size": (0.9, 0.9, 1.2)},
    )
    replay = solve(level, BUDGET)
    assert replay is not None
    games, held_up = 40, 8
    simulation = Simulation(solver_config(level, "default"), games)
    simulation.seed([np.random.default_rng(row) for row in range(games)])
    simulation.reset()
    for late in range(held_up):
        hold = np.arange(games) % held_up <= late
        simulation.step(np.zeros((games, 2)), hold)
    Tracker(Reference.of(replay, level), simulation).play(2 * len(replay) + 120)
    assert simulation.state.finished.mean() >= 0.9


def test_a_spring_is_entered_as_fast_as_the_landing_needs() -> None:
    proof = prove("springs", BUDGET, games=20, tries=1)
    assert proof is not None
    assert proof.finished >= 0.9


def test_an_archive_keeps_the_soonest_game_of_a_cell_and_never_more_than_it_may() -> None:
    archive = Archive()
    game = Search("flat").archive.nodes[0].game
    for number in range(MOST_CELLS + 10):
        cell = np.array([number, 0, 0, number % 7])
        archive.put(cell, Node(-1, np.zeros(0, dtype=np.int64), 5, number % 7, game))
    assert len(archive) <= MOST_CELLS
    rich = np.array([6, 0, 0, 6])
    assert archive.steps_to(rich) == 5
    archive.put(rich, Node(-1, np.ones(2, dtype=np.int64), 2, 6, game))
    assert archive.steps_to(rich) == 2
    drawn = archive.draw(64, 0.7, np.random.default_rng(0))
    assert all(archive.nodes[node].game is not None for node in drawn)
    assert archive.way_to(len(archive.nodes) - 1).tolist() == [1, 1]
