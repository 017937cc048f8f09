"""docs/levels.md: every example in it works as it says, and it leaves no field out."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from roller_env.level import LevelError, level_json_schema, parse_level
from scripts import level_tables

DOCS = Path(__file__).parents[2] / "docs" / "levels.md"
TEXT = DOCS.read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```([a-z ]+)\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
EXAMPLES = [body for kind, body in BLOCKS if kind == "yaml"]
BROKEN = [
    (body, BLOCKS[index + 1][1]) for index, (kind, body) in enumerate(BLOCKS) if "broken" in kind
]
LEFT_OUT = {
    "name": "name: example",
    "units": "units: quant",
    "start": "start: {at: [0, 0, 5000]}",
    "finish": "finish: {at: [0, 900, 5000], size: [1, 1, 1]}",
}


def completed(example: str) -> str:
    """Return the example with what the page says the examples leave out."""
    written = re.findall(r"^([a-z_]+):", example, re.MULTILINE)
    return "\n".join([*(line for key, line in LEFT_OUT.items() if key not in written), example])


def test_the_page_has_the_examples_that_the_tests_below_are_about() -> None:
    assert len(EXAMPLES) >= 10
    assert len(BROKEN) == 2


@pytest.mark.filterwarnings("ignore::roller_env.level.LevelWarning")  # most have no ground
@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_loads(example: str) -> None:
    assert parse_level(completed(example)).name in ("example", "hello", "hop")


def test_the_first_example_is_a_whole_level() -> None:
    assert parse_level(EXAMPLES[0]).name == "hello"


@pytest.mark.parametrize(("example", "printed"), BROKEN)
def test_every_broken_example_says_what_the_page_prints(example: str, printed: str) -> None:
    with pytest.raises(LevelError) as caught:
        parse_level(example, "oops.yaml")
    assert str(caught.value) + "\n" == printed


def test_the_python_examples_run(tmp_path: Path) -> None:
    (tmp_path / "hello.yaml").write_text(EXAMPLES[0], encoding="utf-8")
    programs = [body + "print(level.name)\n" for kind, body in BLOCKS if kind == "python"]
    run = subprocess.run(
        [sys.executable, "-c", "".join(programs)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(DOCS.parents[1])},
        check=True,
        capture_output=True,
        text=True,
    )
    assert run.stdout.split() == ["hello", *2 * ["generated-v2-7-200"], "plank"]


def test_the_tables_are_what_the_models_say() -> None:
    assert level_tables.written(TEXT) == TEXT, "run scripts/level_tables.py"


def test_every_model_of_a_level_has_a_table() -> None:
    wanted = {"Level", *level_json_schema()["$defs"]}
    assert level_tables.tables(TEXT) == wanted, "add a table of it, and run scripts/level_tables.py"


def test_every_field_is_described() -> None:
    for name in level_tables.tables(TEXT):
        for line in level_tables.table(name).split("\n")[3:]:
            assert not line.endswith("|  |"), f"{name}: {line}"


def test_the_script_writes_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "levels.md"
    page.write_text(TEXT.replace("| needed |", "| |"), encoding="utf-8")
    monkeypatch.setattr(level_tables, "PAGE", page)
    level_tables.main()
    assert page.read_text(encoding="utf-8") == TEXT


def test_the_worked_example_of_a_piece_is_its_module() -> None:
    root = DOCS.parents[1]
    section = (root / "CONTRIBUTING.md").read_text(encoding="utf-8").split("## Adding a piece")[1]
    module = (root / "roller_env" / "pieces" / "lift_pad.py").read_text(encoding="utf-8")
    code = {line.strip() for line in module.splitlines()}
    shown = "".join(re.findall(r"```python\n(.*?)```", section.split("\n## ")[0], re.DOTALL))
    assert {line.strip() for line in shown.splitlines()} - code == {"..."}
