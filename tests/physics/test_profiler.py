"""MuJoCo's profiler is off while the game steps, and as it was afterwards."""

from __future__ import annotations

import multiprocessing
import threading

import mujoco
import pytest

from roller_env.compile.compiled import compile_level
from roller_env.physics.profiler import profiler_off
from tests.builders import make_level

STEP = int(mujoco.mjtTimer.mjTIMER_STEP)


def falling_ball() -> mujoco.MjModel:
    return compile_level(make_level()).model


def time_taken(data: mujoco.MjData) -> float:
    """Return what MuJoCo's own profiler has summed up for steps, microseconds."""
    return float(data.timer[STEP].duration)


def test_steps_are_timed_as_ever_outside_and_not_inside() -> None:
    model = falling_ball()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 10)
    before = time_taken(data)
    assert before > 0.0
    with profiler_off():
        mujoco.mj_step(model, data, 10)
    assert time_taken(data) == before
    mujoco.mj_step(model, data, 10)
    assert time_taken(data) > before


def test_the_profiler_is_on_again_after_an_error() -> None:
    model = falling_ball()
    data = mujoco.MjData(model)
    with pytest.raises(RuntimeError, match="in between"), profiler_off():
        raise RuntimeError("in between")
    mujoco.mj_step(model, data)
    assert time_taken(data) > 0.0


def test_two_games_that_step_at_once_leave_the_profiler_as_it_was() -> None:
    """The second begins before the first has ended, and ends after it."""
    model = falling_ball()
    data = mujoco.MjData(model)
    first, second = profiler_off(), profiler_off()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    mujoco.mj_step(model, data)
    assert time_taken(data) == 0.0
    second.__exit__(None, None, None)
    mujoco.mj_step(model, data)
    assert time_taken(data) > 0.0


@pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="nothing forks here"
)
def test_a_process_forked_while_another_thread_steps_is_timed_as_ever() -> None:
    model, stepping, done = falling_ball(), threading.Event(), threading.Event()

    def step() -> None:
        with profiler_off():
            stepping.set()
            done.wait()

    def child() -> None:
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 10)
        untimed = time_taken(data) == 0.0
        with profiler_off():
            mujoco.mj_step(model, data)
        answer.put(untimed)

    context = multiprocessing.get_context("fork")
    answer = context.SimpleQueue()
    thread = threading.Thread(target=step)
    thread.start()
    stepping.wait()
    process = context.Process(target=child)
    process.start()
    process.join(60.0)
    done.set()
    thread.join()
    assert process.exitcode == 0
    assert not answer.get()
