"""``roller``: the commands of the package, each in a module of its own.

A command's module is imported when the command is given, so that ``roller --help`` and
``roller level check`` need not wait for what only training or drawing needs.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Final

from roller_env import __version__
from roller_env.checks import nearest


@dataclass(frozen=True, slots=True)
class Command:
    """A word that may follow ``roller``.

    Attributes:
        says: what the command does, for ``roller --help``.
        extra: the extra of the package that brings what the command needs beyond the core.
    """

    says: str
    extra: str | None = None


COMMANDS: Final[dict[str, Command]] = {
    "train": Command("train an agent, evaluate it and draw what it does", "train"),
    "evaluate": Command("play a trained agent and say how good it is", "train"),
    "play": Command("play in a browser page, or watch a trained agent play", "play"),
    "replay": Command("verify a replay bit for bit, show it, film it, convert it"),
    "level": Command("check, draw and begin levels; watch one while it is written"),
}
"""By name, which is also the name of the module in this package."""

_EXTRA_OF: Final = {
    **dict.fromkeys(("stable_baselines3", "torch", "safetensors", "tensorboard"), "train"),
    **dict.fromkeys(("matplotlib", "PIL", "imageio", "tqdm"), "train"),
    **dict.fromkeys(("starlette", "uvicorn", "websockets"), "play"),
    "minari": "demos",
}
"""Which extra of this package brings a package that is missing."""


def main(argv: Sequence[str] | None = None) -> int:
    """Do what the command line says.

    Args:
        argv: the words after ``roller``; by default those of this process.

    Returns:
        The exit status.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    name = words[0] if words else "--help"
    if name in ("-h", "--help"):
        print(usage())
        return 0 if words else 2
    if name == "--version":
        print(f"roller {__version__}")
        return 0
    if name not in COMMANDS:
        known = ", ".join(COMMANDS)
        hint = nearest(name, list(COMMANDS))
        print(f"error: no command is called {name!r}; there are {known}{hint}", file=sys.stderr)
        return 2
    try:
        status = import_module(f"roller_env.cli.{name}").main(words[1:], f"roller {name}")
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        extra = _EXTRA_OF.get(package)
        if extra is None:
            raise
        print(
            f"error: 'roller {name}' needs the package {package!r}; "
            f"pip install 'roller-env[{extra}]' brings it",
            file=sys.stderr,
        )
        return 1
    return int(status or 0)


def usage() -> str:
    """Return what ``roller --help`` prints."""
    width = max(map(len, COMMANDS))
    lines = [
        f"  {name:<{width}}  {command.says}"
        + (f" (extra {command.extra!r})" if command.extra else "")
        for name, command in COMMANDS.items()
    ]
    return "\n".join(
        [
            "usage: roller COMMAND ...",
            "",
            "Roller: a ball, four keys and MuJoCo.",
            "",
            *lines,
            "",
            "'roller COMMAND --help' says more; 'roller --version' says which Roller this is.",
        ]
    )
