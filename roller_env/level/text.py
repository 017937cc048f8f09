"""A level as the text of a file."""

from __future__ import annotations

import yaml

from roller_env.level.schema import Level


def level_text(level: Level) -> str:
    """Return YAML in metres, without what is by default, that loads as an equal level."""
    fields = level.model_dump(mode="json", exclude_defaults=True)
    text: str = yaml.safe_dump(fields, sort_keys=False, width=100, default_flow_style=None)
    return text
