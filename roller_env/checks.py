"""What is asked of a value before anything is done with it, and the words in which it is refused.

Each function returns the value as plain Python has it: NumPy's numbers are numbers here, and True
is not 1. Every error reads ``name: found X; must be Y`` or ``name: found X; allowed are Y``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import MISSING, fields
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, TypeGuard, TypeVar, cast

from roller_env import names

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_Choice = TypeVar("_Choice", bound=str | int | None)
_Record = TypeVar("_Record", bound="DataclassInstance")


class Refused(ValueError):
    """Values that are not allowed.

    Attributes:
        messages: one for each, as this module words them.
    """

    def __init__(self, messages: Sequence[str]) -> None:
        self.messages = tuple(messages)
        super().__init__("\n".join(self.messages))


def each(checked: Mapping[str, Callable[[], Any]]) -> dict[str, Any]:
    """Return what each of the checks returns, by its name, having asked all of them.

    Raises:
        ValueError: the only one that was raised, or a `Refused` with the messages of all.
    """
    found: dict[str, Any] = {}
    errors: list[ValueError] = []
    for name, check in checked.items():
        try:
            found[name] = check()
        except ValueError as error:
            errors.append(error)
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise Refused([message for error in errors for message in messages_of(error)])
    return found


def messages_of(error: ValueError) -> tuple[str, ...]:
    """Return what an error says of each value that it refuses."""
    return error.messages if isinstance(error, Refused) else (str(error),)


def one_of(name: str, value: object, allowed: Collection[_Choice]) -> _Choice:
    """Return the allowed choice that ``value`` is.

    Raises:
        ValueError: it is none; the message says which there are and which is nearest.
    """
    if value is None or isinstance(value, str) or is_whole(value):
        for choice in allowed:
            if value == choice:
                return choice
    hint = nearest(str(value), [str(choice) for choice in allowed])
    raise ValueError(f"{name}: found {value!r}; allowed are {', '.join(map(repr, allowed))}{hint}")


def whole(name: str, value: object, low: int, high: int) -> int:
    """Return a whole number from ``low`` to ``high``.

    Raises:
        ValueError: ``value`` is no such number.
    """
    if not is_whole(value) or not low <= int(value) <= high:
        raise ValueError(f"{name}: found {value!r}; must be a whole number from {low} to {high}")
    return int(value)


def is_whole(value: object) -> TypeGuard[int]:
    """Say whether a value is a whole number, Python's or NumPy's."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def number(
    name: str,
    value: object,
    low: float = -math.inf,
    high: float = math.inf,
    wanted: str = "a finite number",
) -> float:
    """Return a finite number from ``low`` to ``high``.

    Args:
        name: what the message calls it.
        value: what was given.
        low: least number allowed.
        high: greatest number allowed.
        wanted: the allowed numbers in words.

    Raises:
        ValueError: ``value`` is no such number.
    """
    if not isinstance(value, bool) and isinstance(value, Real):
        try:
            found = float(value)
        except OverflowError:  # a whole number
            found = math.inf
        if math.isfinite(found) and low <= found <= high:
            return found
    raise ValueError(f"{name}: found {value!r}; must be {wanted}")


def record(name: str, kind: type[_Record], value: object) -> _Record:
    """Return a dataclass that is given as itself or as a mapping of its fields.

    Raises:
        ValueError: ``value`` is neither, or has a field that is unknown, missing or not allowed.
    """
    if isinstance(value, kind):
        return value
    known = {field.name: field.default is MISSING for field in fields(kind)}
    if not isinstance(value, Mapping):
        raise ValueError(
            f"{name}: found {value!r}; must be a {kind.__name__} or a mapping with its fields "
            f"{', '.join(known)}"
        )
    missing = [field for field, is_needed in known.items() if is_needed and field not in value]
    if missing:
        known_names(name, value, known)
        raise ValueError(f"{name}: found no {' and no '.join(missing)}; must have it")
    made = each(
        {
            "names": lambda: known_names(name, value, known),
            "record": lambda: kind(**{key: value[key] for key in known if key in value}),
        }
    )
    return cast("_Record", made["record"])


def known_names(name: str, given: Mapping[Any, object], known: Collection[str]) -> None:
    """Refuse a mapping with other keys than ``known``.

    Raises:
        ValueError: it has one or more; a message each says which there are and which is nearest.
    """
    unknown = [
        f"{name}: found the unknown key {key!r}; allowed are {', '.join(known)}"
        f"{nearest(str(key), known)}"
        for key in given
        if key not in known
    ]
    if unknown:
        raise Refused(unknown)


def nearest(written: str, known: Collection[str]) -> str:
    """Return ``; did you mean 'X'?``, or nothing where no known name is near."""
    near = names.nearest(written, known)
    return f"; did you mean {near!r}?" if near is not None else ""
