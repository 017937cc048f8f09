"""Limits of contacts: impacts, walls, friction, resting, seams, and why a skidding ball hops."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any, Final

import mujoco
import numpy as np

from roller_env.compile.compiled import compile_level
from roller_env.compile.mjcf import build_spec
from roller_env.lab import game
from roller_env.lab.contact.scene import UPWARDS, add_ball, contact_of, new_spec
from roller_env.lab.methods import MUJOCO, MujocoMethod
from roller_env.lab.simulate import Start, record, settled, started, stays
from roller_env.lab.stability.limits import Case, Effort, Limit, Quantity
from roller_env.lab.stability.smooth import damping_limit, rk4_servo_limit
from roller_env.physics.materials import DAMPING_STEPS
from roller_env.physics.presets import MUJOCO_PRESETS, PhysicsPreset

EULER, _, IMPLICITFAST, DISCRETE, RK4 = MUJOCO

GRAVITY: Final = 9.81
RADIUS_M: Final = 0.2
WALL_M: Final = 0.1
"""Thickness of the wall that the ball is shot at."""

TAU_S: Final = 0.02
"""MuJoCo's default time constant of a contact."""
IMPEDANCE: Final = 0.95
"""MuJoCo's default lets it rise from 0.9 to 0.95 within the first millimetre of depth."""
COARSE_S: Final = 0.002
"""MuJoCo's default time step."""
FINE_S: Final = TAU_S / 400
"""A step that resolves a contact; what remains of the discretisation is about h / tau."""
SETTLE_S: Final = 0.5
"""After which what was put down no longer sinks."""
SPECULATIVE: Final = int(mujoco.mjtEnableBit.mjENBL_SPECULATIVE)
REST_M: Final = (1.0 - IMPEDANCE) * GRAVITY * TAU_S**2
"""Depth at which a ball rests in the floor."""


def add_box(
    spec: mujoco.MjSpec, at: Sequence[float], half_size: Sequence[float], **contact: Any
) -> None:
    """Add a fixed box."""
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=at, size=half_size, **contact)


@lru_cache(maxsize=64)
def ball_on_box(
    method: MujocoMethod,
    dt_s: float,
    *,
    solref: tuple[float, float] = (TAU_S, 1.0),
    impedance: float = IMPEDANCE,
    friction: float = 0.0,
    gravity: float = 0.0,
    thickness: float = 2.0,
    **options: float,
) -> mujoco.MjModel:
    """Return a wide box whose upper face is at z = 0, and on it a ball of 1 kg that cannot turn.

    ``qpos`` is the way of the ball from where it touches the face.
    """
    spec = new_spec(method, dt_s, gravity, **options)
    contact = contact_of(friction, solref, impedance)
    add_ball(spec, (0.0, 0.0, RADIUS_M), RADIUS_M, slides=np.eye(3).tolist(), **contact)
    add_box(spec, (0.0, 0.0, -thickness / 2), (50.0, 50.0, thickness / 2), **contact)
    return spec.compile()


def thrown(height_m: float, speed_m_s: float = 0.0) -> Start:
    """Return what puts the ball over the face and gives it a speed upwards."""

    def start(data: mujoco.MjData) -> None:
        data.qpos[2], data.qvel[2] = height_m, speed_m_s

    return start


def impact(
    method: MujocoMethod, dt_s: float, ratio: float = 1.0, phase: float = 0.5
) -> tuple[float, float]:
    """Throw a weightless ball at 1 m/s at a floor; return its greatest depth and speed of return.

    ``phase`` is the fraction of a step's way that it is in the floor when first seen there.
    """
    model = ball_on_box(method, dt_s, solref=(TAU_S, ratio))
    data = started(model, thrown((1.0 - phase) * dt_s, -1.0))
    path = record(model, data, 2 + math.ceil(10.0 * TAU_S / dt_s))
    return -float(path.qpos[:, 2].min()), float(path.qvel[-1, 2])


def worst_return(phase_step: float, ratio: float) -> float:
    """Return how much faster than it came a ball can leave a contact, at any phase of arrival.

    The Euler step of the unilateral spring, written out: while the ball is in the floor,
    v += h max(0, w² x - 2 z w v) downwards, x -= h v. ``phase_step`` is h w, w = 1 / (tau z)
    being the contact's natural frequency, and ``ratio`` its damping ratio z.
    """
    depth = phase_step * np.linspace(0.0, 1.0, 2001)
    speed = np.ones_like(depth)
    while True:
        push = phase_step * (depth + 2.0 * ratio * speed)
        pushed = (depth > 0.0) & (push > 0.0)
        if not pushed.any():
            return float(-speed.min())
        speed -= np.where(pushed, push, 0.0)
        depth += np.where(pushed, phase_step * speed, 0.0)


def _impact(method: MujocoMethod, depth_or_return: int, _effort: Effort) -> float:
    return impact(method, FINE_S)[depth_or_return]


def _return(dt_s: float, ratio: float, effort: Effort) -> float:
    phases = np.linspace(1e-6, 1.0 - 1e-6, 4 * effort.phases).tolist()
    return max(impact(EULER, dt_s, ratio, phase)[1] for phase in phases)


def _bounce(method: MujocoMethod, dt_s: float, effort: Effort) -> float:
    model = ball_on_box(method, dt_s, solref=(-1e5, 0.0), impedance=0.99, gravity=GRAVITY)
    ratios = []
    for drop in np.linspace(1.0, 1.05, effort.phases // 2).tolist():
        path = record(model, started(model, thrown(drop)), round(10.0 / dt_s))
        ratios.append(path.qpos[-round(2.2 / dt_s) :, 2].max() / drop)
    return float(np.median(ratios))


def tunnelling_speed(dt_s: float) -> float:
    """Return the speed at which the ball's centre reaches the middle of the wall.

    There the nearest face is the far one. The depth is v tau / e if the step resolves the contact;
    if refsafe clamps tau to 2 h, the ball first seen a whole step's way deep is stopped in it: v h.
    """
    depth = RADIUS_M + WALL_M / 2
    return depth / dt_s if 2.0 * dt_s >= TAU_S else math.e * depth / TAU_S


def _stopped(dt_s: float, flags: int, speed: float, phase: float) -> bool:
    model = ball_on_box(EULER, dt_s, thickness=WALL_M, enableflags=flags)
    steps = 3 + math.ceil(20.0 * max(TAU_S, 2.0 * dt_s) / dt_s)
    end = settled(model, steps * dt_s, thrown((2.0 - phase) * speed * dt_s, -speed))
    return bool(end.qpos[2] + RADIUS_M > -WALL_M / 2)


def _wall(dt_s: float, flags: int, effort: Effort, speed: float) -> bool:
    # Not 0 nor 1: see the case of the ball that a step ends exactly touching.
    phases = np.linspace(1e-4, 1.0 - 1e-4, effort.phases).tolist()
    return all(_stopped(dt_s, flags, speed, phase) for phase in phases)


def _sweep(effort: Effort, rate_hz: float) -> bool:
    """Say whether a speculative contact stops every ball; of 1/h, so that more is worse."""
    speeds = np.linspace(1.02 * tunnelling_speed(1 / rate_hz), 120.0, effort.phases).tolist()
    return all(_wall(1 / rate_hz, SPECULATIVE, effort, speed) for speed in speeds)


def _touching(_effort: Effort) -> float:
    # Binary fractions, so that the floating-point way to the wall is exact.
    return math.inf if _stopped(1 / 512, SPECULATIVE, 256.0, 0.0) else 256.0


MU: Final = 0.5

SLID_M_S: Final = (0.9 - math.sqrt(0.5)) * MU * GRAVITY * 2.0
BENT_DEG: Final = math.degrees(
    math.atan2(2.0 * math.sin(math.pi / 8), 2.0 * math.cos(math.pi / 8) - MU * GRAVITY * 0.2)
)
CREEP_M_S: Final = (1.0 - IMPEDANCE) / IMPEDANCE * 0.9 * MU * GRAVITY * IMPEDANCE * TAU_S / 2.0
"""Under 0.9 of the friction, which is a damper b = 2 / (d tau) of the acceleration, made soft by
(1 - d) / d / impratio."""


def slide(
    method: MujocoMethod,
    angle_deg: float,
    seconds: float,
    *,
    push: float = 0.0,
    speed: float = 0.0,
    impratio: float = 1.0,
) -> complex:
    """Return the velocity, m/s, x + iy, of a resting mass after a throw and a lasting push.

    Both are along ``angle_deg``, the push in parts of mu m g, the throw in m/s.
    """
    model = ball_on_box(method, COARSE_S, friction=MU, gravity=GRAVITY, impratio=impratio)
    data = settled(model, SETTLE_S)
    along = np.array([math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))])
    data.qfrc_applied[:2] = push * MU * GRAVITY * along
    data.qvel[:2] += speed * along
    mujoco.mj_step(model, data, round(seconds / COARSE_S))
    return complex(*data.qvel[:2])


def _friction(method: MujocoMethod, angle_deg: float, _effort: Effort, push: float) -> bool:
    # To slip so fast after 4 s takes 0.15 % more than the friction.
    return abs(slide(method, angle_deg, 4.0, push=push, impratio=10.0)) < 0.03


def _heading(method: MujocoMethod, _effort: Effort) -> float:
    return float(np.angle(slide(method, 22.5, 0.2, speed=2.0), deg=True))


def _hold(method: MujocoMethod, impratio: float, _effort: Effort) -> float:
    return abs(slide(method, 45.0, 2.0, push=0.9, impratio=impratio))


def _mocap(method: MujocoMethod, dt_s: float, tau_s: float, _effort: Effort) -> float:
    contact = contact_of(0.0, (tau_s, 1.0), IMPEDANCE)
    spec = new_spec(method, dt_s)
    add_ball(spec, (0.0, 0.0, RADIUS_M), RADIUS_M, slides=np.eye(3).tolist(), **contact)
    wall = spec.worldbody.add_body(mocap=True, pos=(-RADIUS_M - 0.1, 0.0, RADIUS_M))
    wall.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.1, 2.0, 2.0], **contact)
    model = spec.compile()
    data = mujoco.MjData(model)
    start = float(data.mocap_pos[0, 0])

    def move(step: int) -> None:
        data.mocap_pos[0, 0] = start + step * dt_s

    record(model, data, 200 + math.ceil(60.0 * tau_s / dt_s), before=move)
    return float(data.mocap_pos[0, 0] - start - data.qpos[0])


def _resting(method: MujocoMethod, effort: Effort, fraction: float) -> bool:
    kick, unsafe = 1e-9, int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    model = ball_on_box(method, fraction * TAU_S, gravity=GRAVITY, disableflags=unsafe)
    data = started(model, thrown(-REST_M, kick))
    return stays(model, data, effort.steps // 2, lambda: bool(abs(data.qvel[2]) < 1e3 * kick))


def _crush(mass_ratio: float, tau_s: float, _effort: Effort) -> float:
    contact = contact_of(0.0, (tau_s, 1.0), IMPEDANCE)
    spec = new_spec(EULER, tau_s / 40.0, GRAVITY)
    add_ball(spec, (0.0, 0.0, 10.0), 10.0, slides=UPWARDS, **contact)
    add_box(spec, (0.0, 0.0, -1.0), (50.0, 50.0, 1.0), **contact)
    block = spec.worldbody.add_body(pos=(0.0, 0.0, 25.0))
    block.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=UPWARDS[0])
    size = [5.0, 5.0, 5.0]
    block.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=size, mass=mass_ratio, **contact)
    # The soft pair settles with the time constant 2 (1 - d) tau M/m; it is given twelve of them.
    seconds = tau_s * (20.0 + 24.0 * (1.0 - IMPEDANCE) * mass_ratio)
    return -float(settled(spec.compile(), seconds).qpos[1])


def _seam(dt_s: float, effort: Effort) -> float:
    """Roll over four seams of coplanar tiles of 1 m."""
    speed, seams = 5.0, 4
    contact = contact_of(1.0, (TAU_S, 1.0), IMPEDANCE)
    spec = new_spec(EULER, dt_s, GRAVITY)
    add_ball(spec, (0.0, 0.0, RADIUS_M), RADIUS_M, **contact)
    for tile in range(seams + 1):
        add_box(spec, (tile, 0.0, -0.5), (0.5, 2.0, 0.5), **contact)
    model = spec.compile()
    bumps = []
    for phase in np.linspace(0.0, 1.0, max(2, effort.phases // 4), endpoint=False):
        data = mujoco.MjData(model)
        data.qpos[0] = phase * speed * dt_s
        mujoco.mj_step(model, data, round(SETTLE_S / dt_s))
        data.qvel[0], data.qvel[4] = speed, speed / RADIUS_M
        height = record(model, data, round(seams / (speed * dt_s))).qpos[:, 2]
        bumps.append(height[1:].max() - height[0])
    return float(np.median(bumps))


HOP_M_S: Final = 4.0


def hop_speed(dt_s: float, share: float = DAMPING_STEPS) -> float:
    """Return the speed, m/s, with which the game's skidding ball leaves the ground in a step.

    MuJoCo's contact impulse p minimises 1/2 p A p - p (v_wanted - v) over the cone: normal A = 1/m,
    tangential A = 7/2 / m on a sphere that can roll. It wants to remove ``share`` of the slip, s,
    and gravity. On the cone p_t = mu p_n, so that p_n / m = (g h + mu s) / (1 + 7/2 mu²), of which
    gravity takes g h (Anitescu 2006, "Optimization-based simulation of nonsmooth rigid multibody
    dynamics").
    """
    mu, weight = game.FRICTION, game.GRAVITY_M_S2 * dt_s
    return (weight + mu * share * HOP_M_S) / (1.0 + 3.5 * mu**2) - weight


def soft_friction_model(preset: PhysicsPreset, share: float) -> mujoco.MjModel:
    """Return the game's ball on a friction that removes ``share`` of the slip in a step.

    Only an explicit contact pair has a ``solreffriction`` of its own.
    """
    spec = build_spec(game.make_level(), preset)
    floor = next(geom for geom in spec.geoms if geom.name.startswith("solid_"))
    pair = spec.add_pair(geomname1=floor.name, geomname2="ball", condim=3)
    pair.friction = [floor.friction[0], floor.friction[0], 0.0, 0.0, 0.0]
    pair.solref, pair.solimp = floor.solref, floor.solimp
    pair.solreffriction = [0.0, -share / preset.dt_s]
    return spec.compile()


def _hop(dt_s: float, share: float | None, _effort: Effort) -> float:
    preset = replace(MUJOCO_PRESETS["default"], dt_s=dt_s)
    if share is None:
        model = compile_level(game.make_level(), preset).model
    else:
        model = soft_friction_model(preset, share)
    data = mujoco.MjData(model)
    data.qpos[:3] = 0.0, 0.0, game.RADIUS_M
    mujoco.mj_step(model, data, round(SETTLE_S / dt_s))
    data.qvel[0] = HOP_M_S
    mujoco.mj_step(model, data)
    return float(data.qvel[2])


_PYRAMIDAL: Final = MujocoMethod("Euler", "pyramidal")
_IMPACTS: Final = {"euler": EULER, "implicitfast": IMPLICITFAST, "rk4": RK4, "discrete": DISCRETE}

CONTACTS: Final[Mapping[str, Case]] = {
    **{
        f"penetration_{key}": Quantity(TAU_S / math.e, partial(_impact, method, 0))
        for key, method in _IMPACTS.items()
    },
    **{
        f"restitution_{key}": Quantity(math.exp(-2.0), partial(_impact, method, 1))
        for key, method in _IMPACTS.items()
    },
    **{
        f"return_{rate}hz_ratio_{ratio:g}": Quantity(
            worst_return(1 / rate / (TAU_S * ratio), ratio), partial(_return, 1 / rate, ratio)
        )
        for rate, ratio in ((120, 0.1), (120, 0.2), (240, 0.1), (960, 0.1))
    },
    "bounce_euler_4ms": Quantity(1.0, partial(_bounce, EULER, 0.004)),
    "bounce_euler_1ms": Quantity(1.0, partial(_bounce, EULER, 0.001)),
    "bounce_euler_0.25ms": Quantity(1.0, partial(_bounce, EULER, 0.00025)),
    "bounce_rk4_4ms": Quantity(1.0, partial(_bounce, RK4, 0.004)),
    "bounce_rk4_1ms": Quantity(1.0, partial(_bounce, RK4, 0.001)),
    "bounce_discrete_1ms": Quantity(1.0, partial(_bounce, DISCRETE, 0.001)),
    "tunnelling_0.5ms": Limit(tunnelling_speed(5e-4), partial(_wall, 5e-4, 0), 1e-3),
    "tunnelling_2ms": Limit(tunnelling_speed(COARSE_S), partial(_wall, COARSE_S, 0), 1e-3),
    "tunnelling_10ms": Limit(tunnelling_speed(0.01), partial(_wall, 0.01, 0), 1e-3),
    "tunnelling_20ms": Limit(tunnelling_speed(0.02), partial(_wall, 0.02, 0), 1e-3),
    "speculative_0.5ms": Limit(tunnelling_speed(5e-4), partial(_wall, 5e-4, SPECULATIVE), 1e-3),
    "speculative_2ms": Limit(math.inf, partial(_wall, COARSE_S, SPECULATIVE)),
    "speculative_5ms": Limit(math.inf, partial(_wall, 0.005, SPECULATIVE)),
    "speculative_needs_large_steps": Limit(tunnelling_speed(FINE_S) / (WALL_M / 2), _sweep, 5e-3),
    "speculative_exactly_touching": Quantity(math.inf, _touching),
    "friction_elliptic_0deg": Limit(1.0, partial(_friction, EULER, 0.0)),
    "friction_elliptic_45deg": Limit(1.0, partial(_friction, EULER, 45.0)),
    "friction_pyramidal_0deg": Limit(1.0, partial(_friction, _PYRAMIDAL, 0.0)),
    "friction_pyramidal_45deg": Limit(math.sqrt(0.5), partial(_friction, _PYRAMIDAL, 45.0)),
    "heading_elliptic": Quantity(22.5, partial(_heading, EULER)),
    "heading_pyramidal": Quantity(BENT_DEG, partial(_heading, _PYRAMIDAL)),
    "hold_elliptic_impratio_1": Quantity(CREEP_M_S, partial(_hold, EULER, 1.0)),
    "hold_elliptic_impratio_10": Quantity(CREEP_M_S / 10.0, partial(_hold, EULER, 10.0)),
    "hold_pyramidal_impratio_1": Quantity(SLID_M_S, partial(_hold, _PYRAMIDAL, 1.0)),
    "mocap_euler": Quantity(2.0 * TAU_S, partial(_mocap, EULER, COARSE_S, TAU_S)),
    "mocap_implicitfast": Quantity(2.0 * TAU_S, partial(_mocap, IMPLICITFAST, COARSE_S, TAU_S)),
    "mocap_discrete": Quantity(2.0 * TAU_S + COARSE_S, partial(_mocap, DISCRETE, COARSE_S, TAU_S)),
    "refsafe_8ms": Quantity(4.0 * 0.008, partial(_mocap, EULER, 0.008, 0.005)),
    "refsafe_4ms": Quantity(4.0 * 0.004, partial(_mocap, EULER, 0.004, 0.005)),
    "resting_euler": Limit(damping_limit(1.0), partial(_resting, EULER)),
    "resting_implicitfast": Limit(damping_limit(1.0), partial(_resting, IMPLICITFAST)),
    "resting_rk4": Limit(rk4_servo_limit(1.0), partial(_resting, RK4)),
    **{
        f"crush_1_to_{ratio:g}_tau_{1e3 * tau_s:g}ms": Quantity(
            2.0 * (1.0 - IMPEDANCE) * (1.0 + ratio) * GRAVITY * tau_s**2,
            partial(_crush, ratio, tau_s),
        )
        for ratio, tau_s in ((1.0, TAU_S), (1000.0, TAU_S), (1000.0, TAU_S / 10))
    },
    "seam_bump_0.02ms": Quantity(2.0 * REST_M / math.e, partial(_seam, 0.00002)),
    "seam_bump_2ms": Quantity(2.0 * REST_M / math.e, partial(_seam, COARSE_S)),
    **{
        f"hop_{rate}hz": Quantity(hop_speed(1 / rate, DAMPING_STEPS), partial(_hop, 1 / rate, None))
        for rate in (120, 240, 960)
    },
    **{
        f"hop_friction_{share:g}": Quantity(
            hop_speed(1 / 240, share), partial(_hop, 1 / 240, share)
        )
        for share in (0.5, 0.3)
    },
}
"""By name."""
