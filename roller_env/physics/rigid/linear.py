"""Small systems of linear equations."""

from __future__ import annotations

from typing import Any, Final

from roller_env.physics.rigid.kernels import kernel

_SINGULAR: Final = 1e-11


@kernel
def eliminate(system: Any, size: int, columns: Any) -> None:
    """Solve a linear system by elimination with complete pivoting; the answer is the last column.

    Where it is singular, as for friction that is indeterminate, the unknowns that nothing decides
    are 0.
    """
    for i in range(size):
        columns[i] = i
        _scale(system, size, i)
    rank = size
    for step in range(size):
        if not _pivot(system, size, step, columns):
            rank = step
            break
        _clear_column(system, size, step)
    for step in range(rank, size):
        system[step, size] = 0.0
    for step in range(rank - 1, -1, -1):
        value = system[step, size]
        for k in range(step + 1, rank):
            value -= system[step, k] * system[k, size]
        system[step, size] = value / system[step, step]
    # The first column's memory is free now: put the answer back into the unknowns' own order.
    for step in range(size):
        system[columns[step], 0] = system[step, size]
    for step in range(size):
        system[step, size] = system[step, 0]


@kernel
def _scale(system: Any, size: int, i: int) -> None:
    """Make a row's largest coefficient 1."""
    largest = 0.0
    for k in range(size):
        largest = max(largest, abs(system[i, k]))
    if largest > 0.0:
        for k in range(size + 1):
            system[i, k] /= largest


@kernel
def _clear_column(system: Any, size: int, step: int) -> None:
    """Take the pivot's row away from those below it."""
    for i in range(step + 1, size):
        factor = system[i, step] / system[step, step]
        if factor != 0.0:
            for k in range(step + 1, size + 1):
                system[i, k] -= factor * system[step, k]


@kernel
def _pivot(system: Any, size: int, step: int, columns: Any) -> bool:
    """Bring the largest number that is left to the diagonal; say whether it is more than 0."""
    best, pivot_row, pivot_column = 0.0, step, step
    for i in range(step, size):
        for k in range(step, size):
            if abs(system[i, k]) > best:
                best, pivot_row, pivot_column = abs(system[i, k]), i, k
    if best < _SINGULAR:
        return False
    if pivot_row != step:
        for k in range(size + 1):
            system[step, k], system[pivot_row, k] = system[pivot_row, k], system[step, k]
    if pivot_column != step:
        for i in range(size):
            system[i, step], system[i, pivot_column] = system[i, pivot_column], system[i, step]
        columns[step], columns[pivot_column] = columns[pivot_column], columns[step]
    return True
