"""Recording: what a simulation's rows are told, and now and then checksums of what came of it."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from gymnasium.utils import seeding

from roller_env.arrays import Float64, Int64, UInt32
from roller_env.config import EnvConfig
from roller_env.pieces.coin import COIN
from roller_env.replay.actions import recorded_actions
from roller_env.replay.checksums import QUANTITIES, Checksums, checksums, interval_of
from roller_env.replay.contents import MAX_STEPS, Replay, Versions, recorded_options
from roller_env.replay.errors import ReplayError
from roller_env.simulation import Simulation

_NAMES = tuple(QUANTITIES)


@dataclass(slots=True)
class _Take:
    """One row's episode so far."""

    start: tuple[float, float, float]
    intro: bool
    seed: int | None
    steps: int = 0
    forces: array[float] = field(default_factory=lambda: array("d"))
    checksums: list[UInt32] = field(default_factory=list)
    is_over: bool = False


class Recorder:
    """Remembers the episodes of some of a simulation's rows.

    It is told of each beginning and each step and reads the rest from the simulation, which knows
    nothing of it: a simulation without a recorder costs nothing, one with it some microseconds a
    recorded row and step. `RollerEnv` and a `RollerVectorEnv` that does not reset in the same step
    leave an ended game where the recorder can read it.
    """

    def __init__(self, simulation: Simulation, player: str = "", check_every: int | None = None):
        """Make a recorder of a simulation.

        Args:
            simulation: whose rows to record.
            player: who plays, in words, such as ``human``.
            check_every: control steps from one row of checksums to the next, so that with 1 the
                very step is found at which a game is another one; by default as many as make
                `roller_env.replay.checksums.INTERVAL_S`.
        """
        self._simulation = simulation
        self._player = player
        self._every = check_every or interval_of(simulation.duration_s)
        self._takes: dict[int, _Take] = {}
        self._options = recorded_options(simulation.config, simulation.level)

    def begin(self, rows: Sequence[int] | Int64 = (0,), seed: int | None = None) -> None:
        """Record ``rows`` from here on, whose episodes have just begun.

        Args:
            rows: to record; what was recorded of them before is forgotten.
            seed: what their generators were seeded with, to be told to whoever reads the replay.

        Raises:
            ValueError: a row's game is not at its beginning, or did not begin as the level says.
        """
        chosen = np.sort(np.asarray(rows, dtype=np.int64))
        if len(chosen) == 0:
            return
        state = self._simulation.state
        under_way = chosen[(state.steps[chosen] > 0) | state.over[chosen]]
        if len(under_way):
            raise ValueError(
                f"rows: found {under_way.tolist()} under way; a recording begins right after reset"
            )
        elsewhere = chosen[self._simulation.ball_velocity[chosen].any(axis=1)]
        elsewhere = np.union1d(elsewhere, chosen[state.of(COIN).taken[chosen].any(axis=1)])
        if len(elsewhere):
            raise ValueError(
                f"rows: found {elsewhere.tolist()} begun with a moving ball or without coins; what "
                "is on record begins as the level says"
            )
        positions = self._simulation.ball_position
        for row in chosen.tolist():
            x, y, z = positions[row].tolist()
            self._takes[row] = _Take((x, y, z), bool(state.control_delay_s[row] > 0.0), seed)
        self._check(chosen)

    def record(self, force_n: Float64) -> None:
        """Remember a step that the simulation has just made.

        Rows that it left alone are left out, and so are those of which the game was over before:
        whatever was done to them, the next recording begins with `begin`.

        Args:
            force_n: (N, 2) newtons, as given to `Simulation.step`; those of actions of the
                simulation's mode, which `replay` makes of them again.

        Raises:
            ValueError: a row was reset or stepped meanwhile without the recorder being told.
        """
        steps, over = self._simulation.state.steps, self._simulation.state.over
        made = [
            row
            for row, take in self._takes.items()
            if steps[row] != take.steps and not take.is_over
        ]
        if not made:
            return
        for row in made:
            take = self._takes[row]
            if steps[row] != take.steps + 1:
                raise ValueError(
                    f"row {row}: found it at step {steps[row]} after {take.steps} recorded; "
                    "tell the recorder of every step and every reset"
                )
            take.steps += 1
            take.forces.extend(force_n[row].tolist())
            take.is_over = bool(over[row])
        self._check(np.sort([row for row in made if steps[row] % self._every == 0]))

    def rewind(self, row: int = 0) -> None:
        """Forget of a row what came after the step to which it was put back, by a snapshot.

        Raises:
            KeyError: the row is not recorded.
            ValueError: it is not at a step before.
        """
        take, now = self._takes[row], int(self._simulation.state.steps[row])
        if now > take.steps:
            raise ValueError(f"row {row}: found it at step {now} after {take.steps} recorded")
        take.steps = now
        del take.forces[2 * now :]
        del take.checksums[now // self._every + 1 :]
        take.is_over = bool(self._simulation.state.over[row])

    def _check(self, rows: Int64) -> None:
        """Add a row of checksums to the takes of these rows."""
        if len(rows):
            for row, sums in zip(rows, checksums(self._simulation, rows, _NAMES), strict=True):
                self._takes[int(row)].checksums.append(sums)

    def replay(self, row: int = 0) -> Replay:
        """Return a row's episode as far as it has come.

        Raises:
            KeyError: the row is not recorded.
            ReplayError: it is too long for a replay, or a force was none of an action of the
                simulation's mode.
            ValueError: the row was reset or stepped meanwhile without the recorder being told.
        """
        simulation, take = self._simulation, self._takes[row]
        steps, now = take.steps, int(simulation.state.steps[row])
        if steps != now:
            raise ValueError(f"row {row}: found it at step {now} after {steps} recorded")
        if steps > MAX_STEPS:
            raise ReplayError(f"{steps} steps are too many; allowed are {MAX_STEPS}")
        sums = take.checksums
        if steps % self._every:
            sums = [*sums, checksums(simulation, np.array([row]), _NAMES)[0]]
        force_n = np.array(take.forces).reshape(-1, 2)
        return Replay(
            options=self._options,
            start=take.start,
            intro=take.intro,
            actions=recorded_actions(simulation.config.action, force_n),
            checksums=Checksums(self._every, _NAMES, np.array(sums)),
            result=simulation.result(row),
            versions=Versions.here(simulation.preset.engine),
            player=self._player,
            seed=take.seed,
        )


def place_at_starts(simulation: Simulation, starts: Float64, intro: bool) -> None:
    """Begin an episode in every row, with the ball where it began before.

    Args:
        simulation: whose rows to reset.
        starts: (N, 3) the balls' centres, metres, world frame.
        intro: see `Simulation.reset`.
    """
    simulation.reset(intro=intro)
    snapshot = simulation.snapshot()
    snapshot.bodies.position[:] = starts
    simulation.restore(snapshot)


def record_episode(
    config: EnvConfig,
    act: Callable[[Simulation], Float64],
    *,
    seed: int | None = None,
    intro: bool = False,
    player: str = "",
    check_every: int | None = None,
) -> Replay:
    """Play one episode to its end and return its replay.

    Args:
        config: of the game.
        act: gives the keys' force, (1, 2) newtons, for the next step: that of an action of the
            configured mode.
        seed: of the row's generator, as `RollerEnv.reset` takes it.
        intro: whether the keys work only after the intro.
        player: who plays, in words.
        check_every: see `Recorder`.
    """
    simulation = Simulation(config)
    simulation.seed([seeding.np_random(seed)[0]])
    simulation.reset(intro=intro)
    recorder = Recorder(simulation, player, check_every)
    recorder.begin(seed=seed)
    while not simulation.state.over[0]:
        force = act(simulation)
        simulation.step(force)
        recorder.record(force)
    return recorder.replay()
