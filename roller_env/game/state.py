"""GameState: all that the rules change, arrays with a leading axis of environments."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env.game.cameras import OVERHEAD_WAITS
from roller_env.game.result import REWARD_TERMS
from roller_env.game.tables import Kind, LevelTable

Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

COIN_ON_PANELS: Final = 10
"""What a coin counts on whatever shows a player how the game stands: the original's `digits` show
ten times the variable. Rewards, scores and all that programs read count a coin as one."""


@dataclass(eq=False)
class GameState:
    """The game's own state of N environments; the ball and the slabs are MuJoCo's.

    Attributes:
        steps: (N,) control steps since the episode began.
        control_delay_s: (N,) time until the keys work (the intro).
        coin_taken: (N, K) which coins are collected.
        points: (N,) how many.
        touching: (N, M) which regions the ball was in at the end of the last step.
        plate_struck: (N, P) which plates are sinking or down.
        plate_down: (N, P) which plates have arrived.
        gate_opening: (N, G) which gates are lowering or down.
        thrust_s: (N, A) how much longer each lift pad pushes the ball up.
        trigger_spent: (N, T) which one-time camera triggers are dead.
        camera_mode: (N,) 0 to 5.
        camera_delay_s: (N, W) times until mode 2 is set, one for each entry of an overhead trigger
            that waits, in order; ``inf`` where none does.
        camera_x: (N,) world x of the camera while it retreats (mode 1), metres.
        waypoint: (N,) index of the next waypoint of the route.
        finished: (N,) the ball has reached the finish and is frozen.
        fallen: (N,) the ball has fallen below the kill height.
        diverged: (N,) the physics failed.
        truncated: (N,) the time is up.
        total_reward: (N,) sum of the rewards since the episode began.
        reward_terms: (N, 4) of which sums that is one: of each of `REWARD_TERMS`.
    """

    steps: Int64
    control_delay_s: Float64
    coin_taken: Bool
    points: Int64
    touching: Bool
    plate_struck: Bool
    plate_down: Bool
    gate_opening: Bool
    thrust_s: Float64
    trigger_spent: Bool
    camera_mode: Int64
    camera_delay_s: Float64
    camera_x: Float64
    waypoint: Int64
    finished: Bool
    fallen: Bool
    diverged: Bool
    truncated: Bool
    total_reward: Float64
    reward_terms: Float64

    @staticmethod
    def initial(table: LevelTable) -> GameState:
        """Return the state of the table's rows at the start of an episode."""
        n = len(table.start)

        def flags(*shape: int) -> Bool:
            return np.zeros((n, *shape), dtype=bool)

        waits = OVERHEAD_WAITS if table.width(Kind.TRIGGER) else 0
        return GameState(
            steps=np.zeros(n, dtype=np.int64),
            control_delay_s=np.zeros(n),
            coin_taken=flags(table.coin_at.shape[1]),
            points=np.zeros(n, dtype=np.int64),
            touching=flags(table.region_radius.shape[1]),
            plate_struck=flags(table.width(Kind.PLATE)),
            plate_down=flags(table.width(Kind.PLATE)),
            gate_opening=flags(table.gate_stop.shape[1]),
            thrust_s=np.zeros((n, table.width(Kind.LIFT_PAD))),
            trigger_spent=flags(table.width(Kind.TRIGGER)),
            camera_mode=np.zeros(n, dtype=np.int64),
            camera_delay_s=np.full((n, waits), np.inf),
            camera_x=np.zeros(n),
            waypoint=np.zeros(n, dtype=np.int64),
            finished=flags(),
            fallen=flags(),
            diverged=flags(),
            truncated=flags(),
            total_reward=np.zeros(n),
            reward_terms=np.zeros((n, len(REWARD_TERMS))),
        )

    @property
    def terminated(self) -> Bool:
        """(N,) whether the game is over for good: finished, fallen or diverged."""
        return self.finished | self.fallen | self.diverged

    @property
    def over(self) -> Bool:
        """(N,) whether the episode has ended, also by time."""
        return self.terminated | self.truncated

    def copy_rows(self, rows: Int64 | slice = slice(None)) -> dict[str, npt.NDArray[Any]]:
        """Return copies of the rows' arrays by name."""
        return {f.name: np.array(getattr(self, f.name)[rows]) for f in fields(self)}

    def set_rows(self, rows: Int64 | slice, values: dict[str, npt.NDArray[Any]]) -> None:
        """Write what `copy_rows` returned back into ``rows``."""
        for field in fields(self):
            getattr(self, field.name)[rows] = values[field.name]


def score_percent(points: Int64, coin_count: Int64, finished: Bool) -> Float64:
    """Return the percentage of the level's coins collected, (N,).

    A level without coins is all or nothing: 100 once it is finished, 0 before and after a fall.
    """
    collected = 100.0 * points / np.maximum(coin_count, 1)
    return np.where(coin_count > 0, collected, np.where(finished, 100.0, 0.0))
