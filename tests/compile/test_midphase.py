"""What the compiler leaves out changes nothing."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
import pytest

from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.compile.mjcf import MIDPHASE_GEOMS
from roller_env.level import Level, load_level
from roller_env.physics.stepper import Stepper, keeps_poses
from tests.builders import make_level

MIDPHASE = int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)
SLEEP = int(mujoco.mjtEnableBit.mjENBL_SLEEP)


def drive(compiled: CompiledLevel, disable_flags: int) -> np.ndarray:
    """Return where random keys take the ball in four seconds, (steps, nq)."""
    model = compiled.model
    before = model.opt.disableflags
    model.opt.disableflags = disable_flags
    data = mujoco.MjData(model)
    data.qpos[compiled.ball_qpos : compiled.ball_qpos + 3] = compiled.level.start.at
    generator = np.random.default_rng(3)
    path = []
    for _ in range(80):
        data.ctrl[compiled.force_ctrl[:2]] = generator.uniform(-5.0, 5.0, 2)
        mujoco.mj_step(model, data, 12)
        path.append(data.qpos.copy())
    model.opt.disableflags = before
    return np.array(path)


def test_a_level_of_few_pieces_goes_without_the_midphase_and_the_ball_does_not_notice() -> None:
    compiled = compile_level(load_level("classic"))
    flags = compiled.model.opt.disableflags
    assert flags & MIDPHASE
    np.testing.assert_array_equal(drive(compiled, flags), drive(compiled, flags & ~MIDPHASE))


def many_boxes(count: int) -> Level:
    boxes = [{"at": (2.0 * i, 3.0, 0.0), "size": (1.0, 1.0, 1.0)} for i in range(count)]
    return make_level(boxes=boxes)


def test_a_level_of_many_pieces_keeps_the_midphase() -> None:
    assert not compile_level(many_boxes(MIDPHASE_GEOMS)).model.opt.disableflags & MIDPHASE


def plain(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return the model that poses its fixed geoms in every step."""
    twin = copy.copy(model)
    twin.opt.enableflags &= ~SLEEP
    return twin


@pytest.mark.parametrize("level", ["classic", many_boxes(200)], ids=["classic", "200 boxes"])
def test_fixed_pieces_that_are_posed_once_change_nothing_of_a_game_with_resets_and_rays(
    level: Level | str,
) -> None:
    compiled = compile_level(level if isinstance(level, Level) else load_level(level))
    assert keeps_poses(compiled.model)
    steppers = [Stepper(model, 5, 12, 2) for model in (compiled.model, plain(compiled.model))]
    generator = np.random.default_rng(1)
    directions = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])
    saved = [stepper.state[[1]].copy() for stepper in steppers]
    for turn in range(40):
        force = generator.uniform(-5.0, 40.0, (5, 2))
        seen = []
        for stepper, state in zip(steppers, saved, strict=True):
            stepper.ctrl[:, compiled.force_ctrl[:2]] = force
            path = stepper.advance().copy()
            if turn % 10 == 9:
                stepper.reset(np.array([0, 3]))
                stepper.state[[4]] = state
            ball = stepper.qpos[:, compiled.ball_qpos : compiled.ball_qpos + 3]
            origins = np.repeat(ball[:, None], len(directions), axis=1)
            seen.append((path, stepper.rays(origins, directions, compiled.ball_body)))
        for sleeping, waking in zip(*seen, strict=True):
            np.testing.assert_array_equal(sleeping, waking)
