"""The JSON Schema beside the levels: current, and of one mind with the loader."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest
import yaml
from hypothesis import HealthCheck, given, settings

from roller_env.level import Level, level_json_schema, levels_directory, shipped_levels
from tests.level.samples import COMPLETE, SMALL
from tests.level.test_robustness import PLACED_DATA
from tests.strategies import as_yaml, levels

VALIDATOR = jsonschema.Draft7Validator(level_json_schema())


def objections(text: str) -> list[str]:
    return [error.json_path for error in VALIDATOR.iter_errors(yaml.safe_load(text))]


def test_the_written_schema_is_current() -> None:
    written = (levels_directory() / "level.schema.json").read_text(encoding="utf-8")
    assert json.loads(written) == level_json_schema(), "run scripts/export_schema.py"


def test_the_script_writes_the_schema(tmp_path: Path) -> None:
    output = tmp_path / "schema.json"
    script = Path(__file__).parents[2] / "scripts" / "export_schema.py"
    subprocess.run([sys.executable, str(script), "--output", str(output)], check=True)
    assert output.read_bytes() == (levels_directory() / "level.schema.json").read_bytes()


def test_the_schema_is_itself_well_formed() -> None:
    jsonschema.Draft7Validator.check_schema(level_json_schema())


def test_editors_accept_what_the_loader_accepts() -> None:
    assert objections(SMALL) == []
    assert objections(COMPLETE) == []
    assert objections(yaml.safe_dump(PLACED_DATA)) == []
    for name in shipped_levels():
        text = (levels_directory() / f"{name}.yaml").read_text(encoding="utf-8")
        assert objections(text) == []


@settings(deadline=None, max_examples=20, suppress_health_check=[HealthCheck.too_slow])
@given(levels())
def test_editors_accept_every_valid_level(level: Level) -> None:
    assert objections(as_yaml(level, "quant")) == []


@pytest.mark.parametrize(
    ("line", "path"),
    [
        ("colour: 3", "$"),
        ("gravity: 0", "$.gravity"),
        ("units: inch", "$.units"),
        ("ball: {radius: '3'}", "$.ball.radius"),
        ("coins: [{}]", "$.coins[0]"),
        ("coins: [{at: [1, 2]}]", "$.coins[0].at"),
        ("materials: {ice: {colour: red}}", "$.materials.ice.colour"),
        ("place: [{of: a, repeat: {count: 0}}]", "$.place[0].repeat"),
        ("prefabs: {a: {boxs: []}}", "$.prefabs.a"),
        ("prefabs: {a: {boxes: [{att: 0}]}}", "$.prefabs.a.boxes[0]"),
        ("camera_triggers: [{kind: over, at: [0, 0, 0]}]", "$.camera_triggers[0].kind"),
    ],
)
def test_editors_underline_what_the_loader_refuses(line: str, path: str) -> None:
    text = SMALL.replace("units: quant\n", "") + line + "\n"
    assert path in " ".join(objections(text))


def test_every_piece_is_described_to_the_one_who_writes_it() -> None:
    schema = level_json_schema()
    assert all("description" in piece for piece in schema["$defs"].values())
    assert "enum" in schema["properties"]["units"]
