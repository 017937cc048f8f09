"""Loading: what a good file gives, and what each kind of bad file says."""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import time
from pathlib import Path

import pytest
import yaml
from pydantic import BaseModel

from roller_env.level import (
    LevelError,
    levels_directory,
    load_level,
    parse_level,
    shipped_levels,
)
from roller_env.problems import MAX_PROBLEMS
from roller_env.units import quants
from roller_env.yaml_tree import MAX_BYTES
from tests.level.samples import COMPLETE, SMALL, small_level


def complaints(text: str) -> list[str]:
    """Return what is printed for a broken file called f, one string a problem, without the f:."""
    with pytest.raises(LevelError) as caught:
        parse_level(text, "f")
    lines = str(caught.value).splitlines()
    assert [str(problem) for problem in caught.value.problems] == lines
    return [line.removeprefix("f:") for line in lines]


def test_lengths_in_quants_become_metres() -> None:
    level = parse_level(SMALL)
    assert level.units == "metre"
    assert level.start.at == (0.0, 0.0, quants(16.0))
    assert level.boxes[0].size == (quants(800), quants(400), quants(16))


def test_metres_are_the_unit_of_a_file_that_names_none() -> None:
    text = SMALL.replace("units: quant\n", "")
    assert parse_level(text).boxes[0].size == (800.0, 400.0, 16.0)


def test_what_a_file_leaves_out_is_the_same_in_either_unit() -> None:
    in_metres = small_level()
    in_quants = parse_level(SMALL)
    assert in_quants.ball == in_metres.ball
    assert in_quants.gravity == in_metres.gravity == pytest.approx(9.8044)
    assert in_quants.kill_height == in_metres.kill_height


def test_forces_times_angles_and_materials_are_not_scaled() -> None:
    level = parse_level(COMPLETE)
    assert level.lift_pads[0].force_n == 12.7
    assert level.lift_pads[0].duration_s == 5.0
    assert level.time_limit_s == 90.0
    assert level.tubes[0].opening is not None
    assert level.tubes[0].opening.width_deg == 60.0
    assert level.materials["ice"].friction == 0.1
    assert level.plates[0].speed == quants(1.6)


def test_numbers_are_read_as_editors_read_them() -> None:
    level = parse_level(SMALL.replace("[800, 400, 16]", "[8e2, +4.0e+2, 016]"))
    assert level.boxes[0].size == (quants(800), quants(400), quants(16))


def test_an_anchor_and_its_aliases_give_the_same_value() -> None:
    text = SMALL + "ramps:\n" + "  - {start: &a [900, 0, 0], end: [990, 0, 9], width: &w 64}\n"
    level = parse_level(text + "  - {start: [990, 0, 9], end: *a, width: *w}\n")
    assert level.ramps[0].start == level.ramps[1].end
    assert level.ramps[1].width == quants(64)


def test_keys_of_a_legend_may_look_like_numbers_or_nothing() -> None:
    text = (
        SMALL + 'floors:\n  - {corner: [0, 900, 0], cell: 9, plan: "1~#", legend: {1: {}, ~: {}}}'
    )
    assert set(parse_level(text).floors[0].legend) == {"1", "~"}


def test_a_level_object_is_checked_and_returned() -> None:
    level = small_level()
    assert load_level(level) is level


def test_a_bad_level_object_is_refused_by_its_field_without_a_line() -> None:
    with pytest.raises(LevelError) as caught:
        load_level(small_level(coins=[{"at": (1.0, 0.0, -90.0)}]))
    (problem,) = caught.value.problems
    assert problem.path == ("coins", 0)
    assert problem.line is None
    assert str(problem).startswith("coins[0]: the coin at [1, 0, -90] is not above the kill height")


def test_every_shipped_level_loads_by_name_and_by_path() -> None:
    for name in shipped_levels():
        path = levels_directory() / f"{name}.yaml"
        assert load_level(name) == load_level(path) == load_level(str(path))
        assert load_level(name).name == name


def test_every_shipped_level_tells_editors_its_schema() -> None:
    for name in shipped_levels():
        text = (levels_directory() / f"{name}.yaml").read_text(encoding="utf-8")
        assert text.startswith("# yaml-language-server: $schema=level.schema.json\n")


def test_a_file_is_found_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(SMALL, encoding="utf-8")
    assert load_level(path) == load_level(str(path)) == parse_level(SMALL)


def test_a_byte_order_mark_is_no_problem(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(SMALL, encoding="utf-8-sig")
    assert load_level(path) == parse_level(SMALL)


def test_an_unknown_name_is_told_the_names_there_are() -> None:
    with pytest.raises(LevelError, match=r"no level is called 'qqq'; .*paths end in \.yaml$"):
        load_level("qqq")
    for name in shipped_levels():
        with pytest.raises(LevelError, match=rf"did you mean '{name}'\?\)$"):
            load_level(f"{name}s")


def test_a_missing_file_gets_the_nearest_one_beside_it(tmp_path: Path) -> None:
    (tmp_path / "tower.yaml").write_text(SMALL, encoding="utf-8")
    missing = tmp_path / "towr.yaml"
    with pytest.raises(LevelError) as caught:
        load_level(missing)
    assert str(caught.value) == f"{missing}: there is no such file (did you mean 'tower.yaml'?)"


@pytest.mark.parametrize("name", ["a\0b.yaml", "x" * 5000 + ".yaml", "/", "."])
def test_a_path_that_cannot_be_a_file_is_a_level_error(name: str) -> None:
    with pytest.raises(LevelError):
        load_level(name if name != "." else Path(name))


def test_a_pipe_as_a_level_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(pipe := tmp_path / "pipe.yaml")
    with pytest.raises(LevelError) as caught:
        load_level(pipe)
    assert str(caught.value) == f"{pipe}: it cannot be read: found a pipe; wanted a regular file"


def test_bytes_that_are_not_utf_8_are_placed(tmp_path: Path) -> None:
    path = tmp_path / "latin.yaml"
    path.write_bytes(SMALL.encode() + "title: Größe\n".encode("latin-1"))
    with pytest.raises(LevelError) as caught:
        load_level(path)
    wanted = f"{path}:7:10: found the byte 0xf6, which is not UTF-8; save it as UTF-8"
    assert str(caught.value) == wanted


PIECES = {
    "boxes": "".join(
        f"- {{at: [{n % 140}, {n // 140}, -1], size: [1, 1, 1]}}\n" for n in range(19_000)
    ),
    "numbers": "- 0\n" * 120_000,
    "wrong boxes": "- {at: [a, b, -1], size: [1, 1, q]}\n" * 19_000,
}


@pytest.mark.parametrize("boxes", PIECES.values(), ids=PIECES)
def test_a_mebibyte_of_level_is_loaded_or_refused_in_two_seconds(boxes: str) -> None:
    text = "name: t\nstart: {at: [0, 0, 1]}\nfinish: {at: [5, 0, 2], size: [1, 1, 1]}\nboxes:\n"
    begin = time.process_time()
    with contextlib.suppress(LevelError):
        assert len(parse_level(text + boxes).boxes) == 19_000
    assert time.process_time() - begin < 2.0


def test_of_thousands_of_wrong_fields_the_first_are_told() -> None:
    with pytest.raises(LevelError) as caught:
        parse_level(SMALL + "plates:\n" + "- 0\n" * 5_000)
    assert len(caught.value.problems) == MAX_PROBLEMS + 1
    assert caught.value.problems[-1].message == "4000 more fields are wrong"


def test_a_file_may_be_one_mebibyte_and_no_more(tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    path.write_text(SMALL + "#" * (MAX_BYTES - len(SMALL)), encoding="utf-8")
    load_level(path)
    path.write_text(SMALL + "#" * (MAX_BYTES - len(SMALL) + 1), encoding="utf-8")
    with pytest.raises(LevelError, match="too large; allowed are at most 1048576 bytes"):
        load_level(path)
    with pytest.raises(LevelError, match="allowed are at most 1048576"):
        parse_level(path.read_text(encoding="utf-8"))


EMPTY = "1:1: the file is empty; wanted a mapping of fields, such as 'name: tower'"
BROKEN_SYNTAX = {
    "empty": ("", [EMPTY]),
    "only a comment": (
        "# none\n",
        [EMPTY],
    ),
    "nothing": (
        "---\n...\n",
        ["2:1: found nothing; wanted a mapping of fields, such as 'name: tower'"],
    ),
    "list": (
        "- name: a\n",
        ["1:1: found a list; wanted a mapping of fields, such as 'name: tower'"],
    ),
    "text": (
        "classic\n",
        ["1:1: found only 'classic'; wanted a mapping of fields, such as 'name: tower'"],
    ),
    "two documents": (
        SMALL + "---\nname: other\n",
        ["7:1: a second document starts here; wanted one only"],
    ),
    "tab": (
        SMALL + "route:\n\tradius: 3\n",
        ["8:1: not valid YAML: found a tab; indent with spaces"],
    ),
    "open bracket": (
        SMALL + "route: [\n",
        ["8:1: not valid YAML: did not find expected node content (while parsing a flow node)"],
    ),
    "colon in text": (
        SMALL + "title: One: two\n",
        [
            "7:11: not valid YAML: found ': ' where no field can start; put text that contains "
            "': ' into quotes, and begin a list or a mapping on its own line"
        ],
    ),
    "NUL": (
        SMALL + "title: a\0b\n",
        ["7:9: found the character U+0000; allowed is printable text"],
    ),
    "bad escape": (
        SMALL + 'title: "\\UFFFFFFFF"\n',
        [
            "7:11: not valid YAML: found an escape that stands for no character; write the "
            "character itself"
        ],
    ),
    "half a character": (
        SMALL + 'title: "\\ud800"\n',
        [
            "7:11: not valid YAML: found an escape that stands for no character; write the "
            "character itself"
        ],
    ),
    "repeated field": (
        SMALL + "boxes: []\n",
        ["7:1: boxes: given twice, first on line 5; keep one of the two"],
    ),
    "repeated field of a piece": (
        SMALL + "ball:\n  radius: 1\n  radius: 2\n",
        ["9:3: ball.radius: given twice, first on line 8; keep one of the two"],
    ),
    "merge key": (
        SMALL + "ball:\n  <<: {radius: 3}\n",
        ["8:3: ball: merge keys ('<<') are not supported; write the fields out"],
    ),
    "list as a key": (
        SMALL + "[a]: 3\n",
        ["7:1: found a list as the name of a field; wanted text"],
    ),
    "python object": (
        SMALL + 'title: !!python/object/apply:os.system ["true"]\n',
        [
            "7:8: title: found the tag '!!python/object/apply:os.system'; only plain "
            "values are read: remove it"
        ],
    ),
    "alias of nothing": (
        SMALL + "ball: *b\n",
        ["7:7: the alias '*b' repeats nothing; write '&b' before what it repeats"],
    ),
    "alias of itself": (
        SMALL + "coins: &c [*c]\n",
        ["7:12: the alias '*c' stands inside what it repeats"],
    ),
    "deep": (SMALL + "ball: " + "[" * 40 + "]" * 40, ["7:38: nested more than 32 levels deep"]),
}


@pytest.mark.parametrize(("text", "wanted"), BROKEN_SYNTAX.values(), ids=BROKEN_SYNTAX)
def test_broken_yaml_is_placed_and_explained(text: str, wanted: list[str]) -> None:
    assert complaints(text) == wanted


CELLS = "floors:\n  - corner: [0, 600, 0]\n    cell: 64\n    plan: |\n"

BROKEN_FIELDS = {
    "unknown field with a near one": (
        SMALL + "materials:\n  ice:\n    colur: red\n",
        [
            "9:5: materials.ice.colur: unknown field 'colur'; allowed: friction, elasticity, "
            "colour, pattern (did you mean 'colour'?)"
        ],
    ),
    "unknown field like no other": (
        SMALL + "ball: {xyz: 1}\n",
        ["7:8: ball.xyz: unknown field 'xyz'; allowed: radius, mass_kg, friction, elasticity"],
    ),
    "missing field": (
        SMALL.replace("start: {at: [0, 0, 16]}\n", ""),
        ["1:1: start: missing; wanted a mapping with the fields at, jitter"],
    ),
    "missing field of a piece": (
        SMALL + "gates:\n  - {name: door, at: [0, 0, 32]}\n",
        ["8:5: gates[0].size: missing; wanted a list of 3 numbers greater than 0"],
    ),
    "unknown word": (
        SMALL.replace("quant\n", "quants\n"),
        ["2:8: units: found the text 'quants'; allowed: 'metre', 'quant' (did you mean 'quant'?)"],
    ),
    "yes for a number": (
        SMALL + "gravity: yes\n",
        ["7:10: gravity: found the text 'yes'; allowed: a number greater than 0"],
    ),
    "true for a number": (
        SMALL + "gravity: true\n",
        ["7:10: gravity: found true; allowed: a number greater than 0"],
    ),
    "true for a whole number": (
        SMALL + "coins: [{line: {start: [0, 0, 9], end: [9, 0, 9], count: true}}]\n",
        ["7:58: coins[0].line.count: found true; allowed: a whole number from 2 to 10000"],
    ),
    "a fraction for a whole number": (
        SMALL + "coins: [{line: {start: [0, 0, 9], end: [9, 0, 9], count: 2.5}}]\n",
        ["7:58: coins[0].line.count: found 2.5; allowed: a whole number from 2 to 10000"],
    ),
    "text for a number": (
        SMALL + "time_limit_s: '60'\n",
        [
            "7:15: time_limit_s: found the text '60'; allowed: a number greater than 0 "
            "and at most 86400"
        ],
    ),
    "number for text": (
        SMALL + "title: 12\n",
        ["7:8: title: found 12; allowed: text of at most 80 characters (put it in quotes)"],
    ),
    "yes for true": (
        SMALL + CELLS + "      #\n    legend: {W: {coin: yes}}\n",
        [
            "12:24: floors[0].legend.W.coin: found the text 'yes'; allowed: true or false "
            "(did you mean true?)"
        ],
    ),
    "not a number": (
        SMALL + "kill_height: .nan\n",
        ["7:14: kill_height: found .nan; allowed: a finite number"],
    ),
    "infinite": (
        SMALL + "kill_height: -.inf\n",
        ["7:14: kill_height: found -.inf; allowed: a finite number"],
    ),
    "overflowing": (
        SMALL + "kill_height: 1e999\n",
        ["7:14: kill_height: found 1e999; allowed: a finite number"],
    ),
    "a huge whole number": (
        SMALL + f"kill_height: {10**30}\n",
        ["7:14: kill_height: a length of 1e+30 is out of this world; allowed is -196850 to 196850"],
    ),
    "a vanishing size": (
        SMALL + "ball: {radius: 1e-300}\n",
        ["7:16: ball.radius: 1e-300 is too small to matter; allowed is 0.0394 or more"],
    ),
    "negative size": (
        SMALL + "ball: {radius: -3}\n",
        ["7:16: ball.radius: found -3; allowed: a number greater than 0"],
    ),
    "two numbers for three": (
        SMALL.replace("[0, 0, 16]", "[0, 16]"),
        ["3:13: start.at: found a list of 2; allowed: a list of 3 numbers"],
    ),
    "four numbers for three": (
        SMALL.replace("[0, 0, 16]", "[0, 0, 0, 16]"),
        ["3:13: start.at: found a list of 4; allowed: a list of 3 numbers"],
    ),
    "mapping for a list": (
        SMALL + "ramps: {start: [0, 0, 0]}\n",
        [
            "7:8: ramps: found a mapping with the fields 'start'; allowed: a list, "
            "each item after a '- '"
        ],
    ),
    "nothing for a list": (
        SMALL + "ramps:\n",
        ["7:7: ramps: found nothing; allowed: a list, each item after a '- '"],
    ),
    "an unquoted colour is a comment": (
        SMALL + "materials:\n  ice:\n    colour: #aabbcc\n",
        [
            "9:12: materials.ice.colour: found nothing; allowed: a colour '#rrggbb' or "
            "'#rrggbbaa' in quotes"
        ],
    ),
    "bad name": (
        SMALL.replace("name: small", "name: 2 fast"),
        [
            "1:7: name: found the text '2 fast'; allowed: a letter, then letters, digits, "
            "'_' or '-', at most 64 in all"
        ],
    ),
    "bad name of a material": (
        SMALL + "materials:\n  blue ice: {}\n",
        [
            "8:3: materials['blue ice']: found the name 'blue ice'; allowed: a letter, then "
            "letters, digits, '_' or '-', at most 64 in all"
        ],
    ),
    "route of one point": (
        SMALL + "route: {points: [[0, 0, 0]]}\n",
        ["7:17: route.points: found a list of 1; allowed: a list of 2 to 1000 items"],
    ),
    "coins of two shapes": (
        SMALL + "coins:\n  - {at: [0, 0, 9], arc: {centre: [0, 0, 9], radius: 9, from_deg: 0, "
        "to_deg: 9, count: 2}}\n",
        ["8:5: coins[0]: give exactly one of at, line, arc, grid; found at, arc"],
    ),
    "ragged plan": (
        SMALL + CELLS + "      ###\n\n      ##\n",
        [
            "13:7: floors[0].plan: row 3 of the plan has 2 characters, others have 3; "
            "draw empty cells as '.'"
        ],
    ),
    "unknown cell": (
        SMALL + CELLS + "      ###\n      #x#\n",
        [
            "12:8: floors[0].plan: row 2 of the plan has 'x', which is not in the legend; "
            "known are . # o"
        ],
    ),
    "a plan on one line": (
        SMALL + "floors:\n  - {corner: [0, 600, 0], cell: 64, plan: '#x'}\n",
        [
            "8:43: floors[0].plan: row 1 of the plan has 'x', which is not in the legend; "
            "known are . # o"
        ],
    ),
    "a plan repeated without its legend": (
        SMALL + CELLS.replace("plan: |", "plan: &p |") + "      #\n      x\n    legend: {x: {}}\n"
        "  - {corner: [0, 900, 0], cell: 64, plan: *p}\n",
        [
            "14:43: floors[1].plan: row 2 of the plan has 'x', which is not in the legend; "
            "known are . # o"
        ],
    ),
    "trigger without a size": (
        SMALL + "camera_triggers:\n  - {kind: overhead, at: [0, 0, 0]}\n",
        ["8:5: camera_triggers[0]: a trigger of kind overhead needs a size"],
    ),
    "three at once, in the order of the file": (
        "name: 3\nunits: quant\nstart: {att: [0, 0, 16]}\nfinish: {at: [], size: [1, 1, 1]}\n",
        [
            "1:7: name: found 3; allowed: a letter, then letters, digits, '_' or '-', "
            "at most 64 in all (put it in quotes)",
            "3:8: start.at: missing; wanted a list of 3 numbers",
            "3:9: start.att: unknown field 'att'; allowed: at, jitter (did you mean 'at'?)",
            "4:14: finish.at: found an empty list; allowed: a list of 3 numbers",
        ],
    ),
}


@pytest.mark.parametrize(("text", "wanted"), BROKEN_FIELDS.values(), ids=BROKEN_FIELDS)
def test_a_broken_field_is_placed_and_explained(text: str, wanted: list[str]) -> None:
    assert complaints(text) == wanted


BROKEN_MEANING = {
    "unknown material": (
        SMALL + "materials: {ice: {}}\nwalls:\n"
        "  - {start: [0, 90], end: [90, 90], bottom: 0, height: 9, material: iced}\n",
        [
            "9:69: walls[0].material: no material is called 'iced'; there are 'ice', 'default', "
            "'glass' (did you mean 'ice'?)"
        ],
    ),
    "unknown gate": (
        SMALL + "gates:\n  - {name: door, at: [300, 0, 32], size: [8, 99, 64]}\n"
        "plates:\n  - {name: a, at: [99, 0, 70], size: [32, 32, 20], opens: [door, dor]}\n",
        [
            "10:66: plates[0].opens[1]: nothing that can be told is called 'dor'; there are 'door' "
            "(did you mean 'door'?)"
        ],
    ),
    "start in the finish": (
        SMALL.replace("[500, 0, 16]", "[20, 0, 16]"),
        [
            "3:13: start.at: the ball, of radius 16 quants, would start in the finish; wanted "
            "outside, at least its radius away"
        ],
    ),
    "finish in a solid": (
        SMALL.replace("[500, 0, 16], size: [32, 32, 32]", "[500, 0, -8], size: [8, 8, 8]"),
        ["4:14: finish.at: the finish is wholly inside boxes[0], where no ball can reach it"],
    ),
    "several, in the order of the file": (
        SMALL.replace("16]}", "4]}").replace("[500, 0, 16]", "[500, 0, -1129]"),
        [
            "3:13: start.at: the ball, of radius 16 quants, would start inside boxes[0]; wanted "
            "free space around it (on a floor: one radius over its upper face)",
            "4:14: finish.at: the finish is at the height -1129 quants; wanted above the kill "
            "height, -1129 quants",
        ],
    ),
}


@pytest.mark.parametrize(("text", "wanted"), BROKEN_MEANING.values(), ids=BROKEN_MEANING)
def test_a_broken_meaning_is_placed_and_explained(text: str, wanted: list[str]) -> None:
    assert complaints(text) == wanted


def test_a_fault_inside_an_alias_is_placed_where_it_is_written() -> None:
    text = SMALL + "coins:\n  - at: &p [1, 2, x]\n  - at: *p\n"
    assert complaints(text) == [
        "8:19: coins[0].at[2]: found the text 'x'; allowed: a number",
        "8:19: coins[1].at[2]: found the text 'x'; allowed: a number",
    ]


def test_aliases_that_explode_are_refused_before_they_do() -> None:
    bomb = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    for level in range(1, 12):
        aliases = ", ".join([f"*a{level - 1}"] * 9)
        bomb.append(f"a{level}: &a{level} [{aliases}]")
    (complaint,) = complaints("\n".join(bomb))
    assert complaint.endswith("more than 250000 values, counting what aliases repeat")


def test_aliases_cannot_nest_deeper_than_lists_may() -> None:
    links = ["a0: &a0 [1]"] + [f"a{i}: &a{i} [*a{i - 1}]" for i in range(1, 40)]
    (complaint,) = complaints("\n".join(links))
    assert complaint.endswith("the alias '*a29' nests more than 32 levels deep")


def test_thousands_of_problems_are_all_kept_and_fifty_printed() -> None:
    text = SMALL + "coins:\n" + "  - {att: [0, 0, 0]}\n" * 1_000
    with pytest.raises(LevelError) as caught:
        parse_level(text)
    assert len(caught.value.problems) == 1_000
    lines = str(caught.value).splitlines()
    assert len(lines) == 51
    assert lines[-1] == "... and 950 more problems"


def test_a_level_error_survives_the_way_between_processes() -> None:
    with pytest.raises(LevelError) as caught:
        parse_level(SMALL + "colour: 3\n")
    again = pickle.loads(pickle.dumps(caught.value))
    assert isinstance(again, LevelError)
    assert again.problems == caught.value.problems
    assert str(again) == str(caught.value)


def unset_fields(piece: object, path: str) -> set[str]:
    """Return the fields that a loaded piece, or each of a list of pieces, leaves out."""
    if isinstance(piece, tuple):
        return set.intersection(*(unset_fields(item, path) for item in piece)) if piece else set()
    if not isinstance(piece, BaseModel):
        return set()
    left_out = {
        f"{path}.{name}" for name in type(piece).model_fields.keys() - piece.model_fields_set
    }
    return left_out.union(*(unset_fields(value, f"{path}.{name}") for name, value in piece))


def test_the_complete_sample_sets_every_field_there_is() -> None:
    assert unset_fields(parse_level(COMPLETE), "level") == set()


def test_a_file_that_pyyaml_writes_reads_as_the_one_it_read() -> None:
    assert parse_level(yaml.safe_dump(yaml.safe_load(COMPLETE))) == parse_level(COMPLETE)


def test_the_text_of_a_level_is_what_it_was_before_there_were_curved_floors() -> None:
    """Records, ghosts and checkpoints go by its hash."""
    text = load_level("classic").model_dump_json()
    assert hashlib.sha256(text.encode()).hexdigest().startswith("97a41b8880b867cb")
    pipe = {"start": (30, 0, 0), "end": (40, 0, 0), "radius": 3}
    assert '"half_pipes":[{' in small_level(half_pipes=[pipe]).model_dump_json()
