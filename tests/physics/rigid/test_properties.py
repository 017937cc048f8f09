"""What holds wherever a ball is: it is in nothing, gains no energy, and always goes on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from roller_env.compile.compiled import compile_level
from roller_env.physics.presets import PhysicsPreset
from roller_env.physics.rigid.law import COULOMB, RELAXED, ContactLaw
from roller_env.physics.rigid.scene import SolidBox, pack
from roller_env.physics.rigid.states import make_counts, make_states
from roller_env.physics.rigid.step import advance
from roller_env.physics.rigid.workspace import make_workspace
from roller_env.physics.stepper import Stepper
from tests.physics.rigid.levels import NAMES, rigid_level
from tests.physics.rigid.world import World

KEY_M_S2 = 5.08
STEP_S = 1 / 20


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(2, 125),
    friction=st.floats(0.0, 1.5),
    law=st.sampled_from([COULOMB, RELAXED]),
)
def test_among_turned_boxes_a_ball_is_in_none_and_gains_no_energy(
    seed: int, count: int, friction: float, law: ContactLaw
) -> None:
    generator = np.random.default_rng(seed)
    boxes = [
        SolidBox(
            tuple(generator.uniform(-2.5, 2.5, 3)),
            tuple(generator.uniform(0.1, 0.8, 3)),
            Rotation.random(random_state=generator).as_matrix().tolist(),
            friction,
            float(generator.choice([0.0, 0.5])),
        )
        for _ in range(count)
    ]
    world = World([*boxes, SolidBox((0.0, 0.0, -5.0), (9.0, 9.0, 0.5))], 8, law=law)
    world.states.position[:] = [0.0, 0.0, 5.0]
    world.states.position[:, :2] += generator.uniform(-2.5, 2.5, (8, 2))
    for step in range(60):
        if step % 3 == 0:
            world.commands.force[:, :2] = generator.choice([-KEY_M_S2, 0.0, KEY_M_S2], (8, 2))
        place, before = world.states.position.copy(), world.energy()
        world.step()
        work = (world.commands.force * (world.states.position - place)).sum(axis=1)
        assert world.depth().max() < 1e-6
        assert (world.energy() - before - work).max() < 1e-7
    assert world.counts.forced.sum() == world.counts.unsolved.sum() == 0


@pytest.mark.parametrize("name", NAMES)
def test_until_it_meets_a_second_solid_a_ball_is_where_mujoco_has_it(name: str) -> None:
    # Beyond that MuJoCo's relaxed friction does not converge to Coulomb's.
    level, rigid = rigid_level(name)
    fine = PhysicsPreset(
        "fine", dt_s=1 / 3840, integrator="RK4", iterations=50, tolerance=1e-14, impratio=10.0
    )
    compiled = compile_level(level, fine)
    steps, ball = round(STEP_S / fine.dt_s), compiled.ball_qpos
    keys = KEY_M_S2 * np.array([(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)], dtype=float)
    stepper = Stepper(compiled.model, len(keys), steps, 1)
    scenes = pack([rigid])
    states = make_states(scenes, len(keys))
    states.position[:] = level.start.at
    path, counts = np.zeros((len(keys), 60, 6)), make_counts(len(keys))
    workspace, rows = make_workspace(scenes), np.arange(len(keys))
    knots = np.zeros(len(keys), dtype=np.int64)
    for part in range(10):
        force = np.roll(keys, part // 5, axis=0) * level.ball.mass_kg
        states.force[:, :2] = force
        stepper.ctrl[:, compiled.force_ctrl[:2]] = force
        stepper.advance()
        advance(
            scenes,
            rows * 0,
            states.packed,
            counts,
            workspace,
            STEP_S,
            1 / 120,
            rows,
            path,
            knots,
            0,
        )
        places = stepper.qpos[:, ball : ball + 3]
        # A rolling ball keeps its height; what has left it has met, or left, something.
        on_ground = np.abs(states.position[:, 2] - level.start.at[2]) < 1e-3
        assert on_ground.any()
        assert np.abs(states.position - places)[on_ground].max() < 1e-6
        ours, theirs = (
            Rotation.from_quat(quaternion, scalar_first=True)
            for quaternion in (states.orientation, stepper.qpos[:, ball + 3 : ball + 7])
        )
        assert (ours.inv() * theirs).magnitude()[on_ground].max() < 1e-6
