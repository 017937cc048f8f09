"""The model that is drawn against the model that is played. None of this needs OpenGL."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roller_env.compile.compiled import compile_level
from roller_env.compile.scenery import build_scenery
from roller_env.drawing.overview import View, fit_view
from roller_env.level import Level, load_level, shipped_levels
from roller_env.physics.presets import physics_preset
from roller_env.pieces.piece import Solid, rotation_matrix
from roller_env.pieces.surfaces import Surface, box_surfaces, full_turn, lathe
from tests.strategies import levels

Float64 = npt.NDArray[np.float64]


def assert_scenery_fits(level: Level) -> None:
    """The scenery takes the positions of the physics, and nothing added touches or weighs."""
    played = compile_level(level).model
    drawn = build_scenery(level, physics_preset("default"))
    assert drawn.nq == played.nq
    assert drawn.nv == played.nv
    for joint in range(played.njnt):
        name = played.joint(joint).name
        assert drawn.joint(name).qposadr[0] == played.joint(name).qposadr[0]
    assert colliding(drawn) == colliding(played)
    assert drawn.body_mass.tolist() == played.body_mass.tolist()


def colliding(model: mujoco.MjModel) -> set[str]:
    """Return the names of the geoms that can touch another."""
    touching = np.flatnonzero((model.geom_contype != 0) | (model.geom_conaffinity != 0))
    return {model.geom(int(number)).name for number in touching}


@pytest.mark.parametrize("name", shipped_levels())
def test_the_scenery_of_a_shipped_level_fits_its_physics(name: str) -> None:
    assert_scenery_fits(load_level(name))


@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow])
@given(level=levels())
def test_the_scenery_of_any_level_fits_its_physics(level: Level) -> None:
    assert_scenery_fits(level)


@given(
    half=st.tuples(*[st.floats(0.01, 10.0)] * 3),
    yaw_deg=st.floats(-180.0, 180.0),
    pitch_deg=st.floats(-60.0, 60.0),
)
def test_a_box_looks_outwards_on_all_its_sides(
    half: tuple[float, float, float], yaw_deg: float, pitch_deg: float
) -> None:
    solid = Solid((3.0, -2.0, 5.0), half, rotation_matrix(yaw_deg, pitch_deg), "default", "")
    surface = Surface.joined([part for part in box_surfaces(solid) if part is not None])
    areas = assert_looks_outwards(surface, np.array(solid.centre))
    x, y, z = (2.0 * edge for edge in half)
    assert areas.sum() == pytest.approx(2.0 * (x * y + y * z + z * x))


def test_a_turned_body_looks_outwards_on_all_its_sides() -> None:
    profile = [(0.0, -1.0), (2.0, -1.0), (2.0, 1.0), (0.0, 1.0)]
    areas = assert_looks_outwards(lathe(profile, full_turn(720)), np.zeros(3))
    assert areas.sum() == pytest.approx(2 * np.pi * 4.0 + 2 * np.pi * 2.0 * 2.0, rel=1e-4)


def assert_looks_outwards(surface: Surface, inside: Float64) -> Float64:
    """Check corners' order and normals against a point inside; return the triangles' areas."""
    corners = surface.vertices[surface.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas: Float64 = np.linalg.norm(cross, axis=1) / 2.0
    real = areas > 1e-9
    outward = np.einsum("ij,ij->i", cross, corners.mean(axis=1) - inside)
    assert (outward[real] > 0.0).all()
    facing = np.einsum("ij,ikj->ik", cross, surface.normals[surface.faces])
    assert (facing[real] > 0.0).all()
    return areas


@given(
    points=st.lists(st.tuples(*[st.floats(-50.0, 50.0)] * 3), min_size=2, max_size=30),
    azimuth_deg=st.floats(-180.0, 180.0),
    elevation_deg=st.floats(-80.0, 80.0),
    aspect=st.floats(0.5, 3.0),
)
def test_an_overview_shows_every_point(
    points: list[tuple[float, float, float]],
    azimuth_deg: float,
    elevation_deg: float,
    aspect: float,
) -> None:
    view = View(azimuth_deg, elevation_deg, 40.0)
    position, target = fit_view(np.array(points), view, aspect)
    ahead = target - position
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    away = np.array(points) - position
    depth = away @ ahead
    slope = np.tan(np.radians(20.0))
    assert (np.abs(away @ up) <= slope * depth + 1e-6).all()
    assert (np.abs(away @ right) <= slope * aspect * depth + 1e-6).all()
