"""Each way to fail, seen: the setting that fails beside those that cure it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import mujoco
import numpy as np

from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.compile.mjcf import SERVO_G, build_spec
from roller_env.lab.game import GATE_SPEED_M_S, Course, make_level
from roller_env.lab.methods import MujocoMethod
from roller_env.lab.simulate import Float64, Path
from roller_env.lab.stability.failure import Failure, Setting
from roller_env.lab.stability.scenes import (
    RADIUS_M,
    SETTLE_S,
    TAU_S,
    Contact,
    add_ball,
    add_box,
    add_floor,
    new_spec,
)
from roller_env.lab.stability.tunnelling import WALL_M
from roller_env.level import Level, load_level
from roller_env.physics.materials import contact_parameters, restitution
from roller_env.physics.presets import PRESETS, PhysicsPreset
from roller_env.units import quants

DEFAULT: Final = PRESETS["default"]
FAST: Final = PRESETS["fast"]


def without_force_limits(compiled: CompiledLevel) -> CompiledLevel:
    """Return the level, whose servos may now pull as hard as they like; changes its model."""
    compiled.model.actuator_forcelimited[:] = 0
    return compiled


def blow_up() -> Failure:
    """Return the gate's servo, whose damper plain Euler takes from before the step."""
    gate = load_level("gate")

    def setting(label: str, preset: PhysicsPreset) -> Setting:
        compiled = without_force_limits(compile_level(gate, preset))
        course = Course(compiled, gate.start.at, movers_m_s=-GATE_SPEED_M_S)
        return Setting(label, compiled.model, course.prepare)

    address = int(compile_level(gate, DEFAULT).gate_qpos[0])

    def way(record: Path) -> Float64:
        return 1e3 * (record.qpos[:, address] + GATE_SPEED_M_S * record.time)

    return Failure(
        name="blow_up",
        title="A servo that is too stiff for the step blows up",
        why="Plain Euler takes the actuator's damping from before the step and is stable up to "
        "h w = 0.828. The gate's servo has w = 200 rad/s, and 1/240 s makes that 0.833. (Here its "
        "force has no limit; the game's has one, which keeps the blow-up within millimetres.) "
        "implicitfast takes the damping from after the step, and the limit is 4.83.",
        x_label="time, s",
        y_label="gate's distance from its set-point, mm",
        seconds=1.5,
        settings=(
            setting("Euler, 1/240 s", replace(DEFAULT, integrator="Euler")),
            setting("implicitfast, 1/240 s", DEFAULT),
            setting("Euler, 1/480 s", replace(DEFAULT, integrator="Euler", dt_s=1 / 480)),
        ),
        curve=lambda record: (record.time, way(record)),
        quantity="greatest distance after the first 0.1 s, mm",
        value=lambda record: float(np.abs(way(record)[record.time > 0.1]).max()),
        says="{:,.0f} mm off",
        acceptable=2.0 * 1e3 * 2.0 * GATE_SPEED_M_S / 200.0,
        limit_reason="twice the 2 v / w by which a servo trails its set-point",
    )


def tunnelling() -> Failure:
    """Return a ball that is shot through a wall."""
    dt_s, speed = 0.002, 40.0

    def setting(label: str, tau_s: float, *, speculative: bool) -> Setting:
        spec = new_spec(MujocoMethod("Euler"), dt_s)
        if speculative:
            spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_SPECULATIVE
        contact = Contact(solref=(tau_s, 1.0))
        add_ball(spec, contact)
        add_box(spec, contact, (0.0, 0.0, -WALL_M / 2), (50.0, 50.0, WALL_M / 2))

        def prepare(data: mujoco.MjData) -> None:
            data.qpos[2], data.qvel[2] = 10.2 * speed * dt_s, -speed

        return Setting(label, spec.compile(), prepare)

    def centre(record: Path) -> Float64:
        return record.qpos[:, 2] + RADIUS_M

    return Failure(
        name="tunnelling",
        title="A fast ball passes through a wall",
        why="The contact is a spring: at v the ball gets v tau / e deep. Once its centre is past "
        "the wall's middle, the nearest way out is the far side. That takes e (R + t/2) / tau = "
        "34 m/s; here it is 40 m/s, at a step of 2 ms.",
        x_label="time, ms",
        y_label="ball's centre over the wall's face, m",
        seconds=0.06,
        settings=(
            setting("tau = 20 ms", TAU_S, speculative=False),
            setting("tau = 20 ms, speculative contacts", TAU_S, speculative=True),
            setting("tau = 5 ms", 0.005, speculative=False),
        ),
        curve=lambda record: (1e3 * record.time, centre(record)),
        quantity="greatest depth of the ball, mm",
        value=lambda record: 1e3 * float(RADIUS_M - centre(record).min()),
        says="{:.0f} mm deep",
        acceptable=1e3 * (RADIUS_M + WALL_M / 2),
        limit_reason="with its centre behind the wall's middle the contact pushes it on",
    )


def skid_level() -> Level:
    """Return the game's ball on wide ground of its own friction."""
    return make_level()


def _skidding(preset: PhysicsPreset, speed: float, angle_deg: float) -> Course:
    compiled = compile_level(skid_level(), preset)
    angle = np.radians(angle_deg)
    return Course(
        compiled,
        at=(0.0, 0.0, compiled.level.ball.radius),
        velocity=(speed * np.cos(angle), speed * np.sin(angle), 0.0),
    )


def bent_heading() -> Failure:
    """Return a skid that the pyramidal cone bends."""
    angle, speed = 22.5, 4.0

    def setting(label: str, preset: PhysicsPreset) -> Setting:
        course = _skidding(preset, speed, angle)
        return Setting(label, course.compiled.model, course.prepare)

    def heading(record: Path) -> Float64:
        return np.asarray(np.degrees(np.arctan2(record.qvel[:, 1], record.qvel[:, 0])))

    return Failure(
        name="bent_heading",
        title="The pyramidal friction cone bends a skidding ball's way",
        why="A pyramid's friction is greatest at its corners, along x and y, whatever the "
        "direction of the slip: it brakes one part of the velocity first and the other later. The "
        "elliptic cone brakes along the slip.",
        x_label="time, s",
        y_label="heading of the ball, degrees",
        seconds=0.6,
        settings=(
            setting("pyramidal cone", replace(DEFAULT, cone="pyramidal")),
            setting("elliptic cone", DEFAULT),
        ),
        curve=lambda record: (record.time, heading(record)),
        quantity="greatest change of heading, degrees",
        value=lambda record: float(np.abs(heading(record) - angle).max()),
        says="{:.1f}° off",
        acceptable=0.5,
        limit_reason="the player steers to about a degree",
    )


def restitution_gain() -> Failure:
    """Return a bouncy contact that gives back more than it got."""
    ratio, drop = 0.1, 0.24
    bouncy = contact_parameters(0.3, restitution(ratio), FAST)

    def setting(label: str, contact: Contact) -> Setting:
        spec = new_spec(MujocoMethod("Euler"), FAST.dt_s, 9.81)
        add_ball(spec, contact)
        add_floor(spec, contact)

        def prepare(data: mujoco.MjData) -> None:
            data.qpos[2] = drop

        return Setting(label, spec.compile(), prepare)

    def energy(record: Path) -> Float64:
        height = record.qpos[:, 2] + record.qvel[:, 2] ** 2 / (2.0 * 9.81)
        return np.asarray(np.maximum(height, 1e-4))

    return Failure(
        name="restitution_gain",
        title="A bouncy contact comes back faster than it went in",
        why="In MuJoCo's (tau, ratio) form the stiffness is 1/(tau ratio)². A ratio of 0.1 means a "
        "bounce of 0.75, and at 1/120 s it is so stiff that one step throws the ball out at up "
        "to 17 times its speed. The direct form keeps the stiffness to what the step can resolve.",
        x_label="time, s",
        y_label="ball's energy as height, m",
        seconds=2.0,
        settings=(
            setting("solref = (0.02, 0.1)", Contact(solref=(TAU_S, ratio))),
            setting(
                f"direct form of the same bounce: ({bouncy.solref[0]:.0f}, {bouncy.solref[1]:.0f})",
                Contact(solref=bouncy.solref, impedance=bouncy.solimp[0]),
            ),
        ),
        curve=lambda record: (record.time, energy(record)),
        quantity="greatest energy over that of the drop",
        value=lambda record: float(energy(record).max() / energy(record)[0]),
        says="{:.3g}× the energy",
        acceptable=1.05,
        limit_reason="a bounce gives no energy; 5 % for where in a step the ball is looked at",
        log_y=True,
    )


def seam_level(*, seams: bool) -> Level:
    """Return a lane of tiles of 64 quants, which two materials keep the compiler from merging."""
    edge, count = quants(64.0), 60
    tiles = [
        {
            "at": (index * edge, 0.0, -quants(8.0)),
            "size": (edge, 8.0, quants(16.0)),
            "material": "other" if seams and index % 2 else "default",
        }
        for index in range(-2, count)
    ]
    start = {"at": (0.0, 0.0, quants(16.0))}
    return make_level(boxes=tiles, materials={"other": {}}, start=start)


def seam_bump() -> Failure:
    """Return a ball that rolls over tiles, and over the box into which the compiler merges them."""
    speed = 5.0

    def setting(label: str, *, seams: bool) -> Setting:
        compiled = compile_level(seam_level(seams=seams), DEFAULT)
        radius = compiled.level.ball.radius
        course = Course(compiled, (0.0, 0.0, radius), (speed, 0.0, 0.0), (0.0, speed / radius, 0.0))
        return Setting(label, compiled.model, course.prepare)

    def bump(record: Path) -> Float64:
        height = record.qpos[:, 2]
        rolling = height[record.time > SETTLE_S]
        return np.asarray(1e3 * (height - np.median(rolling)))

    return Failure(
        name="seam_bump",
        title="Seams of level tiles kick a rolling ball",
        why="A resting ball lies a little in the floor, so that the next tile's edge stands in its "
        "way: the contact with it is tilted, and kicks; how hard depends on where in a step the "
        "ball gets there. Tiles that share their faces and their material are merged into one box "
        "when a level is compiled.",
        x_label="way along the tiles, m",
        y_label="height over its rest, mm",
        seconds=4.0,
        settings=(
            setting("tiles with seams", seams=True),
            setting("merged into one box", seams=False),
        ),
        curve=lambda record: (
            record.qpos[record.time > SETTLE_S, 0],
            bump(record)[record.time > SETTLE_S],
        ),
        quantity="greatest bump at 5 m/s, mm",
        value=lambda record: float(bump(record)[record.time > SETTLE_S].max()),
        says="{:.2f} mm high",
        acceptable=0.05,
        limit_reason="a rolling ball on a plane does not bump; 50 um for settling",
    )


def hanging_gate_level(stop_m: float) -> Level:
    """Return a gate that hangs over the ground and comes down to ``stop_m`` over it.

    No shipped level has one (they sink into the ground), but the format allows it.
    """
    gate = {
        "name": "gate",
        "at": (0.0, 0.0, 2.5),
        "size": (quants(16.0), quants(128.0), 2.6),
        "lowers_to": 1.3 + stop_m,
    }
    plate = {
        "name": "plate",
        "at": (-30.0, 0.0, 0.0),
        "size": (1.0, 1.0, 0.6),
        "opens": ["gate"],
        "sinks_to": -0.5,
    }
    return make_level(gates=[gate], plates=[plate])


def crush() -> Failure:
    """Return the ball under a gate that comes down."""
    level = hanging_gate_level(0.0)
    radius = level.ball.radius

    def setting(label: str, compiled: CompiledLevel) -> Setting:
        course = Course(compiled, (0.0, 0.0, radius), movers_m_s=-GATE_SPEED_M_S)
        return Setting(label, compiled.model, course.prepare)

    limited = compile_level(level, DEFAULT)
    address = int(limited.gate_qpos[0])

    def edge(record: Path) -> Float64:
        return record.qpos[:, address] + 1.2

    return Failure(
        name="crush",
        title="A gate coming down on the ball crushes it",
        why="A servo without a limit of its force pulls 4 MN for a metre of lag, and a contact is "
        f"as stiff as its lighter body, the ball. With at most {SERVO_G:g} times the gate's "
        "weight, as the game has it, the gate stops on the ball.",
        x_label="time, s",
        y_label="gate's lower edge over the floor, m",
        seconds=2.5,
        settings=(
            setting("servo without limit", without_force_limits(compile_level(level, DEFAULT))),
            setting("the game's servo, at most 10 kN", limited),
        ),
        curve=lambda record: (record.time, edge(record)),
        quantity="share of the ball's height that is squeezed, %",
        value=lambda record: 100.0 * float(1.0 - edge(record).min() / (2.0 * radius)),
        says="{:.0f} % squeezed",
        acceptable=5.0,
        limit_reason="a twentieth of its height looks like contact, not like a crushed ball",
    )


VISIBLE_HOP_MM: Final = 8.0
VISIBLE_HOP: Final = "a rigid ball does not hop; a fiftieth of the radius is not seen"

HOP_FRICTION_STEPS: Final = 0.3
"""B h of the friction that cures the hop: the share of the slip that one step removes."""


def soft_friction_model(preset: PhysicsPreset, share: float) -> mujoco.MjModel:
    """Return the skid's model with a friction that removes ``share`` of the slip in a step.

    Only an explicit contact pair has a ``solreffriction`` of its own.
    """
    level = skid_level()
    spec = build_spec(level, preset)
    floor = next(geom for geom in spec.geoms if geom.name.startswith("solid_"))
    spec.add_pair(
        geomname1=floor.name,
        geomname2="ball",
        condim=3,
        friction=[floor.friction[0], floor.friction[0], 0.0, 0.0, 0.0],
        solref=list(floor.solref),
        solimp=list(floor.solimp),
        solreffriction=[0.0, -share / preset.dt_s],
    )
    return spec.compile()


def hop() -> Failure:
    """Return a skidding ball that hops."""
    speed = 4.0
    default = _skidding(DEFAULT, speed, 0.0)
    rk4 = _skidding(replace(DEFAULT, integrator="RK4"), speed, 0.0)
    accurate = _skidding(PRESETS["accurate"], speed, 0.0)

    def height(record: Path) -> Float64:
        return 1e3 * (record.qpos[:, 2] - default.compiled.level.ball.radius)

    return Failure(
        name="hop",
        title="A skidding ball hops",
        why="MuJoCo's friction cone is a convex relaxation: force and velocity at the contact obey "
        "v_normal >= mu v_slip, so that what brakes the slip also lifts the ball, by "
        "mu B h v / (1 + 7/2 mu²) in the first step, at any dt. Cures remove less of the slip in "
        "a step: RK4's stages, or a softer damper for the friction alone.",
        x_label="time, s",
        y_label="height over the floor, mm",
        seconds=0.6,
        settings=(
            Setting("default, 1/240 s", default.compiled.model, default.prepare),
            Setting(
                f"friction's own damper, B h = {HOP_FRICTION_STEPS:g}",
                soft_friction_model(DEFAULT, HOP_FRICTION_STEPS),
                default.prepare,
            ),
            Setting("RK4, 1/240 s", rk4.compiled.model, rk4.prepare),
            Setting("accurate: RK4, 1/960 s", accurate.compiled.model, accurate.prepare),
        ),
        curve=lambda record: (record.time, height(record)),
        quantity="greatest height at 4 m/s of slip, mm",
        value=lambda record: float(height(record).max()),
        says="{:.0f} mm high",
        acceptable=VISIBLE_HOP_MM,
        limit_reason=VISIBLE_HOP,
    )


FAILURES: Final[dict[str, Callable[[], Failure]]] = {
    make.__name__: make
    for make in (
        blow_up,
        tunnelling,
        bent_heading,
        restitution_gain,
        seam_bump,
        crush,
        hop,
    )
}
"""By name."""
