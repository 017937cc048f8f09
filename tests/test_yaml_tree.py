"""The one reader of YAML: the same with and without libyaml, and never long at work."""

from __future__ import annotations

import contextlib
import time

import pytest
import yaml
from hypothesis import given, settings

from roller_env import yaml_tree
from roller_env.level import levels_directory, shipped_levels
from roller_env.problems import MAX_PROBLEMS
from roller_env.yaml_tree import MAX_BYTES, Node, YamlError, read_tree, read_value
from tests.strategies import as_yaml, levels


def read_with(loader: type, text: str) -> Node | tuple[tuple[int | None, int | None], ...]:
    """Return the tree, or where the problems are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(yaml_tree, "_LOADER", loader)
        try:
            return read_tree(text, "file.yaml")
        except YamlError as error:
            return tuple((problem.line, problem.column) for problem in error.problems)


def same_in_both(text: str) -> None:
    assert read_with(yaml.CSafeLoader, text) == read_with(yaml.SafeLoader, text)


def test_a_shipped_level_is_the_same_tree_with_the_same_places_without_libyaml() -> None:
    for name in shipped_levels():
        same_in_both((levels_directory() / f"{name}.yaml").read_text(encoding="utf-8"))


@settings(deadline=None, max_examples=15)
@given(levels())
def test_any_level_is_the_same_tree_without_libyaml(level: object) -> None:
    same_in_both(as_yaml(level))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "text",
    [
        "a: 'ä€😀'  # ö\nb: [1, {c: ~}]\n",
        "a: |\n  x\n\n  y\nb: >-\n  one\n  two\nc: &anchor\n  - d\nd: *anchor\n",
        "? a\n: b\n\"c\": 'd'\ne:\n",
        "---\na: 1\n...\n",
        "a: 1\na: 2\n<<: 3\n[b]: 4\nc: !!int 5\n",
    ],
)
def test_every_kind_of_value_has_the_same_place_without_libyaml(text: str) -> None:
    same_in_both(text)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2026-11-26", "2026-11-26"),
        ("12:30", "12:30"),
        ("yes", "yes"),
        ("0x10", "0x10"),
        ("1e3", 1000.0),
        ("18446744073709551615", 2**64 - 1),
        ("9" * 5000, float("inf")),
        ("[1, {a: ~}]", [1, {"a": None}]),
    ],
)
def test_a_value_is_what_yaml_1_2_says(text: str, value: object) -> None:
    assert read_value(text, "--set").plain() == value


def test_a_character_that_cannot_begin_a_text_is_named() -> None:
    with pytest.raises(YamlError, match=r"^f:1:4: .* no text without quotes can begin with '@'"):
        read_tree("a: @b", "f")


def test_faults_are_counted_up_to_a_thousand() -> None:
    with pytest.raises(YamlError) as caught:
        read_tree("a:\n" * 5000, "f")
    assert len(caught.value.problems) == MAX_PROBLEMS + 1
    assert str(caught.value.problems[-1]).endswith("this much is wrong; the rest was not read")


BOX = "- {at: [0, 0, -0.1], size: [20, 20, 0.2]}\n"
LONG = {
    "boxes": "boxes:\n" + BOX * (MAX_BYTES // len(BOX) - 1),
    "numbers": "a: [" + "0," * 520_000 + "]",
    "empty lists": "a: [" + "[]," * 340_000 + "]",
    "fields": "".join(f"{number:x}:\n" for number in range(140_000)),
    "repeated fields": "a:\n" * 340_000,
    "tags": "a: [" + "!b 0," * 200_000 + "]",
    "lists as keys": "[a]: 0\n" * 140_000,
    "aliases": "x: &a 0\ny: [" + "*a," * 340_000 + "]",
    "anchors": "a: [" + "&a 0," * 200_000 + "]",
    "opened and never closed": "[" * 1_000_000,
    "dashes": "- " * 500_000,
    "a whole number": "a: " + "1" * 1_000_000,
    "a fraction": "a: 1." + "1" * 1_000_000,
    "a text": "a: '" + "x" * 1_000_000 + "'",
    "escapes": 'a: "' + "\\n" * 500_000 + '"',
    "lines": "a: |\n" + " x\n" * 340_000,
}


@pytest.mark.parametrize("text", LONG.values(), ids=LONG)
def test_a_mebibyte_of_anything_is_read_or_refused_in_two_seconds(text: str) -> None:
    assert len(text) <= MAX_BYTES
    begin = time.process_time()
    with contextlib.suppress(YamlError):
        read_tree(text, "long.yaml")
    assert time.process_time() - begin < 2.0
