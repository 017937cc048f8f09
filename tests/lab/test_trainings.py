"""Trainings by the dozen: every finished one is kept, and what they show is told as it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from roller_env.lab import learners, trainings
from roller_env.lab.chart import save
from roller_env.training import load_config

RECIPE = Path(__file__).parents[2] / "configs" / "ppo.yaml"

HEAD = "variant,level,seed,steps,finish,coins,falls,time_s,train_cpu_s\n"


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Path:
    stem = tmp_path_factory.mktemp("results") / "seeds"
    trainings.run(trainings.QUICK, RECIPE, stem, jobs=2)
    return stem


def test_every_trial_has_a_row_and_a_learning_curve(quick: Path) -> None:
    rows = list(trainings._rows(trainings._results(quick)))
    found = {(row["variant"], row["level"], int(row["seed"])) for row in rows}
    assert found == {trial.key for trial in trainings.QUICK.trials}
    for row in rows:
        assert 0.0 <= float(row["finish"]) <= 1.0
        assert int(row["steps"]) == 2048
    curves = list(trainings._rows(trainings._curves(quick)))
    assert {row["level"] for row in curves} == {"flat", "gate"}


def test_what_is_there_is_not_trained_again(quick: Path) -> None:
    before = trainings._results(quick).read_bytes()
    trainings.run(trainings.QUICK, RECIPE, quick, jobs=1)
    assert trainings._results(quick).read_bytes() == before


def test_the_tables_and_the_chart_are_made_from_the_rows(quick: Path, tmp_path: Path) -> None:
    assert "| flat |" in trainings.seeds_table(quick)
    assert "gamma 0.99" in trainings.factors_table(quick)
    assert "on fast | on rigid |" in trainings.transfer_table(quick)
    picture, _ = save(trainings.draw_curves(quick, "note"), {}, tmp_path / "curves")
    assert picture.stat().st_size > 10_000


def test_a_level_is_learnt_where_finish_and_coins_are_both_good(tmp_path: Path) -> None:
    stem = tmp_path / "seeds"
    stem.with_name("seeds.csv").write_text(
        HEAD
        + "recipe,flat,10,9,1.0,1.0,0,9.5,60\n"
        + "recipe,flat,11,9,1.0,0.94,0,9.5,70\n"
        + "recipe,flat,12,9,0.94,1.0,0,9.5,80\n"
    )
    table = trainings.seeds_table(stem)
    assert "| flat | 1 of 3 | 98 % | 94 % | 98 % | 94 % | 9.5 s | 70 s |" in table


def test_every_factor_changes_the_recipe_and_is_a_configuration() -> None:
    recipe = load_config(RECIPE)
    for variant, changes in trainings.VARIANTS.items():
        changed = load_config(RECIPE, changes)
        same = variant in {trainings.RECIPE, "trained on relaxed"}
        assert (changed == recipe) == same, variant


def test_an_off_policy_learner_plays_the_same_games() -> None:
    row = learners.row("SAC", "flat", 0, 640, load_config(RECIPE, ["evaluation_episodes=2"]))
    assert row["steps"] == 640
    assert 0.0 <= row["coins"] <= 1.0
