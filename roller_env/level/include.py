"""The files that a level's file includes: pieces, materials and prefabs to share between levels.

None may lie outside the folder of the level's file, and all of them together may hold what one file
may, so that a level of a stranger opens nothing else and costs no more than another.
"""

from __future__ import annotations

from collections.abc import Iterator
from os.path import realpath
from pathlib import Path
from typing import Final

from roller_env.level.errors import LevelError
from roller_env.level.source import File, Origin
from roller_env.level.text import decoded
from roller_env.problems import FieldPath, Problem, quoted
from roller_env.regular_files import read_regular_file
from roller_env.yaml_tree import MAX_BYTES, MAX_VALUES, Node, YamlError, read_tree

SUFFIXES: Final = (".yaml", ".yml")
MAX_FILES: Final = 64


def with_included(file: File, path: Path | None) -> list[File]:
    """Return a level's file and those that it includes, also by way of others, each once.

    Args:
        file: the level's.
        path: where it lies; None for what is no file, which can include nothing.

    Raises:
        LevelError: a file cannot be included, is no YAML, or includes itself; or they are too many.
    """
    if "include" not in (file.root.value if isinstance(file.root.value, dict) else ()):
        return [file]
    reader = _Reader(path)
    reader.follow(file, path)
    if reader.problems:
        raise LevelError(reader.problems)
    return reader.files


class _Reader:
    def __init__(self, path: Path | None) -> None:
        self.files: list[File] = []
        self.problems: list[Problem] = []
        self._folder = _real(path).parent if path else None
        self._known: set[Path] = {_real(path)} if path else set()
        self._bytes = self._values = 0

    def follow(self, file: File, path: Path | None, open_files: tuple[Path, ...] = ()) -> None:
        """Take a file, and those that it includes."""
        self.files.append(file)
        self._bytes += len(file.text.encode("utf-8", "surrogatepass"))
        self._values += file.root.values
        here = (*open_files, _real(path)) if path else ()
        for where, node in self._entries(file):
            origin = Origin(file, where, node)
            target = self._target(origin, path)
            if target is None:
                continue
            resolved = _real(target)
            if resolved in here:
                self._report(origin, "the file includes itself, here or by way of others")
            elif resolved not in self._known and self._has_room(origin):
                self._known.add(resolved)
                inner = self._read(origin, target)
                if inner is not None:
                    self.follow(inner, target, here)

    def _entries(self, file: File) -> Iterator[tuple[FieldPath, Node]]:
        node = file.root.find(("include",))
        if node is None:
            return
        if not isinstance(node.value, list):
            message = "wanted a list of files, such as [parts.yaml]"
            self._report(Origin(file, ("include",), node), message)
            return
        for index, entry in enumerate(node.value):
            yield ("include", index), entry

    def _target(self, origin: Origin, path: Path | None) -> Path | None:
        """Return the file that an entry names, if it may be read."""
        name = origin.node.value
        if path is None or self._folder is None:
            self._report(origin, "only a file can include others; this is none")
        elif not isinstance(name, str) or not name.endswith(SUFFIXES):
            self._report(origin, f"wanted the name of a file that ends in {' or '.join(SUFFIXES)}")
        elif "\\" in name or "\0" in name or name.startswith("/") or ".." in name.split("/"):
            message = f"found {quoted(name)}; wanted a file in this folder or under it"
            self._report(origin, message)
        else:
            target = path.parent / name
            if _real(target).is_relative_to(self._folder):
                return target
            self._report(origin, f"found {quoted(name)}, which leads out of the level's folder")
        return None

    def _has_room(self, origin: Origin) -> bool:
        if len(self.files) < MAX_FILES:
            return True
        self._report(origin, f"more than {MAX_FILES} files in all")
        return False

    def _read(self, origin: Origin, target: Path) -> File | None:
        try:
            text = decoded(read_regular_file(target, MAX_BYTES - self._bytes), str(target))
            file = File(str(target), text, read_tree(text, str(target)))
        except (LevelError, YamlError) as error:
            self.problems += error.problems
            return None
        except OSError as error:
            message = f"{quoted(str(origin.node.value))} cannot be read: {error.strerror}"
            self._report(origin, message)
            return None
        if self._values + file.root.values > MAX_VALUES:
            self._report(origin, f"with it there are more than {MAX_VALUES} values")
            return None
        return file

    def _report(self, origin: Origin, message: str) -> None:
        self.problems.append(origin.told(Problem((), message)))


def _real(path: Path) -> Path:
    """Return where a file lies, all links followed; without an error for links in a ring."""
    return Path(realpath(path))
