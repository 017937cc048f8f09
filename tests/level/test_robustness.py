"""Whatever a file holds, loading gives a level or a `LevelError`: never a traceback from inside."""

from __future__ import annotations

import contextlib
import copy
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roller_env.level import Level, LevelError, Problem, load_level, parse_level
from tests.level.samples import COMPLETE, SMALL
from tests.strategies import as_yaml, levels

SYNTAX = st.text("{}[]:,-&*!|>'\"#%@`?~<= \n\ta01.\\xu\0\x85\ufeff", max_size=60)
pytestmark = pytest.mark.filterwarnings("ignore::roller_env.level.LevelWarning")

COMPLETE_DATA = yaml.safe_load(COMPLETE)
PLACED_DATA = yaml.safe_load(SMALL) | yaml.safe_load("""\
prefabs:
  post: {parameters: {high: 30}, boxes: [{at: [5, 0, 15], size: [9, 9, $high], name: post}]}
  room:
    floors: [{corner: [0, 0, 0], cell: 64, plan: "#o"}]
    switches: [{at: [9, 9, 9], size: [1, 2, 3], sets: [fan]}]
    fans: [{at: [9, 9, 90], size: [1, 2, 3], force_n: [1, 2, 3], name: fan}]
    place: [{of: post, at: [1, 2, 3], yaw_deg: 30, parameters: {high: 9}}]
place:
  - {of: room, at: [900, 0, 0], yaw_deg: 90, name: east}
  - {pieces: {coins: [{at: [9, 0, 16]}]}, repeat: {count: 3, step: [9, 0, 0], turn_deg: 20}}
""")
JUNK: st.SearchStrategy[Any] = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.sampled_from([10**400, -1, 0, 1e-300, 5_000.1, "yes", "#", "ice", "first_person"])
    | st.floats()
    | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=6,
)


def loads_or_complains(text: str) -> None:
    """Load the text; a `LevelError` must say of every problem in which file it is."""
    problems: tuple[Problem, ...] = ()
    try:
        parse_level(text, "f")
    except LevelError as error:
        problems = error.problems
        said = str(error)
    assert all(str(problem).startswith("f:") for problem in problems)
    assert not problems or said.startswith("f:")


@settings(deadline=None)
@given(st.text() | SYNTAX)
def test_any_text_gives_a_level_or_a_level_error(text: str) -> None:
    loads_or_complains(text)


@settings(deadline=None)
@given(SYNTAX, st.integers(0, len(COMPLETE)))
def test_syntax_put_anywhere_into_a_level_gives_a_level_or_a_level_error(
    text: str, where: int
) -> None:
    loads_or_complains(COMPLETE[:where] + text + COMPLETE[where:])


@settings(deadline=None)
@given(st.text(st.characters(), max_size=20))
def test_even_half_characters_give_a_level_or_a_level_error(text: str) -> None:
    loads_or_complains(SMALL + text)


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary() | SYNTAX.map(str.encode))
def test_any_bytes_give_a_level_or_a_level_error(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "any.yaml"
    path.write_bytes(data)
    with contextlib.suppress(LevelError):
        assert isinstance(load_level(path), Level)


def paths_of(data: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the path of every value in plain data."""
    if not isinstance(data, dict | list):
        return [path]
    items = data.items() if isinstance(data, dict) else enumerate(data)
    return [path, *(inner for key, value in items for inner in paths_of(value, (*path, key)))]


@settings(deadline=None)
@given(st.data(), st.sampled_from([COMPLETE_DATA, PLACED_DATA]))
def test_a_level_with_junk_at_any_field_gives_a_level_or_a_level_error(
    data: st.DataObject, sound: dict[str, Any]
) -> None:
    level: Any = copy.deepcopy(sound)
    *outer, last = data.draw(st.sampled_from([path for path in paths_of(level) if path]))
    parent: Any = level
    for part in outer:
        parent = parent[part]
    change = data.draw(st.sampled_from(["delete", "replace", "rename", "repeat"]))
    if change == "replace":
        parent[last] = data.draw(JUNK)
    elif change == "repeat" and isinstance(parent, list):
        parent.insert(last, parent[last])
    else:
        value = parent.pop(last)
        if change == "rename" and isinstance(parent, dict):
            parent[data.draw(st.text(max_size=8))] = value
    loads_or_complains(yaml.safe_dump(level, allow_unicode=True))


@settings(deadline=None)
@given(st.data())
def test_a_level_with_lines_missing_or_twice_gives_a_level_or_a_level_error(
    data: st.DataObject,
) -> None:
    lines = COMPLETE.splitlines()
    chosen = data.draw(st.sets(st.integers(0, len(lines) - 1), max_size=3))
    for index in sorted(chosen, reverse=True):
        lines[index : index + 1] = data.draw(st.sampled_from([[], [lines[index]] * 2]))
    loads_or_complains("\n".join(lines))


@settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.too_slow])
@given(levels())
def test_a_random_level_is_sound_and_says_the_same_as_a_file_in_either_unit(level: Level) -> None:
    assert load_level(level) is level
    assert parse_level(as_yaml(level, "metre")) == level
    in_quants = parse_level(as_yaml(level, "quant"))
    assert nearly(in_quants.model_dump()) == level.model_dump()


def nearly(data: Any) -> Any:
    """Return the data with every number standing for all numbers within rounding of it."""
    if isinstance(data, float):
        return pytest.approx(data, rel=1e-12, abs=1e-12)
    if isinstance(data, dict):
        return {key: nearly(value) for key, value in data.items()}
    if isinstance(data, tuple | list):
        return type(data)(nearly(value) for value in data)
    return data
