"""PlayScene: a level as MuJoCo Studio draws it.

Studio sends a model to the browser once, and then in every frame only the state of its physics.
What changes in any other way - coins that turn and vanish, the bands on tubes and panes, the
colours that tell a state - is therefore made a puppet here: a body without physics (MuJoCo's mocap)
that is put where it is seen, or away. A piece that changes its material has a puppet for each. The
finish's particles and the effects change their size, and are sent as loose geoms.

How everything looks is still decided in one place, `roller_env.drawing.stage`: a stage is kept and
asked, and no number of it is repeated here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Final, Literal, NamedTuple

import mujoco
import numpy as np

from roller_env.arrays import Bool, Float64, Int64
from roller_env.compile.mjcf import BALL, build_spec
from roller_env.compile.scenery import add_scenery
from roller_env.drawing.renderer import FIELD_OF_VIEW_DEG
from roller_env.drawing.stage import SEEN_FROM_BELOW_ALPHA, Stage
from roller_env.game.cameras import MODE_BELOW, MODE_FIRST_PERSON
from roller_env.game.state import GameState
from roller_env.level.expand import shapes
from roller_env.level.schema import Level
from roller_env.physics.presets import PhysicsPreset
from roller_env.pieces.look import Fly, Shape, part
from roller_env.play.effects import Light

BALL_GROUP: Final = 2
"""Geom group of the ball, which is not seen in first person."""

GLASS_GROUP: Final = 3
GROUND_GROUP: Final = 5
"""Geom groups of the ground: as it is, and as glass, through which the camera below looks."""

_PHYSICS_GROUP: Final = 4

AWAY: Final = (0.0, 0.0, -10_000.0)
"""Where puppets are that are not seen: far beyond what is drawn."""

WATCHING_DISTANCE_M: Final = 5.0

Quality = Literal["high", "low"]

RENDERING: Final[dict[str, float]] = {
    "filament.fallback.environment_light_intensity": 12_000.0,
    "filament.fallback.scene_light_intensity": 36_000.0,
    "filament.fallback.head_light_intensity": 1_000.0,
    "filament.cg.exposure": -0.1,
    "filament.cg.contrast": 1.25,
    "filament.cg.saturation": 1.1,
    "filament.phong.specular_multiplier": 0.4,
}
"""Light and colour for Filament, Studio's renderer, found by eye; its manual, in MuJoCo's package,
is `doc/programming/rendering.rst`."""

LOW_RENDERING: Final[dict[str, float]] = {
    "filament.ao.enabled": 0.0,
    # As nothing lies in the shade, the sun is to be weaker.
    "filament.fallback.scene_light_intensity": 27_000.0,
}
"""What a machine without a graphics processor is spared, besides shadows and smooth edges."""


class _Puppet(NamedTuple):
    """A geom of the stage, and the material in which this puppet of it is made."""

    geom: str
    material: str


class PlayScene:
    """A level's model for Studio, and what it takes to put it into the state of a game.

    Attributes:
        model: what Studio is given; nothing in it changes while playing.
    """

    def __init__(self, level: Level, preset: PhysicsPreset, quality: Quality = "high"):
        """Build what Studio draws of ``level``."""
        self._stage = Stage(level, preset)
        spec = build_spec(level, preset)
        add_scenery(spec, level)
        seen = list(shapes(level))
        particles = [shape.name for shape in seen if isinstance(shape.motion, Fly)]
        puppets = _make_puppets(spec, seen)
        _add_glass_ground(spec)
        for name in particles:  # they change their size, which no body can
            spec.delete(spec.geom(name))
        spec.geom(BALL).group = BALL_GROUP
        _set_rendering(spec, quality)
        _aim_free_camera(spec, level)
        self.model: mujoco.MjModel = spec.compile()
        # Nothing is simulated with it: what mj_forward need not find it should not look for.
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        stage = self._stage.model
        self._geoms = _indices(stage.geom(puppet.geom).id for puppet in puppets)
        self._materials = _indices(stage.material(puppet.material).id for puppet in puppets)
        bodies = [self.model.body(_puppet_name(puppet)) for puppet in puppets]
        self._mocaps = _indices(body.mocapid[0] for body in bodies)
        geoms = _indices(body.geomadr[0] for body in bodies)
        # Compiling has moved meshes to their middles and turned them along their main axes.
        self._offsets = self.model.geom_pos[geoms].copy()
        self._turns = _matrices(self.model.geom_quat[geoms])
        self._sparks = [stage.geom(name).id for name in particles]

    def groups(self, mode: int) -> list[int]:
        """Return which geom groups of the model are seen in camera mode ``mode``, 0 or 1 each."""
        hidden = {_PHYSICS_GROUP, GROUND_GROUP if mode == MODE_BELOW else GLASS_GROUP}
        if mode == MODE_FIRST_PERSON:
            hidden.add(BALL_GROUP)
        return [int(group not in hidden) for group in range(mujoco.mjNGROUP)]

    def show(self, data: mujoco.MjData, qpos: Float64, state: GameState, clock_s: float) -> None:
        """Put ``data``, of `model`, into the state of a game.

        Args:
            data: changed: ``qpos`` and the poses of the puppets.
            qpos: (nq,) positions of the game, as drawn.
            state: of one game.
            clock_s: the time that coins turn and particles fly by.
        """
        stage = self._stage
        stage.show(qpos, state, 0, clock_s)
        data.qpos[:] = qpos
        seen: Bool = stage.model.geom_rgba[self._geoms, 3] > 0.0
        seen &= stage.model.geom_matid[self._geoms] == self._materials
        turns = stage.data.geom_xmat[self._geoms].reshape(-1, 3, 3) @ self._turns.swapaxes(1, 2)
        places = stage.data.geom_xpos[self._geoms] - np.einsum("nij,nj->ni", turns, self._offsets)
        data.mocap_pos[self._mocaps] = np.where(seen[:, None], places, AWAY)
        for mocap, turn in zip(self._mocaps[seen], turns[seen], strict=True):
            mujoco.mju_mat2Quat(data.mocap_quat[mocap], turn.ravel())
        # A window draws what the kinematics say; a browser computes them itself.
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_camlight(self.model, data)

    def loose_geoms(self, lights: Iterable[Light] = ()) -> list[mujoco.MjvGeom]:
        """Return what to draw besides the model, as `show` was last told: particles and lights."""
        model, data = self._stage.model, self._stage.data
        return [_sphere(light) for light in (*self._spark_lights(model, data), *lights)]

    def _spark_lights(self, model: Any, data: Any) -> Iterator[Light]:
        for geom in self._sparks:
            red, green, blue, alpha = model.geom_rgba[geom].tolist()
            if alpha > 0.0:
                x, y, z = data.geom_xpos[geom].tolist()
                yield Light((x, y, z), float(model.geom_size[geom, 0]), (red, green, blue), alpha)


def _sphere(light: Light) -> mujoco.MjvGeom:
    geom = mujoco.MjvGeom()
    mujoco.mjv_initGeom(
        geom,
        mujoco.mjtGeom.mjGEOM_SPHERE.value,
        np.array([light.radius_m, 0.0, 0.0]),
        np.array(light.position),
        _UPRIGHT,
        np.array([*light.colour, light.alpha], dtype=np.float32),
    )
    geom.emission = 1.0
    return geom


_UPRIGHT: Final = np.eye(3).ravel()


def _make_puppets(spec: mujoco.MjSpec, seen: Iterable[Shape]) -> list[_Puppet]:
    """Put a puppet for every paint in the place of each shape that changes; return them."""
    puppets = []
    for shape in seen:
        if isinstance(shape.motion, Fly) or not (shape.motion or shape.has_phases):
            continue
        geom = spec.geom(shape.name)
        for material in shape.materials:
            puppet = _Puppet(shape.name, material)
            body = spec.worldbody.add_body(name=_puppet_name(puppet), mocap=True, pos=AWAY)
            _copy_geom(geom, body, material)
            puppets.append(puppet)
        spec.delete(geom)
    return puppets


def _puppet_name(puppet: _Puppet) -> str:
    return f"{puppet.geom} {puppet.material}"


def _copy_geom(geom: Any, body: Any, material: str, **changes: Any) -> None:
    """Add to a body a geom that looks the same and touches nothing."""
    body.add_geom(
        **{
            "type": geom.type,
            "size": geom.size,
            "meshname": geom.meshname,
            "material": material,
            "group": geom.group,
            "castshadow": geom.castshadow,
            "contype": 0,
            "conaffinity": 0,
            "mass": 0.0,
            **changes,
        }
    )


def _add_glass_ground(spec: mujoco.MjSpec) -> None:
    """Add to every surface of the ground the same one in glass."""
    for geom in [geom for geom in spec.worldbody.geoms if geom.name.startswith(part("ground"))]:
        geom.group = GROUND_GROUP
        solid = spec.material(geom.material)
        glass = spec.add_material(
            name=solid.name + " as glass",
            rgba=[1.0, 1.0, 1.0, SEEN_FROM_BELOW_ALPHA],
            specular=solid.specular,
            shininess=solid.shininess,
        )
        role = mujoco.mjtTextureRole.mjTEXROLE_RGB
        glass.textures[role] = solid.textures[role]
        _copy_geom(geom, spec.worldbody, glass.name, group=GLASS_GROUP, castshadow=False)


def _set_rendering(spec: mujoco.MjSpec, quality: Quality) -> None:
    spec.visual.global_.fovy = FIELD_OF_VIEW_DEG
    # Filament shares out one intensity among all lights: let the sun have it.
    spec.delete(spec.light("sky light/"))
    settings = dict(RENDERING)
    if quality == "low":
        settings |= LOW_RENDERING
        spec.light("sun/").castshadow = False
        spec.visual.quality.offsamples = 0
    for name, value in settings.items():
        spec.add_numeric(name=name, data=[value], size=1)


def _aim_free_camera(spec: mujoco.MjSpec, level: Level) -> None:
    """Let the camera of whoever watches begin above and behind the start, looking forward."""
    visual, before = spec.visual, spec.stat.extent
    # Its distance is one and a half of this; what is given in extents stays where it was.
    spec.stat.extent = WATCHING_DISTANCE_M / 1.5
    visual.map.znear *= before / spec.stat.extent
    visual.map.zfar *= before / spec.stat.extent
    spec.stat.center = level.start.at
    visual.global_.azimuth, visual.global_.elevation = 0.0, -30.0


def _matrices(quaternions: Float64) -> Float64:
    """Return the rotation matrices, (N, 3, 3), of unit quaternions (N, 4)."""
    matrices = np.empty((len(quaternions), 9))
    for quaternion, matrix in zip(quaternions, matrices, strict=True):
        mujoco.mju_quat2Mat(matrix, quaternion)
    return matrices.reshape(-1, 3, 3)


def _indices(numbers: Iterable[int]) -> Int64:
    return np.fromiter(numbers, dtype=np.int64)
