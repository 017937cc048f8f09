"""What pictures need and the physics does not: surfaces, colours, sky, lights, coins, the finish.

`add_scenery` changes a spec that `roller_env.compile.mjcf.build_spec` made. Everything it adds is
without mass and touches nothing, and no joint is added, so that the positions (``qpos``) of a
simulation can be put into the scenery's model as they are. What is seen of pieces besides their
solids they say themselves, in `roller_env.pieces.piece.Piece.looks`.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import Any, Final

import mujoco
import numpy as np

from roller_env.arrays import Float64
from roller_env.compile import textures
from roller_env.compile.merge import merge_solids
from roller_env.compile.mjcf import BALL, build_spec, machine_name, quaternion
from roller_env.level.expand import expand, shapes
from roller_env.level.schema import Level, Material
from roller_env.physics.presets import PhysicsPreset
from roller_env.pieces.look import METAL, Fly, Paint, Shape, part
from roller_env.pieces.piece import Solid
from roller_env.pieces.surfaces import Surface, solid_surfaces

_HIDDEN_GROUP: Final = 4
"""Geoms of the physics that a surface is drawn for; MuJoCo leaves this group out by default."""

_SCENERY_GROUP: Final = 1


def build_scenery(level: Level, preset: PhysicsPreset) -> mujoco.MjModel:
    """Return the model to draw ``level`` with; its ``qpos`` is that of the physics' model."""
    spec = build_spec(level, preset)
    add_scenery(spec, level)
    return spec.compile()


def add_scenery(spec: mujoco.MjSpec, level: Level) -> None:
    """Add to the level's spec what pictures of it need."""
    # Coins and machines are moved by hand: every picture needs all of its geoms posed anew.
    spec.option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    _set_view(spec)
    _add_sky_and_sun(spec)
    _add_ground(spec, level)
    _paint_ball(spec)
    _paint_machines(spec, level)
    seen, meshes = list(shapes(level)), dict[int, str]()
    for shape in seen:
        _add_shape(spec, level, shape, meshes)


def _add(body: Any, name: str, **attributes: Any) -> Any:
    """Add a geom that is only seen."""
    return body.add_geom(
        name=name, contype=0, conaffinity=0, mass=0.0, group=_SCENERY_GROUP, **attributes
    )


def _add_material(
    spec: mujoco.MjSpec,
    name: str,
    colour: str = "#ffffff",
    *,
    texture: str | None = None,
    emission: float = 0.0,
    specular: float = 0.2,
    shininess: float = 0.3,
) -> None:
    """Add a material; ``colour`` is that of a face."""
    rgb, alpha = textures.parse_colour(colour)
    material = spec.add_material(
        name=name,
        rgba=[*rgb, alpha],
        emission=emission,
        specular=specular,
        shininess=shininess,
    )
    if texture is not None:
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = texture


def _set_view(spec: mujoco.MjSpec) -> None:
    visual = spec.visual
    # Distances below are given in metres: MuJoCo takes them in extents of the model.
    spec.stat.extent = 1.0
    visual.map.znear = 0.05
    visual.map.zfar = 1_000.0
    visual.headlight.ambient = [0.34, 0.36, 0.40]
    visual.headlight.diffuse = [0.10, 0.10, 0.10]
    visual.headlight.specular = [0.0, 0.0, 0.0]


def _add_sky_and_sun(spec: mujoco.MjSpec) -> None:
    textures.add_texture(spec, "sky/", "skybox", textures.sky_pixels())
    spec.worldbody.add_light(
        name="sun/",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        dir=[0.42, -0.30, -0.86],
        castshadow=True,
        diffuse=[0.72, 0.69, 0.62],
        ambient=[0.0, 0.0, 0.0],
        specular=[0.5, 0.5, 0.45],
    )
    spec.worldbody.add_light(
        name="sky light/",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        dir=[-0.5, 0.6, 0.35],
        castshadow=False,
        diffuse=[0.16, 0.20, 0.28],
        ambient=[0.0, 0.0, 0.0],
        specular=[0.0, 0.0, 0.0],
    )


def _add_ground(spec: mujoco.MjSpec, level: Level) -> None:
    """Draw one surface for all solids of a material, in place of the physics' boxes."""
    for geom in spec.worldbody.geoms:
        if geom.name.startswith("solid_"):
            geom.group = _HIDDEN_GROUP
    by_material: dict[str, list[Solid]] = defaultdict(list)
    for solid in merge_solids(expand(level).decks):
        by_material[solid.material].append(solid)
    for name, pieces in by_material.items():
        material = level.material(name)
        _add_level_material(spec, name, material)
        faces, edges = zip(*map(solid_surfaces, pieces), strict=True)
        _add_surface(spec, part("ground") + name, faces, name)
        edges = tuple(edge for edge in edges if edge is not None)
        if edges:
            colour, _ = textures.parse_colour(material.colour)
            _add_level_material(spec, part("edge") + name, material, textures.edge_pixels(colour))
            _add_surface(spec, part("ground", 1) + name, edges, part("edge") + name)


def _add_level_material(
    spec: mujoco.MjSpec, name: str, material: Material, pixels: Float64 | None = None
) -> None:
    """Add a level's material under ``name``, with its own pattern unless given other pixels."""
    rgb, alpha = textures.parse_colour(material.colour)
    if pixels is None:
        pixels = textures.floor_pixels(rgb, material.pattern)
    textures.add_texture(spec, name, "2d", pixels)
    _add_material(spec, name, texture=name, specular=0.15, shininess=0.4)
    spec.material(name).rgba[3] = alpha_of_face(alpha)


def alpha_of_face(alpha: float) -> float:
    """Return the opacity, 0 to 1, of each face of a body that is to have ``alpha`` as a whole.

    MuJoCo draws both faces of a wall or slab that one can see through, one over the other.
    """
    return 1.0 - math.sqrt(1.0 - alpha)


def _add_surface(
    spec: mujoco.MjSpec, name: str, surfaces: Sequence[Surface], material: str
) -> None:
    _add_mesh(spec, name, Surface.joined(surfaces))
    geom = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name}
    _add(spec.worldbody, name, material=material, castshadow=_is_opaque(spec, material), **geom)


def _add_mesh(spec: mujoco.MjSpec, name: str, surface: Surface) -> None:
    spec.add_mesh(
        name=name,
        # Surfaces need not enclose anything, and nothing here has mass.
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        uservert=surface.vertices.ravel(),
        usernormal=surface.normals.ravel(),
        usertexcoord=surface.texture.ravel(),
        userface=surface.faces.ravel().astype(np.int32),
    )


def _is_opaque(spec: mujoco.MjSpec, material: str) -> bool:
    """Say whether something of a material casts a shadow."""
    return bool(spec.material(material).rgba[3] == 1.0)


def _paint_ball(spec: mujoco.MjSpec) -> None:
    white, red, navy = ((0.96, 0.95, 0.92), (0.90, 0.20, 0.16), (0.13, 0.22, 0.42))
    textures.add_texture(spec, "ball/", "cube", textures.ball_pixels((red, white, navy), 6))
    _add_material(spec, "ball/", texture="ball/", specular=0.6, shininess=0.7, emission=0.1)
    spec.geom(BALL).material = "ball/"


def _paint_machines(spec: mujoco.MjSpec, level: Level) -> None:
    """Give what moves or does something a dark body."""
    everything = expand(level)
    _add_paint(spec, METAL)
    for name in (*map(machine_name, everything.machines), *(m.name for m in everything.movers)):
        spec.geom(name).material = METAL.name


def _add_shape(spec: mujoco.MjSpec, level: Level, shape: Shape, meshes: dict[int, str]) -> None:
    """Add a shape; ``meshes`` names the surfaces that are there already, by their identity."""
    for paint in shape.paints:
        if spec.material(paint.name) is None:
            _add_paint(spec, paint)
    material = shape.materials[0]
    if spec.material(material) is None:
        _add_level_material(spec, material, level.material(material))
    if isinstance(shape.form, Surface):
        if id(shape.form) not in meshes:
            meshes[id(shape.form)] = shape.name
            _add_mesh(spec, shape.name, shape.form)
        form = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": meshes[id(shape.form)]}
    else:
        kind = getattr(mujoco.mjtGeom, f"mjGEOM_{shape.form.upper()}")
        form = {"type": kind, "size": shape.size}
    _add(
        spec.body(shape.carrier) if shape.carrier else spec.worldbody,
        shape.name,
        pos=shape.at,
        quat=quaternion(np.array(shape.rotation)),
        material=material,
        castshadow=_is_opaque(spec, material) and not isinstance(shape.motion, Fly),
        **form,
    )


def _add_paint(spec: mujoco.MjSpec, paint: Paint) -> None:
    texture = paint.name if paint.texture else None
    if texture is not None:
        textures.add_texture(spec, texture, "2d", textures.chequered_pixels(2))
    _add_material(
        spec,
        paint.name,
        paint.colour,
        texture=texture,
        emission=paint.emission,
        specular=paint.specular,
        shininess=paint.shininess,
    )
    if paint.opacity < 1.0:
        spec.material(paint.name).rgba[3] = alpha_of_face(paint.opacity)
