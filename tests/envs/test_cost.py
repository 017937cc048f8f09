from __future__ import annotations

import sys
from collections import Counter
from types import FrameType
from typing import Any

import numpy as np
import pytest

from roller_env.envs.vector import RollerVectorEnv


def bytecodes_of_a_step(num_envs: int, **options: Any) -> Counter[str]:
    """Return how many of the interpreter's instructions each function runs in a vector step."""
    env = RollerVectorEnv(num_envs, num_threads=1, **options)
    env.reset(seed=0)
    # All balls rest where they start, so that no row meets what the others do not.
    actions = np.zeros(num_envs, dtype=np.int64)
    env.step(actions)
    executed: Counter[str] = Counter()

    def count(frame: FrameType, event: str, _: object) -> Any:
        frame.f_trace_opcodes = True
        if event == "opcode":
            executed[frame.f_code.co_qualname] += 1
        return count

    before = sys.gettrace()
    sys.settrace(count)
    try:
        _, _, terminated, truncated, _ = env.step(actions)
    finally:
        sys.settrace(before)
    assert not (terminated | truncated).any()
    return executed


@pytest.mark.parametrize("observation", ["state", "rays", "dict"])
@pytest.mark.parametrize("level", ["classic", "flat"])
def test_the_interpreter_works_no_more_for_256_games_than_for_8(
    level: str, observation: str
) -> None:
    options = {"level": level, "observation": observation, "reward": "shaped"}
    executed = bytecodes_of_a_step(256, **options)
    assert executed["RollerVectorEnv.step"] > 0
    assert executed == bytecodes_of_a_step(8, **options)
