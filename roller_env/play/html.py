"""A replay as one HTML file that anybody opens in a browser: no server, no other file, no network.

It holds the page's own program, the level and a frame for every 1/30 s, compressed.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import math
import os
from pathlib import Path
from typing import Final

from roller_env.assets import asset_directory
from roller_env.game.result import EpisodeResult
from roller_env.play.ghost import Ghost
from roller_env.play.replay_session import ReplaySession
from roller_env.play.scene import Scene
from roller_env.play.wire import frame_bytes
from roller_env.replay import Replay

RATE_HZ: Final = 30

_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<div id="app"></div>
<script>window.ROLLER = {data};</script>
<script>
(async () => {{
  const bytes = Uint8Array.from(atob("{program}"), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(stream).text();
  document.body.append(script);
}})();
</script>
</body>
</html>
"""


def replay_html(replay: Replay, against: Replay | None = None) -> str:
    """Return a page that shows a replay.

    Args:
        replay: what to show.
        against: another one, of which the ball rolls beside as a ghost.

    Raises:
        FileNotFoundError: the installation has lost the page's program.
    """
    page = asset_directory("page")
    session = ReplaySession(replay)
    scene = Scene(session.level)
    ghost = None if against is None else Ghost(against)
    frames = []
    for number in range(math.floor(session.moments_s[1] * RATE_HZ) + 1):
        session.seek(number / RATE_HZ)
        frames.append(_frame(session, scene, ghost))
    session.seek(session.moments_s[1])
    frames.append(_frame(session, scene, ghost))
    title = f"{session.level.title or session.level.name} - Roller"
    data = {
        "title": title,
        "scene": base64.b64encode(scene.content).decode(),
        "frames": _packed(b"".join(frames)),
        "frame_bytes": len(frames[0]),
        "rate_hz": RATE_HZ,
        "result": _result(replay.result),
        "player": replay.player,
    }
    return _PAGE.format(
        title=html.escape(title),
        style=(page / "roller.css").read_text("utf-8"),
        # What ends a script within a text would end this one.
        data=json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
        program=_packed((page / "roller.js").read_bytes()),
    )


def write_html(replay: Replay, file: str | os.PathLike[str], against: Replay | None = None) -> Path:
    """Write a page that shows a replay, and return where it is.

    Raises:
        OSError: it cannot be written.
    """
    path = Path(file)
    path.write_text(replay_html(replay, against), "utf-8")
    return path


def _frame(session: ReplaySession, scene: Scene, ghost: Ghost | None) -> bytes:
    frame = session.frame()
    beside = None if ghost is None else ghost.at(frame.result.time_s - session.intro_s)
    return frame_bytes(frame, scene, beside)


def _result(result: EpisodeResult) -> dict[str, object]:
    return {"outcome": result.outcome, "coins": result.coins, "time_s": result.time_s}


def _packed(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, mtime=0)).decode()
