"""Names beside the marks of a chart, where there is room for them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.text import Annotation, Text
from matplotlib.transforms import Bbox

Float64 = npt.NDArray[np.float64]
Ring = Sequence[tuple[float, float]]
"""Where a name may stand: points of its nearest edge to the right of and above its mark."""


def _ring(radius: float, directions: int, first_deg: float = 0.0) -> list[tuple[float, float]]:
    angles = np.radians(first_deg) + 2.0 * np.pi * np.arange(directions) / directions
    return [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]


NEAR_RINGS: Final[Ring] = [*_ring(9.0, 4), *_ring(20.0, 12), *_ring(34.0, 16)]
"""First right beside the mark, then a little away with a line to it."""

FAR_RINGS: Final[Ring] = [one for radius in (45.0, 75.0, 105.0) for one in _ring(radius, 12, -90.0)]
"""For names in large frames: first below."""
_BESIDE: Final = 10.0
"""A name as near as this needs no line, points."""


_PIECES: Final = 40
"""In which each stretch of a line is taken for boxes."""


class Room:
    """The room that is left on a chart whose marks, lines, legend and limits are final."""

    def __init__(
        self,
        axes: Axes,
        marks: Sequence[tuple[tuple[float, float], float]],
        line: Sequence[tuple[float, float]],
    ):
        """Remember what must not be written over.

        Args:
            axes: of the chart.
            marks: place in data and radius in points of each mark.
            line: corners, in data, of a line.
        """
        self._axes = axes
        pixels = self._pixels_per_point = axes.figure.dpi / 72.0
        self._taken = [
            Bbox.from_extents(x - r, y - r, x + r, y + r)
            for (x, y), r in ((axes.transData.transform(at), pixels * r) for at, r in marks)
        ]
        for begin, end in pairwise(axes.transData.transform(corner) for corner in line):
            self._keep_clear(begin, end)
        self._taken += [text.get_window_extent() for text in axes.texts]

    def _keep_clear(self, begin: Float64, end: Float64) -> None:
        along = np.linspace(begin, end, _PIECES)
        self._taken += [Bbox.from_extents(*a, *b) for a, b in pairwise(along)]

    def write(self, text: str, at: tuple[float, float], ring: Ring, **style: Any) -> bool:
        """Write a name at the first place of the ring where it hides nothing; say whether."""
        line = style.pop("arrowprops")
        mark = np.array(self._axes.transData.transform(at))
        for offset in ring:
            x, y = offset
            far = math.hypot(x, y) > _BESIDE
            name = self._axes.annotate(
                text,
                at,
                xytext=offset,
                textcoords="offset points",
                ha="left" if x > 1.0 else "right" if x < -1.0 else "center",
                va="bottom" if y > 1.0 else "top" if y < -1.0 else "center",
                arrowprops=line if far else None,
                zorder=6,
                **style,
            )
            if self._take(name, 9.0 if "bbox" in style else 1.0):
                if far:
                    self._keep_clear(mark, mark + self._pixels_per_point * np.array(offset))
                return True
            name.remove()
        return False

    def _take(self, name: Annotation, margin: float) -> bool:
        name.get_window_extent()  # Puts the text where it belongs; the result has the line in it.
        box, inside = Text.get_window_extent(name).padded(margin), self._axes.bbox
        within = inside.x0 < box.x0 and box.x1 < inside.x1
        if not within or box.y0 < inside.y0 or box.y1 > inside.y1:
            return False
        if box.count_overlaps(self._taken):
            return False
        self._taken.append(box)
        return True
