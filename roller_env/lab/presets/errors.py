"""What a setting gets wrong: every measure is of the game's own ball, levels and contacts."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch

from roller_env.compile.compiled import CompiledLevel
from roller_env.config import EnvConfig
from roller_env.game.actions import forces, held_keys
from roller_env.lab.game import (
    DECK_M,
    FRICTION,
    GATE_SPEED_M_S,
    GRAVITY_M_S2,
    LIFT_N,
    LIFT_S,
    RADIUS_M,
    THROUGH_M,
    TUBE_FALL_M,
    Course,
    make_level,
    play,
    played,
)
from roller_env.lab.presets.setting import Setting
from roller_env.lab.stability.failures import hanging_gate_level, seam_level
from roller_env.level import Level, load_level
from roller_env.physics.presets import PhysicsPreset
from roller_env.physics.stepper import keeps_poses
from roller_env.units import quants

Float64 = npt.NDArray[np.float64]

LANE_M: Final = 80.0
LOST_M: Final = 1e4
ROLLING: Final = 1.4
"""Inertia of a solid ball that rolls, over its mass."""


class World:
    """Some balls on one level, and no rules.

    Attributes:
        compiled: the level.
        position: (balls, 3) live view, m.
        velocity: (balls, 3) live view, m/s.
        spin: (balls, 3) live view, rad/s.
        qpos: (balls, nq) live view.
        ctrl: (balls, nu) live view.
        went: (balls, S, nq) every position after the steps of the last `advance`.
    """

    def __init__(self, setting: Setting, level: Level, balls: int, step_s: float):
        """Compile the level; each `advance` will last ``step_s``."""
        self.compiled: CompiledLevel = setting.compile(level)
        self._steps = round(step_s / setting.preset.dt_s)
        self._batch = Batch(
            self.compiled.model, balls, 1, persistent=keeps_poses(self.compiled.model)
        )
        self.qpos: Float64 = self._batch.bind("qpos")
        qvel: Float64 = self._batch.bind("qvel")
        self.ctrl: Float64 = self._batch.bind("ctrl")
        self.went: Float64 = np.empty((balls, 0, self.compiled.model.nq))
        start, velocity = self.compiled.ball_qpos, self.compiled.ball_qvel
        self._place, self._speed = slice(start, start + 3), slice(velocity, velocity + 3)
        self.position = self.qpos[:, self._place]
        self.velocity = qvel[:, self._speed]
        self.spin = qvel[:, velocity + 3 : velocity + 6]

    def force(self, newtons: Float64) -> None:
        """Push every ball, (balls, 2 or 3) N along x, y and z."""
        self.ctrl[:, self.compiled.force_ctrl[: newtons.shape[1]]] = newtons

    def advance(self) -> tuple[Float64, Float64]:
        """Return places, m, and velocities, m/s, from the start on: both (balls, S + 1, 3).

        NaN where a ball has left the world.
        """
        before = self.position[:, None].copy(), self.velocity[:, None].copy()
        went = self._batch.rollout(self._steps, record=("qpos", "qvel"))
        self.went = went["qpos"]
        after = went["qpos"][:, :, self._place], went["qvel"][:, :, self._speed]
        place, velocity = (np.concatenate(pair, 1) for pair in zip(before, after, strict=True))
        lost = ~(np.abs(place) < LOST_M).all(axis=2)
        place[lost] = velocity[lost] = np.nan
        return place, velocity

    def path(self) -> Float64:
        """Return the places of `advance`."""
        return self.advance()[0]


# Driving -------------------------------------------------------------------------------------

SEQUENCES: Final[tuple[tuple[str, ...], ...]] = (
    ("w", "w", "w", "w", "w", "w", "w", "w", "w", "w"),
    ("w", "w", "w", "wa", "wa", "a", "d", "d", "sd", "sd"),
    ("wd", "w", "wa", "a", "as", "s", "sd", "d", "wd", "w"),
    ("a", "", "a", "", "aw", "aw", "", "d", "d", "s"),
)
"""Keys of ``wasd`` held for half a second each: straight on, there and back, round, in pauses."""

HELD_S: Final = 0.5
KEYS_OF_HEADINGS: Final = ("w", "wa", "a", "as", "s", "sd", "d", "wd")


def driving(setting: Setting) -> dict[str, float]:
    """Drive 5 s on open ground, against the rigid ball's exact way; and push in 8 directions."""
    straight = [(keys,) * len(SEQUENCES[0]) for keys in KEYS_OF_HEADINGS]
    plans = [*SEQUENCES, *straight]
    world = World(setting, make_level(), len(plans), HELD_S)
    world.position[:] = 0.0, 0.0, RADIUS_M
    exact = np.zeros((len(plans), 2))
    speed, way, ends = exact.copy(), np.zeros(len(plans)), []
    for held in zip(*plans, strict=True):
        newtons = np.array([forces("keys", held_keys(keys)[None])[0] for keys in held])
        world.force(newtons)
        path = world.path()[:, :, :2]
        push = newtons / ROLLING
        exact = exact + speed * HELD_S + 0.5 * push * HELD_S**2
        speed = speed + push * HELD_S
        way += np.linalg.norm(np.diff(path, axis=1), axis=2).sum(axis=1)
        ends.append(path[:, -1])
    away = np.linalg.norm(ends[-1] - exact, axis=1) / way
    drawn = ends[-1][len(SEQUENCES) :]
    meant = exact[len(SEQUENCES) :]
    heading = np.arctan2(drawn[:, 1], drawn[:, 0]) - np.arctan2(meant[:, 1], meant[:, 0])
    heading = (heading + math.pi) % (2.0 * math.pi) - math.pi
    return {
        "path": _worst(away),
        "heading_deg": _worst(np.degrees(np.abs(heading))),
    }


# Landing -------------------------------------------------------------------------------------

FALL_S: Final = 4.0
FASTEST_M_S: Final = 36.0
"""Of a ball that enters classic's tube as fast as it can, climbs its wall and flies 66 m up."""
ARRIVALS: Final = np.linspace(0.02, 0.98, 12)
"""Shares of a step after which a ball touches the ground."""
TUNNEL_SPEEDS_M_S: Final = np.arange(10.0, 121.0, 5.0)


def landing(setting: Setting) -> dict[str, float]:
    """Drop and throw balls on the thinnest deck: how deep they get, and from when on through."""
    deck = {"at": (0.0, 0.0, -DECK_M / 2), "size": (50.0, 50.0, DECK_M)}
    level = make_level(boxes=[deck], start={"at": (0.0, 0.0, RADIUS_M)})
    falling = World(setting, level, len(ARRIVALS), FALL_S)
    falling.position[:, :2] = 0.0
    # 0.5 m of height are one step of 1/60 s at 30 m/s.
    falling.position[:, 2] = RADIUS_M + TUBE_FALL_M + 0.5 * ARRIVALS
    fallen = _depth(falling.path())
    speeds = np.array([FASTEST_M_S, *TUNNEL_SPEEDS_M_S])
    speed, arrival = (a.ravel() for a in np.meshgrid(speeds, ARRIVALS, indexing="ij"))
    thrown = World(setting, level, len(speed), 0.5)
    thrown.position[:, :2] = 0.0
    thrown.position[:, 2] = RADIUS_M + speed * setting.preset.dt_s * arrival
    thrown.velocity[:, 2] = -speed
    depth = _depth(thrown.path()).reshape(len(speeds), -1).max(axis=1)
    passing = TUNNEL_SPEEDS_M_S[depth[1:] > THROUGH_M]
    return {
        "landing_share": float(fallen.max() / THROUGH_M),
        "fastest_share": float(depth[0] / THROUGH_M),
        "tunnels_at_m_s": float(passing[0]) if len(passing) else math.inf,
    }


def _depth(path: Float64) -> Float64:
    """Return how deep each ball, (balls,), was in the ground at most; infinite if lost."""
    depth: Float64 = RADIUS_M - np.nan_to_num(path[:, :, 2], nan=-np.inf).min(axis=1)
    return depth


# Elasticity ----------------------------------------------------------------------------------

ELASTICITIES: Final = (0.0, 0.2, 0.5, 0.8, 0.95)
SPEEDS_M_S: Final = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
WEIGHTLESS_M_S2: Final = 0.001


def elasticity(setting: Setting) -> dict[str, float]:
    """Bounce balls of every elasticity at every speed, without gravity, which takes its part."""
    worst = 0.0
    speed, arrival = (a.ravel() for a in np.meshgrid(SPEEDS_M_S, ARRIVALS[::2]))
    for one in ELASTICITIES:
        level = make_level(ball={"elasticity": one}, gravity=WEIGHTLESS_M_S2)
        world = World(setting, level, len(speed), 0.6)
        world.position[:] = 0.0
        world.position[:, 2] = RADIUS_M + speed * setting.preset.dt_s * arrival
        world.velocity[:, 2] = -speed
        height = world.path()[:, :, 2]
        returned = np.diff(height, axis=1).max(axis=1) / setting.preset.dt_s / speed
        worst = max(worst, _worst(np.abs(returned - one)))
    return {"elasticity": worst}


# Friction ------------------------------------------------------------------------------------

SKID_SPEEDS_M_S: Final = (2.0, 4.0, 8.0)
SKID_HEADINGS_DEG: Final = (0.0, 22.5, 45.0)


def friction(setting: Setting) -> dict[str, float]:
    """Throw balls along the ground without spin; friction sets them rolling, and makes them hop.

    A rigid ball ends at 5/7 of its speed v and is then v t / 7 ahead of one that began with that,
    t = 2 v / (7 mu g) being how long it skids; so the friction is 2 v² / (49 g lead).
    """
    speed, degrees = (a.ravel() for a in np.meshgrid(SKID_SPEEDS_M_S, SKID_HEADINGS_DEG))
    angle = np.radians(degrees)
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    world = World(setting, make_level(), len(speed), 0.5)
    world.position[:] = 0.0, 0.0, RADIUS_M
    world.advance()
    rest_m = RADIUS_M - float(world.position[0, 2])
    world.velocity[:, :2] = speed[:, None] * way
    path, velocity = zip(*(world.advance() for _ in range(4)), strict=True)
    place = np.concatenate([path[0], *(part[:, 1:] for part in path[1:])], axis=1)
    speeds = np.concatenate([velocity[0], *(part[:, 1:] for part in velocity[1:])], axis=1)
    along = np.einsum("nsd,nd->ns", speeds[:, :, :2], way)
    final = along[:, -1]
    # From the velocities, since the step's own error of the position is not friction's.
    lead = np.trapezoid(along - final[:, None], dx=setting.preset.dt_s, axis=1)
    measured = 2.0 * speed**2 / (49.0 * GRAVITY_M_S2 * lead)
    moved = place[:, -1, :2] - place[:, 0, :2]
    turned = np.degrees(np.abs(np.arctan2(moved[:, 1], moved[:, 0]) - angle))
    hop = np.nanmax(place[:, :, 2], axis=1) - RADIUS_M
    return {
        "friction": _worst(np.abs(measured - FRICTION)),
        "skid_speed": _worst(np.abs(final / (5.0 / 7.0 * speed) - 1.0)),
        "skid_heading_deg": _worst(turned),
        "hop_mm": 1e3 * _worst(hop[speed == 4.0]),
        "rest_mm": 1e3 * rest_m,
    }


# The lift, the seams, the movers -------------------------------------------------------------


def lift(setting: Setting) -> dict[str, float]:
    """Throw the ball up as a lift pad does, and compare the rise with the closed form."""
    world = World(setting, make_level(), 1, LIFT_S)
    world.position[:] = 0.0, 0.0, RADIUS_M
    thrust = LIFT_N - GRAVITY_M_S2
    world.force(np.array([[0.0, 0.0, LIFT_N]]))
    world.advance()
    world.force(np.zeros((1, 3)))
    apex = world.path()[0, :, 2].max() - RADIUS_M
    speed = thrust * LIFT_S
    exact = 0.5 * thrust * LIFT_S**2 + speed**2 / (2.0 * GRAVITY_M_S2)
    return {"lift": abs(float(apex) / exact - 1.0)}


SEAM_SPEEDS_M_S: Final = (3.0, 6.0, 9.0, 12.0, 15.0)


def seams(setting: Setting) -> dict[str, float]:
    """Roll from classic's bridge over two seams onto the island, at 3 to 15 m/s."""
    level = load_level("classic")
    speed, share = (a.ravel() for a in np.meshgrid(SEAM_SPEEDS_M_S, ARRIVALS[::3]))
    world = World(setting, level, len(speed), quants(440.0) / max(SEAM_SPEEDS_M_S))
    world.position[:, 0] = quants(660.0) + speed * setting.preset.dt_s * share
    world.position[:, 1] = 0.0
    world.position[:, 2] = level.start.at[2]
    world.velocity[:, 0] = speed
    world.spin[:, 1] = speed / RADIUS_M
    parts = max(SEAM_SPEEDS_M_S) / min(SEAM_SPEEDS_M_S)
    path = np.concatenate([world.path() for _ in range(round(parts))], axis=1)
    on_course = path[:, :, 0] < quants(1180.0)
    settled = np.arange(path.shape[1]) * setting.preset.dt_s * speed[:, None] > 0.5
    height = np.where(on_course & settled, path[:, :, 2], -np.inf)
    return {"seam_mm": 1e3 * max(0.0, _worst(height.max(axis=1) - level.start.at[2]))}


MOVED_S: Final = 0.3


def movers(setting: Setting) -> dict[str, float]:
    """Lower the gate level's plate and gate under a ball: do they keep the level's speed?"""
    level = load_level("gate")
    wrong, ringing, deepest = 0.0, 0.0, 0.0
    for piece, servo in ((level.plates[0], "plate"), (level.gates[0], "gate")):
        world = World(setting, level, 1, MOVED_S)
        compiled = world.compiled
        at = (compiled.plate_qpos if servo == "plate" else compiled.gate_qpos)[0]
        ctrl = (compiled.plate_ctrl if servo == "plate" else compiled.gate_ctrl)[0]
        top = piece.at[2] + piece.size[2] / 2 + RADIUS_M
        world.position[:] = piece.at[0], piece.at[1], top
        world.ctrl[:, ctrl] = -piece.speed
        world.advance()
        before = float(world.qpos[0, at])
        path = world.path()
        moved = world.went[0, :, at]
        wrong = max(wrong, abs((before - float(moved[-1])) / (MOVED_S * piece.speed) - 1.0))
        speeds = np.diff(moved) / setting.preset.dt_s / piece.speed
        ringing = max(ringing, float(np.ptp(speeds)))
        deepest = max(deepest, top + float(moved[-1]) - float(path[0, -1, 2]))
    return {"movers": wrong, "ringing": ringing, "carried_mm": 1e3 * deepest}


SQUEEZE_S: Final = 2.5
SQUEEZED_AT_M: Final = (0.0, 0.15, 0.3, 0.45)
"""From the middle of the gate."""


def squeeze(setting: Setting) -> dict[str, float]:
    """Let a hanging gate come down on the ball, which has nowhere to go."""
    compiled = setting.compile(hanging_gate_level(0.0))
    runs = [
        play(Course(compiled, (x, 0.0, RADIUS_M), movers_m_s=-GATE_SPEED_M_S), SQUEEZE_S)
        for x in SQUEEZED_AT_M
    ]
    return {"squeeze_mm": 1e3 * max(float(run.depth.max()) for run in runs)}


LANE_SPEEDS_M_S: Final = np.linspace(7.5, 15.0, 76)
"""Some of them keep time with the seams, and bumps grow from one to the next."""


def lane(setting: Setting) -> dict[str, float]:
    """Roll over 49 seams in a row, which two materials keep the compiler from merging.

    The highest bump is that of the speed nearest to a resonance, and grows with the speeds that are
    tried: ``default``'s is 25 mm of 31 and 52 mm of 301. What share of them is thrown does not.
    """
    speed = LANE_SPEEDS_M_S
    world = World(setting, seam_level(seams=True), len(speed), 0.5)
    world.position[:] = 0.0, 0.0, RADIUS_M
    world.velocity[:, 0] = speed
    world.spin[:, 1] = speed / RADIUS_M
    path = np.concatenate([world.path() for _ in range(10)], axis=1)
    bumps = np.where(path[:, :, 0] < LANE_M, path[:, :, 2] - RADIUS_M, 0.0).max(axis=1)
    thrown = ~(bumps <= quants(1.0))
    return {"lane_mm": 1e3 * _worst(bumps), "lane_share": float(thrown.mean())}


# The course ----------------------------------------------------------------------------------

COURSE_S: Final = 3.0
CONTROL_DT_S: Final = 0.05
COURSES: Final[tuple[tuple[tuple[str, float], ...], ...]] = (
    (("w", 1.5), ("wa", 0.5), ("a", 0.5), ("s", 0.5)),
    (("wa", 1.0), ("wd", 1.5), ("w", 0.5)),
    (("wd", 1.5), ("a", 1.5)),
    (("w", 3.0),),
    (("a", 2.0), ("w", 1.0)),
    (("s", 1.0), ("wd", 2.0)),
    (("sd", 1.0), ("aw", 2.0)),
    (("aw", 1.5), ("d", 1.0), ("w", 0.5)),
)
"""Keys and seconds on the classic level: over the deck, onto the plate, into kerbs and the gate."""

REFERENCE_HZ: Final = 7680
"""Steps per second of the converged model: RK4 with 1/3840 s and implicitfast with 1/3840 s are
both 4e-4 of the way from it. Contacts go with the step and approach a rigid ball's."""


@cache
def recordings() -> tuple[tuple[Float64, Float64], ...]:
    """Play `COURSES` on the classic level with ``accurate`` physics; see `played`."""
    config = EnvConfig(level="classic", physics="accurate", control_dt_s=CONTROL_DT_S)
    return tuple(played(config, keys, seed) for seed, keys in enumerate(COURSES))


def course(setting: Setting, reference_hz: int = REFERENCE_HZ) -> dict[str, float]:
    """Play recorded keys on the classic level, against the converged model, for three seconds.

    The error is the mean over the way's time of the distance between the two, as a share of the
    way; of all courses the mean.
    """
    converged = _converged_paths(reference_hz)
    away = np.linalg.norm(course_paths(setting) - converged, axis=2)
    way = np.linalg.norm(np.diff(converged, axis=1), axis=2).sum(axis=1)
    share = np.where(np.isfinite(away).all(axis=1), away.mean(axis=1) / way, 1.0)
    return {"course": float(share.mean())}


def course_paths(setting: Setting) -> Float64:
    """Return where the ball is after every control step, (courses, steps + 1, 3) m."""
    starts, controls = zip(*recordings(), strict=True)
    world = World(setting, load_level("classic"), len(starts), CONTROL_DT_S)
    world.position[:] = starts
    places = [world.position.copy()]
    for ctrl in zip(*controls, strict=True):
        world.ctrl[:] = ctrl
        places.append(world.path()[:, -1])
    return np.stack(places, axis=1)


@cache
def _converged_paths(steps_per_s: int) -> Float64:
    preset = PhysicsPreset("converged", 1 / steps_per_s, "RK4", iterations=100, tolerance=1e-14)
    return course_paths(Setting("converged", "reference", preset))


def _worst(values: Float64) -> float:
    """Return the largest, infinite where any is not finite."""
    return float(values.max()) if np.isfinite(values).all() else math.inf


Errors = dict[str, float]
"""What one setting gets wrong, by the names of `MEANINGS`."""

MEANINGS: Final = {
    "path": "distance from a rigid ball's place after 5 s of driving over the way rolled; worst of "
    "twelve sequences of keys",
    "heading_deg": "largest error of the direction in which keys push, of all eight",
    "landing_share": "depth of the landing after 46.9 m over that at which a ball falls through",
    "fastest_share": "the same for 36 m/s",
    "tunnels_at_m_s": "least speed tried at which a ball passes a deck of 16 quants; or infinite",
    "elasticity": "largest error of the coefficient of restitution, of five and at seven speeds",
    "friction": "largest error of the coefficient of friction, measured on skids",
    "skid_speed": "largest relative error of the speed at which a skid ends",
    "skid_heading_deg": "largest bend of a skid's way",
    "hop_mm": "highest that a ball skidding at 4 m/s hops",
    "rest_mm": "how deep a ball lies in the ground half a second after it was put there",
    "lift": "relative error of the height to which a lift pad throws",
    "seam_mm": "highest bump at a seam of classic's bridge, at 3 to 15 m/s",
    "movers": "largest relative error of the speed of a plate or gate under the ball",
    "ringing": "how much that speed goes up and down once it is reached, over the speed",
    "carried_mm": "how deep the ball is in what sinks under it",
    "squeeze_mm": "deepest contact while a hanging gate presses on the ball",
    "lane_mm": "highest bump on a lane of 49 seams that cannot be merged, at 7.5 to 15 m/s",
    "lane_share": "of these speeds, the share at which that bump is over one quant",
    "course": "distance from the converged model's place on the classic course over the way",
}


_MEASURES: Final[Sequence[Callable[[Setting], dict[str, float]]]] = (
    driving,
    landing,
    elasticity,
    friction,
    lift,
    seams,
    movers,
    squeeze,
    lane,
)


def errors_of(setting: Setting, reference_hz: int = REFERENCE_HZ) -> Errors:
    """Measure everything that a setting gets wrong."""
    values = course(setting, reference_hz)
    for measure in _MEASURES:
        values |= measure(setting)
    return values


@dataclass(frozen=True, slots=True)
class Requirement:
    """What the game can bear.

    Attributes:
        name: in `MEANINGS`.
        label: for tables and charts; after a comma the unit.
        limit: largest bearable value.
        reason: why that.
    """

    name: str
    label: str
    limit: float
    reason: str

    @property
    def title(self) -> str:
        """The label without its unit."""
        return self.label.partition(", ")[0]

    @property
    def unit(self) -> str:
        """Of the limit; empty for shares."""
        return self.label.partition(", ")[2]


_ASKED: Final = "asked of the default preset"
_FALLS: Final = "deeper, it falls through"
_NOT_SEEN: Final = "a fiftieth of the radius is not seen"
REQUIREMENTS: Final = (
    Requirement("path", "path after 5 s of driving", 0.01, _ASKED),
    Requirement("heading_deg", "heading of the keys, °", 0.5, _ASKED),
    Requirement("landing_share", "landing from 46.9 m", 1.0, _FALLS),
    Requirement("fastest_share", "landing at 36 m/s", 1.0, _FALLS),
    Requirement("elasticity", "elasticity", 0.02, _ASKED),
    Requirement("friction", "friction", 0.02, _ASKED),
    Requirement("skid_speed", "speed after a skid", 0.01, "as for the path"),
    Requirement("skid_heading_deg", "bend of a skid, °", 0.5, "as for the keys"),
    Requirement("rest_mm", "depth at rest, mm", 1e3 * RADIUS_M / 50, _NOT_SEEN),
    Requirement("lift", "height of the lift", 0.01, "as for the path"),
    Requirement("seam_mm", "bump of a seam, mm", 1e3 * RADIUS_M / 50, _NOT_SEEN),
    Requirement("movers", "speed of plate and gate", 0.01, "as for the path"),
    Requirement("ringing", "ringing of plate and gate", 0.01, "as for the path"),
    Requirement("carried_mm", "depth on plate and gate, mm", 1e3 * RADIUS_M / 50, _NOT_SEEN),
    Requirement(
        "squeeze_mm", "depth under a gate, mm", 1e3 * THROUGH_M, "deeper, it falls through"
    ),
    Requirement("lane_share", "thrown by a lane of seams", 0.1, "one speed in ten"),
    Requirement("course", "course of classic", 0.01, "as for the path"),
)
"""The hop of a skid has no limit here, since what cures it costs the course; see the docs."""


def violations(errors: Errors) -> list[Requirement]:
    """Return the requirements that are not met."""
    return [one for one in REQUIREMENTS if not errors[one.name] <= one.limit]
