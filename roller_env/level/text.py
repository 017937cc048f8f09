"""Texts of files: of a level, and what somebody wrote."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import yaml

from roller_env.level.errors import LevelError
from roller_env.level.schema import Level
from roller_env.problems import Problem


def level_text(level: Level) -> str:
    """Return YAML in metres, without what is by default, that loads as an equal level."""
    return fields_text(level.model_dump(mode="json", exclude_defaults=True))


def fields_text(fields: Mapping[str, Any]) -> str:
    """Return YAML that says the fields of a level file, in their order and in their own unit."""
    plain = dict(fields)
    text: str = yaml.safe_dump(plain, sort_keys=False, width=100, default_flow_style=None)
    return text


def decoded(data: bytes, filename: str) -> str:
    """Return the text of a file that somebody wrote.

    Args:
        data: what is in it.
        filename: what errors call it.

    Raises:
        LevelError: it is not UTF-8; says where.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
        message = f"found the byte 0x{data[error.start]:02x}, which is not UTF-8; save it as UTF-8"
        raise LevelError([Problem((), message, filename, line, column)]) from None
