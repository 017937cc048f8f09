"""What the tests of environment checkers share."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

# Small pictures, but not so small that SB3's convolutions would not fit.
SMALL: Final[dict[str, Any]] = {"width": 48, "height": 40}


@contextmanager
def no_warnings_but_of_unbounded_observations() -> Iterator[None]:
    """Make warnings errors, except that some observations have no bounds.

    Positions, velocities and directions to things have none: a level may be of any size, and
    nothing limits the ball's speed.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for bound in ("minimum value is -infinity", "maximum value is infinity"):
            warnings.filterwarnings("ignore", message=f".*Box observation space {bound}.*")
        yield
