"""The whole game on the rigid-ball engine: what every engine owes to the rules and their users."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from itertools import islice
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils import env_checker

from roller_env import ENV_IDS
from roller_env.compile import rigid
from roller_env.config import make_config
from roller_env.level import load_level, shipped_levels
from roller_env.replay import load_replay, record_episode, save_replay, verify
from roller_env.replay.scripted import ScriptedPlayer
from roller_env.simulation import Simulation
from tests.builders import ORIGINALS, VARIED, make_level
from tests.envs.checking import no_warnings_but_of_unbounded_observations
from tests.replay.recording import wandered
from tests.simulation.driving import along_the_route, bits, simulation_of, wandering

Bits = list[list[bytes]]


def play_on(simulation: Simulation, steps: int = 40, seed: int = 7) -> Bits:
    """Return the bits of all rows after each of some random steps."""
    seen = []
    for force in islice(wandering(simulation.num_envs, seed), steps):
        simulation.step(force)
        seen.append(bits(simulation))
    return seen


@pytest.mark.parametrize("env_id", ENV_IDS)
def test_gymnasium_finds_nothing_wrong(env_id: str) -> None:
    with no_warnings_but_of_unbounded_observations():
        env = gym.make(env_id, physics="rigid", max_episode_steps=60)
        env_checker.check_env(env.unwrapped, skip_render_check=True)
        env.close()


@pytest.mark.parametrize("level", shipped_levels())
def test_random_keys_move_every_ball_and_nothing_diverges(level: str) -> None:
    simulation = simulation_of(level, num_envs=40, physics="rigid")
    start = simulation.ball_position.copy()
    for force in islice(wandering(40), 300):
        simulation.step(force)
    assert simulation.divergences == 0
    assert np.isfinite(simulation.observe()).all()
    assert (np.linalg.norm(simulation.ball_position - start, axis=1) > 0.1).all()


@pytest.mark.parametrize("level", ["gate", "lift"])
def test_a_copy_goes_on_with_the_same_bits(level: str) -> None:
    simulation = simulation_of(level, num_envs=3, physics="rigid", reward="shaped")
    for _ in range(60):
        simulation.step(along_the_route(simulation))
    kept = pickle.loads(pickle.dumps(simulation.snapshot()))
    copies = copy.deepcopy(simulation), pickle.loads(pickle.dumps(simulation))
    other = simulation_of(level, num_envs=3, seed=9, physics="rigid", reward="shaped")
    other.restore(kept)
    expected = play_on(simulation)
    for again in (*copies, other):
        assert play_on(again) == expected
    simulation.restore(kept)
    assert play_on(simulation) == expected


@pytest.mark.parametrize("level", VARIED)
def test_neither_threads_nor_company_change_a_bit(level: str) -> None:
    one, two = (
        play_on(simulation_of(level, num_envs=80, physics="rigid", num_threads=threads))
        for threads in (1, 2)
    )
    assert one == two
    for row in (0, 41, 79):
        alone = play_on(simulation_of(level, seed=row, physics="rigid"), seed=7 + row)
        assert [now[0] for now in alone] == [now[row] for now in one]


def test_held_rows_stay_as_they_are_and_change_nothing_for_the_others() -> None:
    some, every = (simulation_of("classic", num_envs=70, physics="rigid") for _ in range(2))
    hold = np.arange(70) % 3 == 0
    before = bits(some)
    for force in islice(wandering(70), 40):
        some.step(force, hold=hold)
        every.step(force)
    after, free = bits(some), bits(every)
    for row in range(70):
        assert after[row] == (before if hold[row] else free)[row]


def test_in_the_intro_the_ball_hangs_still_and_then_falls() -> None:
    """It falls for the rest of the step in which it is let go of, as it does in MuJoCo."""
    level = make_level(start={"at": (0.0, 0.0, 3.0)})
    fallen = []
    for physics in ("rigid", "accurate"):
        simulation = simulation_of(level, physics=physics)
        simulation.reset(intro=True)
        heights = []
        for _ in range(200):
            simulation.step(np.ones((1, 2)))
            heights.append(simulation.ball_position[0, 2])
        fallen.append(3.0 - np.array(heights))
    rigid, mujoco = fallen
    still = np.flatnonzero(rigid)[0]
    assert still == np.flatnonzero(mujoco)[0] > 10
    np.testing.assert_allclose(rigid[still : still + 8], mujoco[still : still + 8], rtol=2e-3)


@pytest.mark.parametrize("level", ORIGINALS)
def test_rays_measure_what_mujocos_do(level: str) -> None:
    rigid, mujoco = (
        simulation_of(level, num_envs=8, physics=name, observation="rays", reward="shaped")
        for name in ("rigid", "default")
    )
    for _ in range(40):
        mujoco.step(along_the_route(mujoco))
        theirs, ours = mujoco.snapshot(), rigid.snapshot()
        for name in ("position", "orientation", "velocity", "displacement"):
            getattr(ours.bodies, name)[:] = getattr(theirs.bodies, name)
        rigid.restore(ours)
        np.testing.assert_allclose(
            rigid._cast_rays(None, np.arange(8)),
            mujoco._cast_rays(None, np.arange(8)),
            rtol=1e-6,
            atol=1e-6,
        )


@pytest.mark.parametrize("level", ORIGINALS)
def test_the_scripted_player_finishes_and_its_replay_verifies(level: str, tmp_path: Path) -> None:
    """Plates, gates and pads are on its way."""
    config = make_config(level=level, physics="rigid", num_threads=1)
    played = record_episode(config, ScriptedPlayer(load_level(level)), seed=0)
    assert played.result.success
    assert played.result.score_percent == 100.0
    again = load_replay(save_replay(played, tmp_path / "a.replay"))
    assert again.versions.engine == "rigid"
    assert verify(again).is_exact


def test_another_engine_does_not_verify_what_rigid_played() -> None:
    rigid, fast = wandered("bridge", physics="rigid"), wandered("bridge", physics="fast")
    assert rigid.versions.differences(fast.versions)


WITHOUT_MUJOCO = """
import sys
sys.modules["mujoco"] = None  # importing it is an ImportError
import gymnasium as gym, numpy as np, roller_env
env = gym.make("Roller/Flat-v0", physics="rigid")
env.reset(seed=0)
for _ in range(20):
    env.step(env.action_space.sample())
envs = gym.make_vec("Roller/Gate-v0", num_envs=3, physics="rigid", observation="rays")
envs.reset(seed=0)
for _ in range(20):
    envs.step(envs.action_space.sample())
print([name for name in sys.modules if name.startswith("mujoco.")])
"""

MANY = """
import numpy as np
import psutil
from roller_env.config import make_config
from roller_env.simulation import Simulation
games = Simulation(make_config(level="classic", physics="rigid"), 100_000)
games.reset()
for _ in range(3):
    games.step(np.ones((100_000, 2)))
    games.observe()
print(psutil.Process().memory_info().rss)
"""


def printed(program: str) -> str:
    """Return what a program prints that another interpreter runs."""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_an_environment_is_made_and_stepped_without_mujoco() -> None:
    assert printed(WITHOUT_MUJOCO) == "[]"


def test_a_hundred_thousand_games_fit_in_a_gigabyte() -> None:
    # Compiling takes more than that, once for a machine: here, so that the games are measured. A
    # process's highest use is no measure: it begins with that of the process that started it.
    printed(MANY.replace("100_000", "2"))
    assert int(printed(MANY)) < 1e9


@pytest.mark.parametrize("threads", [2, 3])
@pytest.mark.parametrize("observation", ["state", "rays"])
def test_games_shared_by_threads_have_the_bits_of_one(
    threads: int, observation: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rigid, "WORLDS_A_THREAD", 3)
    games = [
        simulation_of(
            "gate", num_envs=13, physics="rigid", observation=observation, num_threads=count
        )
        for count in (1, threads)
    ]
    held = np.zeros(13, dtype=bool)
    held[[2, 7, 12]] = True
    for number, force in enumerate(islice(wandering(13, 3), 60)):
        hold = held if number % 3 == 1 else None
        for game in games:
            game.step(force, hold)
        one, several = games
        assert bits(several) == bits(one)
        rows = np.array([11, 0, 5])
        assert np.array_equal(several.observe(), one.observe())
        assert np.array_equal(several.observe(rows), one.observe(rows))


def test_a_game_that_diverges_in_one_thread_leaves_others_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(rigid, "WORLDS_A_THREAD", 2)
    games = [simulation_of("flat", num_envs=8, physics="rigid", num_threads=n) for n in (1, 4)]
    for game in games:
        snapshot = game.snapshot()
        snapshot.bodies.velocity[[1, 6]] = np.nan
        game.restore(snapshot)
        with pytest.warns(RuntimeWarning, match="diverged"):
            game.step(np.zeros((8, 2)))
        assert game.divergences == 2
    assert bits(games[1]) == bits(games[0])
