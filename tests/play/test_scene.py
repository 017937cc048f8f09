"""What a page is told of a level once."""

from __future__ import annotations

import base64
import gzip
import json
from typing import Any

import numpy as np
import pytest

from roller_env.assets import LEVELS
from roller_env.config import EnvConfig
from roller_env.level import load_level
from roller_env.level.expand import expand, shapes
from roller_env.play.scene import Scene, coin_bits
from roller_env.play.wire import frame_bytes
from roller_env.simulation import Simulation
from tests.play.lane import game, lane

MOST_BYTES = 64_000


def content(name: str) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(gzip.decompress(Scene(load_level(name)).content))
    return data


def array(text: str, dtype: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype)


@pytest.mark.parametrize("name", LEVELS)
def test_a_scene_is_whole_and_small(name: str) -> None:
    level = load_level(name)
    everything = expand(level)
    scene = Scene(level)
    assert len(scene.content) < MOST_BYTES
    data = content(name)
    assert data["coins"] == len(everything.coins)
    coins = [shape["coin"] for shape in data["shapes"] if shape["coin"] >= 0]
    assert coins == list(range(len(everything.coins)))
    bodies = len(everything.machines) + len(everything.movers)
    assert len(data["shapes"]) == bodies + sum(1 for _ in shapes(level))
    for shape in data["shapes"]:
        known = data["materials"] if shape["is_material"] else data["paints"]
        assert set(shape["look"]) <= set(known)
        assert np.linalg.norm(shape["rotation"]) == pytest.approx(1.0)
        if isinstance(shape["form"], int):
            assert shape["form"] < len(data["surfaces"])
    for piece in data["ground"]:
        assert piece["material"] in data["materials"]
    for surface in data["surfaces"]:
        vertices = array(surface["vertices"], "<f4").reshape(-1, 3)
        faces = array(surface["faces"], "<u4").reshape(-1, 3)
        assert len(array(surface["normals"], "<f4")) == 3 * len(vertices)
        assert len(array(surface["texture"], "<f4")) == 2 * len(vertices)
        assert faces.max() < len(vertices)
        assert np.isfinite(vertices).all()


def test_the_ground_has_the_area_of_the_decks() -> None:
    data = json.loads(gzip.decompress(Scene(lane()).content))
    area = 0.0
    for piece in data["ground"]:
        surface = data["surfaces"][piece["surface"]]
        corners = array(surface["vertices"], "<f4").reshape(-1, 3)[
            array(surface["faces"], "<u4").reshape(-1, 3)
        ]
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area += 0.5 * np.linalg.norm(sides, axis=1).sum()
    assert area == pytest.approx(2 * (20 * 8 + 20 * 1 + 8 * 1))


def test_equal_levels_are_one_scene_and_others_are_others() -> None:
    assert Scene(lane()).hash == Scene(lane()).hash
    assert Scene(lane()).content == Scene(lane()).content
    assert Scene(lane()).hash != Scene(lane(title="Another")).hash


def test_what_hangs_on_a_gate_goes_down_with_it() -> None:
    data = content("gate")
    mover = [m["name"] for m in data["movers"]].index("gate")
    carried = [shape for shape in data["shapes"] if shape["mover"] == mover]
    assert len(carried) > 1
    assert data["movers"][mover]["along"] == [0.0, 0.0, 1.0]


def test_the_phases_of_machines_are_told_in_the_order_of_the_scene() -> None:
    level = load_level("gate")
    scene = Scene(level)
    simulation = Simulation(EnvConfig(level=level), 1)
    kinds = [machine.kind for machine in scene.machines]
    displacements = simulation.qpos[0, 7:][scene.slots]
    assert set(scene.phases(simulation.state, displacements)) == {0}
    simulation.state.signals[:] = True
    gates = [
        phase
        for kind, phase in zip(kinds, scene.phases(simulation.state, displacements), strict=True)
        if kind == "gate"
    ]
    assert gates == [1]
    down = displacements - 10.0
    gates = [
        phase
        for kind, phase in zip(kinds, scene.phases(simulation.state, down), strict=True)
        if kind == "gate"
    ]
    assert gates == [2]


def test_coins_are_bits_from_the_lowest() -> None:
    assert coin_bits(np.array([1, 0, 0, 0, 0, 0, 0, 0, 0, 1], dtype=bool)) == bytes([1, 2])
    assert coin_bits(np.zeros(0, dtype=bool)) == b""


def test_a_level_of_many_machines_has_frames_too() -> None:
    pads = [
        {"at": (1.0 + n % 20, n // 20 - 7.0, 0.02), "size": (0.3, 0.3, 0.04)} for n in range(300)
    ]
    level = lane(
        boxes=[{"at": (10.0, 0.0, -0.5), "size": (40.0, 40.0, 1.0)}],
        lift_pads=[{**pad, "force_n": 20.0} for pad in pads],
    )
    scene = Scene(level)
    assert len(scene.machines) == 300
    assert len(frame_bytes(game(level).frame(), scene)) == 98 + 300 + 1
