"""MuJoCo's enumerations, as far as Roller uses them."""

from typing import ClassVar

class _Enum(int):
    """No `enum.Enum`, but taken wherever an int is."""

    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class mjtBias(_Enum):
    mjBIAS_AFFINE: ClassVar[mjtBias]
    __members__: ClassVar[dict[str, mjtBias]]

class mjtCamera(_Enum):
    mjCAMERA_FREE: ClassVar[mjtCamera]
    __members__: ClassVar[dict[str, mjtCamera]]

class mjtCatBit(_Enum):
    mjCAT_ALL: ClassVar[mjtCatBit]
    __members__: ClassVar[dict[str, mjtCatBit]]

class mjtCone(_Enum):
    mjCONE_ELLIPTIC: ClassVar[mjtCone]
    mjCONE_PYRAMIDAL: ClassVar[mjtCone]
    __members__: ClassVar[dict[str, mjtCone]]

class mjtDisableBit(_Enum):
    mjDSBL_AUTORESET: ClassVar[mjtDisableBit]
    mjDSBL_CONTACT: ClassVar[mjtDisableBit]
    mjDSBL_EULERDAMP: ClassVar[mjtDisableBit]
    mjDSBL_ISLAND: ClassVar[mjtDisableBit]
    mjDSBL_MIDPHASE: ClassVar[mjtDisableBit]
    mjDSBL_REFSAFE: ClassVar[mjtDisableBit]
    __members__: ClassVar[dict[str, mjtDisableBit]]

class mjtDyn(_Enum):
    mjDYN_INTEGRATOR: ClassVar[mjtDyn]
    __members__: ClassVar[dict[str, mjtDyn]]

class mjtEnableBit(_Enum):
    mjENBL_ENERGY: ClassVar[mjtEnableBit]
    mjENBL_SLEEP: ClassVar[mjtEnableBit]
    mjENBL_SPECULATIVE: ClassVar[mjtEnableBit]
    __members__: ClassVar[dict[str, mjtEnableBit]]

class mjtFontScale(_Enum):
    mjFONTSCALE_100: ClassVar[mjtFontScale]
    __members__: ClassVar[dict[str, mjtFontScale]]

class mjtFramebuffer(_Enum):
    mjFB_OFFSCREEN: ClassVar[mjtFramebuffer]
    __members__: ClassVar[dict[str, mjtFramebuffer]]

class mjtGeom(_Enum):
    mjGEOM_BOX: ClassVar[mjtGeom]
    mjGEOM_CYLINDER: ClassVar[mjtGeom]
    mjGEOM_MESH: ClassVar[mjtGeom]
    mjGEOM_PLANE: ClassVar[mjtGeom]
    mjGEOM_SPHERE: ClassVar[mjtGeom]
    __members__: ClassVar[dict[str, mjtGeom]]

class mjtIntegrator(_Enum):
    mjINT_DISCRETE: ClassVar[mjtIntegrator]
    mjINT_EULER: ClassVar[mjtIntegrator]
    mjINT_IMPLICIT: ClassVar[mjtIntegrator]
    mjINT_IMPLICITFAST: ClassVar[mjtIntegrator]
    mjINT_RK4: ClassVar[mjtIntegrator]
    __members__: ClassVar[dict[str, mjtIntegrator]]

class mjtJacobian(_Enum):
    mjJAC_DENSE: ClassVar[mjtJacobian]
    mjJAC_SPARSE: ClassVar[mjtJacobian]
    __members__: ClassVar[dict[str, mjtJacobian]]

class mjtJoint(_Enum):
    mjJNT_SLIDE: ClassVar[mjtJoint]
    __members__: ClassVar[dict[str, mjtJoint]]

class mjtLightType(_Enum):
    mjLIGHT_DIRECTIONAL: ClassVar[mjtLightType]
    __members__: ClassVar[dict[str, mjtLightType]]

class mjtMeshInertia(_Enum):
    mjMESH_INERTIA_SHELL: ClassVar[mjtMeshInertia]
    __members__: ClassVar[dict[str, mjtMeshInertia]]

class mjtSolver(_Enum):
    mjSOL_CG: ClassVar[mjtSolver]
    mjSOL_PGS: ClassVar[mjtSolver]
    __members__: ClassVar[dict[str, mjtSolver]]

class mjtStage(_Enum):
    mjSTAGE_NONE: ClassVar[mjtStage]
    __members__: ClassVar[dict[str, mjtStage]]

class mjtState(_Enum):
    mjSTATE_CTRL: ClassVar[mjtState]
    mjSTATE_INTEGRATION: ClassVar[mjtState]
    __members__: ClassVar[dict[str, mjtState]]

class mjtTexture(_Enum):
    __members__: ClassVar[dict[str, mjtTexture]]

class mjtTextureRole(_Enum):
    mjTEXROLE_RGB: ClassVar[mjtTextureRole]
    __members__: ClassVar[dict[str, mjtTextureRole]]

class mjtTimer(_Enum):
    mjTIMER_STEP: ClassVar[mjtTimer]
    __members__: ClassVar[dict[str, mjtTimer]]

class mjtTrn(_Enum):
    mjTRN_JOINT: ClassVar[mjtTrn]
    __members__: ClassVar[dict[str, mjtTrn]]
