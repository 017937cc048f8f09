"""The parallel cube: where MuJoCo's free joint and the report's rigid body agree, and where not."""

from __future__ import annotations

import csv
import itertools
import subprocess
import sys
from collections.abc import Sequence
from decimal import Decimal, localcontext
from fractions import Fraction
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given

from roller_env.lab.free import FreeScene, free_model, to_mujoco
from roller_env.lab.methods import MujocoMethod, RigidBodyMethod
from roller_env.lab.parallel import (
    AGREEMENT,
    BODIES,
    FLIGHTS,
    REFERENCE_ERROR,
    Settings,
    chosen,
    compare,
    flown,
    parsed_keys,
)
from roller_env.rigid_body import (
    LIE_RK4,
    RK4,
    RK4_BODY,
    SPLITTING4,
    Integrator,
    State,
    quaternion,
)
from roller_env.rigid_body.arrays import Float64, cross
from tests.rigid_body.bodies import EXAMPLES, boxes, states

SCRIPT = Path(__file__).parents[2] / "scripts" / "parallel_cube.py"
MUJOCO_RK4 = MujocoMethod("RK4")
DT_S = 1e-3
FLIGHT_S = 10.0


def settings(
    *names: str, method: Integrator = RK4, dt_s: float = DT_S, duration_s: float = FLIGHT_S
) -> Settings:
    flights = {name: FLIGHTS[name] for name in names or FLIGHTS}
    return Settings(("cube", "box"), flights, method, MUJOCO_RK4, dt_s, duration_s)


def verdicts(body: str, wanted: Settings) -> dict[str, Any]:
    return {row.scene: row for row in compare(wanted, body)[0].itertuples()}


@pytest.fixture(scope="module")
def cube() -> dict[str, Any]:
    return verdicts("cube", settings())


@pytest.fixture(scope="module")
def box() -> dict[str, Any]:
    return verdicts("box", settings())


@pytest.fixture(scope="module")
def box_in_its_own_axes() -> dict[str, Any]:
    return verdicts("box", settings(method=RK4_BODY))


# --- where they agree, and where not ---------------------------------------------------------


@pytest.mark.parametrize("scene", FLIGHTS)
def test_the_cubes_position_and_attitude_agree_for_ten_seconds(
    cube: dict[str, Any], scene: str
) -> None:
    assert cube[scene].position_m <= AGREEMENT
    assert cube[scene].attitude_rad <= AGREEMENT
    assert cube[scene].verdict == "agree"


@pytest.mark.parametrize("scene", FLIGHTS)
def test_the_cubes_momenta_and_energy_agree_to_rounding(cube: dict[str, Any], scene: str) -> None:
    """Ten thousand sums of up to 98 kg m/s and 4.8 kJ; under torque 2e-12 of them are order 4."""
    assert cube[scene].momentum_kg_m_s < 1e-12
    assert cube[scene].angular_momentum_kg_m2_s < 1e-11
    assert cube[scene].energy_j < 1e-11


def test_the_cubes_attitude_differs_by_what_sums_of_quaternions_cost(
    cube: dict[str, Any],
) -> None:
    """T w (dt w)^4 / 5120 rad at constant spin w: MuJoCo turns by rotations, which cost nothing."""
    spin = float(np.linalg.norm(FLIGHTS["drift"].spin_rad_s))
    late = FLIGHT_S * spin * (DT_S * spin) ** 4 / 5120.0
    assert cube["drift"].attitude_rad == pytest.approx(late, rel=1e-2)
    assert cube["drift"].mujoco_attitude_error_rad < 1e-12


@pytest.mark.parametrize("scene", ["drift", "ballistic", "keys", "lift"])
def test_the_boxs_attitudes_part_and_ours_is_the_wrong_one(box: dict[str, Any], scene: str) -> None:
    found = box[scene]
    assert AGREEMENT < found.attitude_rad < 5e-8
    assert found.ours_attitude_error_rad > 10.0 * found.mujoco_attitude_error_rad
    assert found.mujoco_attitude_error_rad < 3e-10
    assert found.verdict.startswith("ours rk4 is off by")


@pytest.mark.parametrize("scene", ["drift", "ballistic", "keys", "lift"])
def test_the_boxs_position_agrees_all_the_same(box: dict[str, Any], scene: str) -> None:
    assert box[scene].position_m <= 1e-10
    assert box[scene].ours_position_error_m <= 1e-10
    assert box[scene].mujoco_position_error_m <= 1e-10


@pytest.mark.parametrize("scene", FLIGHTS)
def test_in_body_axes_the_box_agrees_with_mujoco_in_every_scene(
    box_in_its_own_axes: dict[str, Any], scene: str
) -> None:
    assert box_in_its_own_axes[scene].position_m <= AGREEMENT
    assert box_in_its_own_axes[scene].attitude_rad <= AGREEMENT
    assert box_in_its_own_axes[scene].verdict == "agree"


# --- why -------------------------------------------------------------------------------------


def remedy(scene: str, method: Integrator, dt_s: float, duration_s: float) -> dict[str, float]:
    """Return the largest angles of a box's flight: between the two, of ours and of MuJoCo's."""
    flight = settings(scene, dt_s=dt_s, duration_s=duration_s).scene("box", scene, dt_s)
    mine = flown(flight, RigidBodyMethod(method), dt_s)
    theirs = flown(flight, MUJOCO_RK4, dt_s)
    pairs = {
        "between": (mine, theirs),
        "ours": (mine, flight.truth),
        "MuJoCo": (theirs, flight.truth),
    }
    return {
        name: float(quaternion.angle_between(a.rotation, b.rotation).max())
        for name, (a, b) in pairs.items()
    }


def test_turns_do_not_mend_the_thrown_box_but_body_axes_do() -> None:
    """Classical Runge-Kutta and sums of quaternions as before; only the axes are others."""
    coarse = 8.0 * DT_S
    error = {
        method.name: remedy("ballistic", method, coarse, FLIGHT_S)["ours"]
        for method in (RK4, LIE_RK4, RK4_BODY)
    }
    assert error["lie_rk4"] > 0.5 * error["rk4"]
    assert error["rk4_body"] < 1e-2 * error["rk4"]


def test_half_the_step_shrinks_the_difference_sixteenfold() -> None:
    apart = [remedy("drift", RK4, dt_s, 1.0)["between"] for dt_s in (4e-3, 2e-3, 1e-3)]
    ratios = [coarse / fine for coarse, fine in itertools.pairwise(apart)]
    assert ratios == pytest.approx([16.0, 16.0], rel=0.02), apart


def test_splitting_is_nearer_to_the_truth_than_mujoco() -> None:
    found = remedy("drift", SPLITTING4, 4e-3, 1.0)
    assert found["ours"] < 0.1 * found["MuJoCo"]


def test_mujocos_rk4_is_munthe_kaas_in_body_axes() -> None:
    """So its attitude is of order four, and a step of it can be written down in ten lines."""
    body, scene, h = BODIES["box"], FLIGHTS["drift"], 0.1
    inertia, w1 = body.inertia[0], np.array(scene.spin_rad_s)

    def alpha(w: Float64) -> Float64:
        rate: Float64 = -cross(w, inertia * w) / inertia
        return rate

    def inverse_dexp(u: Float64, w: Float64) -> Float64:
        half = 0.5 * float(np.linalg.norm(u))
        first = cross(u, w)
        factor = (1.0 - half / np.tan(half)) / (4.0 * half**2)
        rate: Float64 = w + 0.5 * first + factor * cross(u, first)
        return rate

    w2 = w1 + 0.5 * h * alpha(w1)
    w3 = w1 + 0.5 * h * alpha(w2)
    w4 = w1 + h * alpha(w3)
    r2 = inverse_dexp(0.5 * h * w1, w2)
    r3 = inverse_dexp(0.5 * h * r2, w3)
    r4 = inverse_dexp(h * r3, w4)
    turn = quaternion.from_rotation_vector(h / 6.0 * (w1 + 2.0 * (r2 + r3) + r4)[None])
    one_step = settings("drift", dt_s=h, duration_s=h).scene("box", "drift", h)
    expected = quaternion.multiply(one_step.start.rotation, turn)
    stepped = flown(one_step, MUJOCO_RK4, h)
    assert float(quaternion.angle_between(stepped.rotation, expected)[0]) < 1e-15


# --- momentum form against velocity form -----------------------------------------------------


@EXAMPLES
@given(states(boxes(1)))
def test_mujoco_sees_the_same_momenta_and_energy(state: State) -> None:
    model = free_model(state.body, MUJOCO_RK4, DT_S)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    (data.qpos[:],), (data.qvel[:],) = to_mujoco(state)
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    flyer = 1
    for theirs, mine in (
        (data.subtree_linvel[flyer] * state.body.mass[0], state.momentum[0]),
        (data.subtree_angmom[flyer], state.angular_momentum[0]),
        (data.energy[1], state.kinetic_energy()[0]),
    ):
        np.testing.assert_allclose(theirs, mine, rtol=1e-11, atol=1e-11 * (1 + np.abs(mine).max()))


# --- what acts -------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [RigidBodyMethod(RK4), MUJOCO_RK4], ids=["ours", "MuJoCo"])
def test_both_sides_hold_each_key_for_as_many_steps_as_it_is_down(
    method: RigidBodyMethod | MujocoMethod,
) -> None:
    """The impulse of W, WA, A, SD, D and none, counted by hand, and ten seconds of weight."""
    flight, dt_s = FLIGHTS["keys"], FLIGHT_S / 200
    force_n = 200.0 * 0.0254
    impulse = force_n * np.array([1.0 + 1.5 - 2.5, 1.5 + 1.5 - 2.5 - 1.5, 0.0])
    weight = 10.0 * np.array(flight.acting.gravity_m_s2)
    expected = np.array(flight.velocity_m_s) + impulse + weight
    end = flown(settings("keys", dt_s=dt_s).scene("cube", "keys", dt_s), method, dt_s)
    np.testing.assert_allclose(end.momentum[-1], expected, atol=1e-11)


# --- the reference ---------------------------------------------------------------------------

DIGITS = 40
TERMS = 30


def convolved(a: Sequence[Decimal], b: Sequence[Decimal]) -> Decimal:
    """Return the last coefficient of the product of two series of one length."""
    return sum((x * y for x, y in zip(a, reversed(b), strict=True)), Decimal(0))


def hamilton(a: Sequence[Sequence[Decimal]], b: Sequence[Sequence[Decimal]]) -> list[Decimal]:
    """Return the last coefficients of a quaternion product of series."""
    p = [[convolved(x, y) for y in b] for x in a]
    return [
        p[0][0] - p[1][1] - p[2][2] - p[3][3],
        p[0][1] + p[1][0] + p[2][3] - p[3][2],
        p[0][2] - p[1][3] + p[2][0] + p[3][1],
        p[0][3] + p[1][2] - p[2][1] + p[3][0],
    ]


def conjugate(q: Sequence[Decimal]) -> list[Decimal]:
    return [q[0], *(-x for x in q[1:])]


def attitude_in_40_digits(scene: FreeScene, duration_s: float) -> Float64:
    """Return the orientation after a flight, (1, 4), by Taylor series of Euler's equations.

    L' = L x w - c w + R^T torque and q' = q w / 2 in body axes; all terms are products, so a
    coefficient of every series follows from those before.
    """
    start, acting = scene.start, scene.acting
    inertia, torque = (
        [Decimal(x) for x in values] for values in (start.body.inertia[0], acting.torque_nm)
    )
    damping, step = Decimal(acting.spin_damping_nm_s), Decimal("0.05")
    q = [Decimal(x) for x in start.orientation[0]]
    length = sum((x * x for x in q), Decimal(0)).sqrt()
    q = [x / length for x in q]
    spatial = [[Decimal(0)], *([Decimal(x)] for x in start.angular_momentum[0])]
    inner = hamilton([[x] for x in conjugate(q)], spatial)
    momentum = hamilton([[x] for x in inner], [[x] for x in q])[1:]
    for _ in range(round(duration_s / float(step))):
        turn, spun = [[x] for x in q], [[x] for x in momentum]
        half_way: list[list[Decimal]] = [[], [], [], []]
        for k in range(TERMS):
            omega = [[x / i for x in series] for series, i in zip(spun, inertia, strict=True)]
            flow = hamilton(turn, [[Decimal(0)] * (k + 1), *omega])
            newest = [[x] for x in conjugate([series[k] for series in turn])]
            push = hamilton(newest, [[Decimal(0)], *([x] for x in torque)])
            for series, value in zip(half_way, push, strict=True):
                series.append(value)
            pushed = hamilton(half_way, turn)[1:] if any(torque) else [Decimal(0)] * 3
            change = [
                convolved(spun[i - 2], omega[i - 1])
                - convolved(spun[i - 1], omega[i - 2])
                - damping * omega[i][k]
                + pushed[i]
                for i in range(3)
            ]
            for i in range(4):
                turn[i].append(flow[i] / 2 / (k + 1))
            for i in range(3):
                spun[i].append(change[i] / (k + 1))
        powers = [step**k for k in range(TERMS + 1)]
        q = [sum(map(Decimal.__mul__, series, powers), Decimal(0)) for series in turn]
        momentum = [sum(map(Decimal.__mul__, series, powers), Decimal(0)) for series in spun]
    return np.array([[float(x) for x in q]])


@pytest.mark.parametrize(
    ("body", "scene", "duration_s"),
    [("box", "ballistic", 10.0), ("box", "damping", 1.0), ("box", "torque", 1.0)],
)
def test_the_references_attitude_stands_up_to_40_digits(
    body: str, scene: str, duration_s: float
) -> None:
    flight = settings(scene, dt_s=0.01, duration_s=duration_s).scene(body, scene, 0.01)
    with localcontext() as context:
        context.prec = DIGITS
        truth = attitude_in_40_digits(flight, duration_s)
    found = flight.truth.rotation[-1:]
    error = float(quaternion.angle_between(truth, found)[0])
    assert error < REFERENCE_ERROR


@pytest.mark.parametrize("body", BODIES)
def test_the_references_position_stands_up_to_exact_fractions(body: str) -> None:
    flight, mass = FLIGHTS["keys"], Fraction(float(BODIES[body].mass[0]))
    held, end = flight.acting.held, Fraction(10)
    assert held is not None
    switches = [Fraction(float(t)) for t in held.switches_s]
    found = settings("keys").scene(body, "keys", 0.1).truth.position[-1]
    for axis in range(3):
        x, v = Fraction(0), Fraction(flight.velocity_m_s[axis])
        for begin, stop in zip(switches, [*switches[1:], end], strict=True):
            force = Fraction(float(held.force_at_time(float(begin))[axis]))
            a, t = Fraction(flight.acting.gravity_m_s2[axis]) + force / mass, stop - begin
            x, v = x + v * t + a * t * t / 2, v + a * t
        assert found[axis] == pytest.approx(float(x), rel=0.0, abs=REFERENCE_ERROR)


# --- wrong input -----------------------------------------------------------------------------


def test_a_name_that_does_not_exist_is_refused_with_the_nearest_that_does() -> None:
    with pytest.raises(ValueError, match=r"no scene 'balistic': .* did you mean 'ballistic'"):
        chosen("scene", "balistic", list(FLIGHTS))
    with pytest.raises(ValueError, match=r"no body 'boxx': .* did you mean 'box'"):
        chosen("body", "boxx", list(BODIES))
    assert chosen("scene", "all", list(FLIGHTS)) == tuple(FLIGHTS)


def test_a_step_that_straddles_a_key_or_the_end_is_refused() -> None:
    with pytest.raises(ValueError, match=r"dt 0\.003 s: a flight ends at 10 s"):
        settings("drift", dt_s=0.003)
    with pytest.raises(
        ValueError, match=r"'keys' changes its force at 2\.5 s.*0\.833333333 s would"
    ):
        settings("keys", dt_s=1.0)
    with pytest.raises(ValueError, match="dt must be a positive number"):
        settings("drift", dt_s=-0.001)
    with pytest.raises(ValueError, match="duration must be a positive number"):
        settings("drift", duration_s=float("nan"))


@pytest.mark.parametrize("event", ["W", "soon=W", "=W", "nan=W"])
def test_keys_that_cannot_be_read_are_refused(event: str) -> None:
    with pytest.raises(ValueError, match=f"keys: found '{event}'"):
        parsed_keys([event])


def test_keys_are_read_as_they_are_written() -> None:
    keys = parsed_keys(["0=W", "1=wa", "2.5="])
    assert keys.switches_s.tolist() == [0.0, 1.0, 2.5]
    assert (keys.forces != 0.0).tolist() == [[1, 0, 0], [1, 1, 0], [0, 0, 0]]
    with pytest.raises(ValueError, match=r"unknown keys \['Q'\]"):
        parsed_keys(["0=Q"])


# --- the command -----------------------------------------------------------------------------


def run_script(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_the_command_writes_tables_and_pictures(tmp_path: Path) -> None:
    done = run_script(
        *("--body", "box", "--scene", "keys", "--keys", "0=W", "0.2=", "--dt", "0.02"),
        *("--duration", "0.4", "--out", str(tmp_path)),
    )
    assert done.returncode == 0, done.stderr
    assert "| box | keys |" in done.stdout
    for picture in ("box.png", "box.svg", "box_remedies.png", "box_remedies.svg"):
        assert (tmp_path / picture).stat().st_size > 10_000
    with (tmp_path / "differences.csv").open(encoding="utf-8") as file:
        assert next(file).startswith("# command parallel_cube.py --body box")
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * 20
    assert {row["pair"] for row in rows} == {
        "ours - MuJoCo",
        "ours - reference",
        "MuJoCo - reference",
    }
    assert (tmp_path / "verdicts.json").exists()
    assert (tmp_path / "remedies.csv").exists()


def test_the_command_refuses_a_wrong_name_in_one_line(tmp_path: Path) -> None:
    done = run_script("--method", "rk5", "--out", str(tmp_path / "none"))
    assert done.returncode == 1
    assert done.stderr.startswith("error: no integrator 'rk5'")
    assert "did you mean 'rk4'" in done.stderr
    assert not (tmp_path / "none").exists()
