"""The error that a level which cannot be used is, and the warning that a strange one gives."""

from __future__ import annotations

from roller_env.problems import Problem, ProblemsError, printed


class LevelError(ProblemsError):
    """A level that cannot be used.

    Attributes:
        problems: everything that is wrong with it, in the order of the file.
    """


class LevelWarning(UserWarning):
    """A level that can be used, but hardly is what its designer meant.

    Attributes:
        problems: everything that is strange about it, in the order of the file.
    """

    def __init__(self, problems: tuple[Problem, ...]) -> None:
        self.problems = problems
        super().__init__(problems)

    def __str__(self) -> str:
        return printed(self.problems)
