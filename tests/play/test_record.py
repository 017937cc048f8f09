"""What a person plays in the browser becomes a data set from which a policy learns."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roller_env.play.server import LOOPBACK
from roller_env.replay import load_replay, verify
from roller_env.training.behaviour_cloning import start_from_demonstrations
from roller_env.training.demonstrations import load_demonstrations
from roller_env.training.files import RunFiles
from tests.patience import STALLED_S
from tests.play.browser import SCENE, Browser
from tests.play.stand import free_port, is_served, wait_until_served
from tests.training.small import small_config

pytestmark = pytest.mark.xdist_group("browser")

ROOT = Path(__file__).parents[2]


class Game:
    """`scripts/play.py` as a person starts it."""

    def __init__(self, home: Path, *arguments: str) -> None:
        self.port = free_port()
        self.url = f"http://{LOOPBACK}:{self.port}/"
        self._process = subprocess.Popen(
            [sys.executable, str(ROOT / "scripts" / "play.py"), f"--port={self.port}", *arguments],
            env=os.environ | {"PYTHONPATH": str(ROOT), "MINARI_DATASETS_PATH": str(home)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def is_served(self) -> bool:
        assert self._process.poll() is None, self._process.communicate()[0]
        return is_served(self.url)

    def end(self, number: signal.Signals) -> tuple[int, str]:
        """End it with a signal, and return its status and what it wrote."""
        self._process.send_signal(number)
        output, _ = self._process.communicate(timeout=STALLED_S)
        return self._process.returncode, output


def test_what_is_played_with_the_keys_is_recorded_and_can_be_learnt_from(
    chromium: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("minari", reason="the extra 'demos' is not installed")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    replays = tmp_path / "replays"
    game = Game(
        tmp_path,
        "--level=flat",
        "--skip-intro",
        "--mute",
        "--quality=low",
        "--record=roller/human",
        f"--replays={replays}",
    )
    wait_until_served(game.is_served)
    browser = Browser(chromium, game)
    # With R, one game ends and the next begins: one of each ends up in a file.
    browser.tap("Enter")
    for number in range(2):
        at_rest = browser.settled()[SCENE]
        browser.keyboard.down("w")
        browser.wait_for_change("the ball rolls", at_rest, SCENE)
        browser.keyboard.up("w")
        browser.press("r", "a game is over", written(replays, number + 1))
    browser.tap("d")
    # As when the terminal is closed.
    status, output = game.end(signal.SIGTERM)
    browser.close()
    assert status == 0, output
    assert "data set: roller/human/flat-v0" in output
    files = [Path(file) for file in re.findall("replay: (.*)", output)]
    assert files == sorted(replays.glob("*.replay"))
    played = [load_replay(file) for file in files]
    for replay in played:
        verdict = verify(replay)
        assert verdict.is_exact, str(verdict)
    assert {replay.player for replay in played} == {"human"}
    pushed = [replay.force_n for replay in played[:2]]
    assert all((force[:, 0] > 0.0).any() for force in pushed)

    config = small_config(demonstrations="roller/human/flat-v0", cloning={"epochs": 2})
    demonstrations = load_demonstrations("roller/human/flat-v0", config)
    assert len(demonstrations) == len(played)
    # Twelve steps of the person's game are one of the training's.
    assert [len(one) for one in demonstrations] == [-(-len(one) // 12) for one in played]
    files_of_run = RunFiles(tmp_path / "run")
    files_of_run.directory.mkdir()
    cloning = start_from_demonstrations(config, demonstrations, files_of_run)
    assert cloning.samples + cloning.held_out == sum(map(len, demonstrations))
    assert np.isfinite(cloning.accuracy)


def written(directory: Path, least: int) -> Callable[[], bool]:
    """Return what says whether a directory has so many replays."""
    return lambda: len(list(directory.glob("*.replay"))) >= least


def test_a_name_that_no_data_set_can_have_is_refused_before_anything_is_played() -> None:
    pytest.importorskip("minari", reason="the extra 'demos' is not installed")
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "play.py"), "--port=1", "--record=my games"],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=STALLED_S,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("error: record: found 'my games'")
    assert done.stdout == ""
