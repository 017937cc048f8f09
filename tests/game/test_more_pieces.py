"""What designers add to the original's pieces: each does what it says, on either engine."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from roller_env.config import EnvConfig
from roller_env.envs.vector import RollerVectorEnv
from roller_env.game.observations import MORE_ENTRIES, STATE_ENTRIES, split
from roller_env.level import Level, LevelError, load_level
from roller_env.pieces.fan import FAN
from roller_env.pieces.piece import rotation_matrix
from roller_env.pieces.platform import PLATFORM
from roller_env.pieces.switch import SWITCH
from roller_env.simulation import Simulation
from tests.builders import (
    BALL_RADIUS_M,
    GRAVITY,
    GROUND,
    WEIGHTLESS,
    Game,
    coin,
    make_level,
)

both = pytest.mark.parametrize("physics", ["rigid", "default"])
EVERYWHERE: Final = {"at": (0.0, 0.0, 0.0), "size": (700.0, 700.0, 100.0)}
STEP_S: Final = 1 / 20


def until(game: Game, keys: str, reached: Callable[[], bool]) -> None:
    """Hold keys until something is so, which has to be within ten seconds."""
    for _ in range(round(10.0 / game.simulation.duration_s)):
        if reached():
            return
        game.step(keys)
    raise AssertionError("it never was")


def shown(game: Game, name: str) -> Any:
    """Return one entry of the first game's observation."""
    return split(game.simulation.observe(), game.simulation.entries)[name][0]


def refused(**pieces: Any) -> str:
    """Return what is wrong with a level."""
    with pytest.raises(AssertionError) as found:
        make_level(**pieces)
    return str(found.value)


# Fans ---------------------------------------------------------------------------------------------


@both
def test_wind_rolls_the_ball_with_five_sevenths_of_its_force(physics: str) -> None:
    game = Game(make_level(fans=[EVERYWHERE | {"force_n": (0.0, 2.0, 0.0)}]), physics=physics)
    game.play(1.0 + STEP_S)  # it blows from the step after the one in which the ball is met
    velocity = game.simulation.ball_velocity[0]
    assert velocity == pytest.approx([0.0, 5 / 7 * 2.0, 0.0], rel=2e-3, abs=1e-3)
    assert shown(game, "wind").tolist() == [0.0, 2.0, 0.0]


@both
def test_wind_stops_where_its_box_ends(physics: str) -> None:
    fan = {"at": (0.0, 0.0, 0.4), "size": (2.0, 2.0, 2.0), "force_n": (4.0, 0.0, 0.0)}
    game = Game(make_level(fans=[fan]), physics=physics)
    until(game, "", lambda: game.position[0] > 1.3)
    before = game.simulation.ball_velocity[0, 0]
    game.play(1.0)
    assert game.simulation.ball_velocity[0, 0] == pytest.approx(before, rel=1e-4)


def test_a_fan_can_be_switched_on_and_off() -> None:
    fan = EVERYWHERE | {"force_n": (1.0, 0.0, 0.0), "blows": False, "name": "gust"}
    plate = {"at": (0.0, 0.0, 0.0), "size": (1.0, 1.0, 0.1), "sets": ["gust"], "mode": "hold"}
    game = Game(make_level(fans=[fan], switches=[plate]))
    game.play(0.5)
    assert game.state.of(FAN).turned[0, 0]
    until(game, "", lambda: not shown(game, "switch_on")[0])
    assert not game.state.of(FAN).turned[0, 0]
    game.step()
    before = game.simulation.ball_velocity[0, 0]
    game.play(0.5)
    assert game.simulation.ball_velocity[0, 0] == pytest.approx(before, rel=1e-4)


# Teleporters --------------------------------------------------------------------------------------


@both
def test_a_teleporter_keeps_velocity_and_spin(physics: str) -> None:
    there = (50.0, -30.0, BALL_RADIUS_M)
    portal = {"at": (3.0, 0.0, 0.4), "size": (0.2, 4.0, 2.0), "to": there}
    game = Game(make_level(teleporters=[portal]), physics=physics)
    for _ in range(60):
        velocity, spin = game.simulation.ball_velocity, game.simulation.ball_angular_velocity
        game.step("w")
        if game.position[0] > 10.0:
            break
    assert game.position == pytest.approx(there, abs=1e-12)
    # The step that ends there began before it, and W goes on pushing.
    gain = 3.63 * STEP_S
    now = game.simulation.ball_velocity[0]
    assert now == pytest.approx(velocity[0] + [gain, 0.0, 0.0], abs=5e-3)
    assert game.simulation.ball_angular_velocity[0, 1] == pytest.approx(
        spin[0, 1] + gain / BALL_RADIUS_M, abs=0.02
    )


def test_a_teleporter_may_not_lead_into_another_or_into_the_ground() -> None:
    first = {"at": (3.0, 0.0, 0.4), "size": (1.0, 1.0, 1.0), "to": (8.0, 0.0, 0.4)}
    second = {"at": (8.0, 0.0, 0.4), "size": (1.0, 1.0, 1.0), "to": (20.0, 0.0, -1.0)}
    text = refused(teleporters=[first, second])
    assert "would not stay" in text
    assert "inside boxes[0]" in text


# Springs and bumpers ------------------------------------------------------------------------------


@both
def test_a_spring_throws_the_ball_as_high_as_its_velocity_takes_it(physics: str) -> None:
    pad = {"at": (2.0, 0.0, 0.0), "size": (1.0, 1.0, 0.1), "velocity": (0.0, 0.0, 6.0)}
    game = Game(make_level(springs=[pad]), physics=physics, control_dt_s=1 / 60)
    until(game, "w", lambda: game.simulation.ball_velocity[0, 2] > 5.0)
    assert game.simulation.ball_velocity[0, 2] == pytest.approx(6.0, abs=1e-12)
    below = game.position[2]
    top = game.play(1.0)[:, 2].max()
    # At most half a step from the top; MuJoCo's Euler falls behind by half a step's speed.
    assert top - below == pytest.approx(6.0**2 / (2 * GRAVITY), abs=0.015)


@both
def test_a_spring_leaves_what_is_across_its_way_as_it_is(physics: str) -> None:
    pad = {"at": (2.0, 0.0, 0.0), "size": (1.0, 9.0, 0.5), "velocity": (5.0, 0.0, 0.0)}
    game = Game(make_level(springs=[pad], gravity=WEIGHTLESS), physics=physics)
    game.place((0.0, 0.0, 0.45), (2.0, 1.0, 0.0))
    until(game, "", lambda: game.simulation.ball_velocity[0, 0] > 4.0)
    assert game.simulation.ball_velocity[0] == pytest.approx([5.0, 1.0, 0.0], abs=1e-3)


@both
def test_a_bumper_throws_the_ball_away_from_its_middle(physics: str) -> None:
    post = {"at": (3.0, 0.0, 0.5), "size": (0.5, 0.5, 1.0), "speed": 4.0}
    game = Game(make_level(bumpers=[post]), physics=physics)
    until(game, "w", lambda: game.simulation.ball_velocity[0, 0] < 0.0)
    assert game.position[0] < 2.8
    assert game.simulation.ball_velocity[0, :2] == pytest.approx([-4.0, 0.0], abs=1e-9)
    assert shown(game, "bumper")[0] == pytest.approx(3.0 - game.position[0])


# Hazards ------------------------------------------------------------------------------------------


@both
def test_touching_a_hazard_is_a_fall(physics: str) -> None:
    lava = {"at": (5.0, 0.0, 0.0), "size": (1.0, 8.0, 0.1)}
    game = Game(make_level(hazards=[lava]), physics=physics)
    assert shown(game, "hazard")[0] == pytest.approx(4.5)
    until(game, "w", lambda: bool(game.state.over[0]))
    assert game.simulation.result().fall
    # It touches the edge of the slab when it is 0.35 m under the ball's middle.
    reach = math.sqrt(BALL_RADIUS_M**2 - (BALL_RADIUS_M - 0.05) ** 2)
    assert 4.5 - reach - 1e-3 < game.position[0] < 4.5 - reach + 0.4


def test_after_a_hazard_the_ball_comes_back_to_its_checkpoint() -> None:
    lava = {"at": (5.0, 0.0, 0.0), "size": (1.0, 8.0, 0.1)}
    flag = {"at": (2.0, 0.0, BALL_RADIUS_M), "size": (1.0, 8.0, 1.0)}
    game = Game(make_level(hazards=[lava], checkpoints=[flag], falls="checkpoint"))
    furthest = game.play(4.0, "w")[:, 0].max()
    assert 4.0 < furthest < 5.0
    assert not game.state.over[0]


def test_a_ball_may_not_begin_in_a_hazard() -> None:
    assert "would touch it at the start" in refused(hazards=[{"at": (0, 0, 0), "size": (1, 1, 1)}])


# Switches and gates -------------------------------------------------------------------------------

DOOR: Final = {"name": "door", "at": (20.0, 0.0, 1.0), "size": (0.4, 4.0, 2.0), "lowers_to": -1.2}


def switched(mode: str, **changes: Any) -> Game:
    """Return a game with a switch before the ball, and a door that closes."""
    switch = {"at": (2.0, 0.0, 0.0), "size": (1.0, 1.0, 0.1), "sets": ["door"], "mode": mode}
    level = make_level(switches=[switch | changes], gates=[DOOR | {"closes": True}])
    return Game(level, physics="rigid")


def roll_over(game: Game) -> None:
    """Let the ball roll over the switch, from its one side to the other."""
    side = math.copysign(4.0, 2.0 - game.position[0])
    game.place((2.0 - side, 0.0, BALL_RADIUS_M), (side, 0.0, 0.0))
    game.play(3.0)


def is_on(game: Game) -> bool:
    return bool(game.state.of(SWITCH).on[0, 0])


def test_a_switch_touched_once_stays_on() -> None:
    game = switched("once")
    for _ in range(2):
        roll_over(game)
        assert is_on(game)
    game.play(3.0)
    assert game.slab("door") == pytest.approx(-2.2, abs=0.01)


def test_a_toggle_goes_on_and_off_and_its_door_with_it() -> None:
    game = switched("toggle")
    for wanted in (True, False, True):
        roll_over(game)
        assert is_on(game) == wanted
        game.play(4.0)
        assert game.slab("door") == pytest.approx(-2.2 if wanted else 0.0, abs=0.01)


def test_a_switch_that_is_held_is_on_while_the_ball_is_there() -> None:
    game = switched("hold")
    game.place((2.0, 0.0, BALL_RADIUS_M))
    game.play(2.0)
    assert is_on(game)
    game.place((6.0, 0.0, BALL_RADIUS_M))
    game.play(0.1)
    assert not is_on(game)


@pytest.mark.parametrize("control_dt_s", [1 / 60, 1 / 20, 1 / 10])
def test_a_timed_switch_is_on_for_its_time(control_dt_s: float) -> None:
    switch = {"at": (2, 0, 0), "size": (1, 1, 0.1), "sets": ["door"], "mode": "timed"}
    level = make_level(switches=[switch | {"duration_s": 3.0}], gates=[DOOR | {"closes": True}])
    game = Game(level, control_dt_s)
    game.place((1.0, 0.0, BALL_RADIUS_M), (4.0, 0.0, 0.0))
    lit = 0
    for _ in range(round(6.0 / control_dt_s)):
        game.step()
        lit += is_on(game)
    assert lit * control_dt_s == pytest.approx(3.0, abs=1e-9)


def test_a_gate_that_needs_all_waits_for_the_last() -> None:
    switches = [
        {"at": (x, 0, 0), "size": (1, 1, 0.1), "sets": ["door"], "mode": "once"} for x in (2, 6)
    ]
    for needs, opens_after in (("any", 2.0), ("all", 6.0)):
        level = make_level(switches=switches, gates=[DOOR | {"needs": needs}])
        game = Game(level, physics="rigid")
        until(game, "w", lambda game=game: game.slab("door") < 0.0)  # type: ignore[misc]
        assert opens_after - 1.5 < game.position[0] < opens_after + 1.5


@both
def test_a_door_that_closes_does_not_shoot_the_ball_away(physics: str) -> None:
    """It rises under the ball, which is lifted or rolls off."""
    switch = {"at": (18, 0, 0), "size": (1, 4, 0.1), "sets": ["door"], "mode": "timed"}
    level = make_level(switches=[switch | {"duration_s": 4.0}], gates=[DOOR | {"closes": True}])
    game = Game(level, physics=physics)
    game.place((18.0, 0.0, BALL_RADIUS_M))
    game.play(3.0)
    game.place((20.0, 0.0, BALL_RADIUS_M))
    fastest = 0.0
    for _ in range(160):
        game.step()
        fastest = max(fastest, float(np.linalg.norm(game.simulation.ball_velocity[0])))
    assert fastest < 7.0  # a fall from 2.4 m
    assert game.slab("door") == pytest.approx(0.0, abs=0.01)


def test_a_switch_names_what_there_is() -> None:
    switch = {"at": (2, 0, 0), "size": (1, 1, 0.1), "sets": ["dor"]}
    assert "is called 'dor'; there are 'door'" in refused(switches=[switch], gates=[DOOR])
    assert "tells nothing" in refused(switches=[switch | {"sets": []}], gates=[DOOR])


# Platforms ----------------------------------------------------------------------------------------


def with_platform(**fields: Any) -> Level:
    """Return a level with a platform at the height 1, and the ball on it."""
    ferry = {"name": "ferry", "at": (0.0, 0.0, 0.8), "size": (40.0, 4.0, 0.4), "wait_s": 0.5}
    ferry |= {"to": (30.0, 0.0, 0.8), "speed": 2.0} | fields
    return make_level(start={"at": (0.0, 0.0, 1.0 + BALL_RADIUS_M)}, platforms=[ferry])


@pytest.mark.parametrize(("physics", "error"), [("rigid", 1e-9), ("default", 2e-2)])
def test_a_platform_carries_the_ball_with_two_sevenths_of_its_speed(
    physics: str, error: float
) -> None:
    """Friction acts through the ball's lowest point until that is as fast as the platform."""
    game = Game(with_platform(), physics=physics)
    game.play(3.0)
    assert game.simulation.ball_velocity[0, 0] == pytest.approx(2 / 7 * 2.0, rel=error)
    assert game.position[2] == pytest.approx(1.0 + BALL_RADIUS_M, abs=2e-3)


@pytest.mark.parametrize(("physics", "error"), [("rigid", 1e-9), ("default", 0.03)])
def test_a_platform_lifts_the_ball_to_its_end(physics: str, error: float) -> None:
    game = Game(with_platform(to=(0.0, 0.0, 3.8), speed=1.0, returns=False), physics=physics)
    game.play(6.0)
    assert game.position == pytest.approx([0.0, 0.0, 4.0 + BALL_RADIUS_M], abs=error)


@settings(max_examples=12, deadline=None)
@given(
    steps=st.integers(10, 200),
    speed=st.floats(0.5, 3.0),
    way=st.floats(0.5, 6.0),
    wait_s=st.floats(0.0, 2.0),
)
def test_a_platform_keeps_to_its_timetable_however_long_a_step_is(
    steps: int, speed: float, way: float, wait_s: float
) -> None:
    level = with_platform(to=(way, 0.0, 0.8), speed=speed, wait_s=wait_s, size=(1.0, 1.0, 0.4))
    trip = way / speed
    clock = (steps / 10) % (2 * (trip + wait_s))
    due = (
        min(clock * speed, way)
        if clock < trip + wait_s
        else max(0.0, way - (clock - trip - wait_s) * speed)
    )
    for each in (1, 2, 6):
        game = Game(level, 1 / (10 * each), physics="rigid")
        game.play(steps / 10)
        assert -game.slab("ferry") == pytest.approx(due, abs=1e-9)


def test_a_platform_that_is_told_goes_only_then() -> None:
    switch = {"at": (0, 0, 1.0), "size": (1, 1, 0.1), "sets": ["ferry"], "mode": "timed"}
    level = with_platform().model_dump(exclude_defaults=True)
    game = Game(Level.model_validate(level | {"switches": [switch | {"duration_s": 2.0}]}))
    game.play(8.0)
    assert not game.state.of(PLATFORM).goes[0, 0]
    assert game.slab("ferry") == pytest.approx(-2.0 * 2.0, abs=0.25)


def test_an_agent_sees_where_the_platform_is_and_how_it_goes() -> None:
    game = Game(with_platform(), physics="rigid")
    game.play(1.0)
    place, velocity = shown(game, "platform"), shown(game, "platform_velocity")
    assert place[0] == pytest.approx(2.0 - game.position[0], abs=1e-5)
    assert velocity.tolist() == pytest.approx([2.0, 0.0, 0.0], abs=1e-5)


@both
def test_a_ball_between_a_platform_and_a_wall_stays_in_the_world(physics: str) -> None:
    wall = {"at": (5.0, 0.0, 2.0), "size": (1.0, 6.0, 4.0)}
    ram = {"name": "ram", "at": (-3.0, 0.0, 0.6), "to": (3.6, 0.0, 0.6), "size": (1.0, 2.0, 1.0)}
    game = Game(make_level(boxes=[GROUND, wall], platforms=[ram | {"speed": 1.0}]), physics=physics)
    fastest = 0.0
    for _ in range(200):
        game.step("w")
        fastest = max(fastest, float(np.linalg.norm(game.simulation.ball_velocity[0])))
    assert fastest < 8.0
    assert np.abs(game.position).max() < 20.0


# Boxes and the finish -----------------------------------------------------------------------------


@given(*(st.floats(-180.0, 180.0) for _ in range(3)))
def test_a_box_is_rolled_then_pitched_then_yawed(yaw: float, pitch: float, roll: float) -> None:
    wanted = Rotation.from_euler("xyz", [roll, pitch, yaw], degrees=True).as_matrix()
    assert np.array(rotation_matrix(yaw, pitch, roll)) == pytest.approx(wanted, abs=1e-12)


@both
def test_the_ball_rolls_down_the_side_of_a_rolled_box(physics: str) -> None:
    angle = math.radians(10.0)
    slab = {"at": (0.0, 0.0, 0.0), "size": (20.0, 40.0, 1.0), "roll_deg": 10.0}
    above = (0.5 + BALL_RADIUS_M) / math.cos(angle)
    game = Game(make_level(boxes=[slab], start={"at": (0.0, 0.0, above)}), physics=physics)
    game.play(1.0)
    along = 5 / 7 * GRAVITY * math.sin(angle)
    assert game.simulation.ball_velocity[0, 1] == pytest.approx(-along * math.cos(angle), rel=5e-3)


@both
def test_a_finish_that_needs_coins_is_open_when_they_are_there(physics: str) -> None:
    goal = {"at": (3.0, 0.0, 0.5), "size": (1.0, 1.0, 1.0), "needs_coins": 1}
    closed = Game(make_level(finish=goal, coins=[coin(-5.0, 0.0, 0.4)]), physics=physics)
    closed.play(2.5, "w")
    assert not closed.state.finished[0]
    opened = Game(make_level(finish=goal, coins=[coin(1.0, 0.0, 0.4)]), physics=physics)
    opened.play(2.5, "w")
    assert opened.state.finished[0]
    assert "the level has 0 coins" in refused(finish=goal)


# What an agent sees of them -----------------------------------------------------------------------


def test_levels_without_them_are_seen_as_ever_and_others_have_their_entries_behind() -> None:
    plain, level = load_level("classic"), with_platform()
    assert Simulation(EnvConfig(level=plain)).entries == STATE_ENTRIES
    names = [entry.name for entry in Simulation(EnvConfig(level=level)).entries]
    assert names[: len(STATE_ENTRIES)] == [entry.name for entry in STATE_ENTRIES]
    assert names[len(STATE_ENTRIES) :] == ["platform", "platform_present", "platform_velocity"]
    everything = Simulation(EnvConfig(level=plain, kinds="all"))
    assert everything.entries == STATE_ENTRIES + MORE_ENTRIES
    everything.reset()
    assert (everything.observe()[0, -sum(e.size for e in MORE_ENTRIES) :] == 0.0).all()


EVERYTHING: Final = {
    "coins": [coin(4.0, 0.0, 0.4)],
    "fans": [{"at": (6.0, 0.0, 0.5), "size": (2.0, 2.0, 2.0), "force_n": (0.0, 1.5, 0.0)}],
    "teleporters": [{"at": (9.0, 6.0, 0.5), "size": (1, 1, 1), "to": (-5.0, 0.0, 0.5)}],
    "springs": [{"at": (9.0, 0.0, 0.0), "size": (1, 1, 0.1), "velocity": (1.0, 1.0, 4.0)}],
    "bumpers": [{"at": (3.0, 2.0, 0.5), "size": (0.5, 0.5, 1.0)}],
    "switches": [{"at": (2.0, 0.0, 0.0), "size": (1, 1, 0.1), "sets": ["door", "ferry"]}],
    "gates": [DOOR | {"at": (12.0, 0.0, 1.0), "closes": True}],
    "hazards": [{"at": (0.0, -8.0, 0.0), "size": (20.0, 1.0, 0.1)}],
    "platforms": [{"name": "ferry", "at": (4, 4, 0.2), "to": (8, 4, 0.2), "size": (2, 1, 0.5)}],
}


@both
def test_a_game_with_everything_goes_on_from_a_snapshot_with_the_same_bits(physics: str) -> None:
    rng = np.random.default_rng(3)
    keys = ["".join(k for k in "wasd" if rng.random() < 0.4) for _ in range(160)]
    game, other = (Game(make_level(**EVERYTHING), physics=physics) for _ in range(2))
    for held in keys[:80]:
        game.step(held)
    other.simulation.restore(game.simulation.snapshot())
    for held in keys[80:]:
        game.step(held)
        other.step(held)
        np.testing.assert_array_equal(game.simulation.observe(), other.simulation.observe())
        np.testing.assert_array_equal(game.simulation.qpos, other.simulation.qpos)


def test_levels_with_different_pieces_are_played_together_as_each_alone() -> None:
    levels = [make_level(**EVERYTHING), make_level()]
    options: dict[str, Any] = {"physics": "rigid", "kinds": "all"}
    together = RollerVectorEnv(6, levels=levels, **options)
    seen, _ = together.reset(seed=0)
    played = together.simulation.level_of
    assert set(played) == {0, 1}
    alone = [RollerVectorEnv(1, level=levels[number], **options) for number in played]
    for env in alone:
        env.reset(seed=0)
    rng = np.random.default_rng(0)
    over = np.zeros(6, dtype=bool)
    for _ in range(120):
        actions = rng.integers(0, 9, 6)
        seen, _, ended, _, _ = together.step(actions)
        for row, env in enumerate(alone):
            own, *_ = env.step(actions[row : row + 1])
            # What is over plays another level next.
            if not over[row]:
                np.testing.assert_array_equal(seen[row], own[0])
        over |= ended
    assert not over.all()


def test_an_unknown_choice_of_kinds_is_refused() -> None:
    with pytest.raises(ValueError, match="kinds: found 'some'"):
        EnvConfig(kinds="some")  # type: ignore[arg-type]
    with pytest.raises(LevelError, match="needs"):
        load_level(make_level().model_dump(mode="json") | {"gates": [DOOR | {"needs": "most"}]})
