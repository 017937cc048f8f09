"""What Studio is given to draw: it is what the game's own pictures show."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import pytest

from roller_env.drawing.stage import Stage
from roller_env.game.cameras import MODE_BEHIND, MODE_BELOW, MODE_FIRST_PERSON, MODES
from roller_env.level import Level, load_level, shipped_levels
from roller_env.level.expand import expand
from roller_env.physics.presets import PRESETS
from roller_env.pieces.finish import SPARK_LIFE_S
from roller_env.pieces.look import part
from roller_env.play.effects import Light
from roller_env.play.scene import AWAY, BALL_GROUP, GLASS_GROUP, GROUND_GROUP, PlayScene
from roller_env.simulation import Simulation
from roller_env.units import quants
from tests.builders import Game
from tests.drawing.course import change_state, course

CLOCK_S = 1.234
PRESET = PRESETS["default"]


@dataclass
class Shown:
    """A scene and its data, with a game to show."""

    scene: PlayScene
    data: mujoco.MjData
    simulation: Simulation

    def show(self, clock_s: float = CLOCK_S) -> None:
        simulation = self.simulation
        self.scene.show(self.data, simulation.qpos[0], simulation.state, clock_s)
        mujoco.mj_forward(self.scene.model, self.data)

    def place(self, name: str) -> np.ndarray:
        """Return where the geom of a puppet is."""
        body = self.scene.model.body(name)
        return np.array(self.data.geom_xpos[int(body.geomadr[0])])

    def is_seen(self, name: str) -> bool:
        return bool(self.place(name)[2] > AWAY[2] / 2)


def shown(level: Level) -> Shown:
    game = Game(level)
    scene = PlayScene(game.simulation.level, PRESET)
    result = Shown(scene, mujoco.MjData(scene.model), game.simulation)
    result.show()
    return result


@pytest.fixture
def hall() -> Shown:
    return shown(course())


@pytest.mark.parametrize("name", shipped_levels())
def test_what_is_seen_lies_and_turns_as_on_the_games_own_stage(name: str) -> None:
    level = load_level(name)
    here = shown(level)
    stage = Stage(level, PRESET)
    stage.show(here.simulation.qpos[0], here.simulation.state, 0, CLOCK_S)
    mine, seen = here.scene.model, 0
    for number in range(mine.nbody):
        body = mine.body(number)
        if body.mocapid[0] < 0 or not here.is_seen(body.name):
            continue
        seen += 1
        geom = stage.model.geom(body.name.split(" ")[0]).id
        puppet = int(body.geomadr[0])
        assert here.data.geom_xpos[puppet] == pytest.approx(stage.data.geom_xpos[geom], abs=1e-9)
        assert here.data.geom_xmat[puppet] == pytest.approx(stage.data.geom_xmat[geom], abs=1e-6)
        of_stage = stage.model.material(stage.model.geom_matid[geom]).name
        assert mine.material(mine.geom_matid[puppet]).name == of_stage
    assert seen >= len(expand(level).coins) > 0


def test_its_positions_are_those_of_the_simulation(hall: Shown) -> None:
    assert hall.scene.model.nq == hall.simulation.qpos.shape[1]
    assert (hall.data.qpos == hall.simulation.qpos[0]).all()


def test_a_collected_coin_is_gone(hall: Shown) -> None:
    name = part("coin", 0) + " gold/"
    assert hall.is_seen(name)
    change_state(hall.simulation, {"coin/taken": True})
    hall.show()
    assert not hall.is_seen(name)


def test_a_coin_turns_by_the_clock(hall: Shown) -> None:
    body = hall.scene.model.body(part("coin", 0) + " gold/").id
    before = hall.data.xquat[body].copy()
    hall.show(CLOCK_S + 0.5)
    assert abs(before @ hall.data.xquat[body]) < 0.9


@pytest.mark.parametrize(
    ("kind", "name", "arrays", "state"),
    [
        ("plate", part("plate") + "plate", {}, "idle"),
        ("plate", part("plate") + "plate", {"plate/struck": True}, "active"),
        ("plate", part("plate") + "plate", {"plate/struck": True, "plate/down": True}, "done"),
        ("gate", part("gate", 0) + "gate", {}, "idle"),
        ("gate", part("gate", 0) + "gate", {"signals": True}, "active"),
        ("pad", part("pad", 0), {}, "idle"),
        ("pad", part("pad", 0), {"lift_pad/thrust_s": 1.0}, "active"),
    ],
)
def test_exactly_the_puppet_of_the_state_is_seen(
    hall: Shown, kind: str, name: str, arrays: dict[str, object], state: str
) -> None:
    change_state(hall.simulation, arrays)
    hall.show()
    states = ("idle", "active") if kind == "pad" else ("idle", "active", "done")
    seen = [other for other in states if hall.is_seen(f"{name} {kind}/{other}")]
    assert seen == [state]


def test_the_bands_run_along_the_tube(hall: Shown) -> None:
    name = part("ring", 0, 0) + " ring/"
    before = hall.place(name)
    hall.show(CLOCK_S + 0.1)
    assert hall.place(name) - before == pytest.approx([0.0, 0.0, quants(16.0 * 0.1)])


def test_the_bands_run_up_a_retreat_triggers_pane_until_it_is_dead(hall: Shown) -> None:
    """By 300 quants a second: `camch2` moves its texture by 5 units a frame."""
    name = part("band", 0, 0) + " band/"
    hall.show(0.01)
    before = hall.place(name)
    hall.show(0.02)
    assert hall.place(name) - before == pytest.approx([0.0, 0.0, quants(300.0 * 0.01)])
    for clock_s in np.linspace(0.0, 1.0, 101):
        hall.show(clock_s)
        assert abs(hall.place(name)[2] - 1.0) < 1.0, "within the pane"
    change_state(hall.simulation, {"camera_trigger/spent": True})
    hall.show()
    assert not hall.is_seen(name)


def test_puppets_touch_nothing_and_weigh_nothing(hall: Shown) -> None:
    model = hall.scene.model
    for number in range(model.ngeom):
        if model.body(model.geom_bodyid[number]).mocapid[0] >= 0:
            assert model.geom_contype[number] == model.geom_conaffinity[number] == 0
    assert hall.data.ncon == 0


def test_the_first_person_does_not_see_the_ball_and_the_camera_below_sees_through_the_ground(
    hall: Shown,
) -> None:
    behind, first, below = map(hall.scene.groups, (MODE_BEHIND, MODE_FIRST_PERSON, MODE_BELOW))
    assert (behind[BALL_GROUP], first[BALL_GROUP], below[BALL_GROUP]) == (1, 0, 1)
    assert (behind[GROUND_GROUP], behind[GLASS_GROUP]) == (1, 0)
    assert (below[GROUND_GROUP], below[GLASS_GROUP]) == (0, 1)


@pytest.mark.parametrize("mode", range(len(MODES)))
def test_boxes_that_a_surface_is_drawn_for_are_never_seen(hall: Shown, mode: int) -> None:
    model = hall.scene.model
    boxes = [n for n in range(model.ngeom) if model.geom(n).name.startswith("solid_")]
    assert boxes
    groups = hall.scene.groups(mode)
    assert not any(groups[model.geom_group[box]] for box in boxes)


def test_particles_live_five_eighths_of_a_second_and_fade_and_shrink(hall: Shown) -> None:
    assert SPARK_LIFE_S == 0.625
    geoms = hall.scene.loose_geoms()
    # One is born in every frame of 1/60 s.
    assert len(geoms) == pytest.approx(0.625 * 60, abs=1)
    by_alpha = sorted(geoms, key=lambda geom: float(geom.rgba[3]))
    sizes = [float(geom.size[0]) for geom in by_alpha]
    assert sizes == sorted(sizes)
    assert 2.0 * sizes[-1] == pytest.approx(quants(20.0), rel=0.05), "20 quants wide at first"
    assert by_alpha[0].rgba[3] < 0.05
    assert by_alpha[-1].rgba[3] > 0.95


def test_effects_are_drawn_as_they_are_told(hall: Shown) -> None:
    light = Light((1.0, 2.0, 3.0), 0.5, (1.0, 0.5, 0.25), 0.75)
    geom = hall.scene.loose_geoms([light])[-1]
    assert geom.pos == pytest.approx([1.0, 2.0, 3.0])
    assert geom.size[0] == pytest.approx(0.5)
    assert geom.rgba == pytest.approx([1.0, 0.5, 0.25, 0.75])


def test_low_quality_draws_the_same_without_shadows() -> None:
    level = course()
    high, low = (PlayScene(level, PRESET, quality).model for quality in ("high", "low"))
    assert high.ngeom == low.ngeom
    assert high.light("sun/").castshadow[0]
    assert not low.light("sun/").castshadow[0]


def test_whoever_watches_sees_the_start_at_first(hall: Shown) -> None:
    model = hall.scene.model
    camera = mujoco.MjvCamera()
    mujoco.mjv_defaultFreeCamera(model, camera)
    assert camera.distance == pytest.approx(5.0)
    assert camera.lookat == pytest.approx(hall.simulation.ball_position[0])
    # Nothing nearer or farther is cut off than in the game's own pictures.
    stage = Stage(course(), PRESET).model
    extent, own = model.stat.extent, stage.stat.extent
    assert model.vis.map.znear * extent == pytest.approx(stage.vis.map.znear * own)
    assert model.vis.map.zfar * extent == pytest.approx(stage.vis.map.zfar * own)
