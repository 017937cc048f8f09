"""What a setting gets wrong: every measure is of the game's own ball, levels and contacts."""

from __future__ import annotations

import math
from functools import cache
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch

from roller_env.arrays import Float64
from roller_env.config import EnvConfig
from roller_env.game.actions import forces, held_keys
from roller_env.lab import game
from roller_env.lab.game import DECK_M, GRAVITY_M_S2, LIFT_N, LIFT_S, RADIUS_M, THROUGH_M
from roller_env.lab.presets.settings import Setting
from roller_env.lab.stability.failures import hanging_gate_level, seam_level
from roller_env.level import Level, load_level
from roller_env.physics.presets import PhysicsPreset
from roller_env.physics.stepper import keeps_poses
from roller_env.units import quants

Errors = dict[str, float]
"""What one setting gets wrong, by names such as those of `REQUIREMENTS`."""

LOST_M: Final = 1e4
ARRIVALS: Final = np.linspace(0.02, 0.98, 12)
"""Shares of a step after which a ball touches the ground."""


class World:
    """Some balls on one level, and no rules."""

    position: Float64  # (balls, 3) live view, m
    velocity: Float64  # (balls, 3) live view, m/s
    spin: Float64  # (balls, 3) live view, rad/s
    ctrl: Float64  # (balls, nu) live view
    went: Float64  # (balls, S, nq) after every step of the last `advance`

    def __init__(self, setting: Setting, level: Level, position: npt.ArrayLike):
        """Compile the level, with balls at rest at ``position``, (balls, 3) m."""
        self.compiled, self.dt_s = setting.compile(level), setting.preset.dt_s
        model, position = self.compiled.model, np.asarray(position)
        self._batch = Batch(model, len(position), 1, persistent=keeps_poses(model))
        self.ctrl, qpos, qvel = (self._batch.bind(name) for name in ("ctrl", "qpos", "qvel"))
        start, velocity = self.compiled.ball_qpos, self.compiled.ball_qvel
        self._place, self._speed = slice(start, start + 3), slice(velocity, velocity + 3)
        self.position, self.velocity = qpos[:, self._place], qvel[:, self._speed]
        self.spin = qvel[:, velocity + 3 : velocity + 6]
        self.position[:] = position

    def roll(self, speed: Float64) -> None:
        """Have balls roll along x, (balls,) m/s."""
        self.velocity[:, 0], self.spin[:, 1] = speed, speed / RADIUS_M

    def force(self, newtons: Float64) -> None:
        """Push every ball, (balls, 2 or 3) N along x, y and z."""
        self.ctrl[:, self.compiled.force_ctrl[: newtons.shape[1]]] = newtons

    def advance(self, seconds: float, times: int = 1) -> tuple[Float64, Float64]:
        """Go on for some times so many seconds; return places, m, and velocities, m/s.

        Both (balls, S + 1, 3), from the start on; NaN where a ball has left the world.
        """
        before = self.position[:, None].copy(), self.velocity[:, None].copy()
        went = self._batch.rollout(times * round(seconds / self.dt_s), record=("qpos", "qvel"))
        self.went = went["qpos"]
        after = went["qpos"][:, :, self._place], went["qvel"][:, :, self._speed]
        place, velocity = (np.concatenate(pair, 1) for pair in zip(before, after, strict=True))
        lost = ~(np.abs(place) < LOST_M).all(axis=2)
        place[lost] = velocity[lost] = np.nan
        return place, velocity


def _each(*values: npt.ArrayLike) -> tuple[Float64, ...]:
    """Return every combination of some values, the first changing last."""
    return tuple(axis.ravel() for axis in np.meshgrid(*values, indexing="ij"))


def _worst(values: Float64) -> float:
    """Return the largest, infinite where any is not finite."""
    return float(values.max()) if np.isfinite(values).all() else math.inf


def _over_ground(height: npt.ArrayLike) -> Float64:
    """Return places over the origin with the ball's lowest point at heights, (balls, 3) m."""
    return np.multiply.outer(RADIUS_M + np.asarray(height), (0.0, 0.0, 1.0))


SEQUENCES: Final = (
    ("w", "w", "w", "w", "w", "w", "w", "w", "w", "w"),
    ("w", "w", "w", "wa", "wa", "a", "d", "d", "sd", "sd"),
    ("wd", "w", "wa", "a", "as", "s", "sd", "d", "wd", "w"),
    ("a", "", "a", "", "aw", "aw", "", "d", "d", "s"),
    *((keys,) * 10 for keys in ("w", "wa", "a", "as", "s", "sd", "d", "wd")),
)
"""Keys of ``wasd`` held for half a second each: straight on, there and back, round, in pauses; and
in all eight directions."""
HELD_S: Final = 0.5


def driving(setting: Setting) -> Errors:
    """Drive 5 s on open ground, against the rigid ball's exact way; and push in 8 directions.

    Distance from a rigid ball's place over the way rolled, worst of twelve sequences of keys; and
    the largest error of the direction in which keys push.
    """
    world = World(setting, game.make_level(), _over_ground(np.zeros(len(SEQUENCES))))
    exact, speed, way = np.zeros((12, 2)), np.zeros((12, 2)), np.zeros(12)
    for held in zip(*SEQUENCES, strict=True):
        newtons = np.array([forces("keys", held_keys(keys)[None])[0] for keys in held])
        world.force(newtons)
        path = world.advance(HELD_S)[0][:, :, :2]
        push = newtons / 1.4  # inertia of a solid ball that rolls, over its mass
        exact = exact + speed * HELD_S + 0.5 * push * HELD_S**2
        speed = speed + push * HELD_S
        way += np.linalg.norm(np.diff(path, axis=1), axis=2).sum(axis=1)
    end = path[:, -1]
    drawn, meant = (np.arctan2(place[4:, 1], place[4:, 0]) for place in (end, exact))
    heading = (drawn - meant + math.pi) % (2.0 * math.pi) - math.pi
    return {
        "path": _worst(np.linalg.norm(end - exact, axis=1) / way),
        "heading_deg": _worst(np.degrees(np.abs(heading))),
    }


FASTEST_M_S: Final = 36.0
"""Of a ball that enters classic's tube as fast as it can, climbs its wall and flies 66 m up."""
TUNNEL_SPEEDS_M_S: Final = np.arange(10.0, 121.0, 5.0)


def landing(setting: Setting) -> Errors:
    """Drop and throw balls on the thinnest deck: how deep they get, and from when on through.

    Depth of the landing after 46.9 m and at 36 m/s over that at which a ball falls through, and the
    least speed tried at which one passes the deck, or infinite.
    """
    deck = {"at": (0.0, 0.0, -DECK_M / 2), "size": (50.0, 50.0, DECK_M)}
    level = game.make_level(boxes=[deck], start={"at": (0.0, 0.0, RADIUS_M)})
    # 0.5 m of height are one step of 1/60 s at 30 m/s.
    falling = World(setting, level, _over_ground(game.TUBE_FALL_M + 0.5 * ARRIVALS))
    fallen = _depth(falling.advance(4.0)[0])
    speed, arrival = _each([FASTEST_M_S, *TUNNEL_SPEEDS_M_S], ARRIVALS)
    thrown = World(setting, level, _over_ground(speed * setting.preset.dt_s * arrival))
    thrown.velocity[:, 2] = -speed
    depth = _depth(thrown.advance(0.5)[0]).reshape(-1, len(ARRIVALS)).max(axis=1)
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


def elasticity(setting: Setting) -> Errors:
    """Bounce balls of every elasticity at every speed, without gravity, which takes its part."""
    errors = []
    speed, arrival = _each([0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0], ARRIVALS[::2])
    for one in (0.0, 0.2, 0.5, 0.8, 0.95):
        level = game.make_level(ball={"elasticity": one}, gravity=0.001)
        world = World(setting, level, _over_ground(speed * setting.preset.dt_s * arrival))
        world.velocity[:, 2] = -speed
        height = world.advance(0.6)[0][:, :, 2]
        returned = np.diff(height, axis=1).max(axis=1) / setting.preset.dt_s / speed
        errors.append(np.abs(returned - one))
    return {"elasticity": _worst(np.array(errors))}


def friction(setting: Setting) -> Errors:
    """Throw balls along the ground without spin; friction sets them rolling, and makes them hop.

    A rigid ball ends at 5/7 of its speed v and is then v t / 7 ahead of one that began with that,
    t = 2 v / (7 mu g) being how long it skids; so the friction is 2 v² / (49 g lead). The largest
    errors of friction, of the last speed and of the heading; how high a ball of 4 m/s hops; and how
    deep one lies half a second after it was put there.
    """
    speed, degrees = _each([2.0, 4.0, 8.0], [0.0, 22.5, 45.0])
    angle = np.radians(degrees)
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    world = World(setting, game.make_level(), _over_ground(np.zeros(len(speed))))
    world.advance(0.5)
    rest_m = RADIUS_M - float(world.position[0, 2])
    world.velocity[:, :2] = speed[:, None] * way
    place, velocity = world.advance(0.5, times=4)
    along = np.einsum("nsd,nd->ns", velocity[:, :, :2], way)
    final = along[:, -1]
    # From the velocities, since the step's own error of the position is not friction's.
    lead = np.trapezoid(along - final[:, None], dx=setting.preset.dt_s, axis=1)
    measured = 2.0 * speed**2 / (49.0 * GRAVITY_M_S2 * lead)
    moved = place[:, -1, :2] - place[:, 0, :2]
    turned = np.degrees(np.abs(np.arctan2(moved[:, 1], moved[:, 0]) - angle))
    hop = np.nanmax(place[:, :, 2], axis=1) - RADIUS_M
    return {
        "friction": _worst(np.abs(measured - game.FRICTION)),
        "skid_speed": _worst(np.abs(final / (5.0 / 7.0 * speed) - 1.0)),
        "skid_heading_deg": _worst(turned),
        "hop_mm": 1e3 * _worst(hop[speed == 4.0]),
        "rest_mm": 1e3 * rest_m,
    }


def lift(setting: Setting) -> Errors:
    """Throw the ball up as a lift pad does, and compare the rise with the closed form."""
    world = World(setting, game.make_level(), _over_ground([0.0]))
    thrust = LIFT_N - GRAVITY_M_S2
    world.force(np.array([[0.0, 0.0, LIFT_N]]))
    world.advance(LIFT_S)
    world.force(np.zeros((1, 3)))
    apex = world.advance(LIFT_S)[0][0, :, 2].max() - RADIUS_M
    speed = thrust * LIFT_S
    exact = 0.5 * thrust * LIFT_S**2 + speed**2 / (2.0 * GRAVITY_M_S2)
    return {"lift": abs(float(apex) / exact - 1.0)}


def seams(setting: Setting) -> Errors:
    """Roll from classic's bridge over two seams onto the island, at 3 to 15 m/s: highest bump."""
    level = load_level("classic")
    speed, share = _each([3.0, 6.0, 9.0, 12.0, 15.0], ARRIVALS[::3])
    begin = quants(660.0) + speed * setting.preset.dt_s * share
    flat = np.zeros_like(speed)
    world = World(setting, level, np.stack([begin, flat, flat + level.start.at[2]], axis=1))
    world.roll(speed)
    path, _ = world.advance(quants(440.0) / 15.0, times=5)
    on_course = path[:, :, 0] < quants(1180.0)
    settled = np.arange(path.shape[1]) * setting.preset.dt_s * speed[:, None] > 0.5
    height = np.where(on_course & settled, path[:, :, 2], -np.inf)
    return {"seam_mm": 1e3 * max(0.0, _worst(height.max(axis=1) - level.start.at[2]))}


def movers(setting: Setting) -> Errors:
    """Lower the gate level's plate and gate under a ball: do they keep the level's speed?

    The largest relative error of the speed, how much it goes up and down once it is reached, and
    how deep the ball is in what sinks under it.
    """
    level, found, moved_s = load_level("gate"), [], 0.3
    for piece, servo in ((level.plates[0], "plate"), (level.gates[0], "gate")):
        top = piece.at[2] + piece.size[2] / 2 + RADIUS_M
        world = World(setting, level, [(piece.at[0], piece.at[1], top)])
        (at,), (ctrl,) = (getattr(world.compiled, f"{servo}_{of}") for of in ("qpos", "ctrl"))
        world.ctrl[:, ctrl] = -piece.speed
        world.advance(moved_s)
        before = float(world.went[0, -1, at])
        path, _ = world.advance(moved_s)
        moved = world.went[0, :, at]
        wrong = abs((before - float(moved[-1])) / (moved_s * piece.speed) - 1.0)
        ringing = float(np.ptp(np.diff(moved) / setting.preset.dt_s / piece.speed))
        found.append((wrong, ringing, 1e3 * (top + float(moved[-1]) - float(path[0, -1, 2]))))
    worst = np.max([(0.0, 0.0, 0.0), *found], axis=0).tolist()
    return dict(zip(("movers", "ringing", "carried_mm"), worst, strict=True))


def squeeze(setting: Setting) -> Errors:
    """Let a hanging gate come down on the ball, which has nowhere to go: the deepest contact."""
    compiled, down = setting.compile(hanging_gate_level(0.0)), -game.GATE_SPEED_M_S
    # So far from the middle of the gate.
    places = [(x, 0.0, RADIUS_M) for x in (0.0, 0.15, 0.3, 0.45)]
    runs = [game.play(game.Course(compiled, at, movers_m_s=down), 2.5) for at in places]
    return {"squeeze_mm": 1e3 * max(float(run.depth.max()) for run in runs)}


LANE_SPEEDS_M_S: Final = np.linspace(7.5, 15.0, 76)
"""Some of them keep time with the seams, and bumps grow from one to the next."""


def lane(setting: Setting) -> Errors:
    """Roll over 49 seams in a row, which two materials keep the compiler from merging.

    The highest bump is that of the speed nearest to a resonance, and grows with the speeds that are
    tried: ``default``'s is 25 mm of 31 and 52 mm of 301. What share of them is thrown, by more than
    one quant, does not.
    """
    world = World(setting, seam_level(seams=True), _over_ground(np.zeros(len(LANE_SPEEDS_M_S))))
    world.roll(LANE_SPEEDS_M_S)
    path, _ = world.advance(0.5, times=10)
    bumps = np.where(path[:, :, 0] < 80.0, path[:, :, 2] - RADIUS_M, 0.0).max(axis=1)
    thrown = ~(bumps <= quants(1.0))
    return {"lane_mm": 1e3 * _worst(bumps), "lane_share": float(thrown.mean())}


CONTROL_DT_S: Final = 0.05
COURSES: Final = (
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
    """Play `COURSES` on the classic level with ``accurate`` physics; see `game.played`."""
    config = EnvConfig(level="classic", physics="accurate", control_dt_s=CONTROL_DT_S)
    return tuple(game.played(config, keys, seed) for seed, keys in enumerate(COURSES))


def course(setting: Setting, reference_hz: int = REFERENCE_HZ) -> Errors:
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
    world = World(setting, load_level("classic"), starts)
    places = [world.position.copy()]
    for ctrl in zip(*controls, strict=True):
        world.ctrl[:] = ctrl
        places.append(world.advance(CONTROL_DT_S)[0][:, -1])
    return np.stack(places, axis=1)


@cache
def _converged_paths(steps_per_s: int) -> Float64:
    preset = PhysicsPreset("converged", 1 / steps_per_s, "RK4", iterations=100, tolerance=1e-14)
    return course_paths(Setting("converged", "reference", preset))


_MEASURES: Final = (
    *(driving, landing, elasticity, friction),
    *(lift, seams, movers, squeeze, lane),
)


def errors_of(setting: Setting, reference_hz: int = REFERENCE_HZ) -> Errors:
    """Measure everything that a setting gets wrong."""
    values = course(setting, reference_hz)
    for measure in _MEASURES:
        values |= measure(setting)
    return values


class Requirement(NamedTuple):
    """What the game can bear."""

    name: str  # in `Errors`
    title: str  # for tables and charts
    limit: float  # largest bearable value
    reason: str
    unit: str = ""  # of the limit; empty for shares


_ASKED: Final = "asked of the default preset"
_AS_PATH: Final = "as for the path"
_FALLS: Final = "deeper, it falls through"
_NOT_SEEN: Final = (1e3 * RADIUS_M / 50, "a fiftieth of the radius is not seen", "mm")

REQUIREMENTS: Final = (
    Requirement("path", "path after 5 s of driving", 0.01, _ASKED),
    Requirement("heading_deg", "heading of the keys", 0.5, _ASKED, "°"),
    Requirement("landing_share", "landing from 46.9 m", 1.0, _FALLS),
    Requirement("fastest_share", "landing at 36 m/s", 1.0, _FALLS),
    Requirement("elasticity", "elasticity", 0.02, _ASKED),
    Requirement("friction", "friction", 0.02, _ASKED),
    Requirement("skid_speed", "speed after a skid", 0.01, _AS_PATH),
    Requirement("skid_heading_deg", "bend of a skid", 0.5, "as for the keys", "°"),
    Requirement("rest_mm", "depth at rest", *_NOT_SEEN),
    Requirement("lift", "height of the lift", 0.01, _AS_PATH),
    Requirement("seam_mm", "bump of a seam", *_NOT_SEEN),
    Requirement("movers", "speed of plate and gate", 0.01, _AS_PATH),
    Requirement("ringing", "ringing of plate and gate", 0.01, _AS_PATH),
    Requirement("carried_mm", "depth on plate and gate", *_NOT_SEEN),
    Requirement("squeeze_mm", "depth under a gate", 1e3 * THROUGH_M, _FALLS, "mm"),
    Requirement("lane_share", "thrown by a lane of seams", 0.1, "one speed in ten"),
    Requirement("course", "course of classic", 0.01, _AS_PATH),
)
"""The hop of a skid has no limit here, since what cures it costs the course; see the docs."""


def violations(errors: Errors) -> list[Requirement]:
    """Return the requirements that are not met."""
    return [one for one in REQUIREMENTS if not errors[one.name] <= one.limit]
