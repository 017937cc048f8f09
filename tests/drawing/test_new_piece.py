"""A kind of piece that nobody but its class knows: what follows of itself once it is registered."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
import pytest
from pydantic import Field

from roller_env.compile.compiled import compile_level
from roller_env.drawing.overview import level_corners
from roller_env.drawing.stage import Stage
from roller_env.drawing.topdown import draw_paths
from roller_env.game.state import GameState
from roller_env.game.tables import LevelTable
from roller_env.level import Level, check_level, level_warnings
from roller_env.level.expand import expand
from roller_env.level.schema import PIECE_FIELDS
from roller_env.physics.presets import PRESETS
from roller_env.pieces.fields import Name, Point
from roller_env.pieces.look import ACTIVE, IDLE, Shape, part, states
from roller_env.pieces.piece import UNTURNED, Mover, Piece, Region, Solid, Vector
from roller_env.pieces.surroundings import Surroundings
from roller_env.problems import FieldPath, Problem

PRESET: Final = PRESETS["default"]
_LAMP: Final = states("post", ("#111111", 0.0), ("#eeeeee", 1.0))


class Post(Piece):
    """A post that sinks into the ground under a lamp that is lit on Sundays."""

    name: Name = Field(description="Of no use.")
    at: Point

    def solids(self, source: str) -> Iterator[Solid]:
        yield Solid(self.at, (0.5, 0.5, 0.1), UNTURNED, "", source)

    def mover(self, source: str) -> Mover:
        x, y, z = self.at
        return Mover.down(self.name, Solid((x, y, z + 1), (0.2,) * 3, UNTURNED, "", source), z, 0.5)

    def region(self, touch: float) -> Region:
        return Region(self.at, (0.5, 0.5, 0.1), touch)

    def looks(self, number: int) -> Iterator[Shape]:
        at = (0.0, 0.0, 0.5)
        yield Shape(part("lamp", number), "sphere", _LAMP, (0.1, 0, 0), at, carrier=self.name)
        yield Shape(part("shine", number), "sphere", _LAMP[1:], (1, 0, 0), seen_in=(ACTIVE,))

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        return ACTIVE if arrived else IDLE

    def label(self) -> tuple[str, Vector]:
        return self.name, self.at

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        yield from around.too_low((*path, "at"), "the post is", self.at[2])
        if self.name == "wrong":
            yield Problem((*path, "name"), "a post is never wrong")

    def doubts(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        if around.names[Post] != ("one",):
            yield Problem(path, f"there are the posts {around.names[Post]}")


class LevelWithPosts(Level):
    """A level that has them."""

    posts: tuple[Post, ...] = ()


@pytest.fixture(autouse=True)
def _registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PIECE_FIELDS, "posts", Post)


def with_posts(*posts: dict[str, Any]) -> Level:
    return LevelWithPosts.model_validate(
        {
            "name": "posts",
            "start": {"at": (0.0, 0.0, 0.4064)},
            "finish": {"at": (15.0, 0.0, 0.5), "size": (1.0, 1.0, 1.0)},
            "boxes": [{"at": (8.0, 0.0, -0.5), "size": (20.0, 6.0, 1.0)}],
            "posts": posts,
        }
    )


ONE: Final = {"name": "one", "at": (4.0, 0.0, 0.1)}


def test_its_own_checks_are_asked() -> None:
    assert check_level(with_posts(ONE)) == level_warnings(with_posts(ONE)) == []
    two = with_posts(ONE, ONE | {"name": "wrong", "at": (8.0, 0.0, -90.0)})
    assert [problem.path for problem in check_level(two)] == [
        ("posts", 1, "at"),
        ("posts", 1, "name"),
    ]
    assert [doubt.path for doubt in level_warnings(two)] == [("posts", 0), ("posts", 1)]


def test_its_names_and_its_place_count_as_those_of_any_piece() -> None:
    twice = with_posts(ONE, ONE)
    assert ("posts", 1, "name") in [problem.path for problem in check_level(twice)]
    (problem,) = check_level(with_posts(ONE | {"at": (0.0, 0.0, 0.1)}))
    assert "would start inside posts[0]" in problem.message


def test_it_is_solid_moves_and_acts() -> None:
    level = with_posts(ONE)
    assert [region.centre for region in expand(level).regions[Post]] == [ONE["at"]]
    model = compile_level(level).model
    assert model.geom("post_0").pos.tolist() == list(ONE["at"])
    assert model.joint("one").type[0] == mujoco.mjtJoint.mjJNT_SLIDE
    assert model.actuator("one").id >= 0


def test_it_is_seen_as_its_phase_says() -> None:
    level = with_posts(ONE)
    stage = Stage(level, PRESET)
    state = GameState.initial(LevelTable.of_levels([level]), 1)
    qpos = stage.model.qpos0.copy()
    lamp, shine = stage.model.geom("lamp/0/").id, stage.model.geom("shine/0/").id

    def look() -> tuple[str, bool]:
        stage.show(qpos, state, 0, 0.0)
        paint = stage.model.material(stage.model.geom_matid[lamp]).name
        return paint, bool(stage.model.geom_rgba[shine, 3] > 0.0)

    assert look() == ("post/idle", False)
    qpos[stage.model.joint("one").qposadr[0]] = -1.1
    assert look() == ("post/active", True)
    assert stage.data.geom_xpos[lamp] == pytest.approx((4.0, 0.0, 0.5)), "on what carries it"


def test_it_is_on_maps_and_in_overviews(tmp_path: Path) -> None:
    far = with_posts(ONE | {"at": (40.0, 0.0, 0.1)})
    assert level_corners(far)[:, 0].max() == 40.5
    draw_paths(far, [np.zeros((0, 3))], ["fall"], tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 0
