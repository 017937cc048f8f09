"""`roller play`, `roller replay` and `roller level watch` as a person starts them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Final

from tests.patience import STALLED_S

ROOT: Final = Path(__file__).parents[2]
_ADDRESS: Final = "The game is at http://localhost:"


class Served:
    """A program that serves the page.

    Attributes:
        process: the program.
        port: where it does.
    """

    def __init__(self, *words: str, port: int = 0, **environment: str) -> None:
        """Start ``roller`` with these words, and wait until the page is served."""
        command = "import sys; from roller_env.cli import main; sys.exit(main(sys.argv[1:]))"
        self.process = subprocess.Popen(
            [sys.executable, "-c", command, *words, f"--port={port}"],
            env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"} | environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert self.process.stdout is not None
        said = ""
        for line in self.process.stdout:
            said += line
            if line.startswith(_ADDRESS):
                self.port = int(line.removeprefix(_ADDRESS).partition("/")[0])
                return
        raise AssertionError(f"it ended before it served anything: {said}")

    def url(self, path: str = "/") -> str:
        """Return an address of the page."""
        return f"http://localhost:{self.port}{path}"

    def end(self, number: int = signal.SIGINT) -> tuple[int, str]:
        """End it with a signal, and return its status and what it has written since."""
        self.process.send_signal(number)
        output, _ = self.process.communicate(timeout=STALLED_S)
        return self.process.returncode, output
