"""MuJoCo's specs, from which models are compiled, as far as Roller uses them.

What ``add_...`` takes are the fields of what it makes, by their names, and more.
"""

from typing import Any

import numpy as np
from mujoco._enums import mjtGeom, mjtJoint
from mujoco._structs import Array, MjModel, MjOption, MjStatistic, MjVisual

class MjsGeom:
    castshadow: bool
    conaffinity: int
    condim: int
    contype: int
    friction: Array[np.float64]
    group: int
    mass: float
    material: str
    name: str
    pos: Array[np.float64]
    priority: int
    quat: Array[np.float64]
    rgba: Array[np.float32]
    size: Array[np.float64]
    solimp: Array[np.float64]
    solref: Array[np.float64]
    type: mjtGeom

class MjsJoint:
    axis: Array[np.float64]
    damping: Array[np.float64]
    name: str
    type: mjtJoint

class MjsPair:
    friction: Array[np.float64]
    geomname1: str
    geomname2: str
    solimp: Array[np.float64]
    solref: Array[np.float64]
    solreffriction: Array[np.float64]

class MjsTexture:
    data: bytes
    name: str

class MjsMaterial:
    name: str
    rgba: Array[np.float32]
    shininess: float
    specular: float
    textures: list[str]

class MjsMesh:
    name: str

class MjsBody:
    explicitinertial: bool
    inertia: Array[np.float64]
    ipos: Array[np.float64]
    mass: float
    mocap: bool
    name: str
    pos: Array[np.float64]
    quat: Array[np.float64]
    bodies: list[MjsBody]
    joints: list[MjsJoint]
    geoms: list[MjsGeom]
    def add_body(self, **fields: Any) -> MjsBody: ...
    def add_freejoint(self, **fields: Any) -> MjsJoint: ...
    def add_geom(self, **fields: Any) -> MjsGeom: ...
    def add_joint(self, **fields: Any) -> MjsJoint: ...
    def add_light(self, **fields: Any) -> Any: ...
    def add_site(self, **fields: Any) -> Any: ...

class MjSpec:
    memory: int
    modelname: str
    option: MjOption
    stat: MjStatistic
    visual: MjVisual
    worldbody: MjsBody
    bodies: list[MjsBody]
    joints: list[MjsJoint]
    geoms: list[MjsGeom]
    materials: list[MjsMaterial]
    pairs: list[MjsPair]
    textures: list[MjsTexture]
    def add_actuator(self, **fields: Any) -> Any: ...
    def add_material(self, **fields: Any) -> MjsMaterial: ...
    def add_mesh(self, **fields: Any) -> MjsMesh: ...
    def add_numeric(self, **fields: Any) -> Any: ...
    def add_pair(self, **fields: Any) -> MjsPair: ...
    def add_texture(self, **fields: Any) -> MjsTexture: ...
    def actuator(self, name: str) -> Any: ...
    def body(self, name: str) -> MjsBody: ...
    def compile(self) -> MjModel: ...
    def delete(self, element: object) -> None: ...
    def geom(self, name: str) -> MjsGeom: ...
    def joint(self, name: str) -> MjsJoint: ...
    def light(self, name: str) -> Any: ...
    def material(self, name: str) -> MjsMaterial: ...
    def to_xml(self) -> str: ...
