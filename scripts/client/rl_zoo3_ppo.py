"""RL Zoo: its own commands, train, enjoy and record_video, with the configuration beside this."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

CONFIGURATION = Path(__file__).with_suffix(".yml")
ID = "Roller/Flat-v0"
PACKAGES = ("--gym-packages", "roller_env")
OPTIONS = ("reward:'shaped'", "physics:'rigid'", "control_dt_s:0.1", "max_episode_steps:150")


def zoo(command: str, *arguments: str) -> None:
    subprocess.run(
        [sys.executable, "-m", f"rl_zoo3.{command}", "--algo", "ppo", "--env", ID, *arguments],
        env=os.environ | {"PYTHONPATH": str(Path.cwd())},
        check=True,
    )


def main() -> None:
    zoo(
        "train",
        *PACKAGES,
        *("--conf-file", str(CONFIGURATION), "--env-kwargs", *OPTIONS),
        *("--eval-freq", "-1", "--seed", "0", "--log-folder", "logs", "--verbose", "0"),
    )
    zoo("enjoy", *PACKAGES, "--folder", "logs", "--n-timesteps", "200", "--no-render")
    # It has no such option, but imports a module of this name, if there is one.
    Path("custom_envs.py").write_text("import roller_env\n", encoding="utf-8")
    zoo("record_video", "--folder", "logs", "--n-timesteps", "40", "--output-folder", "films")
    (film,) = Path("films").glob("*.mp4")
    if film.stat().st_size < 1000:
        raise RuntimeError(f"{film}: found an empty film")
    monitors = sorted(Path("logs").rglob("*.monitor.csv"))
    ended: list[tuple[float, float]] = []
    for monitor in monitors:
        lines = monitor.read_text(encoding="utf-8").splitlines()[1:]
        ended += [(float(row["t"]), float(row["r"])) for row in csv.DictReader(lines)]
    returns = [value for _, value in sorted(ended)]
    print(json.dumps({"used": "train, enjoy, record_video", "returns": returns}))


if __name__ == "__main__":
    main()
