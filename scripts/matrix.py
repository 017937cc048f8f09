"""Try the wheel with the Pythons and Gymnasiums that it supports: `make matrix`.

Every Python named in pyproject.toml's classifiers that is found on this machine (on the path, or
among pyenv's) gets an environment in .venv-matrix/ with the package and pytest, without the
training's libraries, and runs a part of the tests against what is installed there. The lowest
Python takes the oldest Gymnasium that pyproject.toml allows, the others that of constraints.txt,
from which all else comes too. A Python that is not found is said to be absent.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
MATRIX: Final = ROOT / ".venv-matrix"

TESTS: Final = (
    "tests/envs/test_autoreset.py",
    "tests/envs/test_infos.py",
    "tests/envs/test_making.py",
    "tests/envs/test_seeding.py",
    "tests/simulation/test_transition.py",
)
"""Quick ones about what Python's and Gymnasium's versions could break."""

SAY_VERSIONS: Final = """
import platform
from importlib.metadata import version
print(f"Python {platform.python_version()}", *(f"{n} {version(n)}" for n in
      ("gymnasium", "mujoco", "numba", "numpy", "pydantic")), sep=", ")
"""


@dataclass(frozen=True)
class Case:
    """One environment of the matrix: a Python's version as 3.12, where it is, which Gymnasium."""

    python: str
    program: str
    gymnasium: str

    @property
    def directory(self) -> Path:
        """Where its environment is kept for the next time."""
        return MATRIX / self.python

    @property
    def own_python(self) -> Path:
        """The environment's interpreter."""
        return self.directory / "bin" / "python"


def supported_pythons(project: dict[str, list[str]]) -> list[str]:
    """Return the versions that the classifiers name, the lowest first."""
    found = re.findall(r"Python :: (3\.\d+)$", "\n".join(project["classifiers"]), flags=re.M)
    return sorted(found, key=lambda version: int(version.split(".")[1]))


def oldest_gymnasium(project: dict[str, list[str]]) -> str:
    """Return the lowest version that the dependencies allow."""
    (oldest,) = re.findall(r"^gymnasium>=([\d.]+)", "\n".join(project["dependencies"]), flags=re.M)
    return str(oldest)


def find_python(version: str) -> str | None:
    """Return a Python of this version that can make environments, or None."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    candidates = [str(path) for path in sorted(pyenv.glob(f"{version}.*/bin/python"))]
    on_the_path = shutil.which(f"python{version}")
    for candidate in candidates if on_the_path is None else [*candidates, on_the_path]:
        # One of pyenv's doors may be there without anything behind it.
        code = "import ensurepip, sys, venv; print('%d.%d' % sys.version_info[:2])"
        said = subprocess.run([candidate, "-c", code], capture_output=True, text=True, check=False)
        if said.stdout.strip() == version:
            return candidate
    return None


def cases() -> tuple[list[Case], list[str]]:
    """Return what can be tried on this machine, and the supported Pythons that are absent."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found = {version: find_python(version) for version in supported_pythons(project)}
    there = [(version, program) for version, program in found.items() if program is not None]
    pinned = _pinned()["gymnasium"]
    gymnasiums = [oldest_gymnasium(project), *[pinned] * len(there)]
    made = [Case(*python, gym) for python, gym in zip(there, gymnasiums, strict=False)]
    return made, [version for version, program in found.items() if program is None]


def _pinned() -> dict[str, str]:
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    return dict(re.findall(r"^([\w.-]+)==(\S+)$", text, flags=re.M))


def run(*command: str | Path, directory: Path) -> str:
    """Return what a command prints; nothing of this checkout is on its path.

    Raises:
        subprocess.CalledProcessError: it failed; what it printed is in ``stdout``.
    """
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return subprocess.run(
        [str(part) for part in command],
        cwd=directory,
        env=clean | {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_INPUT": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=True,
    ).stdout


def attempt(case: Case, wheel: Path) -> tuple[bool, str]:
    """Set the environment up and run the tests in it; return whether they pass, and the report."""
    started = time.perf_counter()
    try:
        versions, tested = _set_up_and_test(case, wheel)
    except subprocess.CalledProcessError as failure:
        return False, f"Python {case.python}, gymnasium {case.gymnasium}: FAILED\n{failure.stdout}"
    seconds = time.perf_counter() - started
    return True, f"{versions}: {tested} ({seconds:.0f} s with setting up)"


def _set_up_and_test(case: Case, wheel: Path) -> tuple[str, str]:
    if not case.own_python.exists():
        run(case.program, "-m", "venv", case.directory, directory=ROOT)
    pins = _pinned() | {"gymnasium": case.gymnasium}
    constraints = case.directory / "constraints.txt"
    constraints.write_text("".join(f"{name}=={version}\n" for name, version in pins.items()))
    pip = (case.own_python, "-m", "pip", "install", "--quiet", "--constraint", constraints)
    run(*pip, wheel, "pytest", "hypothesis", directory=case.directory)
    run(*pip, "--force-reinstall", "--no-deps", wheel, directory=case.directory)
    tests = case.directory / "tests"
    shutil.rmtree(tests, ignore_errors=True)
    shutil.copytree(ROOT / "tests", tests, ignore=shutil.ignore_patterns("__pycache__"))
    versions = run(case.own_python, "-c", SAY_VERSIONS, directory=case.directory).strip()
    pytest = (case.own_python, "-m", "pytest", "--quiet", "-p", "no:cacheprovider")
    return versions, run(*pytest, *TESTS, directory=case.directory).splitlines()[-1]


def build_wheel(directory: Path) -> Path:
    """Build the package's wheel into a directory and return its path."""
    build = (sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation")
    run(*build, "--wheel-dir", directory, ROOT, directory=ROOT)
    (wheel,) = directory.glob("*.whl")
    return wheel


def main() -> int:
    """Try every case, as many at once as there are processors; return the exit status."""
    made, absent = cases()
    MATRIX.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as directory:
        wheel = build_wheel(Path(directory))
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            results = list(pool.map(lambda case: attempt(case, wheel), made))
    for _, report in results:
        print(report)
    for version in absent:
        print(f"Python {version}: absent from this machine, not tried")
    return 0 if results and all(passed for passed, _ in results) else 1


if __name__ == "__main__":
    sys.exit(main())
