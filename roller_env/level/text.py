"""A level as the text of a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import yaml

from roller_env.level.schema import Level


def level_text(level: Level) -> str:
    """Return YAML in metres, without what is by default, that loads as an equal level."""
    return fields_text(level.model_dump(mode="json", exclude_defaults=True))


def fields_text(fields: Mapping[str, Any]) -> str:
    """Return YAML that says the fields of a level file, in their order and in their own unit."""
    plain = dict(fields)
    text: str = yaml.safe_dump(plain, sort_keys=False, width=100, default_flow_style=None)
    return text
