"""A start-state curriculum: some games practise what the agent achieves least surely.

A long level teaches its end slowly when every attempt at it must first play the whole beginning,
and what lies beside the way is learnt late or never: an agent that rolls past a coin into the
finish meets the coin by chance once in ten thousand steps. So whatever is achieved in an episode,
by the agent or by explorers that play at random, is kept together with the game as it was a while
before. A part of the environments begins there and tries to achieve it again, the more often the
less often that succeeds, first from half a second before and later from further back (Salimans &
Chen 2018 and Florensa et al. 2017 go backwards like this, Ecoffet et al. 2021 keep what explorers
find). Only training does this: evaluation always plays from the start.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from stable_baselines3.common.vec_env import VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from roller_env.arrays import Bool, Float64, Int64
from roller_env.envs.infos import TERMS
from roller_env.envs.sb3 import TRUNCATED, RollerVecEnv, VecSnapshot
from roller_env.envs.spaces import shape_observation
from roller_env.game.result import REWARD_TERMS
from roller_env.simulation import Snapshot, joined
from roller_env.training.exploration import Explorers, Journeys

FROM_START: Final = "from_start"
"""Key of a finished episode's info: whether it began at the level's start."""

TICK_S: Final = 0.5
"""All games are looked back at in steps of this length."""

LOOKS_BACK: Final = (1, 2, 4, 8)
"""How many of these steps lie at most between a kept game and what it achieved."""

_TRIES: Final = 1.5
"""Times that long a game is practised at most, and `_GRACE_S` more."""

_GRACE_S: Final = 2.0

_FREE_S: Final = 5.0
"""A game without a goal, taken over from an explorer, is practised this long."""

_STALL_S: Final = 10.0
"""A game from the start in which nothing was achieved for so long, and the ball stayed within
`_ELSEWHERE_M`, is over, as after a fall. An agent that stands still between two coins would else
see nothing else for the rest of a minute, and think well of it."""

_ELSEWHERE_M: Final = 4.0

_FREE: Final = 0.3
"""Fraction of the practice that begins where an explorer is, whatever can be done from there."""

_BESIDE_THE_AGENT: Final = 0.5
"""Fraction of the explorers' journeys that begin where the agent is, in a game from the start."""

_KEPT: Final = 32
"""Games kept for each task; a newer one takes the place of any."""

_RENEWAL: Final = 0.1
"""Fraction of the games that are kept when a task has all its games already."""

_MEMORY: Final = 0.03
"""Weight of the last trial in a task's rate of success."""

_LEAST: Final = 0.1
"""Weight, beside its rate of failure, with which a task is chosen that never fails."""

_NONE: Final = -1


@dataclass(frozen=True, eq=False)
class CurriculumSnapshot:
    """Everything that the future of a `StartStateCurriculum` depends on.

    Attributes:
        environments: all rows, the explorers' too.
        recent: the games a tick ago, two ticks ago and so on.
        games: those kept, by task.
        success: (tasks,) rate of success, 0 to 1.
        age: (rows,) steps since a game began or was put there.
        idle: (rows,) steps since something was achieved, a game began, or the ball left
            `_ELSEWHERE_M` behind.
        anchor: (rows, 3) where the ball was then, metres.
        task: (rows,) what a row is practising; -1 for nothing.
        from_start: (rows,) whether a game began at the start.
        clock: steps since the last tick.
        journeys: of the explorers.
        generator: state of the random generator.
    """

    environments: VecSnapshot
    recent: tuple[Snapshot, ...]
    games: dict[int, list[Snapshot]]
    success: Float64
    age: Int64
    idle: Int64
    anchor: Float64
    task: Int64
    from_start: Bool
    clock: int
    journeys: Journeys
    generator: Mapping[str, Any]


class StartStateCurriculum(VecEnvWrapper):
    """Lets the first rows practise and the rest play from the start; hides the explorers' rows.

    A task is a goal, one of `GameState.achieved` or the finish, and how far back its games begin;
    its number is ``goal * len(LOOKS_BACK) + look``. Practice is cut short when it takes too long,
    and a game from the start ends when it stalls. The level's own time limit is, to the learner, an
    end like others: the observation shows the time that is left (Pardo et al. 2018).
    """

    def __init__(
        self, environments: RollerVecEnv, fraction: float, seed: int, explorers: int = 0
    ) -> None:
        """Wrap environments.

        Args:
            environments: to wrap; the last rows are the explorers'.
            fraction: of the other rows that practise, 0 to 1.
            seed: of all choices.
            explorers: number of rows that explore.
        """
        super().__init__(environments)
        self.environments = environments
        self.num_envs = environments.num_envs - explorers
        self._rng = np.random.default_rng(seed)
        simulation = environments.simulation
        self._explorers = Explorers(simulation, explorers, self._rng)
        rows, practise = np.arange(environments.num_envs), round(fraction * self.num_envs)
        self._practises = rows < practise
        self._plays = (rows >= practise) & (rows < self.num_envs)
        self._shows_time = simulation.config.observation != "pixels"
        self._goals = simulation.state.achieved.shape[1] + 1
        self._tick = max(round(TICK_S / simulation.config.control_dt_s), 1)
        looks = self._tick * np.array(LOOKS_BACK)
        self._patience = np.rint(looks * _TRIES).astype(np.int64) + self._steps(_GRACE_S)
        self._games: dict[int, list[Snapshot]] = {}
        self._success = np.zeros(self._goals * len(LOOKS_BACK))
        self._begin_anew()

    def _steps(self, seconds: float) -> int:
        return round(seconds / self.environments.simulation.config.control_dt_s)

    def _begin_anew(self) -> None:
        rows = self.environments.num_envs
        self._recent: tuple[Snapshot, ...] = ()
        self._age = np.zeros(rows, dtype=np.int64)
        self._idle = np.zeros(rows, dtype=np.int64)
        self._anchor = np.zeros((rows, 3))
        self._task = np.full(rows, _NONE)
        self._from_start = np.ones(rows, dtype=bool)
        self._clock = 0

    def reset(self) -> Any:
        """Begin every episode at the start."""
        observations = self.environments.reset()
        self._begin_anew()
        self._anchor[:] = self.environments.simulation.ball_position
        self._achieved = self.environments.simulation.state.achieved
        return self._learner_s(observations)

    def _learner_s(self, observations: Any) -> Any:
        if isinstance(observations, dict):
            return {name: values[: self.num_envs] for name, values in observations.items()}
        return observations[: self.num_envs]

    def step_async(self, actions: Any) -> None:
        """Let the explorers act as well."""
        if len(self._explorers.rows):
            actions = np.concatenate([actions, self._explorers.actions()])
        self.environments.step_async(actions)

    def step_wait(self) -> VecEnvStepReturn:
        """Step, keep what was achieved, and begin some of the new episodes elsewhere."""
        observations, rewards, dones, infos = self.environments.step_wait()
        for row in np.flatnonzero(dones).tolist():
            infos[row][FROM_START] = bool(self._from_start[row])
            if self._shows_time:
                infos[row][TRUNCATED] = False
        if self._practises.any():
            self._practise(observations, dones, infos)
        mine = slice(self.num_envs)
        return self._learner_s(observations), rewards[mine], dones[mine], list(infos[mine])

    def _practise(self, observations: Any, dones: Bool, infos: Sequence[dict[str, Any]]) -> None:
        """Keep, judge and begin games; ``dones`` and ``infos`` tell what was cut short."""
        simulation = self.environments.simulation
        state = simulation.state
        finished = np.zeros(len(dones), dtype=bool)
        finished[dones] = [infos[row]["success"] for row in np.flatnonzero(dones).tolist()]
        done_now = np.column_stack([state.achieved & ~dones[:, None], finished])
        news = done_now.copy()
        news[:, :-1] &= ~self._achieved
        self._age += 1
        self._clock += 1
        self._keep(news)
        elsewhere = np.linalg.norm(simulation.ball_position - self._anchor, axis=1) > _ELSEWHERE_M
        self._idle += 1
        self._idle[news.any(axis=1) | elsewhere] = 0
        practising = self._practises & ~self._from_start
        tired = practising & ~dones & (self._age >= self._limits())
        stalled = self._plays & ~dones & (self._idle >= self._steps(_STALL_S))
        self._tell(np.flatnonzero(tired | stalled), observations, infos)
        self._judge(done_now, dones | tired)
        dones |= tired | stalled
        self._age[dones] = self._idle[dones] = 0
        self._from_start[dones] = True
        self._achieved = state.achieved
        self._begin_again(np.flatnonzero(stalled), observations)
        self._begin(np.flatnonzero(dones & self._practises), observations)
        self._explorers.journeys.left[dones[self._explorers.rows]] = 0
        self._send_out(self._explorers.arrived())
        fresh = self._idle == 0
        self._anchor[fresh] = simulation.ball_position[fresh]
        if self._clock == self._tick:
            self._clock = 0
            self._recent = (simulation.snapshot(), *self._recent)[: LOOKS_BACK[-1]]

    def _tell(self, rows: Int64, observations: Any, infos: Sequence[dict[str, Any]]) -> None:
        """Write into infos what is told of games that are cut short where they are."""
        state = self.environments.simulation.state
        for row in rows.tolist():
            last = (
                {name: values[row].copy() for name, values in observations.items()}
                if isinstance(observations, dict)
                else observations[row].copy()
            )
            told: dict[str, Any] = {
                "terminal_observation": last,
                "episode": {"r": float(state.total_reward[row]), "l": int(state.steps[row])},
                TERMS: dict(zip(REWARD_TERMS, state.reward_terms[row].tolist(), strict=True)),
                TRUNCATED: not self._plays[row],
                FROM_START: bool(self._from_start[row]),
            }
            infos[row].update(told)

    def _limits(self) -> Int64:
        """Return after how many steps each row has practised enough, (rows,)."""
        patience = self._patience[self._task % len(LOOKS_BACK)]
        limits: Int64 = np.where(self._task == _NONE, self._steps(_FREE_S), patience)
        return limits

    def _keep(self, news: Bool) -> None:
        """Keep the games that have just achieved something as they were before it."""
        rows, goals = np.nonzero(news)
        for row, goal in zip(rows.tolist(), goals.tolist(), strict=True):
            for look, ticks in enumerate(LOOKS_BACK):
                ago = self._clock + (ticks - 1) * self._tick
                if ticks <= len(self._recent) and ago <= self._age[row]:
                    self._keep_one(goal, look, self._recent[ticks - 1], row)

    def _keep_one(self, goal: int, look: int, past: Snapshot, row: int) -> None:
        games = self._games.setdefault(goal * len(LOOKS_BACK) + look, [])
        if len(games) < _KEPT:
            games.append(past.take([row]))
        elif self._rng.random() < _RENEWAL:
            place = int(self._rng.integers(_KEPT))
            if goal == self._goals - 1:
                # To finish with all coins is what is hardest, so of that the best are kept.
                coins = [int(game.game.coins[0]) for game in games]
                place = int(np.argmin(coins))
                if past.game.coins[row] < coins[place]:
                    return
            games[place] = past.take([row])

    def _judge(self, done_now: Bool, over: Bool) -> None:
        """Count the trials that are over, or have succeeded."""
        rows = np.flatnonzero(self._task != _NONE)
        succeeded = done_now[rows, self._task[rows] // len(LOOKS_BACK)]
        for row, success in zip(rows, succeeded, strict=True):
            if success or over[row]:
                task = self._task[row]
                self._success[task] += _MEMORY * (float(success) - self._success[task])
        # What is done goes on until it takes too long, now without a goal.
        self._task[rows[over[rows]]] = _NONE
        self._task[rows[succeeded]] = _NONE

    def _begin_again(self, rows: Int64, observations: Any) -> None:
        """Begin at the start in rows whose games are cut short."""
        if len(rows):
            simulation = self.environments.simulation
            simulation.reset(rows)
            self._put(separate(simulation.snapshot(rows)), rows)
            self._show(rows, observations)

    def _begin(self, rows: Int64, observations: Any) -> None:
        """Put kept games and explorers' games into rows, and what they show where it belongs."""
        if not len(rows) or not self._games:
            return
        simulation = self.environments.simulation
        free = self._rng.random(len(rows)) < _FREE
        explored = self._explorers.rows[~simulation.state.over[self._explorers.rows]]
        if not len(explored):
            free[:] = False
        games: list[Snapshot] = []
        self._task[rows] = _NONE
        if not free.all():
            self._task[rows[~free]], games = self._drawn(int((~free).sum()))
        if free.any():
            drawn = self._rng.integers(len(explored), size=int(free.sum()))
            games += separate(simulation.snapshot(explored).take(drawn))
        self._put(games, np.concatenate([rows[~free], rows[free]]))
        self._from_start[rows] = False
        self._show(rows, observations)

    def _show(self, rows: Int64, observations: Any) -> None:
        simulation = self.environments.simulation
        fresh = shape_observation(simulation.config, simulation.entries, simulation.observe(rows))
        if isinstance(observations, dict):
            for name, values in observations.items():
                values[rows] = fresh[name]
        else:
            observations[rows] = fresh

    def _send_out(self, rows: Int64) -> None:
        """Put explorers where the agent is or where something was achieved; let them set out.

        From where the agent is, they find what it could do next in just the games that it plays;
        what they found in others, it may not recognise in its own.
        """
        if not len(rows):
            return
        simulation, agents = self.environments.simulation, np.flatnonzero(self._plays)
        beside = (self._rng.random(len(rows)) < _BESIDE_THE_AGENT) | (not self._games)
        beside &= len(agents) > 0
        games: list[Snapshot] = []
        if beside.any():
            drawn = self._rng.integers(len(agents), size=int(beside.sum()))
            games += separate(simulation.snapshot(agents).take(drawn))
        if self._games and not beside.all():
            games += self._drawn(int((~beside).sum()))[1]
        order = np.concatenate([rows[beside], rows[~beside]])[: len(games)]
        if len(games):
            self._put(games, order)
        self._explorers.set_out(rows)

    def _drawn(self, count: int) -> tuple[Int64, list[Snapshot]]:
        """Return tasks, (count,), most often those that fail most, and a game of each."""
        tasks = np.array(sorted(self._games))
        weights = 1.0 + _LEAST - self._success[tasks]
        drawn = self._rng.choice(tasks, count, p=weights / weights.sum())
        kept = [self._games[int(task)] for task in drawn]
        return drawn, [games[int(self._rng.integers(len(games)))] for games in kept]

    def _put(self, games: Sequence[Snapshot], rows: Int64) -> None:
        """Put games of one row each into rows, which keep their random generators."""
        own = self.environments.simulation.snapshot(rows).generators
        zeros = np.zeros(len(rows))
        put = replace(joined(games), generators=own)
        self.environments.set_state(VecSnapshot(put, zeros, zeros.astype(np.int64)), rows)
        self._settle(rows)

    def _settle(self, rows: Int64) -> None:
        self._age[rows] = self._idle[rows] = 0
        self._achieved[rows] = self.environments.simulation.state.achieved[rows]

    def snapshot(self) -> CurriculumSnapshot:
        """Return the state of all rows and what was kept; as copies."""
        return CurriculumSnapshot(
            environments=self.environments.get_state(),
            recent=self._recent,
            games={task: list(games) for task, games in self._games.items()},
            success=self._success.copy(),
            age=self._age.copy(),
            idle=self._idle.copy(),
            anchor=self._anchor.copy(),
            task=self._task.copy(),
            from_start=self._from_start.copy(),
            clock=self._clock,
            journeys=self._explorers.journeys.copy(),
            generator=self._rng.bit_generator.state,
        )

    def restore(self, snapshot: CurriculumSnapshot) -> None:
        """Put everything back; the same actions then give the same bits."""
        self.environments.set_state(snapshot.environments)
        self._recent = snapshot.recent
        self._games = {task: list(games) for task, games in snapshot.games.items()}
        self._success = snapshot.success.copy()
        self._age = snapshot.age.copy()
        self._idle = snapshot.idle.copy()
        self._anchor = snapshot.anchor.copy()
        self._task = snapshot.task.copy()
        self._from_start = snapshot.from_start.copy()
        self._clock = snapshot.clock
        self._explorers.journeys = snapshot.journeys.copy()
        self._rng.bit_generator.state = snapshot.generator
        self._achieved = self.environments.simulation.state.achieved


def separate(games: Snapshot) -> list[Snapshot]:
    """Return a snapshot of many rows as snapshots of one row each."""
    return [games.take([row]) for row in range(len(games))]
