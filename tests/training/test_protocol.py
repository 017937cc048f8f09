"""docs/baselines.md: what it has others run is the protocol by which its own numbers were made."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from roller_env.assets import SHIPPED
from roller_env.training import load_policy
from roller_env.training.run import evaluate_policy
from roller_env.training.shipped import run_of

PAGE = Path(__file__).parents[2] / "docs" / "baselines.md"


def test_the_example_counts_what_an_evaluation_of_the_same_agent_counts() -> None:
    (example,) = re.findall(
        r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S
    )
    policy = load_policy(run_of(SHIPPED, "pinball"))
    said: dict[str, Any] = {"act": policy}
    exec(example.replace("Bridge", "Pinball").replace("= 100,", "= 8,"), said)  # noqa: S102
    results = evaluate_policy(policy, policy.config, 8).results
    assert said["finish"].tolist() == [result.success for result in results]
    percent = [result.score_percent for result in results]
    assert (100.0 * said["coins"]).tolist() == pytest.approx(percent)
