"""The name that was probably meant."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice
from typing import Final

_LONG_NAME: Final = 64
_MANY_NAMES: Final = 1_000


def nearest(written: str, known: Iterable[str]) -> str | None:
    """Return the known name that is nearest to a written one, if any is near.

    Nothing is near a name that is longer than any, nor looked for among more than a thousand.
    """
    lower = {name.lower(): name for name in islice(known, _MANY_NAMES + 1)}
    if len(written) > _LONG_NAME or len(lower) > _MANY_NAMES:
        return None
    near = get_close_matches(written.lower(), lower, n=1)
    return lower[near[0]] if near else None
