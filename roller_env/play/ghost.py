"""Ghost: the ball of another run, to race against."""

from __future__ import annotations

from roller_env.arrays import Float64
from roller_env.replay import Replay, load_replay, shipped_replays
from roller_env.replay.contents import level_hash
from roller_env.replay.playback import paths


class Ghost:
    """Where the ball of a run was at every moment."""

    def __init__(self, replay: Replay):
        """Play the replay once."""
        self._centres = paths([replay])[0]
        self._step_s = replay.options.control_dt_s

    def at(self, time_s: float) -> Float64:
        """Return the ball's centre, (3,) metres, a time after the start; at last where it ended."""
        last = len(self._centres) - 1
        moment = min(max(time_s / self._step_s, 0.0), float(last))
        before = int(moment)
        after = min(before + 1, last)
        share = moment - before
        centre: Float64 = (1.0 - share) * self._centres[before] + share * self._centres[after]
        return centre


def par_run(name: str, hash_of_level: str) -> Replay | None:
    """Return the run that comes with a level, None if there is none of the level as it is."""
    file = shipped_replays().get(name)
    if file is None:
        return None
    replay = load_replay(file)
    return replay if level_hash(replay.level) == hash_of_level else None
