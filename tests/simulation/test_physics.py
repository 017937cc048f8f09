from __future__ import annotations

import mujoco
import numpy as np
import pytest

from roller_env.compile.compiled import compile_level
from tests.builders import ORIGINALS
from tests.simulation.driving import (
    along_the_route,
    force_on_ball,
    plain_data,
    simulation_of,
    wandering,
)

STATE = mujoco.mjtState.mjSTATE_INTEGRATION


@pytest.mark.parametrize("physics", ["fast", "default", "accurate"])
@pytest.mark.parametrize("level", ORIGINALS)
def test_a_step_is_a_loop_of_mj_step_bit_for_bit(level: str, physics: str) -> None:
    simulation = simulation_of(
        level, num_envs=3, physics=physics, reward="shaped", control_dt_s=1 / 20, num_threads=2
    )
    model, substeps = compile_level(simulation.level, physics).model, simulation.config.substeps
    copies = [plain_data(model, state) for state in simulation.snapshot().physics]
    wander = wandering(num_envs=3)
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    for _ in range(40 if physics == "accurate" else 150):
        # Two rows of three go along the route, to the plates and pads.
        force = along_the_route(simulation)
        force[2] = next(wander)[2]
        stepped = simulation.step(force).stepped
        after = simulation.snapshot().physics
        for row in np.flatnonzero(stepped):
            # The controls that a step set are part of the state that it left.
            copies[row].ctrl[:] = plain_data(model, after[row]).ctrl
            for _ in range(substeps):
                mujoco.mj_step(model, copies[row])
            mujoco.mj_getState(model, copies[row], state, STATE)
            assert state.tobytes() == after[row].tobytes()


def test_the_keys_are_newtons_on_the_ball() -> None:
    simulation = simulation_of("lift")
    simulation.step(np.array([[5.08, -2.54]]))
    assert force_on_ball(simulation) == [5.08, -2.54, 0.0]
