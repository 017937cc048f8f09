"""What somebody who waits for the first step is told."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

USE_A_RULE = """
from roller_env.game.cameras import CameraState, retreat
retreat(0, 1.0, 0.0, CameraState.initial(1))
"""

NOTHING_CAN_BE_KEPT = """
from numba.core import caching
def refuse(self):
    raise OSError("read-only")
caching._CacheLocator.ensure_cache_path = refuse
"""


def said_by_a_new_process(cache: Path, code: str) -> list[str]:
    """Return the lines on the terminal of a process that uses a rule, with its own cache."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"NUMBA_CACHE_DIR": str(cache)},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    assert done.stdout == ""
    return done.stderr.splitlines()


def test_one_line_says_what_is_waited_for_and_only_where_there_is_something_to_wait_for(
    tmp_path: Path,
) -> None:
    cold = said_by_a_new_process(tmp_path, USE_A_RULE)
    assert cold == ["Roller: compiling the rules (up to a minute), once for this machine"]
    assert said_by_a_new_process(tmp_path, USE_A_RULE) == []


def test_who_waits_in_every_process_is_told_how_not_to(tmp_path: Path) -> None:
    (line,) = said_by_a_new_process(tmp_path, NOTHING_CAN_BE_KEPT + USE_A_RULE)
    assert "in every process" in line
    assert "NUMBA_CACHE_DIR" in line


def test_others_who_compile_hear_nothing_of_it(tmp_path: Path) -> None:
    code = "import numba, roller_env.compiled\nnumba.njit(lambda x: x + 1)(1)"
    assert said_by_a_new_process(tmp_path, code) == []


def test_what_was_kept_of_a_package_is_not_used_when_one_of_its_modules_has_changed(
    tmp_path: Path,
) -> None:
    package = tmp_path / "pair"
    package.mkdir()
    decorate = "from roller_env.compiled import compiled_with_package as kernel\n@kernel\n"
    (package / "inner.py").write_text(f"{decorate}def one() -> float:\n    return 1.0\n")
    (package / "outer.py").write_text(
        f"from pair.inner import one\n{decorate}def two() -> float:\n    return 2.0 * one()\n"
    )

    def answer() -> tuple[str, int]:
        code = "from pair.outer import two; print(two(), sum(two.stats.cache_hits.values()))"
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | {"PYTHONPATH": f"{tmp_path}:{Path(__file__).parents[2]}"},
            capture_output=True,
            text=True,
            check=True,
        )
        number, hits = done.stdout.split()
        return number, int(hits)

    assert answer() == ("2.0", 0)
    assert answer() == ("2.0", 1)
    (package / "inner.py").write_text(f"{decorate}def one() -> float:\n    return 1.25\n")
    assert answer() == ("2.5", 0)
