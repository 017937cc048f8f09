"""Included files: what they bring, and that a level can reach nothing but its own folder."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from roller_env.level import LevelError, load_level, parse_level
from roller_env.yaml_tree import MAX_BYTES
from tests.level.samples import SMALL

PARTS = """\
units: quant
materials: {wax: {friction: 0.5}}
prefabs:
  post: {boxes: [{at: [0, 0, 15], size: [9, 9, 30], material: wax}]}
boxes:
  - {at: [300, 0, 5], size: [9, 9, 10], name: kerb}
"""


def write(folder: Path, **files: str) -> Path:
    """Write files, ``main`` the level's, and return the level's path."""
    for name, text in files.items():
        path = folder / f"{name.replace('__', '/')}.yaml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder / "main.yaml"


def including(*names: str) -> str:
    return f"{SMALL}include: [{', '.join(names)}]\n"


def complaints(path: Path) -> list[str]:
    with pytest.raises(LevelError) as caught:
        load_level(path)
    return str(caught.value).replace(f"{path.parent}{os.sep}", "").splitlines()


def test_an_included_file_brings_its_pieces_materials_and_prefabs(tmp_path: Path) -> None:
    text = including("lib/parts.yaml") + "place: [{of: post, at: [400, 0, 0]}]\n"
    level = load_level(write(tmp_path, main=text, lib__parts=PARTS))
    assert level == parse_level(
        SMALL
        + "  - {at: [400, 0, 15], size: [9, 9, 30], material: wax}\n"
        + "  - {at: [300, 0, 5], size: [9, 9, 10], name: kerb}\n"
        + "materials: {wax: {friction: 0.5}}\n"
    )


def test_a_file_includes_from_its_own_folder_and_each_is_read_once(tmp_path: Path) -> None:
    inner = "units: quant\ninclude: [parts.yaml]\nwedges: [{at: [600, 0, 9], size: [9, 9, 9]}]\n"
    text = including("lib/a.yaml", "lib/b.yaml", "./lib/parts.yaml")
    level = load_level(write(tmp_path, main=text, lib__a=inner, lib__b=inner, lib__parts=PARTS))
    assert len(level.wedges) == 2
    assert [box.name for box in level.boxes] == [None, "kerb"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("../other.yaml", "found '../other.yaml'; wanted a file in this folder or under it"),
        ("lib/../../other.yaml", "found 'lib/../../other.yaml'; wanted a file in this folder or"),
        ("/etc/other.yaml", "found '/etc/other.yaml'; wanted a file in this folder or under it"),
        ("/etc/passwd", "wanted the name of a file that ends in .yaml or .yml"),
        ("link.yaml", "found 'link.yaml', which leads out of the level's folder"),
        ("ring.yaml", "'ring.yaml' cannot be read: "),
        ("none.yaml", "'none.yaml' cannot be read: there is no such file"),
        ("pipe.yaml", "'pipe.yaml' cannot be read: found a pipe; wanted a regular file"),
        ("large.yaml", "'large.yaml' cannot be read: the file is too large; allowed are at most"),
        ("3", "wanted the name of a file that ends in .yaml or .yml"),
        ("main.yaml", "the file includes itself, here or by way of others"),
    ],
)
def test_what_cannot_be_included_is_said_in_its_line(tmp_path: Path, name: str, said: str) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (tmp_path / "other.yaml").write_text(PARTS, encoding="utf-8")
    (folder / "link.yaml").symlink_to(tmp_path / "other.yaml")
    (folder / "ring.yaml").symlink_to(folder / "ring.yaml")
    (folder / "large.yaml").write_bytes(b"#" * MAX_BYTES)
    os.mkfifo(folder / "pipe.yaml")
    (found,) = complaints(write(folder, main=including(name)))
    assert found.startswith(f"main.yaml:7:11: include[0]: {said}")


def test_files_that_include_each_other_are_an_error(tmp_path: Path) -> None:
    text = "units: quant\ninclude: [{}.yaml]\n"
    path = write(tmp_path, main=including("a.yaml"), a=text.format("b"), b=text.format("a"))
    itself = "the file includes itself, here or by way of others"
    assert complaints(path) == [f"b.yaml:2:11: include[0]: {itself}"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("boxes: [{at: [0, 0, 0], size: [9, 9]}]", "2:31: boxes[0].size: found a list of 2; "),
        ("coins: [{at: [0, 0, -9000]}]", "2:9: coins[0]: the coin at [0, 0, -9000] is not above"),
        ("start: {at: [0, 0, 0]}", "2:1: start: unknown field; allowed: include, units, "),
        ("boxes: {}", "2:8: boxes: wanted a list, each item after a '- '"),
        ("boxes: [", "3:1: not valid YAML: "),
        ("materials: {ice: {colour: red}}", "2:27: materials.ice.colour: found the text 'red'; "),
        ("materials: {wood: {}}", "2:19: materials.wood: another file has a material of this name"),
        (
            "floors:\n  - corner: [0, 900, 0]\n    cell: 9\n    plan: |\n      ##\n      #x",
            "7:8: floors[0].plan: row 2 of the plan has 'x'",
        ),
    ],
)
def test_what_is_wrong_in_an_included_file_is_said_there(
    tmp_path: Path, text: str, said: str
) -> None:
    main = including("part.yaml") + "materials: {wood: {}}\n"
    (found,) = complaints(write(tmp_path, main=main, part=f"units: quant\n{text}\n"))
    assert found.startswith(f"part.yaml:{said}")


def test_an_included_file_is_in_the_units_of_the_level(tmp_path: Path) -> None:
    path = write(tmp_path, main=including("a.yaml", "b.yaml"), a="units: metre\n", b="boxes: []\n")
    wanted = "wanted units: quant, as the level has that includes this file"
    assert complaints(path) == [f"a.yaml:1:8: units: {wanted}", f"b.yaml:1:1: {wanted}"]


def test_only_a_file_can_include_others() -> None:
    with pytest.raises(LevelError, match=r"f:7:11: include\[0\]: only a file can include others"):
        parse_level(including("a.yaml"), "f")


def test_too_many_files_are_refused(tmp_path: Path) -> None:
    names = [f"p{number}" for number in range(70)]
    files = dict.fromkeys(names, "units: quant\n")
    found = complaints(write(tmp_path, main=including(*(f"{n}.yaml" for n in names)), **files))
    assert "more than 64 files in all" in found[0]
