"""A picture of a whole level, as one would put on its box."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from roller_env.arrays import Float64
from roller_env.drawing.canvas import Canvas, Picture
from roller_env.drawing.renderer import look
from roller_env.drawing.stage import Stage
from roller_env.game.state import GameState
from roller_env.game.tables import LevelTable
from roller_env.level.expand import expand
from roller_env.level.schema import Level
from roller_env.physics.presets import physics_preset

SHADOW_PIXELS: Final = 8192
"""Edge of the picture that shadows are made from: here it has to cover the level."""

SHADOW_MARGIN: Final = 2.0
"""Far from the middle of the shadows' square, MuJoCo sprinkles floors with shadow."""

MARGIN: Final = 1.06
"""The level's outline fills the picture but for this."""


@dataclass(frozen=True, slots=True)
class View:
    """How to look at a level; from where follows from its size.

    Attributes:
        azimuth_deg: the direction looked in, from +x towards +y.
        elevation_deg: likewise, upwards; so negative is from above.
        field_of_view_deg: of the picture's height. A wide one shows depth.
    """

    azimuth_deg: float = 38.0
    elevation_deg: float = -24.0
    field_of_view_deg: float = 32.0


def render_overview(level: Level, width: int, height: int, view: View | None = None) -> Picture:
    """Return a picture of the whole level at the start of a game, by default in three-quarter view.

    Raises:
        DrawingUnavailable: there is no OpenGL here.
    """
    stage = Stage(level, physics_preset("default"))
    corners = level_corners(level)
    view = view or View()
    position, target = fit_view(corners, view, width / height)
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    stage.model.vis.global_.fovy = view.field_of_view_deg
    reach = float(np.linalg.norm(corners - middle, axis=1).max())
    stage.model.vis.map.shadowclip = SHADOW_MARGIN * reach
    stage.model.vis.quality.shadowsize = SHADOW_PIXELS
    canvas = Canvas(stage.model, width, height)
    try:
        state = GameState.initial(LevelTable.of_levels([level]), 1)
        stage.show(stage.model.qpos0, state, 0, 0.4)
        stage.light_from(middle)
        return canvas.draw(stage.data, look(position, target))
    finally:
        canvas.close()


def level_corners(level: Level) -> Float64:
    """Return the corners of all that there is to see, (n, 3) metres."""
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    corners = [solid.corners() for solid in expand(level).at_the_start]
    # The arch stands about twice as high as the finish itself.
    corners += [signs * np.array(level.finish.size) * [0.5, 0.5, 1.5] + level.finish.at]
    return np.concatenate([*corners, [level.start.at]])


def fit_view(points: Float64, view: View, aspect: float) -> tuple[Float64, Float64]:
    """Return where to stand and what to look at to see all ``points``, (n, 3), as near as can be.

    For each side of the picture there is one point that comes nearest to it; the position follows
    from where the four planes through these meet.
    """
    azimuth, elevation = math.radians(view.azimuth_deg), math.radians(view.elevation_deg)
    ahead = np.array(
        [
            math.cos(azimuth) * math.cos(elevation),
            math.sin(azimuth) * math.cos(elevation),
            math.sin(elevation),
        ]
    )
    right = np.array([math.sin(azimuth), -math.cos(azimuth), 0.0])
    up = np.cross(right, ahead)
    slope = math.tan(math.radians(view.field_of_view_deg) / 2) / MARGIN
    depth = points @ ahead
    place, distance = [], []
    for axis, tangent in ((right, slope * aspect), (up, slope)):
        high = float((points @ axis - tangent * depth).max())
        low = float((-(points @ axis) - tangent * depth).max())
        place.append((high - low) / 2)
        distance.append(-(high + low) / (2 * tangent))
    position = place[0] * right + place[1] * up + min(distance) * ahead
    return position, position + ahead
