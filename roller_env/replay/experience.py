"""What an agent would have seen, done and earned in a replay's place."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Bool, Float64
from roller_env.envs.spaces import Observations, shape_observation
from roller_env.replay.actions import recorded_actions
from roller_env.replay.checksums import checksums
from roller_env.replay.contents import Replay
from roller_env.replay.errors import ReplayError
from roller_env.replay.playback import play_together
from roller_env.simulation import Simulation

STATES_AT_ONCE: Final = 2**18
"""Most states of replays that are played together: their observations, 110 numbers each at most,
then take 115 MB. A single replay may have more."""


@dataclass(frozen=True, eq=False)
class Experience:
    """One episode as an environment with the options asked for gives it.

    It begins where the keys begin to work: while the intro runs, there is nothing to decide. Of a
    game that was left in its intro, nothing remains.

    Attributes:
        replay: whose it is.
        observations: (T + 1, ...) float32, before the first step and after each; a dict of them
            with the ``dict`` observation.
        actions: (T,), (T, 4) or (T, 2), as the action mode has them.
        rewards: (T,) float64.
        terminated: (T,) as `RollerEnv.step` returned it.
        truncated: (T,) likewise.
    """

    replay: Replay
    observations: Observations
    actions: npt.NDArray[Any]
    rewards: Float64
    terminated: Bool
    truncated: Bool

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self.rewards)


def experiences(replays: Iterable[Replay], **changes: Any) -> Iterator[Experience]:
    """Play replays again and yield what an agent would have seen, done and earned.

    Replays of one game that follow each other are played together, but no more than
    `STATES_AT_ONCE`: who lets go of what is yielded needs memory for so many only.

    Args:
        replays: of any levels and options.
        changes: other options than the replays' own, such as ``observation="rays"`` or
            ``reward="shaped"``, but none that changes the game or its steps.

    Returns:
        One for each replay, in their order.

    Raises:
        ReplayError: a replay is not exact here, or its forces are none of the action mode's.
        ValueError: an option is wrong, or asks for pictures.
    """
    fixed = {"level", "physics", "control_dt_s", "max_episode_steps"} & changes.keys()
    if fixed:
        raise ValueError(f"{', '.join(sorted(fixed))}: these are the replay's own")
    return (one for group in _groups(replays) for one in _play(group, changes))


def _groups(replays: Iterable[Replay]) -> Iterator[list[Replay]]:
    """Yield replays that can be played together, in their order."""
    for _, alike in itertools.groupby(replays, _game_of):
        group: list[Replay] = []
        longest = 0
        for replay in alike:
            longest = max(longest, len(replay) + 1)
            if group and longest * (len(group) + 1) > STATES_AT_ONCE:
                yield group
                group, longest = [], len(replay) + 1
            group.append(replay)
        yield group


def _game_of(replay: Replay) -> tuple[str, str, bool, tuple[str, ...]]:
    """Return what is the same for replays that can be played together."""
    return *replay.environment_key, replay.intro, replay.checksums.quantities


def _play(replays: list[Replay], changes: dict[str, Any]) -> list[Experience]:
    """Play replays of one level and one set of options."""
    config = replays[0].config(**changes)
    if config.observation == "pixels":
        raise ValueError("observation: pictures are not made again; choose state, rays or dict")
    simulation = Simulation(config, len(replays))
    transitions = play_together(simulation, replays)
    lengths = np.array([len(replay) for replay in replays])
    steps = int(lengths.max())
    seen = np.empty((steps + 1, *simulation.observe().shape), dtype=np.float32)
    seen[0], reward = simulation.observe(), np.zeros((steps, len(replays)))
    terminated, truncated = (np.zeros((steps, len(replays)), dtype=bool) for _ in range(2))
    waits = np.zeros(len(replays), dtype=np.int64)
    _compare(simulation, replays, 0)
    # Control that comes back within a step does something in it.
    waiting = simulation.state.control_delay_s >= simulation.duration_s
    for step, transition in enumerate(transitions):
        waits += waiting & transition.stepped
        waiting = simulation.state.control_delay_s >= simulation.duration_s
        reward[step] = transition.reward
        terminated[step], truncated[step] = transition.terminated, transition.truncated
        seen[step + 1] = simulation.observe()
        _compare(simulation, replays, step + 1)
    return [
        Experience(
            replay=replay,
            observations=shape_observation(config, simulation.entries, seen[begin : end + 1, row]),
            actions=recorded_actions(config.action, replay.force_n[begin:]),
            rewards=reward[begin:end, row].copy(),
            terminated=terminated[begin:end, row].copy(),
            truncated=truncated[begin:end, row].copy(),
        )
        for row, (replay, begin, end) in enumerate(zip(replays, waits, lengths, strict=True))
    ]


def _compare(simulation: Simulation, replays: list[Replay], step: int) -> None:
    """Refuse replays that are not the game which was recorded, where they have checksums of it."""
    found = (
        (row, replay.checksums.row_of(step, len(replay)))
        for row, replay in enumerate(replays)
        if step <= len(replay)
    )
    due = {row: number for row, number in found if number is not None}
    if not due:
        return
    now = checksums(simulation, np.array(list(due)), replays[0].checksums.quantities)
    others = [
        names
        for (row, number), sums in zip(due.items(), now, strict=True)
        if (names := replays[row].checksums.mismatches(number, sums))
    ]
    if others:
        raise ReplayError(
            f"{len(others)} of {len(replays)} replays of level {simulation.level.name!r} "
            f"are other games at step {step}, in {', '.join(others[0])}: they were recorded with "
            "other versions, which 'roller replay' names"
        )
