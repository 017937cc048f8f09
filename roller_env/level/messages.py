"""pydantic's findings -> plain words: what was found in the file, and what is allowed there.

What is allowed is read off the JSON Schema, so that an error and an editor's completion always
agree with the models.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any, Final, get_args

from pydantic import ValidationError
from pydantic_core import ErrorDetails
from pydantic_core.core_schema import ErrorType

from roller_env.level.source import Source
from roller_env.pieces.fields import COLOUR_PATTERN, NAME_PATTERN, Part
from roller_env.problems import MAX_PROBLEMS, FieldPath, Problem, listed, quoted
from roller_env.yaml_tree import Node

_PATTERNS: Final = {
    NAME_PATTERN: "a letter, then letters, digits, '_' or '-', at most 64 in all",
    COLOUR_PATTERN: "a colour '#rrggbb' or '#rrggbbaa' in quotes",
}
_PYDANTICS_OWN: Final = frozenset(get_args(ErrorType))
_PLAN_ROW_ERRORS: Final = ("ragged_plan", "unknown_cell")
_BOOLEAN_WORDS: Final = {"yes": "true", "on": "true", "no": "false", "off": "false"}
_LONG_TEXT: Final = 64

Schema = dict[str, Any]


def explain(error: ValidationError, source: Source, model: type[Part]) -> list[Problem]:
    """Return the error's findings as problems of the files, up to `MAX_PROBLEMS` of them.

    Args:
        error: what pydantic says of the source's fields.
        source: what was read.
        model: what it should have been.
    """
    problems: dict[Problem, None] = {}
    for details in error.errors(include_url=False)[:MAX_PROBLEMS]:
        problem = _in_words(details, source, _whole(model))
        of_key = details["type"] == "extra_forbidden" or details["loc"][-1:] == ("[key]",)
        told = source.told(problem, of_key)
        if details["type"] in _PLAN_ROW_ERRORS and told.line:
            line, column = _plan_place(source, problem.path, details["ctx"])
            told = replace(told, line=line, column=column)
        problems[told] = None
    more = error.error_count() - MAX_PROBLEMS
    if more > 0:
        problems[Problem((), f"{more} more fields are wrong", source.own.file.name)] = None
    return list(problems)


def _in_words(details: ErrorDetails, source: Source, whole: Schema) -> Problem:
    """Return the problem without its place in the file."""
    path, kind = details["loc"], details["type"]
    if kind in _PLAN_ROW_ERRORS:
        return Problem((*path, "plan"), details["msg"])
    if kind not in _PYDANTICS_OWN:
        return Problem(path, details["msg"])
    if kind == "extra_forbidden":
        known = tuple(_schema_at(path[:-1], whole).get("properties", {}))
        message = f"unknown field {quoted(str(path[-1]))}; allowed: {', '.join(known)}"
        return Problem(path, message, written=str(path[-1]), known=known)
    if path and path[-1] == "[key]":
        name, allowed = quoted(str(path[-2])), _PATTERNS[NAME_PATTERN]
        return Problem(path[:-1], f"found the name {name}; allowed: {allowed}")
    if kind == "missing" and isinstance(path[-1], str):
        return Problem(path, f"missing; wanted {_describe(_schema_at(path, whole))}")
    if kind == "missing":  # an item of a list of fixed length
        path = path[:-1]
    node, schema = source.find(path), _schema_at(path, whole)
    assert node is not None, "pydantic complains of a value, so the file has one"
    allowed = "a finite number" if kind == "finite_number" else _describe(schema)
    message = f"found {_found(node)}; allowed: {allowed}{_advice(node, schema)}"
    written = node.value if isinstance(node.value, str) else ""
    return Problem(path, message, written=written, known=tuple(schema.get("enum", ())))


def _found(node: Node) -> str:
    value = node.value
    if isinstance(value, dict):
        return f"a mapping with the fields {', '.join(map(quoted, list(value)[:5]))}"
    if isinstance(value, list):
        return f"a list of {len(value)}" if value else "an empty list"
    if isinstance(value, str):
        long = len(value) > _LONG_TEXT
        return f"a text of {len(value)} characters" if long else f"the text {quoted(value)}"
    return "nothing" if value is None else str(node.text)


def _advice(node: Node, schema: Schema) -> str:
    if schema.get("type") == "string" and isinstance(node.value, bool | int | float):
        return " (put it in quotes)" if "enum" not in schema else ""
    if schema.get("type") == "boolean" and isinstance(node.value, str):
        meant = _BOOLEAN_WORDS.get(node.value.lower())
        return f" (did you mean {meant}?)" if meant else ""
    return ""


def _plan_place(source: Source, path: FieldPath, found: dict[str, Any]) -> tuple[int, int]:
    """Return the position of a row, and of a strange character in it, of a plan drawn as a block.

    Args:
        source: what was read.
        path: the plan.
        found: ``number``, the row from 1, and perhaps ``character``, in quotes.
    """
    origin, rest = source.origin(path)
    line, column = origin.node.position(rest)
    plan = origin.node.find(rest)
    if plan is None or not plan.is_block:
        return line, column
    lines = origin.file.text.splitlines()
    row = line + found["number"] - 1
    indent = len(lines[row]) - len(lines[row].lstrip())
    strange = lines[row].find(found.get("character", "''")[1:-1], indent)
    return row + 1, max(strange, indent) + 1


@cache
def _whole(model: type[Part]) -> Schema:
    return model.model_json_schema()


def _resolved(schema: Schema, whole: Schema) -> Schema:
    """Follow references, and of "something or null" take the something."""
    while "$ref" in schema or "anyOf" in schema:
        if "$ref" in schema:
            name = schema["$ref"].removeprefix("#/$defs/")
            schema = whole["$defs"][name]
        else:
            schema = next(choice for choice in schema["anyOf"] if choice.get("type") != "null")
    return schema


def _schema_at(path: FieldPath, whole: Schema) -> Schema:
    """Return the schema of the field at ``path`` in a model's."""
    schema = _resolved(whole, whole)
    for part in path:
        if isinstance(part, int):
            fixed = schema.get("prefixItems")
            inner = fixed[part] if fixed else schema["items"]
        elif part in schema.get("properties", {}):
            inner = schema["properties"][part]
        elif "patternProperties" in schema:
            (inner,) = schema["patternProperties"].values()
        else:
            inner = schema["additionalProperties"]
        schema = _resolved(inner, whole)
    return schema


def _describe(schema: Schema) -> str:
    if "enum" in schema:
        return listed(schema["enum"])
    kind = schema["type"]
    if kind == "object" and "properties" in schema:
        return f"a mapping with the fields {', '.join(schema['properties'])}"
    if kind == "object":
        return "a mapping from names to what they stand for"
    if kind == "array":
        return _describe_list(schema)
    if kind == "string":
        longest = schema.get("maxLength")
        text = f"text of at most {longest} characters" if longest else "text"
        return _PATTERNS.get(schema.get("pattern", ""), text)
    if kind == "boolean":
        return "true or false"
    return f"a {'whole ' if kind == 'integer' else ''}number{_bounds(schema)}"


def _describe_list(schema: Schema) -> str:
    if "prefixItems" in schema:
        first, count = schema["prefixItems"][0], len(schema["prefixItems"])
        whole = "whole " if first["type"] == "integer" else ""
        return f"a list of {count} {whole}numbers{_bounds(first)}"
    if "maxItems" in schema:
        return f"a list of {schema['minItems']} to {schema['maxItems']} items"
    return "a list, each item after a '- '"


def _bounds(schema: Schema) -> str:
    if "minimum" in schema and "maximum" in schema:
        return f" from {schema['minimum']:g} to {schema['maximum']:g}"
    words = {
        "exclusiveMinimum": "greater than",
        "minimum": "of at least",
        "exclusiveMaximum": "less than",
        "maximum": "at most",
    }
    return " and".join(f" {word} {schema[key]:g}" for key, word in words.items() if key in schema)
