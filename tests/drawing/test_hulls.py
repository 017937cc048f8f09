"""Hulls and wedges in pictures, on maps and in overviews."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.drawing.overview import level_corners, render_overview
from roller_env.drawing.topdown import draw_paths
from roller_env.level import Level
from roller_env.level.expand import expand
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.piece import UNTURNED, Solid
from roller_env.pieces.surfaces import TILE_M, box_surfaces, solid_surfaces
from tests.builders import make_level
from tests.drawing.test_scenery import assert_looks_outwards
from tests.drawing.test_topdown import pixels_of

RED = "#ff0000"


def yard(**pieces: Any) -> Level:
    """Return a level with a floor of 20 m."""
    floor = {"at": (0.0, 0.0, -0.5), "size": (20.0, 20.0, 1.0)}
    finish = {"at": (9.0, 9.0, 0.5), "size": (1.0, 1.0, 1.0)}
    return make_level(
        boxes=[floor], finish=finish, materials={"red": {"colour": RED}}, kill_height=-5.0, **pieces
    )


PYRAMID: dict[str, Any] = {
    "points": [(2, -4, 0), (8, -4, 0), (2, 4, 0), (8, 4, 0), (5, 0, 3)],
    "material": "red",
}
WEDGE: dict[str, Any] = {"at": (-5.0, 0.0, 1.0), "size": (5.0, 8.0, 2.0), "material": "red"}


@given(seed=st.integers(0, 2**32 - 1))
def test_a_hull_looks_outwards_on_all_its_sides(seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(20, 3))
    solid = ConvexSolid.of([(x, y, z) for x, y, z in points.tolist()], "default", "")
    surface, edge = solid_surfaces(solid)
    assert edge is None
    assert_looks_outwards(surface, points.mean(axis=0))


def test_the_faces_of_a_wedge_have_its_area() -> None:
    (wedge,) = (s for s in expand(yard(wedges=[WEDGE])).solids if isinstance(s, ConvexSolid))
    areas = assert_looks_outwards(solid_surfaces(wedge)[0], np.array([-4.0, 0.0, 0.7]))
    assert areas.sum() == pytest.approx(5 * 8 + 2 * 8 + 8 * np.hypot(5, 2) + 2 * (5 * 2 / 2))


def test_the_texture_goes_on_unbroken_from_a_box_to_a_hull() -> None:
    box = Solid((3.0, -2.0, 5.0), (1.0, 1.0, 1.0), UNTURNED, "default", "")
    hull = ConvexSolid.of([(x, y, z) for x, y, z in box.corners().tolist()], "default", "")
    boxed, hulled = (
        {
            tuple(np.round([*vertex, *normal, *place], 9) + 0.0)
            for vertex, normal, place in zip(
                surface.vertices, surface.normals, surface.texture, strict=True
            )
        }
        for surface in (box_surfaces(box)[0], solid_surfaces(hull)[0])
    )
    assert boxed == hulled


def test_the_texture_of_a_slope_is_as_large_as_on_the_level() -> None:
    (wedge,) = (s for s in expand(yard(wedges=[WEDGE])).solids if isinstance(s, ConvexSolid))
    surface, _ = solid_surfaces(wedge)
    for corners in surface.faces:
        for first, second in ((0, 1), (1, 2), (2, 0)):
            ends = corners[[first, second]]
            length = np.linalg.norm(np.diff(surface.vertices[ends], axis=0))
            painted = np.linalg.norm(np.diff(surface.texture[ends], axis=0)) * TILE_M
            assert painted == pytest.approx(length)


def test_hulls_and_wedges_are_on_maps(tmp_path: Path) -> None:
    """Each face in its own light: the nearer it looks upwards, the brighter."""
    reds = []
    for name, pieces in (
        ("none", {}),
        ("hull", {"hulls": [PYRAMID]}),
        ("wedge", {"wedges": [WEDGE]}),
    ):
        file = tmp_path / f"{name}.png"
        draw_paths(yard(**pieces), [], [], file)
        reds.append(sum(pixels_of(file, shade) for shade in ("#ff6666", "#f36161", "#d05353")))
    assert reds[0] == 0
    assert min(reds[1:]) > 10_000


def test_the_map_of_a_level_of_hulls_alone_is_cut_to_them(tmp_path: Path) -> None:
    level = make_level(boxes=[], hulls=[PYRAMID], materials={"red": {"colour": RED}})
    draw_paths(level, [], [], tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 0


def test_an_overview_has_room_for_a_hull() -> None:
    far = yard(hulls=[{"points": [(60, 0, 0), (70, 0, 0), (60, 5, 0), (60, 0, 9)]}])
    assert level_corners(far).max(axis=0).tolist() == [70.0, 10.0, 9.0]


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("pieces", [{"hulls": [PYRAMID]}, {"wedges": [WEDGE]}])
def test_hulls_and_wedges_are_seen(pieces: dict[str, Any]) -> None:
    red = []
    for level in (yard(), yard(**pieces)):
        picture = render_overview(level, 200, 150).astype(int)
        red.append((picture[..., 0] > 2 * picture[..., 1:].max(axis=-1)).sum())
    assert red[1] - red[0] > 500
