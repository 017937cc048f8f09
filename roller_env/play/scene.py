"""A level as pages draw it: what is seen of it as plain data, sent once; frames say what changes.

Nothing is decided here about how anything looks: pieces say it in `roller_env.pieces.look`, and
solids get their surfaces in `roller_env.pieces.surfaces`.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from collections import defaultdict
from collections.abc import Iterator
from functools import cached_property
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Bool, Float64
from roller_env.compile.merge import merge_solids
from roller_env.compile.mjcf import quaternion
from roller_env.game.state import GameState
from roller_env.game.tables import LevelTable
from roller_env.level.expand import expand, shapes
from roller_env.level.schema import Level
from roller_env.pieces.coin import coin_shapes
from roller_env.pieces.look import METAL, Paint, Shape
from roller_env.pieces.piece import Mover, Piece, Solid, number_of
from roller_env.pieces.surfaces import Surface, solid_surfaces

FORMAT: Final = 1


class Machine:
    """A piece whose look changes with what it is doing.

    Attributes:
        kind: of piece, such as ``plate``.
        name: what the level calls it.
    """

    def __init__(self, piece: Piece, number: int, mover: int, stop: float):
        """Make it of a piece, the ``number``-th of its kind.

        Args:
            piece: the piece.
            number: its own among those of its kind.
            mover: number of what moves of it among the level's movers; -1 for nothing.
            stop: displacement at which that has arrived, metres.
        """
        self.kind = piece.rules.name if piece.rules is not None else type(piece).__name__.lower()
        self.name = str(getattr(piece, "name", ""))
        self._piece, self._number = piece, number
        self._mover, self._stop = mover, stop

    def phase(self, state: GameState, displacements: Float64) -> int:
        """Return what it is doing in a game: IDLE, ACTIVE or DONE of `roller_env.pieces.look`."""
        arrived = self._mover >= 0 and bool(displacements[self._mover] <= self._stop)
        return self._piece.phase(state, 0, self._number, arrived)


class Scene:
    """A level as pages draw it.

    Attributes:
        level: the level.
        machines: the pieces of which frames tell the phase.
        coins: how many there are.
        slots: of each of the level's movers, which slab of the simulation's it is.
    """

    def __init__(self, level: Level):
        """Find what is to be seen of ``level``."""
        everything = expand(level)
        self.level = level
        self.coins = len(everything.coins)
        self.slots = LevelTable.of_levels([level]).slots([level])[0]
        self.machines: list[Machine] = []
        self._machine_of: dict[str, int] = {}
        self._mover_of = {mover.name: i for i, mover in enumerate(everything.movers)}
        of_source = {mover.solid.source: mover for mover in everything.movers}
        for source, piece in level.pieces():
            number = number_of(source)
            changing = [shape.name for shape in piece.looks(number) if shape.has_phases]
            if changing:
                self._machine_of.update(dict.fromkeys(changing, len(self.machines)))
                self.machines.append(self._machine(piece, number, of_source.get(source)))

    def phases(self, state: GameState, displacements: Float64) -> list[int]:
        """Return what the machines are doing in a game.

        Args:
            state: of one row.
            displacements: (M,) metres, in the order of the level's movers.
        """
        return [machine.phase(state, displacements) for machine in self.machines]

    @cached_property
    def content(self) -> bytes:
        """The scene as JSON, compressed by gzip: always the same bytes for the same level."""
        data = {**self._data, "hash": self.hash}
        return gzip.compress(_json(data).encode(), mtime=0)

    @cached_property
    def hash(self) -> str:
        """Of all that the scene is made of: scenes with the same one are the same."""
        return hashlib.sha256(_json(self._data).encode()).hexdigest()[:16]

    def _machine(self, piece: Piece, number: int, mover: Mover | None) -> Machine:
        if mover is None:
            return Machine(piece, number, -1, 0.0)
        return Machine(piece, number, self._mover_of[mover.name], mover.stop)

    @cached_property
    def _data(self) -> dict[str, Any]:
        level, everything = self.level, expand(self.level)
        surfaces = _Surfaces()
        drawn = [*self._machine_shapes(surfaces), *self._shapes(surfaces)]
        ground = list(self._ground(surfaces))
        corners = np.concatenate(
            [np.array([level.start.at]), *(solid.corners() for solid in everything.at_the_start)]
        )
        paints = {paint.name: paint for shape in shapes(level) for paint in shape.paints}
        paints[METAL.name] = METAL
        return {
            "format": FORMAT,
            "name": level.name,
            "title": level.title or level.name,
            "description": level.description,
            "par_time_s": level.par_time_s,
            "coins": self.coins,
            "ball_radius": level.ball.radius,
            "start": list(level.start.at),
            "low": corners.min(axis=0).tolist(),
            "high": corners.max(axis=0).tolist(),
            "materials": {
                name: {"colour": material.colour, "pattern": material.pattern}
                for name, material in self._materials().items()
            },
            "paints": {
                name: _paint(paint) for name, paint in {METAL.name: METAL, **paints}.items()
            },
            "surfaces": surfaces.data,
            "ground": ground,
            "movers": [{"name": m.name, "along": list(m.along)} for m in everything.movers],
            "shapes": drawn,
            "machines": [{"kind": m.kind, "name": m.name} for m in self.machines],
            "labels": [
                {"text": label[0], "at": list(label[1])}
                for _, piece in level.pieces()
                if (label := piece.label()) is not None
            ],
        }

    def _materials(self) -> dict[str, Any]:
        named = {solid.material for solid in expand(self.level).decks}
        named |= {str(shape.paint) for shape in shapes(self.level) if not shape.paints}
        return {name: self.level.material(name) for name in sorted(named)}

    def _ground(self, surfaces: _Surfaces) -> Iterator[dict[str, Any]]:
        """Yield the surfaces of what stands still and does nothing: one for each material."""
        by_material: dict[str, list[Solid]] = defaultdict(list)
        for solid in merge_solids(expand(self.level).decks):
            by_material[solid.material].append(solid)
        for name, pieces in by_material.items():
            faces, edges = zip(*map(solid_surfaces, pieces), strict=True)
            there = [edge for edge in edges if edge is not None]
            yield {"surface": surfaces.add(Surface.joined(faces)), "material": name, "part": "face"}
            if there:
                edge = surfaces.add(Surface.joined(there))
                yield {"surface": edge, "material": name, "part": "edge"}

    def _machine_shapes(self, surfaces: _Surfaces) -> Iterator[dict[str, Any]]:
        """Yield the bodies of what does something, which are of metal."""
        everything = expand(self.level)
        still = [(solid, "") for solid in everything.machines]
        moving = [(mover.solid, mover.name) for mover in everything.movers]
        for solid, carrier in [*still, *moving]:
            box = type(solid) is Solid
            form = "box" if box else surfaces.add(solid_surfaces(solid)[0])
            at = solid.centre if box else (0.0, 0.0, 0.0)
            yield {
                **self._shape_data(Shape("", "box", (METAL,), solid.half_size, at)),
                "form": form,
                "rotation": _quaternion(solid.rotation) if box else [1.0, 0.0, 0.0, 0.0],
                "mover": self._mover_of.get(carrier, -1),
            }

    def _shapes(self, surfaces: _Surfaces) -> Iterator[dict[str, Any]]:
        everything = expand(self.level)
        coin_of = {shape.name: i for i, shape in enumerate(coin_shapes(everything.coins))}
        for shape in shapes(self.level):
            data = self._shape_data(shape)
            if isinstance(shape.form, Surface):
                data["form"] = surfaces.add(shape.form)
            data["coin"] = coin_of.get(shape.name, -1)
            if shape.carrier:
                carrier = everything.movers[self._mover_of[shape.carrier]].solid
                turn = np.array(carrier.rotation)
                data["at"] = (turn @ shape.at + carrier.centre).tolist()
                data["rotation"] = _quaternion(turn @ np.array(shape.rotation))
            yield data

    def _shape_data(self, shape: Shape) -> dict[str, Any]:
        motion = shape.motion
        return {
            "form": shape.form,
            "size": list(shape.size),
            "at": list(shape.at),
            "rotation": _quaternion(shape.rotation),
            "look": list(shape.materials),
            "is_material": not shape.paints,
            "mover": self._mover_of.get(shape.carrier, -1),
            "machine": self._machine_of.get(shape.name, -1),
            "coin": -1,
            "seen_in": list(shape.seen_in),
            "motion": motion and {"kind": type(motion).__name__.lower(), **motion._asdict()},
        }


class _Surfaces:
    """The surfaces of a scene, each once."""

    def __init__(self) -> None:
        self.data: list[dict[str, str]] = []
        self._known: dict[int, tuple[int, Surface]] = {}

    def add(self, surface: Surface) -> int:
        """Return a surface's number."""
        if id(surface) not in self._known:
            # Kept, so that no other surface gets its identity.
            self._known[id(surface)] = (len(self.data), surface)
            self.data.append(
                {
                    "vertices": _base64(surface.vertices, "<f4"),
                    "normals": _base64(surface.normals, "<f4"),
                    "texture": _base64(surface.texture, "<f4"),
                    "faces": _base64(surface.faces, "<u4"),
                }
            )
        return self._known[id(surface)][0]


def _json(data: dict[str, Any]) -> str:
    return json.dumps(data, separators=(",", ":"), allow_nan=False)


def _base64(array: npt.NDArray[Any], dtype: str) -> str:
    return base64.b64encode(np.ascontiguousarray(array, dtype=dtype).tobytes()).decode()


def _quaternion(rotation: Any) -> list[float]:
    found: list[float] = quaternion(np.asarray(rotation, dtype=np.float64)).tolist()
    return found


def _paint(paint: Paint) -> dict[str, Any]:
    data = paint._asdict()
    del data["name"]
    return data


def coin_bits(taken: Bool) -> bytes:
    """Return flags of coins, (K,), as bits: coin i is bit i % 8 of byte i // 8."""
    return np.packbits(taken, bitorder="little").tobytes()
