"""Replay files: one gzip stream of text and plain numbers, in which nothing can be executed.

Uncompressed it is

1. one line of JSON: `_Header`, with all that is short;
2. one line of JSON: the level;
3. the forces, (T, 2) little-endian float64;
4. the checksums, (T + 1,) little-endian uint32;

so ``zcat FILE | head -1`` tells what a file is. It is not an .npz because those hold, per array, a
header that is a Python expression; here the sizes follow from two whole numbers, which are checked
before anything of that size is made. Gzip's own checksum finds damage.
"""

from __future__ import annotations

import gzip
import hashlib
import os
import zlib
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import from_json

from roller_env.level import Level, LevelError, levels_directory, load_level
from roller_env.regular_files import read_regular_file
from roller_env.replay.contents import (
    FORMAT_VERSION,
    MAX_STEPS,
    Number,
    Options,
    Replay,
    ReplayError,
    Result,
    Text,
    Versions,
)

SUFFIX: Final = ".replay"

MAX_HEADER_BYTES: Final = 2**14
MAX_LEVEL_BYTES: Final = 2**22
"""A level file may have a quarter of this; with its defaults written out it grows."""

_FORCE: Final = np.dtype(("<f8", 2))
_CHECKSUM: Final = np.dtype("<u4")
_MAX_BYTES: Final = (
    MAX_HEADER_BYTES + MAX_LEVEL_BYTES + (MAX_STEPS + 1) * (_FORCE.itemsize + _CHECKSUM.itemsize)
)
"""Of a whole file; what does not compress at all grows by less than the header's share."""

_GZIP: Final = 16 + zlib.MAX_WBITS
_KIND: Final = "roller-replay"


class _Header(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    kind: Literal["roller-replay"] = _KIND
    format: Literal[1] = FORMAT_VERSION
    player: Text
    seed: Annotated[int, Field(ge=0, lt=2**128)] | None
    start: tuple[Number, Number, Number]
    intro: bool
    steps: Annotated[int, Field(ge=0, le=MAX_STEPS)]
    result: Result
    options: Options
    versions: Versions
    level_bytes: Annotated[int, Field(ge=2, le=MAX_LEVEL_BYTES)]
    level_sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]

    @property
    def body_bytes(self) -> int:
        """Bytes after the header's line."""
        numbers = self.steps * _FORCE.itemsize + (self.steps + 1) * _CHECKSUM.itemsize
        return self.level_bytes + 1 + numbers


def save_replay(replay: Replay, file: str | os.PathLike[str]) -> Path:
    """Write a replay and return its path; equal replays give equal bytes.

    Raises:
        ReplayError: the level's text is too long.
        OSError: the file cannot be written.
    """
    path = Path(file)
    content = encode(replay)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


def load_replay(file: str | os.PathLike[str]) -> Replay:
    """Read a replay, from wherever it comes.

    Whatever the file holds, nothing of it is executed, and memory stays within a small multiple of
    the largest replay's size.

    Raises:
        ReplayError: there is no such file, or it is not a whole replay; one line, with its name.
    """
    path = Path(file)
    try:
        return decode(read_regular_file(path, _MAX_BYTES))
    except OSError as error:
        raise ReplayError(f"{path}: {error.strerror}") from None
    except ReplayError as error:
        raise ReplayError(f"{path}: {error}") from None


def shipped_replays() -> dict[str, Path]:
    """Return the files of the demonstrations that come with the package, by level."""
    directory = levels_directory().parent / "replays"
    return {path.stem: path for path in sorted(directory.glob(f"*{SUFFIX}"))}


def encode(replay: Replay) -> bytes:
    """Return a replay as the content of a file.

    Raises:
        ReplayError: the level's text is too long.
    """
    level = replay.level_text.encode()
    if len(level) > MAX_LEVEL_BYTES:
        raise ReplayError(f"the level's text has {len(level)} bytes; allowed are {MAX_LEVEL_BYTES}")
    header = _Header(
        player=replay.player,
        seed=replay.seed,
        start=replay.start,
        intro=replay.intro,
        steps=len(replay),
        result=replay.result,
        options=replay.options,
        versions=replay.versions,
        level_bytes=len(level),
        level_sha256=replay.level_hash,
    )
    content = b"".join(
        (
            header.model_dump_json().encode() + b"\n",
            level + b"\n",
            replay.force_n.astype("<f8").tobytes(),
            replay.checksums.astype(_CHECKSUM).tobytes(),
        )
    )
    return gzip.compress(content, mtime=0)


def decode(content: bytes) -> Replay:
    """Return the replay that a file's content is.

    Raises:
        ReplayError: it is none; one line that says why.
    """
    if len(content) > _MAX_BYTES:
        raise ReplayError(f"too large; allowed are at most {_MAX_BYTES} bytes")
    header, body = _inflate(content)
    level_text, numbers = body[: header.level_bytes], body[header.level_bytes + 1 :]
    if hashlib.sha256(level_text).hexdigest() != header.level_sha256:
        raise ReplayError("damaged: the level does not match its hash")
    forces = header.steps * _FORCE.itemsize
    return Replay(
        level=_level(level_text),
        options=header.options,
        start=header.start,
        intro=header.intro,
        force_n=np.frombuffer(numbers[:forces], "<f8").astype(np.float64).reshape(-1, 2),
        checksums=np.frombuffer(numbers[forces:], _CHECKSUM).astype(np.uint32),
        result=header.result,
        versions=header.versions,
        player=header.player,
        seed=header.seed,
    )


def _inflate(content: bytes) -> tuple[_Header, bytes]:
    """Return the header and the bytes after it, and never make more than the header announces."""
    stream = zlib.decompressobj(_GZIP)
    try:
        begin = stream.decompress(content, MAX_HEADER_BYTES)
        line, newline, body = begin.partition(b"\n")
        if not newline:
            raise ReplayError("not a replay: it does not begin with a replay's header")
        header = _read_header(line)
        # One byte more than there should be, to see that there is none, and to reach the end.
        missing = max(header.body_bytes - len(body), 0)
        body += stream.decompress(stream.unconsumed_tail, missing + 1)
    except zlib.error:
        what = "damaged" if content.startswith(b"\x1f\x8b") else "not a replay"
        raise ReplayError(f"{what}: its content is not a whole gzip stream") from None
    if not stream.eof or stream.unused_data or len(body) != header.body_bytes:
        raise ReplayError("damaged: the content is longer or shorter than its header says")
    return header, body


def _read_header(line: bytes) -> _Header:
    try:
        facts: Any = from_json(line)
        if not isinstance(facts, dict) or facts.get("kind") != _KIND:
            raise ReplayError("not a replay: it does not begin with a replay's header")
        found = facts.get("format")
        # True is equal to 1.
        if isinstance(found, bool) or found != FORMAT_VERSION:
            raise ReplayError(
                f"found format {str(found)[:20]}; this version of Roller reads format "
                f"{FORMAT_VERSION}"
            )
        return _Header.model_validate_json(line)
    except ValidationError as error:
        raise ReplayError(f"its header is wrong: {_first(error)}") from None
    except ReplayError:
        raise
    except ValueError:
        raise ReplayError("not a replay: it does not begin with a replay's header") from None


def _level(text: bytes) -> Level:
    try:
        return load_level(Level.model_validate_json(text))
    except ValidationError as error:
        raise ReplayError(f"its level is wrong: {_first(error)}") from None
    except LevelError as error:
        raise ReplayError(f"its level is wrong: {error.problems[0]}") from None


def _first(error: ValidationError) -> str:
    """Return the first fault in one line."""
    details = error.errors(include_url=False)[0]
    place = ".".join(map(str, details["loc"]))[:80]
    return " ".join(f"{place}: {details['msg']}"[:300].split())
