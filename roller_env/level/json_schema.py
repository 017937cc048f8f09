"""The JSON Schema of level files, for editors."""

from __future__ import annotations

from typing import Any

from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import CoreSchema

from roller_env.level.prefab import LevelFile
from roller_env.level.schema import PIECE_FIELDS
from roller_env.pieces.fields import NAME_PATTERN


class _EditorSchema(GenerateJsonSchema):
    """Pydantic's schema without the titles it makes of the field names, which say nothing."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def generate(self, schema: CoreSchema, mode: Any = "validation") -> dict[str, Any]:
        said: dict[str, Any] = _draft_07(super().generate(schema, mode))
        return {"$schema": "http://json-schema.org/draft-07/schema#", **said}


def level_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 7) of a level file, for editors to complete from."""
    schema = LevelFile.model_json_schema(schema_generator=_EditorSchema)
    schema["title"] = "Roller level"
    schema["description"] = "A level of Roller; see docs/levels.md."
    schema["prefab"] = _prefab(schema["$defs"])
    schema["properties"]["prefabs"]["patternProperties"] = {NAME_PATTERN: {"$ref": "#/prefab"}}
    schema["$defs"]["Placement"]["properties"]["pieces"] |= {"$ref": "#/prefab"}
    return schema


def _prefab(models: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a prefab: every value in it may be a parameter, so none has a type."""
    kinds = {name: kind.__name__ for name, kind in PIECE_FIELDS.items()}
    lists = {
        field: {
            "type": "array",
            "items": {
                "type": "object",
                "properties": {
                    name: {"description": schema.get("description", "")}
                    for name, schema in models[model]["properties"].items()
                },
                "additionalProperties": False,
            },
        }
        for field, model in (kinds | {"place": "Placement"}).items()
    }
    properties = {"parameters": {"type": "object"}} | lists
    return {"type": "object", "properties": properties, "additionalProperties": False}


def _draft_07(schema: Any) -> Any:
    """Say lists of fixed length in the words of draft 7, which every editor understands."""
    if isinstance(schema, list):
        return [_draft_07(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    said = {key: _draft_07(value) for key, value in schema.items()}
    if "prefixItems" in said:
        said["items"], *others = said.pop("prefixItems")
        assert all(other == said["items"] for other in others), "a list of unlike items"
    return said
