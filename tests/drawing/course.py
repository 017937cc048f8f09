"""A small level with every kind of piece, and ways to say what a picture of it shows."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from roller_env.drawing.canvas import Picture
from roller_env.level import Level
from roller_env.simulation import Simulation
from tests.builders import make_level

START: Final = (0.0, 0.0, 0.4064)
COIN: Final = (2.5, 0.0, 0.6)


def course(**pieces: Any) -> Level:
    """Return a grey hall; from the start one sees a coin, a plate, a pad and a gate in a row."""
    grey = {"colour": "#808080"}
    standard: dict[str, Any] = {
        "materials": {"grey": grey, "default": grey},
        "boxes": [{"at": (0.0, 0.0, -0.5), "size": (60.0, 40.0, 1.0), "material": "grey"}],
        "finish": {"at": (25.0, 0.0, 1.0), "size": (1.0, 4.0, 2.0)},
        "coins": [{"at": COIN}],
        "plates": [
            {
                "name": "plate",
                "at": (3.0, 2.0, 0.0),
                "size": (2.0, 2.0, 0.8),
                "opens": ["gate"],
                "sinks_to": -0.3,
            }
        ],
        "gates": [
            {"name": "gate", "at": (7.0, 0.0, 1.0), "size": (0.4, 4.0, 2.0), "lowers_to": -1.5}
        ],
        "lift_pads": [{"at": (3.0, -2.5, 0.0), "size": (1.5, 1.5, 0.2)}],
        "tubes": [{"start": (15.0, 6.0, 0.0), "end": (15.0, 6.0, 8.0), "inner_radius": 1.4}],
        "camera_triggers": [{"kind": "retreat", "at": (-9.0, 0.0, 1.0), "size": (1.0, 4.0, 2.0)}],
        "time_limit_s": 100.0,
    }
    return make_level(**(standard | pieces))


def change_state(simulation: Simulation, arrays: dict[str, Any]) -> None:
    """Set arrays of the game's state, such as ``{"coin/taken": True}``, in every row."""
    snapshot = simulation.snapshot()
    state = snapshot.game.named()
    for name, value in arrays.items():
        state[name][:] = value
    state["coin/collected"][:] = state["coin/taken"].sum(axis=1)
    simulation.restore(snapshot)


def count(picture: Picture, colour: str) -> int:
    """Return how many pixels are clearly ``gold``, ``red`` or ``green``."""
    red, green, blue = (picture[..., channel].astype(np.int64) for channel in range(3))
    clearly = {
        "gold": (red > 150) & (green > 110) & (blue < 80),
        "red": (red > 180) & (green < 120) & (blue < 120),
        "green": (green > 130) & (green > red + 40) & (green > blue + 30),
    }
    return int(clearly[colour].sum())
