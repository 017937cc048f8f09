"""Draw how the package's parts build on each other: `python scripts/draw_architecture.py`.

Everything in the picture is read from the code: the sentences are the parts' docstrings' first, the
labels are the libraries that a part imports itself, and an arrow leads from a part to another that
it imports, unless that follows by way of a third. Lower is what imports less. The picture holds a
digest of all that, by which a test tells whether it is out of date.
"""

from __future__ import annotations

import ast
import hashlib
import json
import re
import textwrap
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Final

import grimp
import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt
import tyro
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch
from matplotlib.path import Path as Curve

ROOT: Final = Path(__file__).resolve().parents[1]
PICTURE: Final = ROOT / "docs" / "images" / "architecture.png"
PACKAGE: Final = "roller_env"

LIBRARIES: Final = {
    "mujoco": "#c2410c",
    "numba": "#0369a1",
    "gymnasium": "#15803d",
    "pydantic": "#7e22ce",
    "torch": "#b91c1c",
}
"""The libraries whose place in the house matters, with the colours of their labels."""

BOX: Final = (4.1, 1.3)
"""Width and height of a part's box."""

GAP: Final = (0.35, 0.6)
"""Space between boxes beside and over each other."""

LANE: Final = 0.5
"""Width of the lane in which an arrow passes a row."""

Node = str | tuple[str, str, int]
"""What stands in a row: a part, or the arrow from one part to another, on its way past the row."""


@dataclass(frozen=True)
class Part:
    """A package or module directly below the root.

    Attributes:
        name: without the root's name.
        does: the first sentence of its docstring.
        libraries: those of `LIBRARIES` that it imports itself.
        imports: the parts that it imports, without those that it has by way of another.
    """

    name: str
    does: str
    libraries: tuple[str, ...]
    imports: tuple[str, ...]


@dataclass(frozen=True)
class House:
    """All the parts: what is drawn."""

    parts: tuple[Part, ...]

    @property
    def digest(self) -> str:
        """A summary of all that is drawn."""
        return hashlib.sha256(json.dumps(asdict(self)).encode()).hexdigest()

    @cached_property
    def rows(self) -> list[list[Node]]:
        """What stands over each other, the lowest first: a part is over all that it imports."""
        imports = {part.name: part.imports for part in self.parts}
        height: dict[str, int] = {}
        while len(height) < len(imports):
            ready = [name for name in imports if name not in height]
            ready = [name for name in ready if all(other in height for other in imports[name])]
            for name in ready:
                height[name] = 1 + max((height[other] for other in imports[name]), default=-1)
        rows: list[list[Node]] = [[] for _ in range(max(height.values()) + 1)]
        for name, others in imports.items():
            rows[height[name]].append(name)
            for other in others:
                for passed in range(height[other] + 1, height[name]):
                    rows[passed].append((name, other, passed))
        return rows

    def way(self, name: str, other: str) -> list[Node]:
        """Return what the arrow from a part to another leads through, both included."""
        passing = [node for row in self.rows for node in row if node[:2] == (name, other)]
        return [name, *reversed(passing), other]


def read_house() -> House:
    """Return the package as its modules import each other now."""
    graph = grimp.build_graph(PACKAGE, include_external_packages=True, cache_dir=None)
    names = {name.removeprefix(f"{PACKAGE}.") for name in graph.find_children(PACKAGE)}
    names -= {"__main__"}
    uses: dict[str, set[str]] = {name: set() for name in sorted(names)}
    for module in graph.modules:
        part = _part_of(module)
        if part in uses:
            found = graph.find_modules_directly_imported_by(module)
            uses[part] |= {_part_of(other) or other for other in found} - {part}
    inner = {name: used & names for name, used in uses.items()}
    return House(
        tuple(
            Part(
                name=name,
                does=_first_sentence(name),
                libraries=tuple(library for library in LIBRARIES if library in used),
                imports=tuple(sorted(inner[name] - _by_way(inner, name))),
            )
            for name, used in uses.items()
        )
    )


def _by_way(imports: Mapping[str, set[str]], name: str) -> set[str]:
    """Return what a part imports by way of what it imports."""
    found: set[str] = set()
    for other in imports[name]:
        found |= imports[other] | _by_way(imports, other)
    return found


def _part_of(module: str) -> str | None:
    """Return the part of the package that a module is in; None outside of it and for its root."""
    names = module.split(".")
    return names[1] if names[0] == PACKAGE and len(names) > 1 else None


def _first_sentence(part: str) -> str:
    package = ROOT / PACKAGE / part
    source = package / "__init__.py" if package.is_dir() else package.with_suffix(".py")
    said = ast.get_docstring(ast.parse(source.read_text(encoding="utf-8"))) or ""
    paragraph = " ".join(said.split("\n\n")[0].split()).replace("`", "")
    return re.split(r"(?<=\.) ", paragraph)[0].rstrip(".")


def arrange(house: House) -> dict[Node, tuple[float, float]]:
    """Return the middle of everything in the rows, with few arrows that cross."""
    links: dict[Node, list[Node]] = {node: [] for row in house.rows for node in row}
    for part in house.parts:
        for other in part.imports:
            way = house.way(part.name, other)
            for upper, lower in pairwise(way):
                links[upper].append(lower)
                links[lower].append(upper)
    x = dict.fromkeys(links, 0.0)
    # Everything goes to the middle of what it is linked with, row by row, up and down.
    for sweep in range(24):
        for row in house.rows if sweep % 2 else reversed(house.rows):
            wanted = {n: sum(x[o] for o in links[n]) / max(len(links[n]), 1) for n in row}
            row.sort(key=lambda node: wanted[node])
            x.update(_spread(row, wanted))
    rise = BOX[1] + GAP[1]
    return {node: (x[node], number * rise) for number, row in enumerate(house.rows) for node in row}


def _spread(row: list[Node], wanted: Mapping[Node, float]) -> dict[Node, float]:
    """Return places beside each other for a row, about where its nodes want to be on average."""
    places, right = [], 0.0
    for node in row:
        width = (BOX[0] if isinstance(node, str) else LANE) + GAP[0]
        places.append(right + width / 2)
        right += width
    shift = sum(wanted[node] - place for node, place in zip(row, places, strict=True)) / len(row)
    return {node: place + shift for node, place in zip(row, places, strict=True)}


def draw(house: House, out: Path) -> None:
    """Draw the parts and arrows into a PNG file, which keeps the house's digest."""
    places = arrange(house)
    boxes = [place for node, place in places.items() if isinstance(node, str)]
    left = min(x for x, _ in boxes) - BOX[0] / 2 - GAP[0]
    right = max(x for x, _ in boxes) + BOX[0] / 2 + GAP[0]
    top = max(y for _, y in boxes) + BOX[1] / 2 + GAP[1] / 2
    bottom = -BOX[1] / 2 - GAP[1] / 2
    figure = plt.figure(figsize=((right - left) * 0.6, (top - bottom) * 0.6))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    axes.axis("off")
    for part in house.parts:
        for other in part.imports:
            _draw_arrow(axes, [places[node] for node in house.way(part.name, other)])
        _draw_part(axes, part, *places[part.name])
    figure.savefig(out, dpi=110, facecolor="white", metadata={"House": house.digest})
    plt.close(figure)


def _draw_arrow(axes: Axes, way: list[tuple[float, float]]) -> None:
    """Draw an arrow that leaves a box below and enters the last one above, upright at every row."""
    half = BOX[1] / 2
    (x, y), *rest = way
    points, y = [(x, y - half)], y - half
    codes = [Curve.MOVETO]
    for number, (next_x, middle) in enumerate(rest, start=1):
        last = number == len(rest)
        bend = (y + middle + half) / 2
        points += [(x, bend), (next_x, bend), (next_x, middle + half)]
        codes += [Curve.CURVE4] * 3
        if not last:
            points.append((next_x, middle - half))
            codes.append(Curve.LINETO)
        x, y = next_x, middle - half
    axes.add_patch(
        FancyArrowPatch(
            path=Curve(points, codes),
            arrowstyle="-|>",
            mutation_scale=11,
            color="#64748b",
            linewidth=1.1,
            zorder=1,
        )
    )


def _draw_part(axes: Axes, part: Part, x: float, y: float) -> None:
    width, height = BOX
    corner = (x - width / 2, y - height / 2)
    axes.add_patch(
        FancyBboxPatch(
            corner,
            width,
            height,
            boxstyle="round,pad=0,rounding_size=0.1",
            facecolor="#f1f5f9",
            edgecolor="#334155",
            zorder=2,
        )
    )
    left, top = corner[0] + 0.12, y + height / 2 - 0.26
    axes.text(left, top, part.name, weight="bold", size=10, va="center", zorder=3)
    end = x + width / 2 - 0.12
    for library in reversed(part.libraries):
        colour = LIBRARIES[library]
        axes.text(end, top, library, size=7, color=colour, ha="right", va="center", zorder=3)
        end -= 0.11 * len(library) + 0.1
    said = textwrap.fill(textwrap.shorten(part.does, 110, placeholder=" ..."), 40)
    axes.text(left, top - 0.2, said, size=7.2, color="#334155", va="top", zorder=3)


def main(out: Path = PICTURE) -> None:
    """Draw the package's parts.

    Args:
        out: the picture, a PNG file.
    """
    draw(read_house(), out)
    print(out)


if __name__ == "__main__":
    tyro.cli(main)
