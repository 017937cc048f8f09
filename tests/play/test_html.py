"""A replay as one file."""

from __future__ import annotations

import base64
import gzip
import json
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roller_env.cli.replay import main
from roller_env.config import EnvConfig
from roller_env.play.html import RATE_HZ, replay_html
from roller_env.replay import Recorder, Replay, load_replay, shipped_replays
from roller_env.simulation import Simulation


@pytest.fixture(scope="module")
def replay() -> Replay:
    return load_replay(shipped_replays()["flat"])


def data_of(page: str) -> dict[str, Any]:
    found = re.search(r"window\.ROLLER = (\{.*\});</script>", page)
    assert found is not None
    data: dict[str, Any] = json.loads(found.group(1))
    return data


def unpacked(text: str) -> bytes:
    return gzip.decompress(base64.b64decode(text))


def test_the_file_holds_the_level_and_a_frame_for_every_thirtieth_of_a_second(
    replay: Replay,
) -> None:
    data = data_of(replay_html(replay))
    assert json.loads(unpacked(data["scene"]))["name"] == "flat"
    frames, size = unpacked(data["frames"]), data["frame_bytes"]
    count, rest = divmod(len(frames), size)
    assert rest == 0
    times = [struct.unpack_from("<f", frames, number * size + 12)[0] for number in range(count)]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(replay.result.time_s, abs=1e-4)
    assert count == pytest.approx(replay.result.time_s * RATE_HZ, abs=2)
    # The last one tells how it ended.
    assert frames[-size + 31] == 1
    assert data["result"]["outcome"] == "finish"


def test_it_is_one_file_that_asks_nobody_for_anything_and_less_than_a_megabyte(
    replay: Replay,
) -> None:
    page = replay_html(replay)
    assert len(page.encode()) < 1_000_000
    assert not re.search(r'(src|href)="', page)
    assert page.count("</script>") == 2


def test_a_levels_words_cannot_become_a_program(replay: Replay) -> None:
    evil = replay.level.model_copy(update={"title": "</script><script>alert(1)</script>"})
    options = replay.options.__class__(**{**replay.options.keywords(), "level": evil})
    page = replay_html(replay.__class__(**{**vars_of(replay), "options": options}))
    assert "<script>alert" not in page
    assert "</script><script>alert" in data_of(page)["title"]


def vars_of(replay: Replay) -> dict[str, Any]:
    return {name: getattr(replay, name) for name in replay.__dataclass_fields__}


def test_the_command_writes_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "flat.html"
    assert main(["flat", "--html", str(file)]) == 0
    assert f"written to {file}" in capsys.readouterr().out
    assert data_of(file.read_text("utf-8"))["rate_hz"] == RATE_HZ


def test_another_suffix_is_refused_before_anything_is_played(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match=r"must end in \.html or \.htm"):
        main(["flat", "--html", str(tmp_path / "flat.pdf")])


def standing(seconds: float) -> Replay:
    """Return a replay of flat in which nobody pushes."""
    simulation = Simulation(EnvConfig(level="flat", physics="rigid"))
    simulation.seed([np.random.default_rng(0)])
    simulation.reset()
    recorder = Recorder(simulation)
    recorder.begin()
    for _ in range(round(seconds / simulation.duration_s)):
        simulation.step(np.zeros((1, 2)))
        recorder.record(np.zeros((1, 2)))
    return recorder.replay()


def test_the_ball_of_another_replay_rolls_beside(replay: Replay) -> None:
    data = data_of(replay_html(replay, standing(1.0)))
    frames, size = unpacked(data["frames"]), data["frame_bytes"]
    last = len(frames) - size
    assert frames[last + 2] & 8
    begun = struct.unpack_from("<3f", frames, 80)
    assert struct.unpack_from("<3f", frames, last + 80) == pytest.approx(begun, abs=0.01)
    x, began_x = (struct.unpack_from("<f", frames, at + 32)[0] for at in (last, 0))
    assert x > began_x + 1.0
