"""Write the tables of docs/levels.md, which say what the models of `roller_env.level.schema` say.

A table stands between ``<!-- table: Plate -->`` and ``<!-- end -->``; a line for each field of that
model, with its default (lengths in quants) and its description, to which its limits are added.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any, Final, get_args

from pydantic import AfterValidator

from roller_env.level import level_json_schema
from roller_env.level.prefab import LevelFile
from roller_env.pieces.fields import Length, NonNegativeLength, Part, PositiveLength
from roller_env.units import METRES_PER_QUANT

PAGE: Final = Path(__file__).parents[1] / "docs" / "levels.md"

_TABLE: Final = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end -->\n)", re.DOTALL)
_LENGTHS: Final = frozenset(
    extra.func
    for length in (Length, PositiveLength, NonNegativeLength)
    for extra in length.__metadata__  # type: ignore[attr-defined]
    if isinstance(extra, AfterValidator)
)


def written(page: str) -> str:
    """Return the page with its tables written anew."""
    return _TABLE.sub(lambda found: found[1] + table(found[2]) + found[3], page)


def tables(page: str) -> set[str]:
    """Return the names of the models whose tables the page has."""
    return {name for _, name, _ in _TABLE.findall(page)}


def table(name: str) -> str:
    """Return the Markdown table of the model called ``name``."""
    model = _models()[name]
    rows = [
        f"| `{field}` | {_default(model, field)} | {_meaning(schema)} |"
        for field, schema in _schema(name)["properties"].items()
    ]
    return "\n".join(["", "| field | default | meaning |", "|---|---|---|", *rows, "", ""])


def _models() -> dict[str, type[Part]]:
    found: dict[str, type[Part]] = {"Level": LevelFile}
    open_models: list[Any] = [field.annotation for field in LevelFile.model_fields.values()]
    while open_models:
        kind = open_models.pop()
        if isinstance(kind, type) and issubclass(kind, Part) and kind.__name__ not in found:
            found[kind.__name__] = kind
            open_models += [field.annotation for field in kind.model_fields.values()]
        open_models += get_args(kind)
    return found


@cache
@cache
@cache
def _schema(name: str) -> dict[str, Any]:
    whole = level_json_schema()
    return dict(whole if name == "Level" else whole["$defs"][name])


def _default(model: type[Part], field: str) -> str:
    info = model.model_fields[field]
    if info.is_required():
        return "needed"
    value = info.default
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, str):
        return f"`{value}`" if value and not value.startswith("#") else f'`"{value}"`'
    is_length = _is_length([info.annotation, *info.metadata])
    if isinstance(value, float | int):
        return _number(value, is_length)
    if isinstance(value, tuple) and value:
        return f"`[{', '.join(_number(part, is_length) for part in value)}]`"
    return ""


def _is_length(types: list[Any]) -> bool:
    """Say whether there is a length among types, what they consist of, and their validators."""
    return any(
        getattr(kind, "func", None) in _LENGTHS
        or _is_length([*get_args(kind), *getattr(kind, "__metadata__", ())])
        for kind in types
    )


def _number(value: float, is_length: bool) -> str:
    return f"{round(value / (METRES_PER_QUANT if is_length else 1.0), 2):g}"


def _meaning(schema: dict[str, Any]) -> str:
    """Return a field's description, or else what its model says first, and its limits."""
    schema = next((s for s in schema.get("anyOf", ()) if s.get("type") != "null"), {}) | schema
    said = schema.get("description", "")
    of = schema.get("$ref") or schema.get("items", {}).get("$ref")
    if of and not said:
        described = _schema(of.rpartition("/")[2])["description"].replace("``", "`")
        said = re.split(r"(?<=\.)\s", described, maxsplit=1)[0]
    if "enum" in schema:
        said += f" One of {', '.join(f'`{value}`' for value in schema['enum'])}."
    if "maximum" in schema:
        low = f"From {schema['minimum']:,} to" if "minimum" in schema else "At most"
        said += f" {low} {schema['maximum']:,}."
    if "maxLength" in schema:
        said += f" At most {schema['maxLength']:,} characters."
    if schema.get("maxItems", 0) > len("xyz"):
        said += f" From {schema['minItems']} to {schema['maxItems']:,} of them."
    return " ".join(said.split()).replace(".0 ", " ").replace(".0.", ".")


def main() -> None:
    """Write the page."""
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"wrote the tables of {PAGE}")


if __name__ == "__main__":
    main()
