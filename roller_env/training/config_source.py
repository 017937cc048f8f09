"""A configuration as it is written: a file, and ``field=value`` on the command line instead of it.

Every field remembers where it was said, so that an error can tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from roller_env.problems import FieldPath, Problem, ProblemsError, quoted
from roller_env.training.files import RunError, read_whole
from roller_env.yaml_tree import MAX_BYTES, MAX_DEPTH, YamlError, read_tree, read_value


class ConfigError(ProblemsError):
    """A training configuration that cannot be used; all its faults, each with its place."""


class ConfigSource:
    """What a configuration is read from.

    Attributes:
        content: plain data, mappings and lists and scalars.
    """

    def __init__(self, file: Path, overrides: Sequence[str]) -> None:
        """Read a file, and put what is said instead into it.

        Args:
            file: YAML.
            overrides: ``field=value`` each; see `roller_env.training.config.load_config`.

        Raises:
            ConfigError: the file cannot be read, or is no YAML, or an override is no such thing.
        """
        self._filename = str(file)
        self._overrides: dict[FieldPath, str] = {}
        try:
            self._root = read_tree(_content(file), self._filename)
            content = self._root.plain()
            assert isinstance(content, dict)
            self.content: dict[str, Any] = content
            for override in overrides:
                self._override(override)
        except YamlError as error:
            raise ConfigError(error.problems) from None

    def _override(self, override: str) -> None:
        name, equals, value = override.partition("=")
        place = f"--set {quoted(override)}"
        *parents, leaf = name.split(".")
        if not equals or not all((*parents, leaf)) or len(parents) > MAX_DEPTH:
            message = "expected field=value, such as ppo.gamma=0.995"
            raise ConfigError([Problem((), message, place)])
        inner = self.content
        for parent in parents:
            inner = inner.setdefault(parent, {})
            if not isinstance(inner, dict):
                message = f"{quoted(parent)} has no fields of its own"
                raise ConfigError([Problem((), message, place)])
        inner[leaf] = read_value(value, place).plain()
        self._overrides[*parents, leaf] = place

    def where(self, path: FieldPath, *, of_key: bool) -> dict[str, Any]:
        """Return filename, line and column of a field for a `Problem`."""
        for length in range(len(path), 0, -1):
            if place := self._overrides.get(path[:length]):
                return {"filename": place}
        line, column = self._root.position(path, of_key=of_key)
        return {"filename": self._filename, "line": line, "column": column}


def _content(file: Path) -> str:
    """Return a file's text.

    Raises:
        ConfigError: there is none, or it is no text.
    """
    try:
        if file.exists():
            return read_whole(file, MAX_BYTES).decode("utf-8-sig")
        known = tuple(other.name for other in file.parent.glob("*.yaml"))
        problem = Problem((), "there is no such file", written=file.name, known=known)
    except RunError as error:
        raise ConfigError([Problem((), str(error))]) from None
    except UnicodeDecodeError as error:
        found = f"found the byte 0x{error.object[error.start]:02x}, which is not UTF-8"
        problem = Problem((), f"{found}; save it as UTF-8")
    except OSError as error:  # a name too long
        problem = Problem((), f"cannot be read: {error.strerror}")
    raise ConfigError([replace(problem, filename=str(file))])
