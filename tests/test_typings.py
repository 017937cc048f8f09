"""The types that are written for MuJoCo's compiled modules are of what MuJoCo has."""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path

import pytest

TYPINGS = Path(__file__).parents[1] / "typings" / "mujoco"
OURS = {"Array"}
"""What stands for a kind of field, and is no class of MuJoCo's."""


def names_of(body: list[ast.stmt]) -> set[str]:
    """Return what is declared there, but for what begins with an underscore."""
    names = set()
    for node in body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.add(node.target.id)
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
    return {name for name in names if not name.startswith("_")} - OURS


@pytest.mark.parametrize("file", sorted(TYPINGS.glob("*.pyi")), ids=lambda file: file.stem)
def test_every_name_that_has_a_type_is_there(file: Path) -> None:
    module = import_module(f"mujoco.{file.stem}")
    tree = ast.parse(file.read_text(encoding="utf-8"))
    assert names_of(tree.body)
    for name in names_of(tree.body):
        assert hasattr(module, name), name
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and node.name in names_of(tree.body):
            # Structs inside structs have their own names in MuJoCo.
            inner = {one.name for one in node.body if isinstance(one, ast.ClassDef)}
            for name in names_of(node.body) - inner:
                assert hasattr(getattr(module, node.name), name), f"{node.name}.{name}"
