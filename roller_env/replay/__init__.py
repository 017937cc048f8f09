"""Replays: episodes on record, played again bit for bit, filmed, and turned into data sets."""

from roller_env.replay.checksums import Checksums
from roller_env.replay.contents import Replay, Versions
from roller_env.replay.errors import ReplayError
from roller_env.replay.file import load_replay, save_replay, shipped_replays
from roller_env.replay.playback import Frame, Playback, Verification, frames, verify
from roller_env.replay.recorder import Recorder, record_episode

__all__ = [
    "Checksums",
    "Frame",
    "Playback",
    "Recorder",
    "Replay",
    "ReplayError",
    "Verification",
    "Versions",
    "frames",
    "load_replay",
    "record_episode",
    "save_replay",
    "shipped_replays",
    "verify",
]
