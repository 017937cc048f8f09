"""Rays among packed levels against MuJoCo's."""

from __future__ import annotations

import numpy as np
import pytest

from roller_env.compile.compiled import compile_level
from roller_env.game.observations import RAY_RANGE_M, ray_directions, scan_offsets
from roller_env.physics.rigid.rays import cast_rays
from roller_env.physics.rigid.scene import pack
from roller_env.physics.rigid.states import make_states
from roller_env.physics.stepper import Stepper
from tests.physics.rigid.levels import NAMES, rigid_level

BALLS = 200


@pytest.mark.parametrize("number", range(len(NAMES)), ids=NAMES)
def test_rays_among_packed_levels_meet_what_those_of_mujoco_meet(number: int) -> None:
    generator = np.random.default_rng(number)
    levels = [rigid_level(name) for name in NAMES]
    scenes = pack([rigid for _, rigid in levels])
    compiled = compile_level(levels[number][0], "default")
    stepper = Stepper(compiled.model, BALLS, 1, 1)
    states = make_states(scenes, BALLS)
    low, high = (f(scenes.solids.one[k], axis=0) for f, k in ((np.min, "low"), (np.max, "high")))
    states.position[:] = generator.uniform(low - 3.0, high + 3.0, (BALLS, 3))
    stop = scenes.slab_stop[number]
    states.slab[:] = generator.uniform(0.0, 1.0, (BALLS, len(stop))) * stop
    ball = compiled.ball_qpos
    stepper.qpos[:, ball : ball + 3] = states.position
    places = [*compiled.plate_qpos, *compiled.gate_qpos]
    stepper.qpos[:, places] = states.slab[:, : len(places)]

    level_of_row = np.full(BALLS, number, dtype=np.int64)
    rows = np.arange(BALLS)
    down = np.broadcast_to([0.0, 0.0, -1.0], scan_offsets().shape).copy()
    for offsets, directions, longest in (
        (np.zeros_like(ray_directions()), ray_directions(), RAY_RANGE_M),
        (scan_offsets(), down, np.inf),
    ):
        found = np.empty((BALLS, len(directions)))
        cast_rays(scenes, level_of_row, states.packed, rows, offsets, directions, longest, found)
        origins = states.position[:, None, :] + offsets
        wanted = stepper.rays(origins, directions, compiled.ball_body)
        wanted[wanted > longest] = np.inf
        assert (np.isinf(found) == np.isinf(wanted)).all()
        assert found == pytest.approx(wanted, abs=1e-9)
        assert np.isfinite(found).any()
