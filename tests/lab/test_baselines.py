"""What the page of the baselines says follows from the rows, and hides none of them."""

from __future__ import annotations

import json
import tarfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import bootstrap

from roller_env.assets import LEVELS
from roller_env.lab import baselines, baselines_page
from roller_env.lab.aggregates import interquartile_mean, stratified
from roller_env.lab.baselines import SEEDS
from roller_env.lab.table import Frame
from roller_env.lab.trainings import UNFINISHED

ROOT = Path(__file__).parents[2]


def trained(level: str, seed: int = SEEDS[0], **changes: Any) -> dict[str, Any]:
    """Return the row of a training that mastered its level, changed."""
    row = {"level": level, "seed": seed, "steps": 10**6, "finish": 1.0, "coins": 1.0}
    return row | {"time_s": 9.0, "train_cpu_s": 60.0, "ended": "mastered"} | changes


def in_files(directory: Path, rows: list[dict[str, Any]], curves: list[dict[str, Any]]) -> Frame:
    """Write rows and curves as a run does, and return what is made of them."""
    Frame(rows).to_csv(directory / "baselines.csv", index=False)
    Frame(curves).to_csv(directory / "baselines_curves.csv", index=False)
    Frame(rows[:1]).to_csv(directory / "seeds.csv", index=False)
    Frame(curves[:1]).to_csv(directory / "seeds_curves.csv", index=False)
    return baselines_page.trainings_of(directory)


def curve_of(*finish: float) -> list[dict[str, Any]]:
    points = [{"steps": 1000 * (n + 1), "finish": share} for n, share in enumerate(finish)]
    return [trained("flat") | point for point in points]


def test_the_interquartile_mean_leaves_out_a_quarter_at_each_end() -> None:
    assert interquartile_mean([0.0, 5.0, 7.0, 9.0, 100.0]) == pytest.approx(7.0)
    assert interquartile_mean([1.0, 2.0]) == pytest.approx(1.5)


def test_the_interval_is_the_one_that_scipy_draws() -> None:
    strata = np.random.default_rng(0).random((6, 8))
    ours = stratified(strata.tolist())
    scipys = bootstrap(
        tuple(strata),
        lambda *drawn, axis: interquartile_mean(np.concatenate(drawn, axis=axis)),
        method="percentile",
        n_resamples=4000,
        rng=np.random.default_rng(1),
    ).confidence_interval
    assert ours.low == pytest.approx(scipys.low, abs=0.01)
    assert ours.high == pytest.approx(scipys.high, abs=0.01)


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=6))
def test_strata_of_one_value_do_not_vary(values: list[float]) -> None:
    found = stratified([[value] for value in values])
    assert found.low == found.high == pytest.approx(found.mean)


@pytest.mark.parametrize(
    ("finish", "reached"),
    [
        ((0.0, 0.95, 0.3, 0.9, 1.0), 4000),
        ((0.9, 1.0), 1000),
        ((1.0, float("nan")), 1000),
        ((0.0, 1.0, 0.5), np.nan),
        ((0.0, 0.89), np.nan),
    ],
)
def test_a_share_is_reached_when_it_is_not_lost_again(
    tmp_path: Path, finish: tuple[float, ...], reached: float
) -> None:
    (row,) = in_files(tmp_path, [trained("flat", steps=8000)], curve_of(*finish)).itertuples()
    assert row.reached_steps == pytest.approx(reached, nan_ok=True)
    assert row.reached_s == pytest.approx(60.0 * reached / 8000, nan_ok=True)


def test_what_a_deadline_cut_off_is_told_and_counts_nowhere(tmp_path: Path) -> None:
    rows = [trained(level) for level in LEVELS]
    rows += [trained("flat", 51, ended=UNFINISHED, finish=0.0, coins=0.25)]
    made = in_files(tmp_path, rows, curve_of(1.0))
    first = next(line for line in baselines_page.levels_table(made).splitlines() if "flat" in line)
    assert "| 1 of 1 (+1 cut off) | 100 % | 100 % |" in first
    each = next(line for line in baselines_page.each_table(made).splitlines() if "flat" in line)
    assert each == "| flat | 100 % / 100 % | cut off: 0 % / 25 % | - | - | - |"
    assert "| 20 | 50 | 20 of 20 | 100 % |" in baselines_page.totals_table(made)


def test_totals_are_of_full_matrices_only(tmp_path: Path) -> None:
    rows = [trained(level) for level in LEVELS]
    rows += [trained("flat", seed, finish=0.5) for seed in SEEDS[1:]]
    rows += [trained("lava", 51, finish=0.0)]
    every_level, every_seed = baselines_page.totals_table(
        in_files(tmp_path, rows, curve_of(1.0))
    ).splitlines()[2:]
    assert every_level.startswith("| 20 | 50 | 20 of 20 | 100 % | 100 % |")
    assert every_seed.startswith("| 1 | 50 to 54 | 1 of 5 | 50 % [50 %, ")


def ship(directory: Path, rows: list[dict[str, Any]], kept: list[dict[str, Any]]) -> list[str]:
    """Ship from an archive of agents, and return what is shipped of each level."""
    archive, out = directory / "policies.tar", directory / "out"
    with tarfile.open(archive, "w") as tar:
        for row in kept:
            for part in ("policy.json", "policy.safetensors"):
                file = directory / part
                file.write_text(json.dumps({"training": {"seed": row["seed"]}}))
                tar.add(file, f"{row['level']}-{row['seed']}/{part}")
    list(baselines.ship(in_files(directory, rows, curve_of(1.0)), archive, out))
    return [(out / level / "policy.safetensors").read_text() for level in LEVELS]


def test_the_best_agent_of_each_level_is_shipped_and_stays_while_it_is_the_best(
    tmp_path: Path,
) -> None:
    rows = [trained(level, finish=0.5) for level in LEVELS]
    rows += [trained("flat", 52), trained("flat", 51), trained("ice", 51, ended=UNFINISHED)]
    first, last = '{"training": {"seed": 50}}', '{"training": {"seed": 54}}'
    found = dict(zip(LEVELS, ship(tmp_path, rows, rows), strict=True))
    assert found == dict.fromkeys(LEVELS, first) | {"flat": first.replace("50", "51")}
    more = [trained("flat", 54), trained("ice", 54), trained("lava", 54, finish=0.4)]
    later = dict(zip(LEVELS, ship(tmp_path, rows + more, more), strict=True))
    assert later == found | {"ice": last}


def test_the_page_has_the_tables_of_the_rows_that_are_there() -> None:
    told, charts, facts = baselines_page.page(ROOT / "docs" / "results")
    assert told in (ROOT / "docs" / "baselines.md").read_text(encoding="utf-8")
    assert set(charts) == {"baselines", "baselines_curves"}
    assert "Xeon" in facts["machine"]
