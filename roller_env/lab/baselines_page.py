"""The tables and charts of docs/baselines.md, made from the rows and curves of trainings."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from roller_env.assets import LEVELS
from roller_env.lab import chart
from roller_env.lab.aggregates import stratified
from roller_env.lab.baselines import SEEDS
from roller_env.lab.table import Frame, markdown
from roller_env.lab.trainings import GOOD, UNFINISHED
from roller_env.replay import load_replay, shipped_replays

REACHED: Final = 0.9
"""Share of the games at the finish of which it is told when it was reached."""

FEW: Final = 3
"""With fewer trainings than that, nothing is said of their spread."""

_KEY: Final = ["level", "seed"]
_COLOURS: Final = {"coins": chart.SERIES[2], "finish": chart.SERIES[0]}  # drawn in this order
_SAID: Final = {"finish": "games at the finish", "coins": "coins"}


def rows_of(results: Path, suffix: str = "") -> Frame:
    """Return the rows of the baselines, and those that older ones of ``seeds.csv`` add to them.

    Args:
        results: directory of both.
        suffix: of the files' names: none, or ``_curves``.
    """
    own = pandas.read_csv(results / f"baselines{suffix}.csv")
    old = pandas.read_csv(results / f"seeds{suffix}.csv")
    taken = set(own[_KEY].itertuples(index=False, name=None))
    is_new = [key not in taken for key in old[_KEY].itertuples(index=False, name=None)]
    both = pandas.concat([own, old[is_new]], ignore_index=True)
    return both[both.seed.isin(SEEDS)].reset_index(drop=True)


def trainings_of(results: Path) -> Frame:
    """Return a row a training, with when it had reached `REACHED`.

    Columns besides the file's: ``is_cut``: a deadline ended it; ``is_learnt``; ``reached_steps``,
    steps at the point of its curve from which on it has `REACHED`, NaN if its last has not;
    ``reached_s``, their part of its CPU seconds.
    """
    rows, curves = rows_of(results), rows_of(results, "_curves")
    reached = {key: _reached_at(curve) for key, curve in curves.groupby(_KEY)}
    keys = rows[_KEY].itertuples(index=False, name=None)
    rows["reached_steps"] = [reached.get(key, np.nan) for key in keys]
    rows["reached_s"] = rows.train_cpu_s * rows.reached_steps / rows.steps
    rows["is_cut"] = rows.ended == UNFINISHED
    rows["is_learnt"] = (rows.finish >= GOOD) & (rows.coins >= GOOD) & ~rows.is_cut
    return rows


def _reached_at(curve: Frame) -> float:
    """Return the steps at which a curve reaches `REACHED` for good: some forget it once more."""
    curve = curve[curve.finish.notna()]
    has = np.asarray(curve.finish >= REACHED)
    if not has.any() or not has[-1]:
        return float("nan")
    first = len(has) - int(np.argmin(has[::-1])) if not has.all() else 0
    return float(curve.steps.iloc[first])


def levels_table(rows: Frame) -> str:
    """Return, as Markdown, what became of the trainings: a row a level."""
    return markdown(Frame([_level_row(level, rows[rows.level == level]) for level in LEVELS]))


def _level_row(level: str, rows: Frame) -> dict[str, str]:
    ended, cut = rows[~rows.is_cut], int(rows.is_cut.sum())
    played = load_replay(shipped_replays()[level]).result
    return {
        "level": level,
        "learnt": f"{ended.is_learnt.sum()} of {len(ended)}"
        + (f" (+{cut} cut off)" if cut else ""),
        "at the finish": _share(ended.finish),
        "coins": _share(ended.coins),
        "time of a game": f"{ended.time_s.median():.1f} s",
        "scripted player": f"{played.score_percent:.0f} %, {played.time_s:.1f} s",
        "steps to 90 %": _reached(ended.reached_steps / 1e6, "{:.2f} M"),
        "CPU to 90 %": _reached(ended.reached_s, "{:.0f} s"),
    }


def _share(values: Frame) -> str:
    found = stratified([values.tolist()])
    interval = f" [{_percent(found.low)}, {_percent(found.high)}]" if len(values) >= FEW else ""
    return _percent(found.mean) + interval


def _reached(values: Frame, form: str) -> str:
    known = values.dropna()
    if known.empty:
        return "never"
    return form.format(known.median()) + ("" if len(known) == len(values) else f" ({len(known)})")


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def totals_table(rows: Frame) -> str:
    """Return, as Markdown, what levels come to that have equally many trainings.

    That is, all levels with the seeds that every one of them has, and the levels that have all
    seeds: what a deadline left out depends on how long a level takes, and must not weigh less.
    """
    ended = rows[~rows.is_cut]
    by_seed, by_level = ended.groupby("seed").size(), ended.groupby("level").size()
    every_level = ended[ended.seed.isin(by_seed[by_seed == len(LEVELS)].index)]
    every_seed = ended[ended.level.isin(by_level[by_level == len(SEEDS)].index)]
    return markdown(Frame([_total(own) for own in (every_level, every_seed) if len(own)]))


def _total(rows: Frame) -> dict[str, str]:
    seeds = rows.seed.nunique()
    told = {
        "levels": str(rows.level.nunique()),
        "seeds": f"{rows.seed.min()}" + (f" to {rows.seed.max()}" if seeds > 1 else ""),
        "learnt": f"{rows.is_learnt.sum()} of {len(rows)}",
    }
    for column, said in _SAID.items():
        found = stratified([own[column].tolist() for _, own in rows.groupby("level")])
        interval = f" [{_percent(found.low)}, {_percent(found.high)}]" if seeds > 1 else ""
        told[f"{said}, interquartile mean"] = _percent(found.mean) + interval
        told[f"{said}, mean"] = _percent(rows[column].mean())
    return told


def each_table(rows: Frame) -> str:
    """Return, as Markdown, the share at the finish and of the coins of every training."""

    def told(row: Any) -> str:
        said = f"{_percent(row.finish)} / {_percent(row.coins)}"
        return f"cut off: {said}" if row.is_cut else said

    kept = [
        {"level": level}
        | {str(row.seed): told(row) for row in rows[rows.level == level].itertuples(index=False)}
        for level in LEVELS
    ]
    columns = ["level", *(str(seed) for seed in SEEDS)]
    return markdown(Frame(kept).reindex(columns=columns).astype(object).fillna("-"))


@chart.styled
def draw_curves(results: Path, rows: Frame) -> Figure:
    """Draw how coins and finishes grow with the steps: a panel a level, a line a training."""
    curves = rows_of(results, "_curves")
    figure, panels = chart.grid(
        (4, 5),
        "The recipe on every level",
        "Share of the coins and of the games at the finish while it learns: whole games from the "
        "start, sampled actions. A line is a training. It ends in a disc where the level was "
        f"mastered, in a cross after all its steps, in a ring where a deadline cut it off. Dashed: "
        f"{GOOD:.0%}.",
        panel=(2.35, 1.75),
        margins=(0.65, 0.3, 1.15, 0.95),
        sharex=True,
        sharey=True,
    )
    for axes, level in zip(panels.ravel(), LEVELS, strict=True):
        own = curves[curves.level == level]
        for seed, curve in own.groupby("seed"):
            (row,) = rows[(rows.level == level) & (rows.seed == seed)].itertuples(index=False)
            for column, colour in _COLOURS.items():
                _draw_training(axes, curve, column, colour, row)
        axes.axhline(GOOD, color="#555555", lw=0.8, ls="--")
        axes.set_title(level, fontsize=10, loc="left")
        learnt = rows[(rows.level == level) & ~rows.is_cut].is_learnt
        said = f"{learnt.sum()} of {len(learnt)}"
        colour = chart.GOOD if learnt.all() else chart.FAILURE
        axes.set_title(said, fontsize=8, loc="right", color=colour)
    panels[0, 0].set(ylim=(-0.05, 1.07), xlim=(0, 4.15))
    panels[0, 0].set_yticks([0, 0.5, 1.0], ["0", "50 %", "100 %"])
    for axes in panels[-1]:
        axes.set_xlabel("million steps")
    lines = [Line2D([], [], color=_COLOURS[column], lw=2) for column in _COLOURS]
    where: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (0.995, 0.02)}
    figure.legend(lines, [_SAID[column] for column in _COLOURS], ncols=2, fontsize=9, **where)
    return figure


def _draw_training(axes: Any, curve: Frame, column: str, colour: str, row: Any) -> None:
    known = curve[curve[column].notna()]
    steps = known.steps / 1e6
    axes.plot(steps, known[column], color=colour, lw=1.2, alpha=0.75)
    mark, face = ("o", colour)
    if row.is_cut:
        face = "white"
    elif row.ended == "all steps":
        mark = "x"
    end = {"marker": mark, "mfc": face, "color": colour, "ms": 5, "zorder": 4}
    axes.plot(steps.iloc[-1:], known[column].iloc[-1:], **end)


@chart.styled
def draw_levels(rows: Frame) -> Figure:
    """Draw, a line a level, what each training came to, and when it had reached 90 %."""
    figure, ((shares, steps),) = chart.grid(
        (1, 2),
        "What a training comes to, and what it takes",
        "Left: shares of the coins and of the games at the finish, 100 games with the likeliest "
        f"actions on MuJoCo's default. Right: steps until {REACHED:.0%} of the training's games "
        "ended at the finish for good; a cross: never, in that many steps. Rings and grey crosses: "
        "cut off by a deadline.",
        panel=(3.9, 5.6),
        margins=(0.95, 0.35, 1.15, 0.95),
        sharey=True,
    )
    for number, level in enumerate(LEVELS):
        own = rows[rows.level == level]
        for row in own.itertuples(index=False):
            for column, beside in (("finish", -0.17), ("coins", 0.17)):
                colour, at = _COLOURS[column], number + beside
                # A ring is seen round a disc that lies in the same place.
                look = {"ms": 7, "mfc": "none"} if row.is_cut else {"ms": 4.5, "alpha": 0.7}
                shares.plot(getattr(row, column), at, "o", color=colour, **look)
            has, cut = not np.isnan(row.reached_steps), row.is_cut
            x = (row.reached_steps if has else row.steps) / 1e6
            colour = chart.PREDICTION if has else "#999999" if cut else chart.FAILURE
            face = "white" if cut else colour
            steps.plot(x, number, "o" if has else "x", ms=5, color=colour, mfc=face, alpha=0.8)
    shares.set_yticks(range(len(LEVELS)), LEVELS)
    shares.set(ylim=(len(LEVELS) - 0.5, -0.5), xlim=(-0.03, 1.03))
    shares.set_xticks([0, 0.25, 0.5, 0.75, 1.0], ["0", "25 %", "50 %", "75 %", "100 %"])
    steps.set(xlim=(0, 4.15), xlabel="million steps")
    lines = [Line2D([], [], color=colour, marker="o", ls="") for colour in _COLOURS.values()]
    where: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.08, 0.02)}
    figure.legend(lines, [_SAID[column] for column in _COLOURS], ncols=2, fontsize=9, **where)
    return figure


def facts_of(rows: Frame) -> dict[str, str]:
    """Return where the trainings were made, as charts tell it at their foot."""
    told = rows.dropna(subset=["machine"])
    names = ("date", "machine", "python", "roller", "mujoco", "torch", "numpy")
    facts = {name: ", ".join(sorted(set(map(str, told[name])))) for name in names}
    others = f"{len(rows) - len(told)} of {len(rows)} trainings are of seeds.csv"
    return facts | ({"but": others} if len(told) < len(rows) else {})


def page(results: Path) -> tuple[str, dict[str, Figure], dict[str, str]]:
    """Return the page's part that is measured, its charts by name, and where it was measured."""
    rows = trainings_of(results)
    told = "\n".join([totals_table(rows), levels_table(rows), each_table(rows)])
    charts = {"baselines": draw_levels(rows), "baselines_curves": draw_curves(results, rows)}
    return told, charts, facts_of(rows)
