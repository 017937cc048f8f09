"""A replay file is read back exactly, and no file, however made, does anything but be refused."""

from __future__ import annotations

import gzip
import io
import json
import os
import pickle
import tracemalloc
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.level import load_level, shipped_levels
from roller_env.play.session import GameSession, play_config
from roller_env.replay import Checksums, Replay, ReplayError, load_replay, save_replay
from roller_env.replay import file as replay_file
from roller_env.replay.checksums import row_count
from roller_env.replay.contents import MAX_PHYSICS_STEPS, MAX_STEPS, canonical_text
from roller_env.replay.file import MAX_HEADER_BYTES, decode, encode
from roller_env.replay.keeper import ReplayKeeper
from roller_env.simulation import Simulation
from tests.replay.recording import same, straight_on, wandered

PLAYED = straight_on("gate", 12, physics="fast")
CONTENT = encode(PLAYED)
PLAIN = gzip.decompress(CONTENT)
MEMORY_BYTES = 16 * 2**20
"""Many times what the small files here hold, and a small part of what they claim to."""


def unpacked() -> tuple[dict[str, Any], bytes]:
    """Return the header and the rest of a file."""
    line, _, body = gzip.decompress(CONTENT).partition(b"\n")
    return json.loads(line), body


def packed(header: Any, body: bytes) -> bytes:
    return gzip.compress(json.dumps(header).encode() + b"\n" + body, mtime=0)


def changed(change: Callable[[dict[str, Any]], None]) -> bytes:
    """Return a file whose header was changed by somebody who knows the format."""
    header, body = unpacked()
    change(header)
    return packed(header, body)


def refusal(content: bytes) -> str:
    """Return why a file is refused, and see that it is done in one line and little memory."""
    tracemalloc.start()
    try:
        with pytest.raises(ReplayError) as refused:
            decode(content)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < MEMORY_BYTES
    message = str(refused.value)
    assert message
    assert "\n" not in message
    return message


def read_or_refused(content: bytes) -> tuple[Replay | None, str]:
    """Return a file's replay, or why it is refused, in one line."""
    try:
        return decode(content), ""
    except ReplayError as error:
        message = str(error)
    assert "\n" not in message
    return None, message


@pytest.mark.parametrize("level", shipped_levels())
def test_what_was_written_is_read_to_the_bit(level: str, tmp_path: Path) -> None:
    played = wandered(level, reward="shaped", max_episode_steps=100)
    file = save_replay(played, tmp_path / "new" / "game.replay")
    again = load_replay(file)
    assert same(played, again)
    assert encode(again) == file.read_bytes()
    assert again.level == load_level(level)
    assert again.level_hash == played.level_hash


@given(
    st.lists(st.integers(0, 8), max_size=40),
    st.integers(1, 50),
    st.integers(0, 2**128 - 1) | st.none(),
    st.text(max_size=200).filter(str.isprintable),
)
def test_any_actions_are_kept_to_the_bit(
    directions: list[int], every: int, seed: int | None, player: str
) -> None:
    rows = row_count(len(directions), every)
    table = (np.arange(rows * 3, dtype=np.uint32) * 0x9E3779B1).reshape(rows, 3)
    sums = Checksums(every, PLAYED.checksums.quantities[2:5], table)
    actions = np.array(directions, dtype=np.int64)
    played = replace(PLAYED, actions=actions, checksums=sums, seed=seed, player=player)
    assert same(decode(encode(played)), played)


@pytest.mark.parametrize("action", ["keys", "force"])
def test_every_kind_of_action_is_kept_to_the_bit(action: str) -> None:
    played = straight_on("gate", 12, direction=2, physics="fast", action=action)
    again = decode(encode(played))
    assert same(again, played)
    assert np.array_equal(again.force_n, played.force_n)
    assert again.force_n[0, 1] > 0.0


def test_a_minute_of_a_persons_game_takes_a_few_kilobytes() -> None:
    rng = np.random.default_rng(0)
    keeper = ReplayKeeper()
    session = GameSession(
        play_config("classic"), skip_intro=True, seed=1, observers=[keeper], agent=None
    )
    session.start()
    # Left and right, so that it stays on the level, with other keys three times a second.
    for held in rng.choice(["", "a", "d", "a", "d"], 180):
        session.advance(1 / 6, str(held))
        session.advance(1 / 6, str(held))
    session.close()
    steps = sum(map(len, keeper.replays))
    assert steps > 5000
    size = sum(len(encode(replay)) for replay in keeper.replays)
    level = len(gzip.compress(keeper.replays[0].level_text.encode()))
    assert (size - level) / (steps / 240) * 60 < 6000


def test_a_file_tells_what_it_is_without_this_package() -> None:
    header, body = unpacked()
    assert (header["kind"], header["format"], header["steps"]) == ("roller-replay", 2, 12)
    assert json.loads(body.partition(b"\n")[0])["name"] == "gate"


@given(st.integers(0, len(CONTENT) - 1))
def test_a_file_cut_short_is_refused(length: int) -> None:
    refusal(CONTENT[:length])


@given(st.integers(0, len(CONTENT) - 1), st.integers(0, 7))
def test_a_flipped_bit_is_noticed_or_changes_nothing(place: int, bit: int) -> None:
    damaged = bytearray(CONTENT)
    damaged[place] ^= 1 << bit
    read, why = read_or_refused(bytes(damaged))
    # Gzip's header holds a time and a system that nothing depends on.
    assert why if read is None else place < 10 and same(read, PLAYED)


@given(
    st.lists(st.tuples(st.integers(0, len(PLAIN) - 1), st.integers(1, 255)), min_size=1, max_size=4)
)
def test_any_bytes_changed_before_it_was_packed_are_refused_or_read(
    changes: list[tuple[int, int]],
) -> None:
    content = bytearray(PLAIN)
    for place, change in changes:
        content[place] ^= change
    read, why = read_or_refused(gzip.compress(bytes(content)))
    assert why or read is not None


@given(st.binary(max_size=500), st.sampled_from([b"", b"\x1f\x8b", b"\x1f\x8b\x08\x00" + bytes(6)]))
def test_any_bytes_are_refused(content: bytes, begin: bytes) -> None:
    refusal(begin + content)


@given(st.binary(max_size=300))
def test_any_bytes_inside_gzip_are_refused(content: bytes) -> None:
    refusal(gzip.compress(content))
    refusal(gzip.compress(content + b"\n" + content))


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=10),
        lambda inner: (
            st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4)
        ),
        max_leaves=6,
    ),
    st.sampled_from(sorted(unpacked()[0])),
)
def test_a_header_with_anything_in_a_field_is_refused_or_read(value: Any, field: str) -> None:
    header, body = unpacked()
    read, why = read_or_refused(packed(header | {field: value}, body))
    assert why if read is None else value in (header[field], getattr(read, field, None))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h: h.update(steps=2**62), "steps"),
        (lambda h: h.update(steps=MAX_STEPS), "longer or shorter"),
        (lambda h: h.update(steps=-1), "steps"),
        (lambda h: h.update(steps=12.0), "steps"),
        (lambda h: h.update(steps="12"), "steps"),
        (lambda h: h.update(level_bytes=2**40), "level_bytes"),
        (lambda h: h.update(level_bytes=h["level_bytes"] - 16), "longer or shorter"),
        (lambda h: h.update(level_bytes=h["level_bytes"] - 16, steps=13), "longer or shorter"),
        (lambda h: h.update(level_sha256="0" * 64), "does not match its hash"),
        (lambda h: h.update(format=3), "found format 3; this version of Roller plays format 2"),
        (lambda h: h.update(format=True), "found format True; this version"),
        (lambda h: h.update(format="\n"), r"found format '\n'; this version"),
        (lambda h: h.update(format=1), "roller replay FILE --convert NEW makes a new file"),
        (lambda h: h.update(encoding="f8"), "longer or shorter"),
        (lambda h: h.update(encoding="f8", steps=1), "longer or shorter"),
        (lambda h: h.update(encoding="O"), "encoding"),
        (lambda h: h.update(check_every=0), "check_every"),
        (lambda h: h.update(check_every=2**62), "check_every"),
        (lambda h: h.update(check_every=12), "longer or shorter"),
        (lambda h: h.update(check_every=1, steps=MAX_STEPS), "rows of checksums"),
        (lambda h: h.update(quantities=["ball_position"] * 16), "each once"),
        (lambda h: h["quantities"].__setitem__(3, "luck"), "must be some of ball_position"),
        (lambda h: h.update(quantities=["x"] * 1000), "quantities"),
        (lambda h: h.update(quantities=[]), "longer or shorter"),
        (lambda h: h.update(player="\x1b]0;title\x07"), "cannot be printed"),
        (lambda h: h["versions"].update(mujoco="4\x1b[2J"), "cannot be printed"),
        (lambda h: h["versions"].update(engine="warp"), "engine"),
        (lambda h: h["versions"].update(rules=-1), "rules"),
        (lambda h: h["options"].update(action="force"), "is written"),
        (lambda h: h.update(kind="pickle"), "not a replay"),
        (lambda h: h.update(start=[1e6, 0.0, 0.0]), "the ball starts at"),
        (lambda h: h.update(start=[0.0, 0.0, 99.0]), "the ball starts at"),
        (lambda h: h["options"]["physics"].update(dt_s=1e-300), "dt_s"),
        (lambda h: h["options"]["physics"].update(iterations=10**9), "iterations"),
        (lambda h: h["options"]["physics"].update(integrator="../x"), "integrator"),
        (lambda h: h["options"]["physics"].update(impratio=-1.0), "impratio"),
        (lambda h: h["options"].update(control_dt_s=0.051), "no multiple"),
        (lambda h: h["options"].update(action="__import__"), "action"),
        (lambda h: h["options"].update(level="/etc/passwd"), "level"),
        (lambda h: h["options"].pop("discount"), "found no discount"),
        (lambda h: h["options"].update(discount="0.9"), "discount"),
        (lambda h: h["options"].update(physics="fast"), "must be the preset's values"),
        (lambda h: h.update(options=[]), "must be a mapping of options"),
        (lambda h: h["result"].update(coins=-1), "coins"),
        (lambda h: h["result"].update(coins=1.5), "coins"),
        (lambda h: h["result"].update(time_s=1e999), "time_s"),
        (lambda h: h["result"].update(reward_terms={"coin": 1.0}), "reward_terms"),
        (lambda h: h["result"].pop("fall"), "fall"),
        (lambda h: h["options"]["reward_weights"].update(coin=1e999), "weights"),
        (lambda h: h.update(player="x" * 201), "player"),
        (lambda h: h.update(more=1), "more"),
        (lambda h: h.pop("intro"), "intro"),
    ],
)
def test_a_header_that_lies_is_refused_with_the_field_it_lies_in(
    change: Callable[[dict[str, Any]], None], message: str
) -> None:
    assert message in refusal(changed(change))


def test_a_file_that_swells_when_it_is_unpacked_is_refused_before_it_does() -> None:
    header, body = unpacked()
    swollen = packed(header, body + bytes(64 * 2**20))
    assert len(swollen) < 2**20
    assert "longer or shorter" in refusal(swollen)
    assert "header" in refusal(gzip.compress(b" " * 32 * 2**20))
    assert "not a replay" in refusal(gzip.compress(b"[" * (MAX_HEADER_BYTES - 2) + b"\n"))


def test_what_follows_the_replay_is_refused() -> None:
    assert "longer or shorter" in refusal(CONTENT + b"x")
    assert "longer or shorter" in refusal(CONTENT + CONTENT)


def test_a_level_that_is_none_is_refused_though_its_hash_is_right() -> None:
    level = PLAYED.level
    for wrong, message in (
        ("{}", "its level is wrong: name"),
        ("[" * 100_000, "its level is wrong"),
        (canonical_text(level).replace('"gate"', '"/tmp/../x"', 1), "its level is wrong: name"),
        (canonical_text(level).replace('"opens":["gate"]', '"opens":["gaet"]'), "gaet"),
    ):
        played = replace(PLAYED)
        played.__dict__["level_text"] = wrong
        assert message in refusal(encode(played))


def test_a_game_that_would_take_days_is_refused() -> None:
    steps = MAX_PHYSICS_STEPS // 6 + 1
    with pytest.raises(ReplayError, match="too long a replay"):
        replace(PLAYED, actions=np.zeros(steps, dtype=np.int64))


@pytest.mark.parametrize(
    ("action", "wrong", "message"),
    [
        ("directions", b"\x09", "step 0, 9, is none of 'directions', which has 0 to 8"),
        ("keys", b"\x10", "step 0, 16, is none of 'keys', which has key codes 0 to 15"),
        *(
            ("force", np.array([push], "<f4").tobytes(), "is none of 'force', which has -1 to 1")
            for push in (np.nan, np.inf, 200.0, 3e38, 1.0000001)
        ),
    ],
)
def test_what_no_key_can_do_is_refused_before_anything_is_played(
    action: str, wrong: bytes, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    played = straight_on("gate", 12, direction=2, physics="fast", action=action)
    header, _, body = gzip.decompress(encode(played)).partition(b"\n")
    at = json.loads(header)["level_bytes"] + 1
    changed_body = body[:at] + wrong + body[at + len(wrong) :]
    monkeypatch.setattr(Simulation, "step", None)
    assert message in refusal(gzip.compress(header + b"\n" + changed_body))


def test_nothing_is_unpickled(tmp_path: Path) -> None:
    class Harm:
        def __reduce__(self) -> tuple[Any, ...]:
            return os.mkdir, (str(tmp_path / "harm"),)

    archive = io.BytesIO()
    np.savez(archive, header=np.array([Harm()], dtype=object))
    zipped = io.BytesIO()
    with zipfile.ZipFile(zipped, "w") as container:
        container.writestr("../../outside", b"x")
    for content in (pickle.dumps(Harm()), archive.getvalue(), zipped.getvalue()):
        assert "not a replay" in refusal(content)
        assert "not a replay" in refusal(gzip.compress(content))
    assert not (tmp_path / "harm").exists()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nothing", "no such file"),
        (".", "found a directory"),
        ("pipe", "found a pipe"),
        ("a\0b", "no such"),
    ],
)
def test_what_is_no_file_is_said_to_be_none(tmp_path: Path, name: str, message: str) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ReplayError, match=message):
        load_replay(tmp_path / name)


def test_a_file_too_large_is_not_read_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = save_replay(PLAYED, tmp_path / "game.replay")
    monkeypatch.setattr(replay_file, "_MAX_BYTES", len(CONTENT) - 1)
    with pytest.raises(
        ReplayError, match=r"game\.replay: the file is too large; allowed are at most"
    ):
        load_replay(file)


def test_a_name_too_long_or_of_escape_characters_is_refused_before_it_is_written() -> None:
    with pytest.raises(ReplayError, match="found 201 characters"):
        replace(PLAYED, player=201 * "x")
    with pytest.raises(ReplayError, match="must be characters that print"):
        replace(PLAYED, player="\x1b[2J")


def test_whoever_is_killed_or_has_no_space_while_writing_leaves_the_file_of_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = save_replay(PLAYED, tmp_path / "game.replay")

    def killed(path: Path, content: bytes) -> None:
        with path.open("wb") as stream:
            stream.write(content[:99])
        raise KeyboardInterrupt

    def full(path: Path, content: bytes) -> None:
        with path.open("wb") as stream:
            stream.write(content[:99])
        raise OSError(28, "No space left on device")

    for failing, error in ((full, OSError), (killed, KeyboardInterrupt)):
        with monkeypatch.context() as patched:
            patched.setattr(Path, "write_bytes", failing)
            with pytest.raises(error):
                save_replay(wandered("flat"), file)
        assert same(load_replay(file), PLAYED)
        assert failing is killed or list(tmp_path.iterdir()) == [file]
