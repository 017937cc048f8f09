"""MuJoCo's structs, as far as Roller uses them: a model, its data, and what is drawn of them."""

from collections.abc import Iterator, Mapping
from typing import Any, Generic, TypeVar, overload

import numpy as np
import numpy.typing as npt

_Scalar = TypeVar("_Scalar", bound=np.generic)

class Array(Generic[_Scalar]):
    """A field that is an array, into which all that makes one can be written."""

    @overload
    def __get__(self, instance: None, owner: type) -> Array[_Scalar]: ...
    @overload
    def __get__(self, instance: object, owner: type) -> npt.NDArray[_Scalar]: ...
    def __set__(self, instance: object, value: npt.ArrayLike) -> None: ...

class MjOption:
    cone: int
    disableflags: int
    enableflags: int
    gravity: Array[np.float64]
    impratio: float
    integrator: int
    iterations: int
    jacobian: int
    solver: int
    timestep: float
    tolerance: float

class MjVisual:
    class Global:
        azimuth: float
        elevation: float
        fovy: float
        offheight: int
        offwidth: int

    class Headlight:
        ambient: Array[np.float32]
        diffuse: Array[np.float32]
        specular: Array[np.float32]

    class Map:
        shadowclip: float
        zfar: float
        znear: float

    class Quality:
        offsamples: int
        shadowsize: int

    global_: Global
    headlight: Headlight
    map: Map
    quality: Quality

class MjStatistic:
    center: Array[np.float64]
    extent: float

class MjModel:
    @staticmethod
    def from_binary_path(filename: str, assets: Mapping[str, bytes] | None = None) -> MjModel: ...
    @staticmethod
    def from_xml_string(xml: str, assets: Mapping[str, bytes] | None = None) -> MjModel: ...
    opt: MjOption
    vis: MjVisual
    stat: MjStatistic
    names: bytes
    na: int
    nbody: int
    ngeom: int
    njnt: int
    nq: int
    nu: int
    nv: int
    actuator_forcelimited: Array[np.bool_]
    body_mass: Array[np.float64]
    dof_damping: Array[np.float64]
    geom_bodyid: Array[np.int32]
    geom_conaffinity: Array[np.int32]
    geom_contype: Array[np.int32]
    geom_dataid: Array[np.int32]
    geom_group: Array[np.int32]
    geom_matid: Array[np.int32]
    geom_pos: Array[np.float64]
    geom_priority: Array[np.int32]
    geom_quat: Array[np.float64]
    geom_rgba: Array[np.float32]
    mat_rgba: Array[np.float32]
    geom_size: Array[np.float64]
    geom_solimp: Array[np.float64]
    geom_solref: Array[np.float64]
    geom_type: Array[np.int32]
    mesh_vert: Array[np.float32]
    qpos0: Array[np.float64]
    # Views of one object each, with the fields that its kind has.
    def actuator(self, key: str | int) -> Any: ...
    def body(self, key: str | int) -> Any: ...
    def geom(self, key: str | int) -> Any: ...
    def joint(self, key: str | int) -> Any: ...
    def light(self, key: str | int) -> Any: ...
    def material(self, key: str | int) -> Any: ...
    def mesh(self, key: str | int) -> Any: ...

class MjContact:
    dist: float
    exclude: int

class _ContactList:
    def __getitem__(self, key: int) -> MjContact: ...
    def __iter__(self) -> Iterator[MjContact]: ...
    def __len__(self) -> int: ...
    dist: Array[np.float64]
    frame: Array[np.float64]
    geom: Array[np.int32]
    pos: Array[np.float64]

class MjWarningStat:
    lastinfo: int
    number: int

class _WarningList(list[MjWarningStat]):
    number: Array[np.int32]

class MjTimerStat:
    duration: float
    number: int

class MjData:
    def __init__(self, model: MjModel) -> None: ...
    @property
    def model(self) -> MjModel: ...
    @property
    def contact(self) -> _ContactList: ...
    @property
    def warning(self) -> _WarningList: ...
    @property
    def timer(self) -> list[MjTimerStat]: ...
    ncon: int
    time: float
    act: Array[np.float64]
    ctrl: Array[np.float64]
    energy: Array[np.float64]
    geom_xmat: Array[np.float64]
    geom_xpos: Array[np.float64]
    light_xdir: Array[np.float64]
    light_xpos: Array[np.float64]
    mocap_pos: Array[np.float64]
    mocap_quat: Array[np.float64]
    qfrc_applied: Array[np.float64]
    qpos: Array[np.float64]
    qvel: Array[np.float64]
    subtree_angmom: Array[np.float64]
    subtree_linvel: Array[np.float64]
    xfrc_applied: Array[np.float64]
    xmat: Array[np.float64]
    xpos: Array[np.float64]
    xquat: Array[np.float64]
    def actuator(self, key: str | int) -> Any: ...
    def body(self, key: str | int) -> Any: ...
    def geom(self, key: str | int) -> Any: ...
    def joint(self, key: str | int) -> Any: ...

class MjrRect:
    def __init__(self, left: int, bottom: int, width: int, height: int) -> None: ...
    bottom: int
    height: int
    left: int
    width: int

class MjvPerturb: ...

class MjvCamera:
    azimuth: float
    distance: float
    elevation: float
    lookat: Array[np.float64]
    type: int

class MjvGeom:
    category: int
    emission: float
    label: str
    pos: Array[np.float32]
    rgba: Array[np.float32]
    shininess: float
    size: Array[np.float32]
    specular: float
    type: int

class MjvOption:
    flags: Array[np.uint8]
    geomgroup: Array[np.uint8]

class MjvScene:
    def __init__(self, model: MjModel | None = None, maxgeom: int = 0) -> None: ...
    geoms: tuple[MjvGeom, ...]
    flags: Array[np.uint8]
    maxgeom: int
    ngeom: int
