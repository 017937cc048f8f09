"""Simulation: N games at once. The one place where physics and rules meet."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from roller_env import checks
from roller_env.arrays import Bool, Float32, Float64, Int64
from roller_env.compiled import Bound
from roller_env.config import MAX_ENVS, EnvConfig, LevelSource
from roller_env.divergence import report
from roller_env.game import observations, step
from roller_env.game.result import REWARD_TERMS, EpisodeResult
from roller_env.game.rewards import POINTS
from roller_env.game.state import GameState, score_percent
from roller_env.game.step import Games, Rewarding
from roller_env.game.tables import LevelTable
from roller_env.level import Level, load_level
from roller_env.level.check import obstacles, obstructions
from roller_env.level.expand import expand
from roller_env.physics.presets import PhysicsPreset
from roller_env.physics.protocol import Bodies, Columns, Path, Physics
from roller_env.pieces.coin import COIN
from roller_env.pieces.fields import MAX_COORDINATE_M
from roller_env.pieces.gate import GATE
from roller_env.pieces.piece import Solid
from roller_env.pieces.plate import PLATE
from roller_env.pieces.rules import Rules
from roller_env.workers import Workers


def make_physics(
    levels: Sequence[Level],
    table: LevelTable,
    level_of: Int64,
    preset: PhysicsPreset,
    substeps: int,
    num_threads: int,
) -> Physics:
    """Return the engine that a preset names, with worlds of some levels.

    Args:
        levels: that `roller_env.level.load_level` has accepted; one, if the engine is MuJoCo.
        table: of these.
        level_of: (N,) which of them each world is; the engine reads it when a world is reset.
        preset: the settings.
        substeps: physics steps in a control step.
        num_threads: native threads; 0 means one for each CPU.

    Raises:
        ValueError: the engine is MuJoCo and there are several levels.
    """
    num_envs = len(level_of)
    # Here, since one engine does not need what the other is made of.
    if preset.engine == "rigid":
        from roller_env.compile.rigid import RigidPhysics

        duration_s = substeps * preset.dt_s
        slots, slabs = table.slots(levels), table.movers.stop.shape[1]
        return RigidPhysics(
            levels, level_of, slots, slabs, num_envs, substeps, num_threads, duration_s, preset.law
        )
    if len(levels) > 1:
        raise ValueError(
            f"levels: found {len(levels)} with physics {preset.name!r}; several can be played only "
            "with 'rigid' and 'relaxed'"
        )
    from roller_env.compile.compiled import compile_level
    from roller_env.compile.physics import MujocoPhysics

    return MujocoPhysics(compile_level(levels[0], preset), num_envs, substeps, num_threads)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Everything that a row's future depends on, for n rows.

    A value: it can be pickled, and nothing in it changes by playing on. A simulation of another
    level, physics preset or control step refuses it.

    Attributes:
        levels: what is played.
        physics: (n, width) float64, the engine's state.
        columns: where everything is in it.
        game: the rules', the cameras' and the shaping's.
        level_of_row: (n,) which level each row plays.
        generators: the random generators' states.
        preset: the physics settings.
        control_dt_s: length of a control step, seconds.
    """

    levels: tuple[Level, ...]
    physics: Float64
    columns: Columns
    game: GameState
    level_of_row: Int64
    generators: tuple[dict[str, Any], ...]
    preset: PhysicsPreset
    control_dt_s: float

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.physics)

    @property
    def bodies(self) -> Bodies:
        """Where the balls and slabs are; views of `physics`, to read or to write to."""
        return Bodies.of(self.physics, self.columns)

    def take(self, rows: npt.ArrayLike) -> Snapshot:
        """Return the snapshot of some of the rows, each as often as it is named.

        Args:
            rows: (m,) row numbers, or a mask of (n,).
        """
        numbers = np.arange(len(self))[np.asarray(rows)]
        return replace(
            self,
            physics=self.physics[numbers],
            game=self.game.copy_rows(numbers),
            level_of_row=self.level_of_row[numbers],
            generators=tuple(self.generators[row] for row in numbers),
        )


def joined(games: Sequence[Snapshot]) -> Snapshot:
    """Return snapshots of one row each, or more, as one of many rows."""
    return replace(
        games[0],
        physics=np.concatenate([game.physics for game in games]),
        game=GameState.joined([game.game for game in games]),
        level_of_row=np.concatenate([game.level_of_row for game in games]),
        generators=tuple(generator for game in games for generator in game.generators),
    )


@dataclass(frozen=True, eq=False)
class Placement:
    """Where n balls begin an episode, and with what; see `Simulation.placement`, which checks it.

    Attributes:
        position: (n, 3) ball centres, metres, world frame; None: at the level's start.
        velocity: (n, 3) m/s, world frame; None: at rest.
        angular_velocity: (n, 3) rad/s, world frame; None: without spin.
        coin_left: (n, K) which coins are still there; None: all.
    """

    position: Float64 | None = None
    velocity: Float64 | None = None
    angular_velocity: Float64 | None = None
    coin_left: Bool | None = None

    def take(self, rows: Int64) -> Placement:
        """Return the placement of some of the rows."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return Placement(**{k: v if v is None else v[rows] for k, v in values.items()})


@dataclass(frozen=True, eq=False)
class Transition:
    """The result of one control step, arrays of (N,).

    Rows that were not stepped, because their game is over or they were held, have reward 0.

    Attributes:
        reward: float64.
        terminated: finished, fallen or diverged, now or before.
        truncated: the time is up, and not terminated.
        stepped: which rows were stepped.
    """

    reward: Float64
    terminated: Bool
    truncated: Bool
    stepped: Bool


class Simulation:
    """N independent games, stepped together: all of one level, or each of any of several.

    A step, in the order of the transition contract (docs/rules.md): physics; events along the path;
    reward and termination for the task as it was when the step began; consequences. `observe` then
    shows the new state.

    Attributes:
        config: the options.
        levels: what is played. Of several every reset draws one for each row, alike often.
        preset: the settings of the physics.
        state: the game's state; read it, and change it only through `restore`.
        table: the level data of every row.
        num_envs: N.
        divergences: how many games the physics has ended so far.
    """

    def __init__(
        self, config: EnvConfig, num_envs: int = 1, levels: Sequence[LevelSource] | None = None
    ):
        """Compile the level and make ``num_envs`` games of it; call `reset` before `step`.

        Args:
            config: the options.
            num_envs: how many games.
            levels: to be played instead of the one of the options.

        Raises:
            LevelError: a level is not valid.
            ValueError: ``num_envs`` is not a whole number from 1 to `MAX_ENVS`, there are no
                levels, or several on MuJoCo.
        """
        self.config = config
        self.num_envs = checks.whole("num_envs", num_envs, 1, MAX_ENVS)
        given = [config.level] if levels is None else list(levels)
        if not given:
            raise ValueError("levels: found none; at least one is needed")
        self.levels = tuple(load_level(level) for level in given)
        self.divergences = 0
        self._generators = [np.random.default_rng() for _ in range(self.num_envs)]
        self._make_games()

    def _make_games(self) -> None:
        """Make the games of which no episode has begun, from what cannot be computed anew."""
        config, num_envs = self.config, self.num_envs
        self.preset = config.preset
        self._duration_s = config.substeps * self.preset.dt_s
        expanded = [expand(level) for level in self.levels]
        self.entries = observations.entries(config.observation, config.kinds, expanded)
        self.table = LevelTable.of_levels(self.levels, config.kinds)
        level_of = np.zeros(num_envs, dtype=np.int64)
        self._games = Games(self.table, level_of, self._episode_lengths(level_of))
        self.state = self._games.state
        self._physics = make_physics(
            self.levels, self.table, level_of, self.preset, config.substeps, config.num_threads
        )
        self._at = self._physics.columns
        self._bodies = Bodies.of(self._physics.state, self._at)
        self._rewarding = Rewarding.of(config.reward_weights, config.reward, config.discount)
        physics, games = self._physics.state, self._games
        self._prepare = Bound(step.prepare, games.preparing, physics, self._at, self._duration_s)
        self._conclude = Bound(
            step.conclude, games.concluding, physics, self._at, self._duration_s, self._rewarding
        )
        self._measure = Bound(step.measure, games.concluding, physics, self._at, self._rewarding)
        self._observe = Bound(step.observe, games.showing, physics, self._at)
        self._every = np.arange(num_envs)
        self._parts = [self._every[part] for part in self._physics.parts]
        self._workers = Workers()
        self._ray_directions = observations.ray_directions()
        self._scan_offsets = observations.scan_offsets()

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy is made of; it goes on with the same bits, and on its own.

        The generators themselves are among it, so that whoever shares them with this simulation
        shares, when both are copied, the copies.
        """
        return {
            "config": self.config,
            "num_envs": self.num_envs,
            "levels": self.levels,
            "divergences": self.divergences,
            "_generators": self._generators,
            "snapshot": self.snapshot(),
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Become the copy."""
        snapshot = state["snapshot"]
        self.__dict__.update({k: v for k, v in state.items() if k != "snapshot"})
        self._make_games()
        self.restore(snapshot)

    # What can be read ------------------------------------------------------------------------

    @property
    def level(self) -> Level:
        """What is played.

        Raises:
            ValueError: that are several levels.
        """
        if len(self.levels) > 1:
            raise ValueError(
                f"found {len(self.levels)} levels in one simulation; this can be done with one"
            )
        return self.levels[0]

    @property
    def level_of(self) -> Int64:
        """(N,) copy of which of `levels` each row plays."""
        return self._games.level_of.copy()

    @property
    def duration_s(self) -> float:
        """Length of a control step."""
        return self._duration_s

    @property
    def ball_position(self) -> Float64:
        """(N, 3) copy of the ball centres, metres, world frame."""
        return self._bodies.position.copy()

    @property
    def ball_velocity(self) -> Float64:
        """(N, 3) copy of the ball centres' velocities, m/s, world frame."""
        return self._bodies.velocity.copy()

    @property
    def ball_orientation(self) -> Float64:
        """(N, 4) copy of the balls' orientations, quaternions w, x, y, z from ball to world."""
        return self._bodies.orientation.copy()

    @property
    def ball_angular_velocity(self) -> Float64:
        """(N, 3) copy of the balls' angular velocities, rad/s, in each ball's own frame."""
        return self._bodies.angular_velocity.copy()

    @property
    def plate_displacement(self) -> Float64:
        """(N, P) copy of how far the plates are over where the level puts them, metres, <= 0."""
        return self._displacement(PLATE)

    @property
    def gate_displacement(self) -> Float64:
        """(N, G) copy of how far the gates are over where the level puts them, metres."""
        return self._displacement(GATE)

    def _displacement(self, rules: Rules[Any, Any]) -> Float64:
        own = self.table.own(rules)
        return self._bodies.displacement[:, own.mover : own.mover + own.movers].copy()

    @property
    def qpos(self) -> Float64:
        """(N, 7 + M) copy of where the ball is, how it is turned, and where the slabs are.

        So MuJoCo has it in its ``qpos``, which pictures are drawn by.
        """
        bodies = self._bodies
        return np.concatenate([bodies.position, bodies.orientation, bodies.displacement], axis=1)

    @property
    def time_s(self) -> Float64:
        """(N,) time since each episode began."""
        return self.state.steps.astype(np.float64) * self.duration_s

    @property
    def coins_in_level(self) -> Int64:
        """(N,) how many coins each env's level has."""
        return self.table.of(COIN).total[self._games.level_of]

    @property
    def generators(self) -> tuple[np.random.Generator, ...]:
        """The random generator of each row."""
        return tuple(self._generators)

    def results(self, rows: Int64 | None = None) -> dict[str, npt.NDArray[Any]]:
        """Return how the games in ``rows`` (all, if None) stand, arrays of (n,) by name.

        They are the fields of `EpisodeResult`, of which ``reward_terms`` is (n, 4).
        """
        every: Int64 | slice = slice(None) if rows is None else rows
        coins, finished = self.state.coins[every], self.state.finished[every]
        return {
            "success": finished.copy(),
            "score_percent": score_percent(coins, self.coins_in_level[every], finished),
            "coins": coins.copy(),
            "time_s": self.time_s[every],
            "fall": self.state.fallen[every].copy(),
            "diverged": self.state.diverged[every].copy(),
            "truncated": self.state.truncated[every].copy(),
            "total_reward": self.state.total_reward[every].copy(),
            "reward_terms": self.state.reward_terms[every].copy(),
        }

    def result(self, row: int = 0) -> EpisodeResult:
        """Return how the game in a row stands."""
        state, one = self.state, slice(row, row + 1)
        score = score_percent(state.coins[one], self.coins_in_level[one], state.finished[one])
        return EpisodeResult(
            success=state.finished.item(row),
            fall=state.fallen.item(row),
            diverged=state.diverged.item(row),
            truncated=state.truncated.item(row),
            coins=state.coins.item(row),
            score_percent=score.item(),
            time_s=state.steps.item(row) * self.duration_s,
            total_reward=state.total_reward.item(row),
            reward_terms=dict(zip(REWARD_TERMS, state.reward_terms[row].tolist(), strict=True)),
        )

    # What changes it -------------------------------------------------------------------------

    def seed(self, generators: list[np.random.Generator]) -> None:
        """Give every row its random generator; the caller may keep using them."""
        if len(generators) != self.num_envs:
            raise ValueError(
                f"generators: found {len(generators)}; needed is one a row, {self.num_envs}"
            )
        self._generators = generators

    def reset(
        self,
        rows: Int64 | None = None,
        intro: bool = False,
        placement: Placement | None = None,
    ) -> None:
        """Load the level anew in ``rows`` (all, if None).

        Args:
            rows: (n,) row indices.
            intro: whether the ball hangs still for `roller_env.game.step.HANGING_S` and the keys
                work only after `INTRO_S`, as when the game is started; after a fall it goes on at
                once.
            placement: of the n balls, from `placement`; the rows' generators draw the same numbers
                with one as without.

        Raises:
            ValueError: ``rows`` are not different row numbers.
        """
        rows = np.arange(self.num_envs) if rows is None else self._checked(rows)
        if len(rows) == 0:
            return
        # In order, as the physics asks for them; every row has its own generator.
        order = np.argsort(rows)
        rows = rows[order]
        jitter = np.array([self._generators[row].uniform(-1.0, 1.0, 2) for row in rows])
        if len(self.levels) > 1:
            drawn = [self._generators[row].integers(len(self.levels)) for row in rows]
            self._play(rows, np.array(drawn))
        level = self._games.level_of[rows]
        self._physics.reset(rows)
        start = self.table.start[level]
        start[:, :2] += jitter * self.table.jitter[level]
        self._bodies.position[rows] = start
        fresh = GameState.initial(self.table, len(rows))
        if intro:
            fresh.control_delay_s[:] = step.INTRO_S
        self.state.set_rows(rows, fresh)
        if placement is not None:
            self._place(rows, placement.take(order))
        follows = placement is not None and placement.position is not None
        self._measure_potential(rows, np.full(len(rows), follows))

    def placement(
        self,
        position: Float64 | None = None,
        velocity: Float64 | None = None,
        angular_velocity: Float64 | None = None,
        coin_left: Bool | None = None,
    ) -> Placement:
        """Return a checked `Placement` of n balls for `reset`; see there for the arguments.

        Raises:
            ValueError: a number is not finite or out of this world, or a ball would begin inside a
                solid or the finish, or where it has fallen already.
        """
        vectors = {
            "position": (position, "m"),
            "velocity": (velocity, "m/s"),
            "angular_velocity": (angular_velocity, "rad/s"),
        }
        for name, (values, unit) in vectors.items():
            if values is not None and not (np.abs(values) <= MAX_COORDINATE_M).all():
                raise ValueError(
                    f"{name}: found {values.tolist()}; must be {-MAX_COORDINATE_M:g} to "
                    f"{MAX_COORDINATE_M:g} {unit}"
                )
        if position is not None:
            self._check_positions(position)
        if coin_left is not None and len(self.levels) > 1:
            raise ValueError("coins: can be chosen only where all games are of one level")
        return Placement(position, velocity, angular_velocity, coin_left)

    def _check_positions(self, position: Float64) -> None:
        level = self.level
        for ball in position[position[:, 2] <= level.kill_height]:
            raise ValueError(
                f"position: found {ball.tolist()}; must be above the level's kill height, "
                f"{level.kill_height:g} m"
            )
        for row, what in obstructions(level, self._obstacles, position).items():
            raise ValueError(
                f"position: found {position[row].tolist()}, where a ball of radius "
                f"{level.ball.radius:g} m is inside {what}; must be free space"
            )

    @cached_property
    def _obstacles(self) -> tuple[Solid, ...]:
        return obstacles(self.level)

    def _place(self, rows: Int64, placement: Placement) -> None:
        """Put the balls of rows that were just reset where a placement says."""
        if placement.position is not None:
            self._bodies.position[rows] = placement.position
        if placement.velocity is not None:
            self._bodies.velocity[rows] = placement.velocity
        if placement.angular_velocity is not None:
            # The ball's own frame, in which MuJoCo has it, is still the world's.
            self._bodies.angular_velocity[rows] = placement.angular_velocity
        if placement.coin_left is not None:
            coins = self.state.of(COIN)
            coins.taken[rows] = ~placement.coin_left
            coins.collected[rows] = (~placement.coin_left).sum(axis=1)

    def step(self, force_n: Float64, hold: Bool | None = None) -> Transition:
        """Advance every game that is not over by one control step.

        Args:
            force_n: (N, 2) newtons of the keys on each ball, world x and y.
            hold: (N,) rows to leave alone.

        Raises:
            ValueError: ``force_n`` has another shape.
        """
        force_n = np.ascontiguousarray(force_n, dtype=np.float64)
        if force_n.shape != (self.num_envs, 2):
            raise ValueError(f"force_n: found shape {force_n.shape}; must be ({self.num_envs}, 2)")
        idle = self.state.over if hold is None else self.state.over | hold
        rows = np.flatnonzero(~idle) if idle.any() else None
        reward = np.zeros(self.num_envs)
        if rows is None or len(rows):
            self._step_rows(rows, force_n)
            every: Int64 | slice = slice(None) if rows is None else rows
            reward[every] = self._games.step.reward[every]
        return Transition(
            reward, self.state.terminated, self.state.truncated.copy(), np.logical_not(idle)
        )

    def _step_rows(self, rows: Int64 | None, force_n: Float64) -> None:
        """Step ``rows``; None: all."""
        lost: list[tuple[Int64, Path, Bool, Float64]] = []

        def advance(envs: Int64) -> None:
            worlds = None if len(envs) == self.num_envs else envs
            self._prepare(envs, force_n)
            before = self._physics.state[slice(None) if worlds is None else worlds].copy()
            hanging = self._games.hanging_s[envs]
            path = self._let_go(worlds, hanging) if hanging.any() else self._physics.advance(worlds)
            diverged = self._physics.diverged(worlds)
            if diverged.any():
                lost.append((envs, path, diverged, before))
            else:
                self._conclude(envs, path.at, path.knots)

        self._workers.share(advance, self._shares(rows))
        for envs, path, diverged, before in sorted(lost, key=lambda one: int(one[0][0])):
            self._end_diverged(envs[diverged], path, diverged, before)
            self._conclude(envs, path.at, path.knots)

    def _shares(self, rows: Int64 | None) -> list[Int64]:
        """Return ``rows``, sorted (all, if None), by the parts of the physics; at least one."""
        if rows is None:
            return self._parts
        ends = [part.start for part in self._physics.parts[1:]]
        shares = np.split(rows, np.searchsorted(rows, ends))
        return [share for share in shares if len(share)] or [rows]

    def _let_go(self, rows: Int64 | None, hanging_s: Float64) -> Path:
        """Advance rows of which some begin to move only after ``hanging_s``, (n,); return paths."""
        still = np.rint(hanging_s / self.preset.dt_s).astype(np.int64)
        return self._physics.advance_late(rows, np.minimum(still, self._physics.substeps))

    def _measure_potential(self, rows: Int64, follows: Bool) -> None:
        """Set the potential of rows whose ball was put somewhere.

        Args:
            rows: (n,).
            follows: (n,) whether the route up to where the ball is counts as passed.
        """
        if self._rewarding.potential != POINTS and len(rows):
            self._measure(rows, follows)

    def _end_diverged(self, rows: Int64, path: Path, diverged: Bool, before: Float64) -> None:
        """Report the rows that diverged, and put their physics back to where it is finite.

        Their games are over, so nothing reads the physics but the last observation.

        Args:
            rows: (m,) which.
            path: of the n rows that were stepped.
            diverged: (n,) which of those are ``rows``.
            before: (n, width) the state of the physics before the step.
        """
        self.divergences += len(rows)
        level = self.levels[self._games.level_of[rows[0]]]
        kept = report(level, self.preset, before[diverged])
        warnings.warn(
            f"{len(rows)} game(s) of level {level.name!r} diverged and were ended; {kept}",
            RuntimeWarning,
            stacklevel=4,
        )
        self._physics.reset(rows)
        self._bodies.position[rows] = self.table.start[self._games.level_of[rows]]
        at = self._at.path
        path.at[diverged] = 0.0
        path.at[diverged, :, at : at + 3] = self._bodies.position[rows][:, None, :]
        self.state.diverged[rows] = True

    # What is seen ----------------------------------------------------------------------------

    def observe(self, rows: Int64 | None = None) -> Float32:
        """Return the observation vectors of ``rows`` (all, if None), (n, size) float32.

        They are laid out as `entries` says.
        """
        envs = self._every if rows is None else np.asarray(rows)
        out = np.zeros((len(envs), sum(entry.size for entry in self.entries)), dtype=np.float32)
        rays = self.config.observation == "rays"

        def show(share: slice) -> None:
            self._observe(envs[share], out[share])
            if rays:
                whole = rows is None and len(envs[share]) == self.num_envs
                seen = self._cast_rays(None if whole else envs[share], envs[share])
                out[share, -seen.shape[1] :] = seen

        size = -(-len(envs) // len(self._parts)) or 1
        self._workers.share(
            show, [slice(first, first + size) for first in range(0, max(len(envs), 1), size)]
        )
        return out

    def _cast_rays(self, rows: Int64 | None, envs: Int64) -> Float32:
        level_rays = self._physics.rays(
            np.zeros_like(self._ray_directions),
            self._ray_directions,
            observations.RAY_RANGE_M,
            rows,
        )
        down = np.tile([0.0, 0.0, -1.0], (len(self._scan_offsets), 1))
        scan = self._physics.rays(self._scan_offsets, down, np.inf, rows)
        radius = self.table.ball_radius[self._games.level_of[envs]]
        return observations.ray_observation(level_rays, scan, radius)

    def _play(self, rows: Int64, levels: Int64) -> None:
        """Have rows, (n,), play levels from their next reset on, (n,) numbers in `levels`."""
        self._games.level_of[rows] = levels
        self._games.concluding.max_steps[rows] = self._episode_lengths(levels)

    def _episode_lengths(self, level_of: Int64) -> Int64:
        """Return the control steps, (N,), after which an episode is truncated."""
        limit_s = self.table.time_limit_s[level_of]
        steps = np.ceil(limit_s / self.duration_s - 1e-9).astype(np.int64)
        limit = self.config.max_episode_steps
        return steps if limit is None else np.minimum(steps, limit)

    # What is kept ----------------------------------------------------------------------------

    def snapshot(self, rows: Int64 | None = None) -> Snapshot:
        """Return all that the future of ``rows`` (all, if None) depends on, as copies."""
        rows = np.arange(self.num_envs) if rows is None else self._checked(rows)
        return Snapshot(
            levels=self.levels,
            physics=self._physics.state[rows].copy(),
            columns=self._at,
            game=self.state.copy_rows(rows),
            level_of_row=self._games.level_of[rows].copy(),
            generators=tuple(self._generators[row].bit_generator.state for row in rows),
            preset=self.preset,
            control_dt_s=self.config.control_dt_s,
        )

    def restore(self, snapshot: Snapshot, rows: Int64 | None = None) -> None:
        """Put a snapshot of n rows into ``rows`` (the first n, if None), of this or another size.

        The same actions then give the same bits as they did after the snapshot.

        Raises:
            ValueError: the snapshot is of another game, or does not fit the rows.
        """
        self.check_snapshot(snapshot)
        count = len(snapshot)
        rows = self._checked(np.arange(count) if rows is None else rows)
        if len(rows) != count:
            raise ValueError(f"rows: found {len(rows)} for a snapshot of {count}")
        self._play(rows, snapshot.level_of_row)
        self._physics.reset(np.sort(rows))
        self._physics.state[rows] = snapshot.physics
        self.state.set_rows(rows, snapshot.game)
        for row, generator in zip(rows, snapshot.generators, strict=True):
            self._generators[row].bit_generator.state = generator
        # The way is only kept where it is rewarded; elsewhere it is found again, from the first
        # step on, after which the ball has passed what it has reached.
        self._measure_potential(rows, snapshot.game.steps > 0)

    def check_snapshot(self, snapshot: Snapshot) -> None:
        """Refuse what is no snapshot of the game that is played here.

        Raises:
            TypeError: it is no snapshot.
            ValueError: it is of another level, physics preset or control step.
        """
        if not isinstance(snapshot, Snapshot):
            raise TypeError(f"snapshot: found {type(snapshot)}; must be a {Snapshot.__name__}")
        theirs, ours = snapshot.levels, self.levels
        if theirs is not ours and theirs != ours:
            names, own = (", ".join(repr(level.name) for level in each) for each in (theirs, ours))
            other = "another" if names == own else "one"
            raise ValueError(
                f"snapshot: found {other} of level {names}; this simulation plays {own}"
            )
        if snapshot.preset != self.preset:
            raise ValueError(
                f"snapshot: found one of the physics {snapshot.preset}; this simulation has "
                f"{self.preset}"
            )
        if snapshot.control_dt_s != self.config.control_dt_s:
            raise ValueError(
                f"snapshot: found one with control_dt_s {snapshot.control_dt_s:g}; this simulation "
                f"has {self.config.control_dt_s:g}"
            )
        width = self._physics.state.shape[1]
        if snapshot.physics.shape[1:] != (width,):
            raise ValueError(
                f"snapshot: found physics of shape {snapshot.physics.shape}, of another version of "
                f"MuJoCo or of the package; must be (n, {width})"
            )

    def _checked(self, rows: Int64) -> Int64:
        """Return ``rows`` as indices if they are different row numbers; a mask is not."""
        rows = np.asarray(rows)
        numbers = range(self.num_envs)
        found = rows.tolist()
        wrong = rows.dtype == np.bool_ or any(row not in numbers for row in found)
        if wrong or len(set(found)) != len(found):
            raise ValueError(
                f"rows: found {_few(found)}; must be different row numbers from 0 to "
                f"{self.num_envs - 1}"
            )
        return rows.astype(np.int64)


def _few(numbers: list[int]) -> str:
    """Return numbers as text that is not too long to be read."""
    shown = ", ".join(map(str, numbers[:8]))
    return f"[{shown}, ... {len(numbers)} in all]" if len(numbers) > 8 else f"[{shown}]"
