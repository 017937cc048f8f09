"""Maps of a level with the ball's paths on it. Matplotlib only: this needs no OpenGL."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from roller_env.arrays import Float64
from roller_env.level.expand import expand
from roller_env.level.schema import Level
from roller_env.pieces.look import METAL
from roller_env.pieces.piece import UNTURNED, UPWARDS, Solid

Colour = tuple[float, float, float, float]

STOREY_GAP_M: Final = 4.0
"""Floors with more than this of empty height between them are drawn on maps of their own."""

OUTCOME_STYLES: Final = {
    "finish": ("#0a8f4d", "o"),
    "fall": ("#d62828", "X"),
    "time limit": ("#e07b00", "s"),
}
"""Colour and end mark of a path, by outcome."""

_OTHER_STYLE: Final = ("#444444", "D")

_PALE: Final = 0.4
"""Share of white in the level's colours, so that the paths stand out from them."""

_PALE_ALPHA: Final = 0.25
"""Opacity of where something will be."""

_WIDTH_IN: Final = 12.0
_MARGIN_M: Final = 1.5
_PLAN: Final = (0, 1, 2)
_SIDE: Final = (0, 2, 1)
"""Axis to the right, axis up, axis towards the eye (whose sign `_draw_boxes` knows)."""


@dataclass(frozen=True)
class _Storey:
    """What lies between two heights, metres, and the part of the plan it takes."""

    low: float
    high: float
    boxes: tuple[tuple[Solid, Colour], ...]

    @property
    def limits(self) -> tuple[Float64, Float64]:
        """Lowest and highest (x, y) of its boxes."""
        corners = np.concatenate([box.corners() for box, _ in self.boxes])[:, :2]
        return corners.min(axis=0) - _MARGIN_M, corners.max(axis=0) + _MARGIN_M


def draw_paths(
    level: Level,
    paths: Sequence[Float64],
    outcomes: Sequence[str],
    file: Path,
    title: str = "",
) -> None:
    """Draw a map of the level with the ball's paths, coloured by how they ended, to a file.

    A level whose floors lie over one another has a map for each storey and a view from the side.

    Args:
        level: the level.
        paths: ball centres, each (T, 3) metres, world frame.
        outcomes: how each path ended: a key of `OUTCOME_STYLES`, or anything else.
        file: the picture's path; its suffix says what kind it is.
        title: written over it; the level's title if empty.

    Raises:
        ValueError: there is not one outcome for each path.
    """
    if len(paths) != len(outcomes):
        raise ValueError(f"outcomes: found {len(outcomes)} for {len(paths)} paths")
    storeys = _storeys(level)
    figure = Figure(layout="constrained", dpi=120)
    figure.suptitle(title or level.title or level.name, fontweight="bold")
    plans, side = _lay_out(figure, storeys, paths)
    edges = [-np.inf, *((a.high + b.low) / 2 for a, b in itertools.pairwise(storeys)), np.inf]
    for storey, axes, (low, high) in zip(storeys, plans, itertools.pairwise(edges), strict=True):
        _draw_boxes(axes, storey.boxes, _PLAN)
        _draw_pieces(axes, level, _PLAN, low, high)
        _draw_lines(axes, paths, outcomes, _PLAN, low, high)
        name = f"{storey.low:.0f} m to {storey.high:.0f} m high" if side else "from above"
        _finish_axes(axes, name, "y (m)", *storey.limits)
    if side is not None:
        boxes = [box for storey in storeys for box in storey.boxes]
        boxes += _coloured(level, expand(level).pipes)
        _draw_boxes(side, boxes, _SIDE)
        _draw_pieces(side, level, _SIDE, -np.inf, np.inf)
        _draw_lines(side, paths, outcomes, _SIDE, -np.inf, np.inf)
        _finish_axes(side, "from the side", "z (m)", *_side_limits(storeys, paths))
    if paths:
        figure.legend(handles=_legend(outcomes), loc="outside lower center", ncols=4, frameon=False)
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file)


def _storeys(level: Level) -> list[_Storey]:
    """Cut the level where nothing but tubes is for a good height."""
    boxes = _coloured(level, expand(level).decks) + _machine_boxes(level)
    spans = sorted(
        ((*_span(box[0]), index) for index, box in enumerate(boxes)), key=lambda span: span[0]
    )
    groups: list[tuple[float, float, list[int]]] = []
    for low, high, index in spans:
        if groups and low - groups[-1][1] < STOREY_GAP_M:
            begin, end, members = groups[-1]
            groups[-1] = (begin, max(end, high), [*members, index])
        else:
            groups.append((low, high, [index]))
    return [
        _Storey(low, high, tuple(boxes[index] for index in members))
        for low, high, members in groups
    ]


def _coloured(level: Level, pieces: Iterable[Solid]) -> list[tuple[Solid, Colour]]:
    return [(piece, _rgba(level.material(piece.material).colour)) for piece in pieces]


def _machine_boxes(level: Level) -> list[tuple[Solid, Colour]]:
    """Return what moves or does something as boxes, in the colours in which it waits.

    Whose other end is elsewhere in the plan is there too, paler.
    """
    colours: dict[str, str] = {}
    fields: list[Solid] = []
    for source, piece in level.pieces():
        for shape in piece.looks(0):
            for paint in shape.paints:
                colours.setdefault(source, paint.colour)
            # A field without substance that fills the place of its piece.
            if shape.form == "box" and shape.at == getattr(piece, "at", None):
                fields.append(Solid(shape.at, shape.size, UNTURNED, "", source))
    everything = expand(level)
    machines = (*(mover.solid for mover in everything.movers), *everything.machines, *fields)
    ends = [mover.end for mover in everything.movers if mover.along != UPWARDS]
    return [
        *((end, (*_rgba(METAL.colour)[:3], _PALE_ALPHA)) for end in ends),
        *((solid, _rgba(colours.get(solid.source, METAL.colour))) for solid in machines),
    ]


def _side_limits(storeys: Sequence[_Storey], paths: Sequence[Float64]) -> tuple[Float64, Float64]:
    """Return the lowest and highest (x, z) of all storeys, and of what flies above them."""
    limits = np.array([storey.limits for storey in storeys])
    tops = [storeys[-1].high, *(float(path[:, 2].max()) for path in paths if len(path))]
    low = np.array([limits[:, 0, 0].min(), storeys[0].low - _MARGIN_M])
    return low, np.array([limits[:, 1, 0].max(), max(tops) + _MARGIN_M])


def _lay_out(
    figure: Figure, storeys: Sequence[_Storey], paths: Sequence[Float64]
) -> tuple[list[Axes], Axes | None]:
    """Make the axes: the storeys' plans side by side at one scale, the side view below them."""
    extents = np.array([np.subtract(*reversed(storey.limits)) for storey in storeys])
    widths, height = extents[:, 0], extents[:, 1].max()
    plan_in = _WIDTH_IN * height / widths.sum()
    if len(storeys) == 1:
        figure.set_size_inches(_WIDTH_IN, float(np.clip(plan_in + 1.6, 3.5, 14.0)))
        return [figure.add_subplot()], None
    low, high = _side_limits(storeys, paths)
    side_in = _WIDTH_IN * (high[1] - low[1]) / (high[0] - low[0])
    figure.set_size_inches(_WIDTH_IN, float(np.clip(plan_in + side_in + 1.2, 6.0, 18.0)))
    grid = figure.add_gridspec(
        2, len(storeys), width_ratios=widths, height_ratios=[plan_in, side_in]
    )
    plans = [figure.add_subplot(grid[0, column]) for column in range(len(storeys))]
    return plans, figure.add_subplot(grid[1, :])


def _draw_boxes(
    axes: Axes, boxes: Sequence[tuple[Solid, Colour]], view: tuple[int, int, int]
) -> None:
    """Draw the faces of boxes that look at the eye, the nearest last."""
    right, up, eye = view
    # Seen from above the eye is at large z; seen from the side, with x to the right, at small y.
    sign = 1.0 if eye == 2 else -1.0
    faces: list[tuple[float, Float64, Colour]] = []
    for box, colour in boxes:
        for normal, corners in box.faces():
            facing = sign * float(normal[eye])
            if facing > 1e-6:
                shade = 0.55 + 0.45 * facing
                red, green, blue = (shade * (_PALE + (1.0 - _PALE) * part) for part in colour[:3])
                lit = (red, green, blue, colour[3])
                faces.append((float(sign * corners[:, eye].max()), corners[:, [right, up]], lit))
    faces.sort(key=lambda face: face[0])
    axes.add_collection(
        PolyCollection(
            [face for _, face, _ in faces],
            facecolors=[colour for _, _, colour in faces],
            edgecolors=(0.1, 0.1, 0.15, 0.25),
            linewidths=0.3,
            zorder=1,
        )
    )


def _draw_pieces(
    axes: Axes, level: Level, view: tuple[int, int, int], low: float, high: float
) -> None:
    """Draw coins, finish, start and names of what lies from ``low`` to ``high``."""
    right, up, _ = view
    coins = expand(level).coins
    coins = coins[(coins[:, 2] > low) & (coins[:, 2] <= high)]
    axes.scatter(
        coins[:, right], coins[:, up], s=26, c="#ffd43b", edgecolors="#8a6500", lw=0.8, zorder=4
    )
    finish = level.finish
    if low < finish.at[2] <= high:
        corner = [finish.at[axis] - finish.size[axis] / 2 for axis in (right, up)]
        size = [finish.size[axis] for axis in (right, up)]
        box = [corner, [corner[0] + size[0], corner[1]], np.add(corner, size)]
        box.append([corner[0], corner[1] + size[1]])
        outline = PolyCollection([np.array(box)], facecolors="none", edgecolors="#111111", zorder=3)
        outline.set_hatch("////")
        axes.add_collection(outline)
    labels = [piece.label() for _, piece in level.pieces()]
    for name, at in [("start", level.start.at), *filter(None, labels)]:
        if low < at[2] <= high:
            axes.annotate(
                name,
                (at[right], at[up]),
                xytext=(0, -13),
                textcoords="offset points",
                ha="center",
                va="top",
                fontsize=8,
                zorder=6,
                bbox={"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.8},
            )
    if low < level.start.at[2] <= high:
        at = level.start.at
        axes.plot(at[right], at[up], marker="*", ms=12, mfc="white", mec="#111111", zorder=6)


def _draw_lines(
    axes: Axes,
    paths: Sequence[Float64],
    outcomes: Sequence[str],
    view: tuple[int, int, int],
    low: float,
    high: float,
) -> None:
    """Draw the parts of the paths from ``low`` to ``high``, and where they end."""
    right, up, _ = view
    lines, colours = [], []
    for path, outcome in zip(paths, outcomes, strict=True):
        colour, mark = OUTCOME_STYLES.get(outcome, _OTHER_STYLE)
        inside = (path[:, 2] > low) & (path[:, 2] <= high)
        cuts = np.flatnonzero(np.diff(inside)) + 1
        for piece, within in zip(np.split(path, cuts), np.split(inside, cuts), strict=True):
            if len(piece) > 1 and within[0]:
                lines.append(piece[:, [right, up]])
                colours.append(colour)
        if len(path) and inside[-1]:
            end = path[-1]
            axes.plot(end[right], end[up], mark, ms=6, mfc=colour, mec="white", mew=0.6, zorder=7)
    # Many paths over one another must not hide the level; one alone must be plain to see.
    alpha = float(np.clip(6.0 / max(len(paths), 1), 0.15, 0.95))
    axes.add_collection(
        LineCollection(lines, colors=colours, linewidths=1.3, alpha=alpha, zorder=5)
    )


def _finish_axes(axes: Axes, name: str, up: str, low: Float64, high: Float64) -> None:
    axes.set_title(name, fontsize=10)
    axes.set_xlabel("x (m)")
    axes.set_ylabel(up)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set_facecolor("#dfe8f1")
    axes.grid(color="white", linewidth=0.6, zorder=0)
    axes.set_axisbelow(True)


def _legend(outcomes: Sequence[str]) -> list[Line2D]:
    known = [*OUTCOME_STYLES, *sorted(set(outcomes) - set(OUTCOME_STYLES))]
    handles = []
    for outcome in known:
        colour, mark = OUTCOME_STYLES.get(outcome, _OTHER_STYLE)
        label = f"{outcome} ({outcomes.count(outcome)})"
        if outcome in outcomes:
            handles.append(Line2D([], [], color=colour, marker=mark, mec="white", label=label))
    return handles


def _span(box: Solid) -> tuple[float, float]:
    heights = box.corners()[:, 2]
    return float(heights.min()), float(heights.max())


def _rgba(colour: str) -> Colour:
    numbers = [int(colour[i : i + 2], 16) / 255.0 for i in range(1, len(colour), 2)]
    return numbers[0], numbers[1], numbers[2], numbers[3] if len(numbers) == 4 else 1.0
