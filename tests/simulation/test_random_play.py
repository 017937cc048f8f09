from __future__ import annotations

import numpy as np
import pytest

from tests.builders import VARIED
from tests.simulation.driving import simulation_of, wandering

ENVS, STEPS = 25, 400


@pytest.mark.parametrize("level", VARIED)
def test_ten_thousand_random_steps_stay_finite(level: str) -> None:
    simulation = simulation_of(level, ENVS, reward="shaped", observation="rays")
    played = 0
    ended = 0
    for force, _ in zip(wandering(ENVS), range(STEPS), strict=False):
        over = np.flatnonzero(simulation.state.over)
        ended += len(over)
        simulation.reset(over)
        transition = simulation.step(force)
        played += int(transition.stepped.sum())
        assert np.isfinite(transition.reward).all()
        assert np.isfinite(simulation.observe()).all()
    assert played == 10_000
    assert simulation.divergences == 0
    assert np.isfinite(simulation.snapshot().physics).all()
