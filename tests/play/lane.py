"""Short straight levels to play on, and ways to play them."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env.game.result import EpisodeResult
from roller_env.level import Level
from roller_env.play.session import GameSession, Phase, play_config
from roller_env.simulation import Simulation, Transition
from tests.builders import coin, make_level

Float64 = npt.NDArray[np.float64]

FRAME_S: Final = 1.0 / 60.0
COIN_X_M: Final = 1.5
FINISH_X_M: Final = 6.0


def lane(**pieces: Any) -> Level:
    """Return a level in which W leads over a coin into the finish, and S over the edge."""
    standard: dict[str, Any] = {
        "boxes": [{"at": (6.0, 0.0, -0.5), "size": (20.0, 8.0, 1.0)}],
        "coins": [coin(COIN_X_M, 0.0, 0.4)],
        "finish": {"at": (FINISH_X_M, 0.0, 0.5), "size": (0.5, 6.0, 1.0)},
        "kill_height": -6.0,
    }
    return make_level(**(standard | pieces))


def game(level: Level | None = None, *, started: bool = True, **options: Any) -> GameSession:
    """Return a game on the lane whose keys work at once."""
    physics = options.pop("physics", "default")
    standard: dict[str, Any] = {"skip_intro": True, "seed": 1}
    session = GameSession(play_config(level or lane(), physics), **(standard | options))
    if started:
        session.start()
    return session


def play(session: GameSession, seconds: float, held: str = "", frame_s: float = FRAME_S) -> None:
    """Let frames of one length pass."""
    for _ in range(round(seconds / frame_s)):
        session.advance(frame_s, held)


def play_until(session: GameSession, phase: Phase, held: str = "", limit_s: float = 20.0) -> float:
    """Let frames pass until a phase begins, and return how long that took."""
    for frame in range(round(limit_s / FRAME_S)):
        if session.phase is phase:
            return frame * FRAME_S
        session.advance(FRAME_S, held)
    raise AssertionError(f"{phase} did not begin in {limit_s} s; it is {session.phase}")


def ball_x(session: GameSession) -> float:
    """Return how far forward the ball is, metres."""
    return float(session.simulation.ball_position[0, 0])


class Witness:
    """An observer that keeps what it is told."""

    def __init__(self) -> None:
        self.seeds: list[int] = []
        self.forces: list[list[Float64]] = []
        self.results: list[EpisodeResult] = []

    def on_reset(self, simulation: Simulation, seed: int) -> None:
        assert simulation.state.steps[0] == 0
        self.seeds.append(seed)
        self.forces.append([])

    def on_step(self, simulation: Simulation, force_n: Float64, transition: Transition) -> None:
        assert transition.stepped[0]
        self.forces[-1].append(force_n.copy())
        assert simulation.state.steps[0] == len(self.forces[-1])

    def on_rewind(self, simulation: Simulation) -> None:
        raise AssertionError("nobody went back")

    def on_end(self, simulation: Simulation, result: EpisodeResult) -> None:
        self.results.append(result)
