"""What goes over the page's WebSocket."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.game.actions import COMBINATIONS, KEY_FORCE_N, forces, held_keys
from roller_env.play.scene import Scene
from roller_env.play.session import Phase
from roller_env.play.wire import Keys, Seek, frame_bytes, keys_of, read_message
from tests.play.lane import game, play, play_until

HEAD_BYTES = 98


def test_a_frame_says_where_the_ball_is_and_what_the_game_does() -> None:
    session = game()
    scene = Scene(session.level)
    play(session, 0.75, "w")
    session.pause()
    frame = session.frame()
    found = frame_bytes(frame, scene, ghost=np.array([1.0, 2.0, 3.0]), recording=True)
    assert len(found) == HEAD_BYTES + 1  # no slabs, no machines, one coin
    kind, phase, flags, camera, episode, steps, time_s, clock_s = struct.unpack_from(
        "<4B2Ifd", found
    )
    assert (kind, phase, camera, episode) == (1, 3, 0, 0)
    assert flags == 4 | 8
    assert steps == session.simulation.state.steps[0]
    assert time_s == pytest.approx(frame.result.time_s)
    assert clock_s == frame.clock_s
    control_in_s, coins, keys, outcome = struct.unpack_from("<fH2B", found, 24)
    assert (control_in_s, coins, keys, outcome) == (0.0, 1, 1, 0)
    place = struct.unpack_from("<3f4f3f", found, 32)
    assert place == pytest.approx([*frame.qpos()[:7], *frame.velocity], abs=1e-6)
    assert struct.unpack_from("<3f", found, 80) == (1.0, 2.0, 3.0)
    assert found[-1] == 1


def test_the_end_of_a_game_is_told_by_its_outcome() -> None:
    session = game()
    play_until(session, Phase.ENDED, "w")
    found = frame_bytes(session.frame(), Scene(session.level))
    assert (found[1], found[31]) == (4, 1)


def test_a_minute_of_frames_is_far_below_what_a_line_can_carry() -> None:
    for name in ("classic", "finale", "elevators"):
        session = game(name)  # type: ignore[arg-type]
        assert 60 * len(frame_bytes(session.frame(), Scene(session.level))) < 20_000


@pytest.mark.parametrize("held", COMBINATIONS)
def test_the_keys_that_push_are_those_that_are_held_unless_they_cancel(held: str) -> None:
    code = keys_of(forces("keys", held_keys(held)[None])[0])
    left = ({"w", "s"} <= set(held) and {"w", "s"}) or set()
    left |= ({"a", "d"} <= set(held) and {"a", "d"}) or set()
    wanted = sum(1 << "wasd".index(key) for key in set(held) - left)
    assert code == wanted


def test_a_push_of_an_agent_is_shown_as_the_nearest_keys() -> None:
    assert keys_of(KEY_FORCE_N * np.array([1.0, 0.2])) == 1
    assert keys_of(KEY_FORCE_N * np.array([0.5, 0.5])) == 3
    assert keys_of(np.zeros(2)) == 0


def test_what_a_page_says_is_read() -> None:
    assert read_message('{"type":"keys","held":"wd"}') == Keys(type="keys", held="wd")
    assert read_message('{"type":"seek","time_s":1}') == Seek(type="seek", time_s=1.0)
    assert read_message('{"type":"pause"}').type == "pause"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[]",
        "null",
        '{"type":"quit"}',
        '{"type":"keys"}',
        '{"type":"keys","held":"wx"}',
        '{"type":"keys","held":"w","more":1}',
        '{"type":"seek","time_s":-1}',
        '{"type":"seek","time_s":NaN}',
        '{"type":"seek","time_s":"1"}',
        '{"type":"speed","factor":1e9}',
        '{"type":"choose","level":' + '"' + "x" * 600 + '"}',
        '{"type":"pause"}' + " " * 600,
    ],
)
def test_what_is_no_message_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"^message: "):
        read_message(text)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=12),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
    ),
    max_leaves=6,
)
KINDS = ["keys", "seek", "speed", "choose", "ghost", "start", "x"]


@settings(max_examples=2_000, deadline=None)
@given(
    st.text(max_size=80)
    | JSON.map(json.dumps)
    | st.fixed_dictionaries(
        {"type": st.sampled_from(KINDS)},
        optional={"held": JSON, "time_s": JSON, "factor": JSON, "level": JSON, "kind": JSON},
    ).map(json.dumps)
)
def test_whatever_a_page_sends_is_a_message_or_refused(text: str) -> None:
    try:
        found: Any = read_message(text)
    except ValueError:
        return
    assert found.type in text
