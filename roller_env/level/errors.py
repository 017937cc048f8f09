"""The error that a level which cannot be used is."""

from __future__ import annotations

from roller_env.problems import ProblemsError


class LevelError(ProblemsError):
    """A level that cannot be used.

    Attributes:
        problems: everything that is wrong with it, in the order of the file.
    """
