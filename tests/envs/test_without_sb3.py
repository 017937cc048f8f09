"""What needs Stable-Baselines3 stands in `tests.sb3` and `tests.training`, and nowhere here."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

COLLECT = """
import sys
sys.modules["stable_baselines3"] = sys.modules["torch"] = None  # importing them is an ImportError
import pytest
sys.exit(pytest.main(["--collect-only", "-q", "-p", "no:cacheprovider", "tests/envs"]))
"""


def test_the_environments_tests_are_collected_without_stable_baselines() -> None:
    done = subprocess.run(
        [sys.executable, "-c", COLLECT],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout
