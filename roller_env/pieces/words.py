"""Words that messages about a level share: lengths in the designer's unit, places, coins."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Float64
from roller_env.pieces.fields import METRES_PER_UNIT
from roller_env.pieces.piece import path_of
from roller_env.problems import FieldPath

Unit = Literal["metre", "quant"]


class InUnit:
    """Writes lengths in the unit of the level's file."""

    def __init__(self, unit: Unit) -> None:
        self._unit, self._scale = unit, METRES_PER_UNIT[unit]

    def length(self, metres: float) -> str:
        """Return a length with its unit."""
        value = f"{metres / self._scale:.6g}"
        return f"{value} {self._unit}{'' if value == '1' else 's'}"

    def rounded_up(self, metres: float) -> str:
        """Return a length with its unit, a hundredth at most too long."""
        return self.length(math.ceil(metres / self._scale * 100.0) / 100.0 * self._scale)

    def point(self, point: Sequence[float]) -> str:
        """Return a place as a file has it."""
        return f"[{', '.join(f'{value / self._scale:.6g}' for value in point)}]"


def coin_groups(
    indices: npt.NDArray[np.intp], positions: Float64, sources: Sequence[str], in_unit: InUnit
) -> Iterator[tuple[FieldPath, str, int]]:
    """Yield, for each piece that some of the coins come from, its path and the first of them.

    Yields:
        The path, "the coin at ... is", and the first coin's index.
    """
    groups: dict[str, list[int]] = {}
    for index in indices.tolist():
        groups.setdefault(sources[index], []).append(index)
    for source, members in groups.items():
        where = in_unit.point(positions[members[0]].tolist())
        others = f" (the first of {len(members)})" if len(members) > 1 else ""
        yield path_of(source), f"the coin at {where}{others} is", members[0]
