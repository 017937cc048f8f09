"""What pictures need and the physics does not: surfaces, colours, sky, lights, coins, the finish.

`add_scenery` changes a spec that `roller_env.compile.mjcf.build_spec` made. Everything it adds is
without mass and touches nothing, and no joint is added, so that the positions (``qpos``) of a
simulation can be put into the scenery's model as they are. What moves or changes its colour while
playing has a name made by `part`.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import Any, Final

import mujoco
import numpy as np
import numpy.typing as npt

from roller_env.compile import textures
from roller_env.compile.merge import merge_solids
from roller_env.compile.mjcf import BALL, build_spec
from roller_env.compile.surfaces import Surface, box_surfaces, full_turn, lathe, tube_surface
from roller_env.level.expand import expand
from roller_env.level.schema import Level, Material
from roller_env.physics.presets import PhysicsPreset
from roller_env.pieces.camera_trigger import CameraTrigger
from roller_env.pieces.gate import Gate
from roller_env.pieces.lift_pad import LiftPad
from roller_env.pieces.piece import Solid, rotation_matrix
from roller_env.pieces.plate import Plate
from roller_env.pieces.tube import Tube
from roller_env.units import quants

Float64 = npt.NDArray[np.float64]

IDLE: Final = "idle"
ACTIVE: Final = "active"
DONE: Final = "done"
STATES: Final = {
    "plate": (IDLE, ACTIVE, DONE),
    "gate": (IDLE, ACTIVE, DONE),
    "pad": (IDLE, ACTIVE),
}
"""The states that plates, gates and pads tell by their material, which is called kind/state."""

SPARKS: Final = 38
"""Particles of the finish alive at once: one a frame of 1/60 s, 0.625 s long."""

RING_SPACING_M: Final = quants(96.0)
"""Distance between the bands that run along a tube."""

PANE_COLOUR: Final = "#0101c8"
PANE_ALPHA: Final = 0.70
"""`camch2`: red, green and blue, and the opacity, of a retreat trigger's pane."""

SPARK_COLOUR: Final = "#01ff64"
"""`fire1`: red, green and blue of the finish's particles."""

BAND_SPACING_M: Final = quants(32.0)
"""Distance between the bands that run up a retreat trigger's pane."""

BAND_HALF_HEIGHT_M: Final = quants(3.0)

GATE_BARS: Final = 7

_HIDDEN_GROUP: Final = 4
"""Geoms of the physics that a surface is drawn for; MuJoCo leaves this group out by default."""

_SCENERY_GROUP: Final = 1

_COIN_RADIUS_M: Final = quants(11.0)
_COIN_HALF_THICKNESS_M: Final = quants(2.0)
_DETAILED_COINS: Final = 500
"""A level with more coins than this has plainer ones, or drawing would take seconds."""


def part(kind: str, *numbers: int) -> str:
    """Return the name of a piece of scenery; no piece of a level can be called so."""
    return "/".join([kind, *map(str, numbers)]) + "/"


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
    _add_state_materials(spec)
    _add_ground(spec, level)
    _paint_ball(spec)
    _add_tubes(spec, level)
    for plate in level.plates:
        _dress_plate(spec, plate)
    for gate in level.gates:
        _dress_gate(spec, gate)
    for number, pad in enumerate(level.lift_pads):
        _dress_pad(spec, pad, number)
    _add_coins(spec, level)
    _add_triggers(spec, level)
    _add_finish(spec, level)


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


def _add_state_materials(spec: mujoco.MjSpec) -> None:
    _add_material(spec, "plate/" + IDLE, "#ffb02e", emission=0.25)
    _add_material(spec, "plate/" + ACTIVE, "#ff6a3d", emission=0.7)
    _add_material(spec, "plate/" + DONE, "#35c46f", emission=0.3)
    _add_material(spec, "gate/" + IDLE, "#ff4d4d", emission=0.5)
    _add_material(spec, "gate/" + ACTIVE, "#ffb02e", emission=0.7)
    _add_material(spec, "gate/" + DONE, "#35c46f", emission=0.3)
    _add_material(spec, "pad/" + IDLE, "#27b5e8", emission=0.25)
    _add_material(spec, "pad/" + ACTIVE, "#8decff", emission=0.7)
    _add_material(spec, "metal/", "#39424e", specular=0.6, shininess=0.6)
    _add_material(spec, "ring/", "#bff0ff59", emission=0.8)
    _add_material(spec, "collar/", "#e9eef3", specular=0.7, shininess=0.7)
    _add_material(spec, "gold/", "#ffc928", emission=0.28, specular=0.9, shininess=0.6)
    _add_material(spec, "trigger/", PANE_COLOUR, emission=0.4)
    spec.material("trigger/").rgba[3] = alpha_of_face(PANE_ALPHA)
    _add_material(spec, "band/", "#6f8bffa0", emission=0.6)
    _add_material(spec, "beam/", "#4fe39a", emission=0.35)
    _add_material(spec, "spark/", SPARK_COLOUR, emission=1.0)


def _add_ground(spec: mujoco.MjSpec, level: Level) -> None:
    """Draw one surface for all solids of a material, in place of the physics' boxes."""
    for geom in spec.worldbody.geoms:
        if geom.name.startswith("solid_"):
            geom.group = _HIDDEN_GROUP
    by_material: dict[str, list[Solid]] = defaultdict(list)
    for solid in merge_solids(s for s in expand(level).ground if not _of_tube(s)):
        by_material[solid.material].append(solid)
    for name, pieces in by_material.items():
        material = level.material(name)
        _add_level_material(spec, name, material)
        faces, edges = zip(*map(box_surfaces, pieces), strict=True)
        _add_surface(spec, part("ground") + name, faces, name)
        edges = tuple(edge for edge in edges if edge is not None)
        if edges:
            colour, _ = textures.parse_colour(material.colour)
            _add_level_material(spec, part("edge") + name, material, textures.edge_pixels(colour))
            _add_surface(spec, part("ground", 1) + name, edges, part("edge") + name)


def _of_tube(solid: Solid) -> bool:
    return solid.source.startswith("tubes[")


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

    MuJoCo draws both faces of a wall or slab that one can see through, one over the other. Studio's
    page draws the nearer one, and mixes in linear light: there it looks like half instead of 0.6.
    """
    return 1.0 - math.sqrt(1.0 - alpha)


def _add_surface(
    spec: mujoco.MjSpec, name: str, surfaces: Sequence[Surface], material: str
) -> None:
    """Add a surface to look at; light falls through it as far as one can see through it."""
    Surface.joined(surfaces).add_to(spec, name)
    _add(
        spec.worldbody,
        name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        material=material,
        castshadow=bool(spec.material(material).rgba[3] == 1.0),
    )


def _paint_ball(spec: mujoco.MjSpec) -> None:
    white, red, navy = ((0.96, 0.95, 0.92), (0.90, 0.20, 0.16), (0.13, 0.22, 0.42))
    textures.add_texture(spec, "ball/", "cube", textures.ball_pixels((red, white, navy), 6))
    _add_material(spec, "ball/", texture="ball/", specular=0.6, shininess=0.7, emission=0.1)
    spec.geom(BALL).material = "ball/"


def _add_tubes(spec: mujoco.MjSpec, level: Level) -> None:
    panels: dict[str, list[Solid]] = defaultdict(list)
    for solid in expand(level).ground:
        if _of_tube(solid):
            panels[solid.source].append(solid)
    for number, tube in enumerate(level.tubes):
        walls = panels[f"tubes[{number}]"]
        if not walls:
            continue
        if spec.material(tube.material) is None:
            _add_level_material(spec, tube.material, level.material(tube.material))
        _add_surface(spec, part("tube", number), [tube_surface(tube, walls)], tube.material)
        if ring_count(tube):
            _add_rings(spec, tube, number)


def ring_count(tube: Tube) -> int:
    """Return how many bands of light run along a tube: none along one with an opening."""
    if tube.opening is not None:
        return 0
    return int(math.dist(tube.start, tube.end) / RING_SPACING_M)


def _add_rings(spec: mujoco.MjSpec, tube: Tube, number: int) -> None:
    """Add a closed tube's collars and the bands of light that run along it."""
    outer = (tube.inner_radius + tube.thickness) / math.cos(math.pi / tube.sides)
    band, collar, height = outer + quants(0.5), outer + quants(3.0), quants(5.0)
    turn = full_turn(4 * tube.sides)
    frame = tube.frame
    frame[:, 1] = np.cross(frame[:, 2], frame[:, 0])
    orientation = np.empty(4)
    mujoco.mju_mat2Quat(orientation, frame.ravel())
    lathe([(band, -height), (band, height)], turn).add_to(spec, part("ring", number))
    ends = [(collar, 0.0), (collar, height), (tube.inner_radius, height)]
    ends += [(tube.inner_radius, 0.0), (collar, 0.0)]
    # Their rims stand out of the floors that the tube ends in, just enough to be seen.
    proud = quants(0.4)
    for end, base in enumerate((-proud, math.dist(tube.start, tube.end) - height + proud)):
        surface = lathe([(radius, base + z) for radius, z in ends], turn)
        _add_surface(
            spec,
            part("collar", number, end),
            [surface.moved(frame, np.array(tube.start))],
            "collar/",
        )
    for ring in range(ring_count(tube)):
        _add(
            spec.worldbody,
            part("ring", number, ring),
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=part("ring", number),
            material="ring/",
            pos=tube.start,
            quat=orientation,
            castshadow=False,
        )


def _box(half: Sequence[float], **attributes: Any) -> dict[str, Any]:
    return {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": half, **attributes}


def _dress_plate(spec: mujoco.MjSpec, plate: Plate) -> None:
    """Give the plate a dark edge and a cap whose colour tells its state."""
    spec.geom(plate.name).material = "metal/"
    x, y, z = (edge / 2 for edge in plate.size)
    margin = min(quants(8.0), 0.2 * min(x, y))
    cap = _box([x - margin, y - margin, quants(0.5)], pos=[0.0, 0.0, z], material="plate/" + IDLE)
    _add(spec.body(plate.name), part("plate") + plate.name, **cap)


def _dress_gate(spec: mujoco.MjSpec, gate: Gate) -> None:
    """Give the gate's slab bars whose colour tells its state."""
    spec.geom(gate.name).material = "metal/"
    x, y, z = (edge / 2 for edge in gate.size)
    thickness, inset = quants(1.0), min(quants(1.0), 0.1 * max(x, y))
    for bar in range(GATE_BARS):
        height = z * (1.0 - (2 * bar + 1) / (GATE_BARS + 1))
        half = (x + thickness, y - inset) if x < y else (x - inset, y + thickness)
        size = [*half, min(quants(3.0), z / (GATE_BARS + 1))]
        box = _box(size, pos=[0.0, 0.0, height], material="gate/" + IDLE)
        _add(spec.body(gate.name), part("gate", bar) + gate.name, **box)


def _dress_pad(spec: mujoco.MjSpec, pad: LiftPad, number: int) -> None:
    """Give the pad a disc that lights up, and a column of light to rise in."""
    spec.geom(f"lift_pad_{number}").material = "metal/"
    radius, top = 0.42 * min(pad.size[:2]), pad.at[2] + pad.size[2] / 2
    _add(
        spec.worldbody,
        part("pad", number),
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius, quants(0.5), 0.0],
        pos=[pad.at[0], pad.at[1], top],
        material="pad/" + IDLE,
    )
    reach = quants(48.0)
    _add(
        spec.worldbody,
        part("glow", number),
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius, reach, 0.0],
        pos=[pad.at[0], pad.at[1], top + reach],
        material="ring/",
        castshadow=False,
    )


def _add_coins(spec: mujoco.MjSpec, level: Level) -> None:
    positions = expand(level).coins
    if len(positions) == 0:
        return
    segments = 24 if len(positions) <= _DETAILED_COINS else 8
    _coin_surface(segments).add_to(spec, part("coin"))
    for number, position in enumerate(positions):
        _add(
            spec.worldbody,
            part("coin", number),
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=part("coin"),
            material="gold/",
            pos=position,
        )


def _coin_surface(segments: int) -> Surface:
    """Return a coin with a raised rim, standing upright, its axis along x."""
    radius, rim, face = _COIN_RADIUS_M, _COIN_HALF_THICKNESS_M, 0.5 * _COIN_HALF_THICKNESS_M
    half = [(radius, 0.0), (radius, 0.7 * rim), (0.94 * radius, rim), (0.76 * radius, rim)]
    half += [(0.70 * radius, face), (0.0, face)]
    profile = [(r, -h) for r, h in reversed(half)] + half[1:]
    upright = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    return lathe(profile, full_turn(segments)).moved(upright, np.zeros(3))


def _add_triggers(spec: mujoco.MjSpec, level: Level) -> None:
    """Show the retreat triggers as blue panes, as `camch2` does; the other triggers are unseen.

    Bands of a lighter blue show that the pane's texture scrolls.
    """
    for number, trigger in enumerate(level.camera_triggers):
        if trigger.kind != "retreat" or trigger.size is None:
            continue
        x, y, z = (edge / 2 for edge in trigger.size)
        pane = _box([x, y, z], pos=trigger.at, material="trigger/", castshadow=False)
        _add(spec.worldbody, part("trigger", number), **pane)
        proud = quants(0.2)
        half = [x + proud, y + proud, min(BAND_HALF_HEIGHT_M, 0.5 * z)]
        for band in range(band_count(trigger)):
            box = _box(half, pos=trigger.at, material="band/", castshadow=False)
            _add(spec.worldbody, part("band", number, band), **box)


def band_count(trigger: CameraTrigger) -> int:
    """Return how many bands run up a trigger's pane: at least one up that of a retreat."""
    if trigger.kind != "retreat" or trigger.size is None:
        return 0
    return max(1, int(trigger.size[2] / BAND_SPACING_M))


def _add_finish(spec: mujoco.MjSpec, level: Level) -> None:
    """Add an arch over the finish's longer side, with a chequered beam and sparks."""
    finish = level.finish
    x, y, z = (edge / 2 for edge in finish.size)
    post = quants(4.0)
    textures.add_texture(spec, "chequers/", "2d", textures.chequered_pixels(2))
    _add_material(spec, "chequers/", texture="chequers/", emission=0.3)
    span = np.array([0.0, 1.0, 0.0]) if y >= x else np.array([1.0, 0.0, 0.0])
    width = max(x, y)
    base = np.array(finish.at) - [0.0, 0.0, z]
    top = max(2.0 * z, quants(72.0))
    for side, sign in enumerate((-1.0, 1.0)):
        place = base + sign * width * span + [0.0, 0.0, top / 2]
        pillar = _box([post, post, top / 2], pos=place, material="beam/")
        _add(spec.worldbody, part("pillar", side), **pillar)
    half = (width + 2 * post) * span + quants(5.0) * (1.0 - span)
    half[2] = quants(10.0)
    middle = (finish.at[0], finish.at[1], float(base[2]) + top)
    size = (float(half[0]), float(half[1]), float(half[2]))
    beam = Solid(middle, size, rotation_matrix(), "chequers/", "finish")
    _add_surface(spec, part("beam"), [box_surfaces(beam)[0]], "chequers/")
    for spark in range(SPARKS):
        _add(
            spec.worldbody,
            part("spark", spark),
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[quants(1.0), 0.0, 0.0],
            pos=finish.at,
            material="spark/",
            castshadow=False,
        )
