"""What a level becomes in MuJoCo.

``golden/small.xml`` is compared as text. When the compiler is meant to write something else, look
at what ``python -m tests.compile.test_mjcf`` changes in it, and commit that with the reason.
"""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings

from roller_env.compile.compiled import CompiledLevel, compile_level, level_mjcf
from roller_env.compile.mjcf import BALL, FORCE_ACTUATORS
from roller_env.level import Level, load_level, shipped_levels
from roller_env.level.expand import expand
from roller_env.physics.presets import PRESETS
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.gate import LOWERS_TO_M
from tests.builders import BALL_RADIUS_M, GROUND, make_level, make_world, q, resting
from tests.strategies import levels

GOLDEN = Path(__file__).parent / "golden"


@pytest.fixture(scope="module")
def small() -> Level:
    return load_level(GOLDEN / "small.yaml")


@pytest.fixture(scope="module")
def compiled(small: Level) -> CompiledLevel:
    return compile_level(small)


def names(model: mujoco.MjModel, kind: str) -> list[str]:
    count = {"geom": model.ngeom, "joint": model.njnt, "actuator": model.nu}[kind]
    return [getattr(model, kind)(index).name for index in range(count)]


# The text -----------------------------------------------------------------------------------------


def test_the_small_level_is_written_as_the_golden_file(small: Level) -> None:
    assert level_mjcf(small) == (GOLDEN / "small.xml").read_text(encoding="utf-8")


def test_equal_levels_are_written_equally() -> None:
    texts = {level_mjcf(load_level(GOLDEN / "small.yaml")) for _ in range(3)}
    assert len(texts) == 1


@pytest.mark.parametrize("name", [*shipped_levels(), str(GOLDEN / "small.yaml")])
def test_the_text_loads_in_plain_mujoco_and_is_the_same_model_to_six_digits(name: str) -> None:
    """MuJoCo writes numbers with six digits, so the text's model may differ by that and no more."""
    level = load_level(name)
    ours, theirs = compile_level(level).model, mujoco.MjModel.from_xml_string(level_mjcf(level))
    for kind in ("geom", "joint", "actuator"):
        assert names(theirs, kind) == names(ours, kind)
    for field in (
        *("geom_pos", "geom_quat", "geom_size", "geom_friction", "geom_solref", "geom_solimp"),
        *("geom_contype", "geom_conaffinity", "geom_priority", "body_mass", "actuator_gainprm"),
    ):
        expected = getattr(ours, field)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(getattr(theirs, field), expected, atol=2e-6 * scale)
    assert theirs.opt.timestep == pytest.approx(ours.opt.timestep, rel=1e-6)


def test_the_texts_model_plays_like_the_levels(small: Level, compiled: CompiledLevel) -> None:
    paths = []
    for model in (compiled.model, mujoco.MjModel.from_xml_string(level_mjcf(small))):
        data = mujoco.MjData(model)
        data.actuator("force_x").ctrl = 5.08
        data.actuator("gate").ctrl = -0.5
        path = []
        for _ in range(240):
            mujoco.mj_step(model, data)
            path.append(data.qpos.copy())
        paths.append(np.array(path))
    np.testing.assert_allclose(paths[1], paths[0], atol=2e-5)


def test_the_compiled_model_steps_like_any_mujoco_model(compiled: CompiledLevel) -> None:
    """Saved as MuJoCo's own binary and loaded again, it steps to the same bits."""
    buffer = np.empty(mujoco.mj_sizeModel(compiled.model), dtype=np.uint8)
    mujoco.mj_saveModel(compiled.model, None, buffer)
    loaded = mujoco.MjModel.from_binary_path("level.mjb", {"level.mjb": buffer.tobytes()})
    states = []
    for model in (compiled.model, loaded):
        data = mujoco.MjData(model)
        data.ctrl[:] = 1.0
        mujoco.mj_step(model, data, nstep=200)
        states.append(data.qpos.copy())
    np.testing.assert_array_equal(states[0], states[1])


# What is in the model -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", shipped_levels())
def test_there_is_one_joint_and_one_actuator_for_each_thing_that_moves_and_no_other(
    name: str,
) -> None:
    level = load_level(name)
    model = compile_level(level).model
    movers = [piece.name for piece in (*level.plates, *level.gates, *level.platforms)]
    assert names(model, "joint") == [BALL, *movers]
    assert names(model, "actuator") == [*FORCE_ACTUATORS, *movers]
    slides = [model.joint(mover).type[0] for mover in movers]
    assert slides == [mujoco.mjtJoint.mjJNT_SLIDE] * len(movers)


def test_coins_triggers_and_the_finish_have_no_geoms(small: Level) -> None:
    without = small.model_copy(update={"coins": (), "camera_triggers": ()})
    elsewhere = small.model_copy(
        update={"finish": small.finish.model_copy(update={"at": (1.0, 1.0, 1.0)})}
    )
    assert level_mjcf(without) == level_mjcf(small) == level_mjcf(elsewhere)


def test_coplanar_cells_of_one_material_are_one_geom(compiled: CompiledLevel) -> None:
    """Five cells of the floor plan's default material: an L, which takes two boxes."""
    floor = [name for name in names(compiled.model, "geom") if name.endswith("_default")]
    # The turned box and the ramp are the other two.
    assert len(floor) == 2 + 2


@pytest.mark.parametrize("physics", PRESETS)
def test_the_options_are_the_presets(small: Level, physics: str) -> None:
    option = compile_level(small, physics).model.opt
    preset = PRESETS[physics]
    assert option.timestep == preset.dt_s
    assert option.integrator == getattr(mujoco.mjtIntegrator, f"mjINT_{preset.integrator.upper()}")
    assert option.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert option.impratio == preset.impratio
    assert option.solver == getattr(mujoco.mjtSolver, f"mjSOL_{preset.solver.upper()}")
    assert option.iterations == preset.iterations
    assert option.tolerance == preset.tolerance
    assert option.jacobian == mujoco.mjtJacobian.mjJAC_DENSE
    np.testing.assert_array_equal(option.gravity, [0.0, 0.0, -small.gravity])


def test_an_unknown_preset_is_refused_with_the_nearest_name(small: Level) -> None:
    with pytest.raises(ValueError, match="did you mean 'accurate'"):
        compile_level(small, "acurate")


def test_the_addresses_are_those_of_the_named_pieces(compiled: CompiledLevel) -> None:
    model = compiled.model
    assert compiled.ball_qpos == model.joint(BALL).qposadr[0]
    assert compiled.ball_qvel == model.joint(BALL).dofadr[0]
    assert [model.actuator(int(i)).name for i in compiled.force_ctrl] == list(FORCE_ACTUATORS)
    assert [model.actuator(int(i)).name for i in compiled.plate_ctrl] == ["plate"]
    assert [model.actuator(int(i)).name for i in compiled.gate_ctrl] == ["gate"]
    assert compiled.plate_qpos.tolist() == model.joint("plate").qposadr.tolist()
    assert compiled.gate_qpos.tolist() == model.joint("gate").qposadr.tolist()
    assert model.body(compiled.ball_body).name == BALL


def test_the_keys_forces_act_along_the_worlds_axes_while_the_ball_spins() -> None:
    level = make_level(gravity=0.001, start={"at": (0.0, 0.0, 50.0)})
    for axis in range(3):
        world = make_world(level, seconds=1.0)
        world.spin[0] = 3.0, -7.0, 11.0
        world.force[0, axis] = 2.0
        world.path()
        expected = 2.0 * np.eye(3)[axis]
        np.testing.assert_allclose(world.velocity[0], expected, atol=2e-3)
        np.testing.assert_allclose(world.spin[0], [3.0, -7.0, 11.0], atol=1e-9)


# Hulls --------------------------------------------------------------------------------------------

ROCK = [(300.0, 0.0, 0.0), (310.0, 0.0, 0.0), (300.0, 12.0, 0.0), (310.0, 12.0, 1.0), (302, 3, 4)]
HULLS: dict[str, Any] = {
    "hulls": [{"points": [*ROCK, (303.0, 4.0, 1.0)], "material": "ice"}],
    "wedges": [{"at": (20.0, 0.0, 1.0), "size": (4.0, 3.0, 2.0), "yaw_deg": 30.0}],
    "boxes": [GROUND, {"at": (9.0, 0.0, 0.5), "size": (1.0, 1.0, 1.0), "material": "ice"}],
    "materials": {"ice": {"friction": 0.1, "elasticity": 0.5}},
}


def vertices(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """Return where the vertices of a geom's mesh are in the world, (n, 3) metres."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mesh = model.mesh(int(model.geom_dataid[geom]))
    first = int(mesh.vertadr[0])
    own = model.mesh_vert[first : first + int(mesh.vertnum[0])].astype(float)
    turn = data.geom_xmat[geom].reshape(3, 3)
    found: np.ndarray = own @ turn.T + data.geom_xpos[geom]
    return found


def test_the_vertices_of_a_hull_are_where_the_level_says() -> None:
    """Though MuJoCo moves meshes to their middles and turns them along their main axes."""
    level = make_level(**HULLS)
    model = compile_level(level).model
    meshes = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH)
    solids = [solid for solid in expand(level).solids if isinstance(solid, ConvexSolid)]
    assert sorted(map(tuple, solids[0].corners().tolist())) == sorted(ROCK)
    for geom, solid in zip(meshes.tolist(), solids, strict=True):
        found, wanted = vertices(model, geom), solid.corners()
        away = np.linalg.norm(found[:, None] - wanted, axis=-1)
        assert sorted(away.argmin(axis=1)) == list(range(len(wanted)))
        assert away.min(axis=1).max() < 1e-6, "single precision of a few metres"


def test_a_hull_has_the_contact_of_a_box_of_its_material() -> None:
    model = compile_level(make_level(**HULLS)).model
    of_ice = [model.geom(name).id for name in names(model, "geom") if name.endswith("_ice")]
    assert len(of_ice) == 2
    for field in (
        *("geom_contype", "geom_conaffinity", "geom_priority", "geom_condim", "geom_friction"),
        *("geom_solref", "geom_solimp", "geom_margin", "geom_gap", "geom_solmix"),
    ):
        box, hull = getattr(model, field)[of_ice]
        np.testing.assert_array_equal(box, hull, err_msg=field)


def test_the_text_of_a_level_with_hulls_loads_in_plain_mujoco() -> None:
    level = make_level(**HULLS)
    ours, theirs = compile_level(level).model, mujoco.MjModel.from_xml_string(level_mjcf(level))
    assert names(theirs, "geom") == names(ours, "geom")
    for geom in np.flatnonzero(ours.geom_type == mujoco.mjtGeom.mjGEOM_MESH).tolist():
        np.testing.assert_allclose(vertices(theirs, geom), vertices(ours, geom), atol=1e-4)


# Contacts -----------------------------------------------------------------------------------------


def crowded() -> Level:
    """A gate that stands in a wall, a plate let into the deck, and a pad under both."""
    return make_level(
        gates=[{"name": "gate", "at": (3.0, 0.0, 0.5), "size": (0.2, 3.0, 2.0), "lowers_to": -1.0}],
        plates=[
            {
                "name": "plate",
                "at": (0.0, 0.0, -0.2),
                "size": (2.0, 2.0, 0.6),
                "opens": ["gate"],
                "sinks_to": -0.4,
            }
        ],
        lift_pads=[{"at": (2.9, 0.0, 0.0), "size": (1.0, 1.0, 0.4), "force_n": 20.0}],
        walls=[{"start": (3.0, -4.0), "end": (3.0, 4.0), "bottom": 0.0, "height": 1.0}],
        start={"at": resting(1.5)},
    )


def test_only_the_ball_and_a_piece_of_the_level_ever_touch() -> None:
    """Though the gate overlaps the wall and the pad, and the plate the deck, from the start."""
    model = compile_level(crowded()).model
    data = mujoco.MjData(model)
    ball = model.geom(BALL).id
    met = set()
    data.actuator("force_x").ctrl = 5.0
    data.actuator("gate").ctrl = -0.5
    data.actuator("plate").ctrl = -0.05
    for _ in range(600):
        mujoco.mj_step(model, data)
        for pair in data.contact.geom:
            assert ball in pair
            met.add(model.geom(int(pair[pair != ball][0])).name)
    assert {"lift_pad_0"} < met


@settings(max_examples=25, deadline=None)
@given(levels())
def test_any_valid_level_compiles_and_moves_finitely(level: Level) -> None:
    compiled = compile_level(level)
    model, data = compiled.model, mujoco.MjData(compiled.model)
    ball = model.geom(BALL).id
    data.ctrl[compiled.force_ctrl] = 5.08, 5.08, 0.0
    data.ctrl[compiled.plate_ctrl] = [-plate.speed for plate in level.plates]
    data.ctrl[compiled.gate_ctrl] = [-gate.speed for gate in level.gates]
    for _ in range(50):
        mujoco.mj_step(model, data)
        assert all(ball in pair for pair in data.contact.geom)
    assert np.isfinite(data.qpos).all()
    assert np.isfinite(data.qvel).all()
    assert not data.warning.number.any()


@settings(max_examples=5, deadline=None)
@given(levels())
def test_any_valid_levels_text_loads(level: Level) -> None:
    loaded = mujoco.MjModel.from_xml_string(level_mjcf(level))
    assert names(loaded, "geom") == names(compile_level(level).model, "geom")


# Plates and gates ---------------------------------------------------------------------------------

PLATE_Q = {"name": "plate", "at": q(0, 0, 72), "size": q(112, 112, 22), "opens": ["gate"]}
GATE_Q = {
    "name": "gate",
    "at": q(400, 0, 64),
    "size": q(16, 128, 224),
    "lowers_to": LOWERS_TO_M,
}
FRAME_S = 1 / 60
"""The original's frame: it stops a slab at most one frame's travel below its stop."""

movers = pytest.mark.parametrize(
    ("name", "top_q", "speed_q", "travel_q"),
    [("plate", (0, 0, 83), 1.6, 5.0), ("gate", (400, 0, 176), 32.0, 96.0)],
)


@movers
@pytest.mark.parametrize("physics", PRESETS)
@pytest.mark.parametrize("drop_m", [0.0, 10.0, None], ids=["under the ball", "ball falls", "alone"])
def test_a_slab_moves_at_its_speed_and_stays_where_the_original_stops(
    physics: str,
    name: str,
    top_q: tuple[float, float, float],
    speed_q: float,
    travel_q: float,
    drop_m: float | None,
) -> None:
    """With the ball standing on it, with the ball landing on it from 10 m, and without."""
    top = q(*top_q)
    start = {"at": (top[0], 0.0, top[2] + BALL_RADIUS_M + (drop_m or 0.0))}
    if drop_m is None:
        start = {"at": resting(-10.0)}
    level = make_level(plates=[PLATE_Q], gates=[GATE_Q], start=start)
    world = make_world(level, seconds=6.0, physics=physics)
    piece = {"plate": world.compiled.plate_ctrl, "gate": world.compiled.gate_ctrl}[name]
    world.stepper.ctrl[0, piece] = -speed_q * 0.0254
    address = world.compiled.model.joint(name).qposadr[0]
    path_q = world.stepper.advance()[0, :, address] / 0.0254
    second = round(1.0 / world.dt_s)
    assert path_q[2 * second] - path_q[second] == pytest.approx(-speed_q, rel=0.02)
    assert -travel_q - speed_q * FRAME_S < path_q[-1] < -travel_q
    assert np.abs(path_q[-second:] - path_q[-1]).max() < 1e-3, "it stays there"


@movers
def test_a_slab_that_nobody_moves_stands_still_under_a_ball_from_10_m(
    name: str, top_q: tuple[float, float, float], speed_q: float, travel_q: float
) -> None:
    del speed_q, travel_q
    x, y, z = q(*top_q)
    start = {"at": (x, y, z + BALL_RADIUS_M + 10.0)}
    world = make_world(make_level(plates=[PLATE_Q], gates=[GATE_Q], start=start), seconds=3.0)
    address = world.compiled.model.joint(name).qposadr[0]
    moved = world.stepper.advance()[0, :, address]
    assert np.abs(moved).max() < 0.01
    assert abs(moved[-1]) < 1e-5


def test_a_ball_pushed_against_a_gate_does_not_move_it() -> None:
    start = {"at": q(370, 0, 16)}
    world = make_world(make_level(plates=[PLATE_Q], gates=[GATE_Q], start=start), seconds=2.0)
    world.force[0, 0] = 5.08
    path = world.path()[0]
    assert path[-1, 0] == pytest.approx(q(400 - 8, 0, 0)[0] - BALL_RADIUS_M, abs=1e-3)
    assert abs(world.stepper.qpos[0, world.compiled.gate_qpos[0]]) < 1e-6


def test_a_gate_that_comes_down_on_the_ball_does_not_break_the_physics() -> None:
    """It is stronger than anything; the ball is squeezed out or pressed down, finitely."""
    gate = {"name": "gate", "at": (0.05, 0.0, 2.0), "size": (0.4, 3.0, 2.0), "lowers_to": 1.0}
    plate = PLATE_Q | {"at": (-6.0, 0.0, 0.4), "size": (1.0, 1.0, 0.8), "sinks_to": 0.0}
    world = make_world(make_level(plates=[plate], gates=[gate]), seconds=4.0)
    world.stepper.ctrl[0, world.compiled.gate_ctrl] = -0.8
    path = world.path()[0]
    assert np.isfinite(path).all()
    assert not world.stepper.diverged().any()
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() / world.dt_s < 20.0


@pytest.mark.parametrize("yaw_deg", [0.0, 30.0, 90.0])
def test_a_turned_gate_stands_where_the_level_says(yaw_deg: float) -> None:
    gate = GATE_Q | {"at": (4.0, 0.0, 0.0), "size": (0.2, 3.0, 2.0), "yaw_deg": yaw_deg}
    model = compile_level(make_level(plates=[PLATE_Q], gates=[gate])).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    along = data.geom("gate").xmat.reshape(3, 3)[:, 1]
    yaw = math.radians(yaw_deg)
    np.testing.assert_allclose(along, [-math.sin(yaw), math.cos(yaw), 0.0], atol=1e-12)


if __name__ == "__main__":
    (GOLDEN / "small.xml").write_text(
        level_mjcf(load_level(GOLDEN / "small.yaml")), encoding="utf-8"
    )


def test_a_floor_of_19_600_pieces_in_two_materials_compiles_in_seconds() -> None:
    rows = [("ab" * 70)[shift : shift + 139] + "a" for shift in (0, 1)]
    chequered = {
        "corner": (0.0, 0.0, -9.0),
        "cell": 1.0,
        "plan": "\n".join(rows * 70),
        "legend": {"a": {}, "b": {"material": "ice"}},
    }
    level = make_level(floors=[chequered], materials={"ice": {"friction": 0.1}})
    began = time.process_time()
    model = compile_level(level).model
    assert time.process_time() - began < 5.0
    assert model.ngeom > 19_000
