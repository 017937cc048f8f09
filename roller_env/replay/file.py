"""Replay files: one gzip stream of text and plain numbers, in which nothing can be executed.

Uncompressed it is

1. one line of JSON: `Header`, with all that is short;
2. one line of JSON: the level;
3. the actions, one after the other, as the header's ``encoding`` says;
4. the checksums, little-endian uint32, those of one quantity after those of the other, so that the
   many which seldom change compress to next to nothing;

so ``zcat FILE | head -1`` tells what a file is. It is not an .npz because those hold, per array, a
header that is a Python expression; here the sizes follow from a few whole numbers, which are
checked before anything of that size is made. Gzip's own checksum finds damage.
"""

from __future__ import annotations

import gzip
import hashlib
import os
import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PlainSerializer,
    PlainValidator,
    ValidationError,
)
from pydantic_core import from_json

from roller_env import checks
from roller_env.assets import asset_directory
from roller_env.config import EnvConfig, make_config
from roller_env.game.result import EpisodeResult
from roller_env.level import Level, LevelError, load_level
from roller_env.regular_files import read_regular_file
from roller_env.replay.actions import (
    ACTION_BYTES,
    Encoding,
    decode_actions,
    encode_actions,
    encoding_of,
)
from roller_env.replay.checksums import MAX_ROWS, QUANTITIES, Checksums, row_count
from roller_env.replay.contents import (
    FORMAT_VERSION,
    MAX_STEPS,
    Number,
    Replay,
    Text,
    Versions,
    recorded_options,
)
from roller_env.replay.errors import ReplayError

SUFFIX: Final = ".replay"

MAX_HEADER_BYTES: Final = 2**14
MAX_COINS: Final = 2**31 - 1
MAX_LEVEL_BYTES: Final = 2**22
"""A level file may have a quarter of this; with its defaults written out it grows."""

_CHECKSUM: Final = np.dtype("<u4")
_MAX_BYTES: Final = (
    MAX_HEADER_BYTES
    + MAX_LEVEL_BYTES
    + MAX_STEPS * max(ACTION_BYTES.values())
    + MAX_ROWS * len(QUANTITIES) * _CHECKSUM.itemsize
)
"""Of a whole file; what does not compress at all grows by less than the header's share."""

_GZIP: Final = 16 + zlib.MAX_WBITS
_KIND: Final = "roller-replay"
_NOT_WRITTEN: Final = {"result": {"reward_terms"}}
"""Played again, the game tells it."""


def _possible(result: EpisodeResult) -> EpisodeResult:
    """Refuse a result of which no game can be."""
    checks.whole("coins", result.coins, 0, MAX_COINS)
    for name in ("score_percent", "time_s", "total_reward"):
        checks.number(name, getattr(result, name))
    if result.reward_terms is not None:
        raise ValueError("reward_terms: found some; a file has only their sum")
    return result


def _options(found: object) -> EnvConfig:
    """Return the options that a header tells: all that a recording has, and no others."""
    if isinstance(found, EnvConfig):
        return found
    names = EnvConfig().episode_options()
    if not isinstance(found, dict):
        raise ValueError(f"found {str(found)[:20]!r}; must be a mapping of options")
    checks.known_names("options", found, names)
    missing = [name for name in names if name not in found]
    if missing:
        raise ValueError(f"found no {' and no '.join(missing)}; must have it")
    if not isinstance(found["physics"], dict):
        raise ValueError("physics: found a name; must be the preset's values")
    return make_config(**found)


RecordedResult = Annotated[EpisodeResult, AfterValidator(_possible)]
RecordedOptions = Annotated[
    EnvConfig, PlainValidator(_options), PlainSerializer(EnvConfig.episode_options)
]


class Header(BaseModel):
    """What every format's first line says."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    kind: Literal["roller-replay"] = _KIND
    format: int
    player: Text
    seed: Annotated[int, Field(ge=0, lt=2**128)] | None
    start: tuple[Number, Number, Number]
    intro: bool
    steps: Annotated[int, Field(ge=0, le=MAX_STEPS)]
    result: RecordedResult
    options: RecordedOptions
    level_bytes: Annotated[int, Field(ge=2, le=MAX_LEVEL_BYTES)]
    level_sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]

    @property
    def numbers_bytes(self) -> int:
        """Bytes after the level's line."""
        raise NotImplementedError


class Header2(Header):
    """Of the format that is written."""

    format: Literal[2] = FORMAT_VERSION
    encoding: Encoding
    check_every: Annotated[int, Field(ge=1, le=MAX_STEPS)]
    quantities: Annotated[tuple[Text, ...], Field(max_length=len(QUANTITIES))]
    versions: Versions

    @property
    def action_bytes(self) -> int:
        """Of all actions."""
        return self.steps * ACTION_BYTES[self.encoding]

    @property
    def checksums_shape(self) -> tuple[int, int]:
        """Quantities and rows."""
        return len(self.quantities), row_count(self.steps, self.check_every)

    @property
    def numbers_bytes(self) -> int:
        """Bytes after the level's line."""
        quantities, rows = self.checksums_shape
        if rows > MAX_ROWS:
            raise ReplayError(f"found {rows} rows of checksums; allowed are at most {MAX_ROWS}")
        return self.action_bytes + quantities * rows * _CHECKSUM.itemsize


def save_replay(replay: Replay, file: str | os.PathLike[str]) -> Path:
    """Write a replay and return its path; equal replays give equal bytes.

    Whenever the process is ended, the path holds what it held before or the whole replay.

    Raises:
        ReplayError: the level's text is too long.
        OSError: the file cannot be written.
    """
    path = Path(file)
    content = encode(replay)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".tmp")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
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
        return decode(read_whole(path))
    except ReplayError as error:
        raise ReplayError(f"{path}: {error}") from None


def read_whole(path: Path) -> bytes:
    """Return a file's content, which may be a byte too long to be a replay's.

    Raises:
        ReplayError: it cannot be read; without its name.
    """
    try:
        return read_regular_file(path, _MAX_BYTES)
    except OSError as error:
        raise ReplayError(str(error.strerror)) from None


def shipped_replays() -> dict[str, Path]:
    """Return the files of the demonstrations that come with the package, by level."""
    files = sorted(asset_directory("replays").glob(f"*{SUFFIX}"))
    return {path.stem: path for path in files}


def encode(replay: Replay) -> bytes:
    """Return a replay as the content of a file.

    Raises:
        ReplayError: the level's text is too long.
    """
    level = replay.level_text.encode()
    if len(level) > MAX_LEVEL_BYTES:
        raise ReplayError(f"the level's text has {len(level)} bytes; allowed are {MAX_LEVEL_BYTES}")
    sums = replay.checksums
    header = Header2(
        player=replay.player,
        seed=replay.seed,
        start=replay.start,
        intro=replay.intro,
        steps=len(replay),
        result=replace(replay.result, reward_terms=None),
        options=replay.options,
        versions=replay.versions,
        encoding=encoding_of(replay.actions),
        check_every=sums.every,
        quantities=sums.quantities,
        level_bytes=len(level),
        level_sha256=replay.level_hash,
    )
    content = b"".join(
        (
            header.model_dump_json(exclude=_NOT_WRITTEN).encode() + b"\n",
            level + b"\n",
            encode_actions(replay.actions),
            sums.table.T.astype(_CHECKSUM).tobytes(),
        )
    )
    return gzip.compress(content, mtime=0)


def decode(content: bytes) -> Replay:
    """Return the replay that a file's content is.

    Raises:
        ReplayError: it is none; one line that says why.
    """
    header, level, numbers = unpack(content, (Header2,))
    assert isinstance(header, Header2)
    return replay_of(header, level, numbers)


def replay_of(header: Header2, level: Level, numbers: bytes) -> Replay:
    """Return the replay of what `unpack` found.

    Raises:
        ReplayError: it is none; one line that says why.
    """
    actions, sums = numbers[: header.action_bytes], numbers[header.action_bytes :]
    table = np.frombuffer(sums, _CHECKSUM).astype(np.uint32).reshape(header.checksums_shape)
    return Replay(
        options=recorded_options(header.options, level),
        start=header.start,
        intro=header.intro,
        actions=decode_actions(header.options.action, header.encoding, actions),
        checksums=Checksums(header.check_every, header.quantities, table.T),
        result=header.result,
        versions=header.versions,
        player=header.player,
        seed=header.seed,
    )


def unpack(content: bytes, kinds: Sequence[type[Header]]) -> tuple[Header, Level, bytes]:
    """Return a file's header, its level, and the numbers after them as bytes.

    Args:
        content: of the file.
        kinds: of headers, and so the formats, that will do.

    Raises:
        ReplayError: the content is of none of these formats.
    """
    if len(content) > _MAX_BYTES:
        raise ReplayError(f"too large; allowed are at most {_MAX_BYTES} bytes")
    header, body = _inflate(content, kinds)
    level_text, numbers = body[: header.level_bytes], body[header.level_bytes + 1 :]
    if hashlib.sha256(level_text).hexdigest() != header.level_sha256:
        raise ReplayError("damaged: the level does not match its hash")
    return header, _level(level_text), numbers


def _inflate(content: bytes, kinds: Sequence[type[Header]]) -> tuple[Header, bytes]:
    """Return the header and the bytes after it, and never make more than the header announces."""
    stream = zlib.decompressobj(_GZIP)
    try:
        begin = stream.decompress(content, MAX_HEADER_BYTES)
        line, newline, body = begin.partition(b"\n")
        if not newline:
            raise ReplayError("not a replay: it does not begin with a replay's header")
        header = _read_header(line, kinds)
        length = header.level_bytes + 1 + header.numbers_bytes
        # One byte more than there should be, to see that there is none, and to reach the end.
        missing = max(length - len(body), 0)
        body += stream.decompress(stream.unconsumed_tail, missing + 1)
    except zlib.error:
        what = "damaged" if content.startswith(b"\x1f\x8b") else "not a replay"
        raise ReplayError(f"{what}: its content is not a whole gzip stream") from None
    if not stream.eof or stream.unused_data or len(body) != length:
        raise ReplayError("damaged: the content is longer or shorter than its header says")
    return header, body


def _read_header(line: bytes, kinds: Sequence[type[Header]]) -> Header:
    try:
        facts: Any = from_json(line)
        if not isinstance(facts, dict) or facts.get("kind") != _KIND:
            raise ReplayError("not a replay: it does not begin with a replay's header")
        return _kind_of(facts.get("format"), kinds).model_validate_json(line)
    except ValidationError as error:
        raise ReplayError(f"its header is wrong: {_first(error)}") from None
    except ReplayError:
        raise
    except ValueError:
        raise ReplayError("not a replay: it does not begin with a replay's header") from None


def _kind_of(found: Any, kinds: Sequence[type[Header]]) -> type[Header]:
    """Return the kind of header that the format ``found`` has."""
    for kind in kinds:
        # True is equal to 1.
        if found == kind.model_fields["format"].default and not isinstance(found, bool):
            return kind
    hint = "; roller replay FILE --convert NEW makes a new file of it" if found == 1 else ""
    raise ReplayError(
        f"found format {found!r:.20}; this version of Roller plays format {FORMAT_VERSION}{hint}"
    )


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
