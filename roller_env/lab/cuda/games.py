"""N envs on a graphics card."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from numba.cuda.random import create_xoroshiro128p_states, xoroshiro128p_dtype

from roller_env.arrays import Float32, Float64
from roller_env.compile.rigid import CAP_S
from roller_env.config import EnvConfig
from roller_env.game.actions import DIRECTIONS, forces
from roller_env.lab.cuda.compiler import compiled_for_card, cuda
from roller_env.lab.cuda.kernels import Games, Rows, draw, step_of
from roller_env.simulation import Simulation

THREADS_A_BLOCK: Final = 64
"""Few, so that a multiprocessor gets other envs as soon as some are done."""

Array = npt.NDArray[Any]
_GROUPS: Final = {np.dtype(np.float64): 0, np.dtype(np.int64): 1, np.dtype(np.bool_): 2}


class Player:
    """What plays envs of one level on a card, made after one env on the CPU.

    Attributes:
        simulation: the env.
        fresh: (1, ...) its rows at the start, before the jitter.
        kernels: what runs on the card, Python functions by name.
    """

    def __init__(self, config: EnvConfig, registers: int | None = None) -> None:
        """Make the env.

        Args:
            config: options of the env; its physics is ``rigid`` or ``relaxed``.
            registers: of a thread, at most; None: as many as the compiler likes.

        Raises:
            ValueError: the physics is MuJoCo's.
        """
        if config.preset.engine != "rigid":
            raise ValueError(
                f"physics: found {config.preset.name!r}; on a card there are 'rigid' and 'relaxed'"
            )
        self._registers = registers
        self._compiled: dict[str, Any] = {}
        self.simulation = Simulation(config, 1)
        self.simulation.state.truncated[:] = False  # As at the beginning of an episode.
        physics, games = self.simulation._physics, self.simulation._games
        fixed: Any = physics._advance._fixed  # type: ignore[attr-defined]
        self._scenes, self._counts = fixed[0], fixed[3]
        # The physics' come first: see `kernels._end_diverged`.
        varying = [
            physics.state,
            games.level_of,
            *games.state.arrays(),
            *_leaves(games.step),
            games.hanging_s,
            *_leaves(self._counts),
            games.concluding.max_steps,
            games.concluding.votes,
            games.concluding.back_at,
            games.showing.work,
        ]
        self._place: dict[int, tuple[int, int, int]] = {}
        widths = [0, 0, 0]
        columns: tuple[list[Array], ...] = ([], [], [])
        for array in varying:
            group, flat = _GROUPS[array.dtype], array.reshape(1, -1)
            self._place[id(array)] = group, widths[group], flat.shape[1]
            widths[group] += flat.shape[1]
            columns[group].append(flat)
        self.fresh = Rows(*(np.concatenate(group, axis=1) for group in columns))
        room = physics._path.at.shape[1]  # type: ignore[attr-defined]
        listed = int(np.diff(self._scenes.cell_start).max())
        step = step_of(room, self._scenes.slab_stop.shape[1], listed)
        self.kernels: dict[str, Callable[..., None]] = {"step": step, "draw": draw}

    @property
    def entries(self) -> int:
        """How many numbers an observation has."""
        return sum(entry.size for entry in self.simulation.entries)

    def compiled(self, name: str, *arguments: Any) -> Any:
        """Return a kernel for arguments like these; all envs of one level have the same types."""
        if name not in self._compiled:
            self._compiled[name] = compiled_for_card(self.kernels[name], arguments, self._registers)
        return self._compiled[name]

    def games(
        self, rows: Rows, fresh: Rows, random: Any, to_device: Callable[[Array], Any]
    ) -> Games:
        """Return what the kernel takes of N envs.

        Args:
            rows: of the envs, on the card.
            fresh: of one, on the card.
            random: (N,) generators, on the card.
            to_device: copies an array to the card.
        """
        known: dict[int, Any] = {}

        def moved(tree: Any) -> Any:
            if tree is None:
                return ()  # CUDA's kernels take no None; nothing looks at it.
            if isinstance(tree, tuple):
                branches = map(moved, tree)
                return type(tree)(*branches) if hasattr(tree, "_fields") else tuple(branches)
            if not isinstance(tree, np.ndarray):
                return tree
            if id(tree) not in known:
                place = self._place.get(id(tree))
                known[id(tree)] = _view(rows, *place, tree.ndim) if place else to_device(tree)
            return known[id(tree)]

        simulation = self.simulation
        games = simulation._games
        return Games(
            scenes=moved(self._scenes),
            movers=moved(games.levels.movers),
            jitter=moved(games.levels.jitter),
            physics=moved(simulation._physics.state),
            counts=moved(self._counts),
            at=simulation._at,
            concluding=moved(games.concluding),
            work=moved(games.showing.work),
            rewarding=moved(simulation._rewarding),
            duration_s=simulation.duration_s,
            cap_s=CAP_S,
            rows=rows,
            fresh=fresh,
            every=to_device(np.arange(len(rows.reals))),
            unmoved=to_device(np.zeros(1, dtype=bool)),
            random=random,
        )

    def host_games(self, count: int) -> Games:
        """Return the same in NumPy's arrays: what there is to compile without a card."""
        rows = Rows(*(np.zeros((count, each.shape[1]), each.dtype, "F") for each in self.fresh))
        random = np.zeros(count, xoroshiro128p_dtype)
        return self.games(rows, self.fresh, random, lambda array: array)

    def named(self, rows: Rows) -> Mapping[str, Array]:
        """Return the state of N envs in rows that were copied back, by name."""
        arrays = self.simulation.state.named()
        found = {name: _view(rows, *self._place[id(a)], a.ndim) for name, a in arrays.items()}
        return {
            "physics": _view(rows, *self._place[id(self.simulation._physics.state)], 2),
            **found,
        }


class CudaGames:
    """N envs of one level on a graphics card, one thread each.

    They play by the rules and the physics of `roller_env.envs.vector.RollerVectorEnv`, with
    NEXT_STEP autoreset and without its infos. Their random numbers are others: the card's own.

    Attributes:
        force_n: (N, 2) newtons on each ball in the next step, on the card.
        observation: (N, entries) float32 after a step, on the card.
    """

    def __init__(self, player: Player, count: int, seed: int = 0) -> None:
        """Make the envs; the first step begins an episode in all.

        Args:
            player: of the level; it compiles for the first envs that it gets.
            count: how many, N.
            seed: of the random numbers.
        """
        self._player = player
        rows = Rows(
            *(cuda.device_array((count, e.shape[1]), e.dtype, order="F") for e in player.fresh)
        )
        # Every env is over.
        rows.flags.copy_to_device(np.ones(rows.flags.shape, dtype=bool, order="F"))
        fresh = Rows(*map(cuda.to_device, player.fresh))
        random = create_xoroshiro128p_states(count, seed)  # type: ignore[no-untyped-call]
        self._games = player.games(rows, fresh, random, cuda.to_device)
        self.force_n = cuda.to_device(np.zeros((count, 2), order="F"))
        self.observation = cuda.device_array((count, player.entries), np.float32, order="F")
        self._choices = cuda.to_device(forces("directions", np.arange(len(DIRECTIONS))))
        self._launch = -(-count // THREADS_A_BLOCK), THREADS_A_BLOCK

    def draw(self) -> None:
        """Draw random actions on the card."""
        random, choices, force_n = self._games.random, self._choices, self.force_n
        self._player.compiled("draw", random, choices, force_n)[self._launch](
            random, choices, force_n
        )

    def push(self, force_n: Float64) -> None:
        """Take the forces of the next step from the CPU, (N, 2) newtons."""
        self.force_n.copy_to_device(np.asfortranarray(force_n))

    def step(self) -> None:
        """Advance every env by a control step, or begin it anew."""
        games, force_n, out = self._games, self.force_n, self.observation
        self._player.compiled("step", games, force_n, out)[self._launch](games, force_n, out)

    def state(self) -> Mapping[str, Array]:
        """Return a copy of the state on the CPU, by name: ``physics``, and that of the rules."""
        return self._player.named(Rows(*(each.copy_to_host() for each in self._games.rows)))

    def observe(self) -> Float32:
        """Return a copy of what was seen after the last step, (N, entries), on the CPU."""
        seen: Float32 = self.observation.copy_to_host()
        return seen


def _view(rows: Any, group: int, first: int, width: int, ndim: int) -> Any:
    """Return the columns of an array of (N,) or (N, width)."""
    if ndim == 1:
        return rows[group][:, first]
    return rows[group][:, first : first + width]


def _leaves(tree: Any) -> Iterator[Array]:
    if isinstance(tree, tuple):
        for branch in tree:
            yield from _leaves(branch)
    else:
        yield tree
