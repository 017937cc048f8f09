"""Simulation: N games at once. The one place where physics and rules meet."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env import checks
from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.config import MAX_ENVS, EnvConfig
from roller_env.divergence import report
from roller_env.game import observations, rewards, rules, sweep
from roller_env.game.result import REWARD_TERMS, EpisodeResult
from roller_env.game.slabs import Bodies
from roller_env.game.state import GameState, score_percent
from roller_env.game.tables import LevelTable
from roller_env.level import Level, load_level
from roller_env.level.check import obstacles, obstructions
from roller_env.level.expand import Solid
from roller_env.level.schema import MAX_COORDINATE_M
from roller_env.physics.presets import PhysicsPreset
from roller_env.physics.stepper import Stepper

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]


_VIEWS_KEPT: Final = 64
"""Numbers of rows whose views of the level data are kept."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Everything that a row's future depends on, for n rows.

    A value: it can be pickled, and nothing in it changes by playing on. A simulation of another
    level, physics preset or control step refuses it.

    Attributes:
        level: what is played.
        physics: (n, nstate) float64, MuJoCo's integration state.
        game: the arrays of `GameState`.
        level_of_row: (n,) which level each row plays.
        generators: the random generators' states.
        preset: the physics settings.
        control_dt_s: length of a control step, seconds.
    """

    level: Level
    physics: Float64
    game: dict[str, npt.NDArray[Any]]
    level_of_row: Int64
    generators: tuple[dict[str, Any], ...]
    preset: PhysicsPreset
    control_dt_s: float

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.physics)

    def take(self, rows: npt.ArrayLike) -> Snapshot:
        """Return the snapshot of some of the rows, each as often as it is named.

        Args:
            rows: (m,) row numbers, or a mask of (n,).
        """
        numbers = np.arange(len(self))[np.asarray(rows)]
        return replace(
            self,
            physics=self.physics[numbers],
            game={name: values[numbers] for name, values in self.game.items()},
            level_of_row=self.level_of_row[numbers],
            generators=tuple(self.generators[row] for row in numbers),
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
    """N independent games of one level, stepped together.

    A step, in the order of the transition contract (docs/rules.md): physics; events along the path;
    reward and termination for the task as it was when the step began; consequences. `observe` then
    shows the new state.

    Attributes:
        config: the options.
        compiled: the level and its model.
        state: the game's state; read it, and change it only through `restore`.
        table: the level data of every row.
        num_envs: N.
        divergences: how many games the physics has ended so far.
    """

    def __init__(self, config: EnvConfig, num_envs: int = 1):
        """Compile the level and make ``num_envs`` games of it; call `reset` before `step`.

        Raises:
            LevelError: the level is not valid.
            ValueError: ``num_envs`` is not a whole number from 1 to `MAX_ENVS`.
        """
        self.config = config
        self.num_envs = checks.whole("num_envs", num_envs, 1, MAX_ENVS)
        self.compiled: CompiledLevel = compile_level(load_level(config.level), config.physics)
        self.divergences = 0
        self._generators = [np.random.default_rng() for _ in range(self.num_envs)]
        self._make_games()

    def _make_games(self) -> None:
        """Make the games of which no episode has begun, from what cannot be computed anew."""
        config, num_envs = self.config, self.num_envs
        self._duration_s = config.substeps * self.compiled.preset.dt_s
        self._levels = LevelTable.of([self.compiled.level])
        self._level_of_row = np.zeros(num_envs, dtype=np.int64)
        self._views: dict[int, LevelTable] = {}
        self.table = self._levels.for_rows(self._level_of_row)
        self.state = GameState.initial(self.table)
        # No episode has begun, so that there is nothing to step before the first reset.
        self.state.truncated[:] = True
        self._stepper = Stepper(self.compiled.model, num_envs, config.substeps, config.num_threads)
        self._potential = np.zeros(num_envs)
        self._max_steps = self._episode_lengths()
        self._ray_directions = observations.ray_directions()
        self._scan_offsets = observations.scan_offsets()
        ball, velocity = self.compiled.ball_qpos, self.compiled.ball_qvel
        self._position = self._stepper.qpos[:, ball : ball + 3]
        self._orientation = self._stepper.qpos[:, ball + 3 : ball + 7]
        self._velocity = self._stepper.qvel[:, velocity : velocity + 3]
        self._spin = self._stepper.qvel[:, velocity + 3 : velocity + 6]

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy is made of; it goes on with the same bits, and on its own.

        The generators themselves are among it, so that whoever shares them with this simulation
        shares, when both are copied, the copies.
        """
        return {
            "config": self.config,
            "num_envs": self.num_envs,
            "compiled": self.compiled,
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
    def duration_s(self) -> float:
        """Length of a control step."""
        return self._duration_s

    @property
    def ball_position(self) -> Float64:
        """(N, 3) copy of the ball centres, metres, world frame."""
        return self._position.copy()

    @property
    def ball_velocity(self) -> Float64:
        """(N, 3) copy of the ball centres' velocities, m/s, world frame."""
        return self._velocity.copy()

    @property
    def ball_orientation(self) -> Float64:
        """(N, 4) copy of the balls' orientations, quaternions w, x, y, z from ball to world."""
        return self._orientation.copy()

    @property
    def ball_angular_velocity(self) -> Float64:
        """(N, 3) copy of the balls' angular velocities, rad/s, in each ball's own frame."""
        return self._spin.copy()

    @property
    def plate_displacement(self) -> Float64:
        """(N, P) copy of how far the plates are over where the level puts them, metres, <= 0."""
        return self._stepper.qpos[:, self.compiled.plate_qpos]

    @property
    def gate_displacement(self) -> Float64:
        """(N, G) copy of how far the gates are over where the level puts them, metres."""
        return self._stepper.qpos[:, self.compiled.gate_qpos]

    @property
    def qpos(self) -> Float64:
        """(N, nq) copy of MuJoCo's positions, for drawing."""
        return self._stepper.qpos.copy()

    @property
    def time_s(self) -> Float64:
        """(N,) time since each episode began."""
        return self.state.steps.astype(np.float64) * self.duration_s

    @property
    def generators(self) -> tuple[np.random.Generator, ...]:
        """The random generator of each row."""
        return tuple(self._generators)

    def results(self, rows: Int64 | None = None) -> dict[str, npt.NDArray[Any]]:
        """Return how the games in ``rows`` (all, if None) stand, arrays of (n,) by name.

        They are the fields of `EpisodeResult`, of which ``reward_terms`` is (n, 4).
        """
        every: Int64 | slice = slice(None) if rows is None else rows
        coins, finished = self.state.points[every], self.state.finished[every]
        return {
            "success": finished.copy(),
            "score_percent": score_percent(coins, self.table.coin_count[every], finished),
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
        values = {name: found[0].tolist() for name, found in self.results(np.array([row])).items()}
        terms = dict(zip(REWARD_TERMS, values.pop("reward_terms"), strict=True))
        return EpisodeResult(**values, reward_terms=terms)

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
            intro: whether the ball hangs still for `rules.HANGING_S` and the keys work only after
                `rules.INTRO_S`, as when the game is started; after a fall it goes on at once.
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
        table = self._table_of(rows)
        self._stepper.reset(rows)
        jitter = np.array([self._generators[row].uniform(-1.0, 1.0, 2) for row in rows])
        start = table.start.copy()
        start[:, :2] += jitter * table.jitter
        self._position[rows] = start
        fresh = GameState.initial(table)
        if intro:
            fresh.control_delay_s[:] = rules.INTRO_S
        self.state.set_rows(rows, fresh.copy_rows())
        if placement is not None:
            self._place(rows, placement.take(order))
        self._measure_potential(rows)

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
        return Placement(position, velocity, angular_velocity, coin_left)

    def _check_positions(self, position: Float64) -> None:
        level = self.compiled.level
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
        return obstacles(self.compiled.level)

    def _place(self, rows: Int64, placement: Placement) -> None:
        """Put the balls of rows that were just reset where a placement says."""
        if placement.position is not None:
            self._position[rows] = placement.position
        if placement.velocity is not None:
            self._velocity[rows] = placement.velocity
        if placement.angular_velocity is not None:
            # The ball's own frame, in which MuJoCo has it, is still the world's.
            self._spin[rows] = placement.angular_velocity
        if placement.coin_left is not None:
            self.state.coin_taken[rows] = ~placement.coin_left
            self.state.points[rows] = (~placement.coin_left).sum(axis=1)
        if placement.position is not None:
            self._follow_route(rows)

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
        if not idle.any():
            reward = self._step_rows(None, self.state, self.table, force_n)
        else:
            reward = np.zeros(self.num_envs)
            rows = np.flatnonzero(~idle)
            if len(rows):
                part = GameState(**self.state.copy_rows(rows))
                table = self._table_of(rows)
                reward[rows] = self._step_rows(rows, part, table, force_n[rows])
                self.state.set_rows(rows, part.copy_rows())
        return Transition(
            reward, self.state.terminated, self.state.truncated.copy(), np.logical_not(idle)
        )

    def _step_rows(
        self, rows: Int64 | None, state: GameState, table: LevelTable, force_n: Float64
    ) -> Float64:
        """Step ``rows`` (None: all), whose state and level data are given; return the rewards."""
        every: Int64 | slice = slice(None) if rows is None else rows
        before = self._stepper.state[every].copy()
        bodies = self._bodies(every) if rules.anything_moves(state) else None
        controls = rules.controls(state, table, force_n, bodies, self.duration_s)
        self._set_controls(every, controls)
        hanging = controls.hanging_s if controls.hanging_s.any() else None
        path = self._stepper.advance(rows) if hanging is None else self._let_go(rows, hanging)
        diverged = self._stepper.diverged()[every] | ~np.isfinite(path[:, -1]).all(axis=1)
        if diverged.any():
            self._end_diverged(every, diverged, path, before, table)
            state.diverged |= diverged
        ball = self.compiled.ball_qpos
        motion = sweep.Motion(
            ball=path[:, :, ball : ball + 3],
            plate=path[:, -1, self.compiled.plate_qpos],
            duration_s=self.duration_s,
        )
        events = sweep.find_events(state, table, motion)
        if hanging is not None:
            sweep.forget(events, hanging > self.duration_s - 1e-9)
        terms = rewards.event_terms(events, self.config.reward_weights)
        rules.apply(state, table, motion, events)
        state.truncated = ~state.terminated & (state.steps >= self._max_steps[every])
        if self.config.reward == "shaped":
            terms[:, -1] = self._shaping(every, state, table, motion.ball[:, -1])
        return rewards.add_up(terms, state.total_reward, state.reward_terms)

    def _bodies(self, rows: Int64 | slice) -> Bodies:
        """Return where the ball and the slabs of ``rows`` are; copies, alike to the compiler."""
        qpos, act, compiled = self._stepper.qpos[rows], self._stepper.act[rows], self.compiled
        return Bodies(
            ball=self._position[rows].copy(),
            velocity=self._velocity[rows].copy(),
            plate=qpos[:, compiled.plate_qpos].copy(),
            gate=qpos[:, compiled.gate_qpos].copy(),
            plate_aim=act[:, compiled.plate_act].copy(),
            gate_aim=act[:, compiled.gate_act].copy(),
        )

    def _let_go(self, rows: Int64 | None, hanging_s: Float64) -> Float64:
        """Advance rows of which some begin to move only after ``hanging_s``, (n,); return paths."""
        still = np.rint(hanging_s / self.compiled.preset.dt_s).astype(np.int64)
        return self._stepper.advance_late(rows, np.minimum(still, self._stepper.substeps))

    def _set_controls(self, rows: Int64 | slice, controls: rules.Controls) -> None:
        ctrl = np.empty((len(controls.force_n), self._stepper.ctrl.shape[1]))
        ctrl[:, self.compiled.force_ctrl] = controls.force_n
        ctrl[:, self.compiled.plate_ctrl] = controls.plate_velocity
        ctrl[:, self.compiled.gate_ctrl] = controls.gate_velocity
        self._stepper.ctrl[rows] = ctrl

    def _shaping(
        self, rows: Int64 | slice, state: GameState, table: LevelTable, ball: Float64
    ) -> Float64:
        """Return the shaping reward of the rows' step, and remember the new potential."""
        rewards.follow_route(state, table, ball)
        weight = self.config.reward_weights.progress
        potential = weight * rewards.route_progress(state, table, ball)
        shaping = rewards.shaping(
            self._potential[rows], potential, state.terminated, self.config.discount
        )
        self._potential[rows] = potential
        return shaping

    def _follow_route(self, rows: Int64) -> None:
        """Count the route up to where the balls of ``rows`` are as passed."""
        if self.config.reward == "shaped" and len(rows):
            part = GameState(**self.state.copy_rows(rows))
            rewards.follow_route(part, self._table_of(rows), self._position[rows])
            self.state.waypoint[rows] = part.waypoint

    def _measure_potential(self, rows: Int64) -> None:
        """Set the potential of rows whose state was replaced."""
        if self.config.reward != "shaped":
            return
        part = GameState(**self.state.copy_rows(rows))
        table = self._table_of(rows)
        progress = rewards.route_progress(part, table, self._position[rows])
        self._potential[rows] = self.config.reward_weights.progress * progress

    def _end_diverged(
        self,
        every: Int64 | slice,
        diverged: Bool,
        path: Float64,
        before: Float64,
        table: LevelTable,
    ) -> None:
        """Report what diverged, and put those rows' physics back to the start, where it is finite.

        Their games are over, so nothing reads the physics but the last observation.
        """
        rows = np.arange(self.num_envs)[every][diverged]
        self.divergences += len(rows)
        kept = report(self.compiled, before[diverged], self._stepper.ctrl[rows])
        warnings.warn(
            f"{len(rows)} game(s) of level {self.compiled.level.name!r} diverged and were ended; "
            f"{kept}",
            RuntimeWarning,
            stacklevel=4,
        )
        self._stepper.reset(rows)
        self._position[rows] = table.start[diverged]
        path[diverged] = self._stepper.qpos[rows][:, None, :]

    # What is seen ----------------------------------------------------------------------------

    def observe(self, rows: Int64 | None = None) -> Float32:
        """Return the observation vectors of ``rows`` (all, if None), (n, size) float32.

        They are laid out as `roller_env.game.observations.entries` of the configured mode says.
        """
        every: Int64 | slice = slice(None) if rows is None else rows
        if rows is None:
            state, table = self.state, self.table
        else:
            state = GameState(**self.state.copy_rows(rows))
            table = self._table_of(rows)
        ball = observations.BallState(
            # Copies, so that all rows and some of them are alike to the compiler.
            position=self._position[every].copy(),
            velocity=self._velocity[every].copy(),
            orientation=self._orientation[every].copy(),
            spin=self._spin[every].copy(),
            gate=self._stepper.qpos[every][:, self.compiled.gate_qpos].copy(),
        )
        vector = observations.state_observation(ball, state, table, self._max_steps[every])
        if self.config.observation != "rays":
            return vector
        return np.concatenate([vector, self._cast_rays(rows, ball.position, table)], axis=1)

    def _cast_rays(self, rows: Int64 | None, ball: Float64, table: LevelTable) -> Float32:
        body = self.compiled.ball_body
        level_origins = np.broadcast_to(ball[:, None, :], (len(ball), len(self._ray_directions), 3))
        level_rays = self._stepper.rays(level_origins, self._ray_directions, body, rows)
        down = np.broadcast_to([0.0, 0.0, -1.0], self._scan_offsets.shape)
        scan = self._stepper.rays(ball[:, None, :] + self._scan_offsets, down, body, rows)
        return observations.ray_observation(level_rays, scan, table.ball_radius)

    def _episode_lengths(self) -> Int64:
        """Return the control steps, (N,), after which an episode is truncated."""
        steps = np.ceil(self.table.time_limit_s / self.duration_s - 1e-9).astype(np.int64)
        limit = self.config.max_episode_steps
        return steps if limit is None else np.minimum(steps, limit)

    # What is kept ----------------------------------------------------------------------------

    def snapshot(self, rows: Int64 | None = None) -> Snapshot:
        """Return all that the future of ``rows`` (all, if None) depends on, as copies."""
        rows = np.arange(self.num_envs) if rows is None else self._checked(rows)
        return Snapshot(
            level=self.compiled.level,
            physics=self._stepper.state[rows].copy(),
            game=self.state.copy_rows(rows),
            level_of_row=self._level_of_row[rows].copy(),
            generators=tuple(self._generators[row].bit_generator.state for row in rows),
            preset=self.compiled.preset,
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
        self._stepper.reset(np.sort(rows))
        self._stepper.state[rows] = snapshot.physics
        self.state.set_rows(rows, snapshot.game)
        self._level_of_row[rows] = snapshot.level_of_row
        for row, generator in zip(rows, snapshot.generators, strict=True):
            self._generators[row].bit_generator.state = generator
        # The way is only kept where it is rewarded; elsewhere it is found again, from the first
        # step on, after which the ball has passed what it has reached.
        self._follow_route(rows[snapshot.game["steps"] > 0])
        self._measure_potential(rows)

    def check_snapshot(self, snapshot: Snapshot) -> None:
        """Refuse what is no snapshot of the game that is played here.

        Raises:
            TypeError: it is no snapshot.
            ValueError: it is of another level, physics preset or control step.
        """
        if not isinstance(snapshot, Snapshot):
            raise TypeError(f"snapshot: found {type(snapshot)}; must be a {Snapshot.__name__}")
        theirs, ours = snapshot.level, self.compiled.level
        if theirs is not ours and theirs != ours:
            other = "another" if theirs.name == ours.name else "one"
            raise ValueError(
                f"snapshot: found {other} of level {theirs.name!r}; this simulation plays "
                f"{ours.name!r}"
            )
        if snapshot.preset != self.compiled.preset:
            raise ValueError(
                f"snapshot: found one of the physics {snapshot.preset}; this simulation has "
                f"{self.compiled.preset}"
            )
        if snapshot.control_dt_s != self.config.control_dt_s:
            raise ValueError(
                f"snapshot: found one with control_dt_s {snapshot.control_dt_s:g}; this simulation "
                f"has {self.config.control_dt_s:g}"
            )
        width = self._stepper.state.shape[1]
        if snapshot.physics.shape[1:] != (width,):
            raise ValueError(
                f"snapshot: found physics of shape {snapshot.physics.shape}, of another version of "
                f"MuJoCo or of the package; must be (n, {width})"
            )

    def _table_of(self, rows: Int64) -> LevelTable:
        """Return the level data of ``rows``.

        Games that play one level differ in nothing there, and views of it for as many rows are
        kept: making one costs as much as all else in a reset.
        """
        if len(self._levels.start) > 1:
            return self._levels.for_rows(self._level_of_row[rows])
        count = len(rows)
        if count not in self._views:
            if len(self._views) == _VIEWS_KEPT:
                self._views.clear()
            self._views[count] = self._levels.for_rows(self._level_of_row[rows])
        return self._views[count]

    def _checked(self, rows: Int64) -> Int64:
        """Return ``rows`` as indices if they are different row numbers; a mask is not."""
        rows = np.asarray(rows)
        numbers = range(self.num_envs)
        found = rows.tolist()
        wrong = rows.dtype == np.bool_ or any(row not in numbers for row in found)
        if wrong or len(set(found)) != len(found):
            raise ValueError(
                f"rows: found {rows.tolist()}; must be different row numbers from 0 to "
                f"{self.num_envs - 1}"
            )
        return rows.astype(np.int64)
