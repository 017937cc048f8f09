"""What the compiler leaves out changes nothing."""

from __future__ import annotations

import mujoco
import numpy as np

from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.compile.mjcf import MIDPHASE_GEOMS
from roller_env.level import Level, load_level
from tests.builders import make_level

MIDPHASE = int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)


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
    boxes = [{"at": (2.0 * i, 50.0, 0.0), "size": (1.0, 1.0, 1.0)} for i in range(count)]
    return make_level(boxes=boxes)


def test_a_level_of_many_pieces_keeps_the_midphase() -> None:
    assert not compile_level(many_boxes(MIDPHASE_GEOMS)).model.opt.disableflags & MIDPHASE
