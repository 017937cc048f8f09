"""Generated levels by the dozen: how hard they are to win, how often one is rejected, how robust.

A level's row is kept as soon as it is there, so that thousands can be made in pieces.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas

from roller_env.lab.table import Frame, markdown
from roller_env.level.expand import expand
from roller_env.level.schema import PIECE_FIELDS, Level
from roller_env.solver import robustness, won_level

DIFFICULTIES: Final = (0.0, 0.25, 0.5, 0.75, 1.0)

GAMES: Final = 50
"""Starts from which a play is followed."""


@dataclass(frozen=True, slots=True)
class Row:
    """What became of a seed and difficulty.

    Attributes:
        version: of the generator.
        difficulty: 0 to 1.
        seed: of the level.
        attempts: levels that the solver tried; all but the last were rejected.
        steps: environment steps of its searches.
        time_s: of the play that won, seconds.
        coins: in the level.
        solids: pieces that stand still.
        kinds: of pieces.
        movers: gates, plates and platforms.
        route_m: length of the route, metres.
        turns: of it by more than 45 degrees, seen from above.
        span_m: longest edge of the level's bounding box seen from above, metres.
        rise_m: height between its lowest and its highest deck, metres.
        rigid: share of other starts from which the play is followed to the finish.
        default: the same on MuJoCo's default.
    """

    version: int
    difficulty: float
    seed: int
    attempts: int
    steps: int
    time_s: float
    coins: int
    solids: int
    kinds: int
    movers: int
    route_m: float
    turns: int
    span_m: float
    rise_m: float
    rigid: float
    default: float


def row(difficulty: float, seed: int, version: int) -> Row:
    """Return the row of one level."""
    won = won_level(seed, difficulty, version=version)
    level, whole = won.level, expand(won.level)
    span, rise = _extent(level)
    length, turns = _route(level)
    finished = {
        physics: robustness(won.replay, level, physics, GAMES).finished
        for physics in ("rigid", "default")
    }
    return Row(
        version=version,
        difficulty=difficulty,
        seed=seed,
        attempts=won.attempts,
        steps=won.steps,
        time_s=round(won.replay.result.time_s, 1),
        coins=len(whole.coins),
        solids=len(whole.ground),
        kinds=sum(bool(getattr(level, field)) for field in PIECE_FIELDS),
        movers=len(whole.movers),
        route_m=round(length, 1),
        turns=turns,
        span_m=round(span, 1),
        rise_m=round(rise, 2),
        **finished,
    )


def _route(level: Level) -> tuple[float, int]:
    """Return the length of a level's route, metres, and how often it turns."""
    legs = np.diff(level.route.points, axis=0) if level.route is not None else np.zeros((0, 3))
    flat = legs[:, :2] / np.linalg.norm(legs[:, :2], axis=1, keepdims=True)
    straight = (flat[1:] * flat[:-1]).sum(axis=1)
    return float(np.linalg.norm(legs, axis=1).sum()), int((straight < math.sqrt(0.5)).sum())


def _extent(level: Level) -> tuple[float, float]:
    at = np.array([box.at for box in level.boxes])
    size = np.array([box.size for box in level.boxes])
    edges = (at + size / 2).max(axis=0) - (at - size / 2).min(axis=0)
    return float(edges[:2].max()), float(np.ptp(at[:, 2]))


def run(
    file: Path,
    seeds: int,
    version: int,
    difficulties: Sequence[float] = DIFFICULTIES,
    watched: Callable[[list[Any]], Iterable[Any]] = iter,
) -> None:
    """Add the rows that a file has not, of the seeds below ``seeds``."""
    done: set[tuple[float, int]] = set()
    if file.exists():
        done = {(r.difficulty, r.seed) for r in pandas.read_csv(file).itertuples()}
    missing = [
        (difficulty, seed)
        for seed in range(seeds)
        for difficulty in difficulties
        if (difficulty, seed) not in done
    ]
    file.parent.mkdir(parents=True, exist_ok=True)
    is_new = not file.exists()
    with file.open("a", encoding="utf-8", newline="") as text:
        names = [field.name for field in fields(Row)]
        writer = csv.DictWriter(text, names, lineterminator="\n")
        if is_new:
            writer.writeheader()
        for difficulty, seed in watched(missing):
            writer.writerow(asdict(row(difficulty, seed, version)))
            text.flush()


def table(file: Path) -> str:
    """Return, as Markdown, the rows of a file by difficulty."""
    rows = pandas.read_csv(file)
    shown = []
    for difficulty, own in rows.groupby("difficulty"):
        robust = (own[["rigid", "default"]].min(axis=1) >= 0.9).mean()
        shown.append(
            {
                "difficulty": difficulty,
                "levels": len(own),
                "won at the first attempt": f"{(own.attempts == 1).mean():.0%}",
                "rejects a level": float(own.attempts.mean() - 1.0),
                "steps, median": f"{own.steps.median():,.0f}",
                "play, s": float(own.time_s.median()),
                "solids": float(own.solids.median()),
                "coins": float(own.coins.median()),
                "kinds": float(own.kinds.median()),
                "movers, mean": float(own.movers.mean()),
                "route, m": float(own.route_m.median()),
                "turns": float(own.turns.median()),
                "span, m": float(own.span_m.median()),
                "rise, m": float(own.rise_m.median()),
                "robust": f"{robust:.0%}",
            }
        )
    return markdown(Frame(shown))
