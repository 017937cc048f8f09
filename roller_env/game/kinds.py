"""The kinds of pieces that have rules, and their hooks one after the other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from roller_env.arrays import Int64
from roller_env.compiled import inlined, spliced
from roller_env.level.schema import PIECE_KINDS
from roller_env.pieces.rules import Hook, Own, Rules, nothing

RULES: Final[tuple[Rules[Any, Any], ...]] = tuple(
    kind.rules for kind in PIECE_KINDS if kind.rules is not None
)
"""In the order in which they act. Tables, states and `Own`s of all kinds are tuples in it."""

AllHooks = Callable[[Any, tuple[Any, ...], tuple[Any, ...], Int64], None]


def all_hooks(name: str) -> AllHooks:
    """Return a function that calls the hook ``name`` of every kind, in order.

    Compiled, it is that many calls: Numba cannot loop over functions of different types.
    """
    hooks: list[Hook] = [getattr(rules, name) for rules in RULES]
    calls = [
        _only(inlined(hook), number, RULES[number].is_basic)
        for number, hook in enumerate(hooks)
        if hook is not nothing
    ]
    assert calls, "every hook has a kind that has to do with it"
    # In pairs, and pairs of pairs: one after the other each would be copied as often as others
    # follow it, which took a fifth of the time of compiling.
    while len(calls) > 1:
        last = calls[len(calls) // 2 * 2 :]
        calls = [*map(_both, calls[::2], calls[1::2]), *last]
    return calls[0]


def _only(hook: Hook, number: int, always: bool) -> AllHooks:
    """Return a function that calls one kind's hook: always, or where a level has such pieces."""

    @spliced
    def call(now: Any, tables: tuple[Any, ...], states: tuple[Any, ...], owns: Int64) -> None:
        if always or owns[number, 1] + owns[number, 3] > 0:
            own = Own(
                owns[number, 0],
                owns[number, 1],
                owns[number, 2],
                owns[number, 3],
                owns[number, 4],
                owns[number, 5],
            )
            hook(now, tables[number], states[number], own)

    return call


def _both(first: AllHooks, others: AllHooks) -> AllHooks:
    @spliced
    def call(now: Any, tables: tuple[Any, ...], states: tuple[Any, ...], owns: Int64) -> None:
        first(now, tables, states, owns)
        others(now, tables, states, owns)

    return call
