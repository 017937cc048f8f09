"""Other environments as benchmark cases, each in an interpreter of the peers' own environment."""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any, Final

from roller_env.lab.runner import Case

INTERPRETER: Final = Path(".venv-peers/bin/python")
"""Where ``make benchmark`` puts the peers."""

_WORKER: Final = Path(__file__).with_name("peer_worker.py")


class PeerError(RuntimeError):
    """A peer's environment is there but does not work."""


class Peer(Case):
    """An environment of `peer_worker`, stepped over a pipe; the pipe's time is not counted."""

    versions: dict[str, str]  # of the packages that it is made of

    def __init__(self, name: str, interpreter: Path, **wanted: Any) -> None:
        """Start the worker in the peers' ``interpreter``, or raise a `PeerError`.

        Of what is ``wanted`` ``peer`` is a key of `peer_worker.PEERS`; the others its arguments.
        """
        self._complaints = tempfile.TemporaryFile("w+", encoding="utf-8")  # noqa: SIM115 - close
        self._process = subprocess.Popen(
            [interpreter, str(_WORKER), json.dumps(wanted)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaints,
            text=True,
        )
        facts = self._answer(name)
        self.versions = facts["versions"]
        super().__init__(name, facts["env_steps"], facts["simulated_s"])

    def close(self) -> None:
        """End the worker, which stops when its input does."""
        self._process.communicate()
        self._complaints.close()

    def _run(self, steps: int) -> float:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"steps": steps}) + "\n")
        self._process.stdin.flush()
        return float(self._answer(self.name)["seconds"])

    def _answer(self, name: str) -> dict[str, Any]:
        assert self._process.stdout is not None
        if line := self._process.stdout.readline():
            answer: dict[str, Any] = json.loads(line)
            return answer
        code = self._process.wait()
        self._complaints.seek(0)
        last = self._complaints.read().strip().splitlines() or ["no message"]
        raise PeerError(f"{name}: the worker ended with code {code}: {last[-1]}")
