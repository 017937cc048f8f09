"""The page in a real browser, as a person plays on it."""

from __future__ import annotations

import io
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from roller_env.level.text import level_text
from roller_env.play.html import write_html
from roller_env.replay import load_replay, shipped_replays, verify
from tests.play.browser import Person
from tests.play.lane import lane
from tests.play.served import Served

pytestmark = pytest.mark.xdist_group("page")

OPTIONS = ("--physics=rigid", "--skip-intro", "--quality=low", "--seed=1")


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a short level: W leads over a coin into the finish, S over the edge."""
    directory = tmp_path_factory.mktemp("home")
    (directory / "lane.yaml").write_text(level_text(lane(title="The lane", par_time_s=60.0)))
    return directory


@pytest.fixture(scope="module")
def game(home: Path) -> Iterator[Served]:
    served = Served("play", str(home / "lane.yaml"), f"--records={home / 'r.sqlite3'}", *OPTIONS)
    yield served
    assert served.end()[0] == 0


@pytest.fixture
def person(chromium: Any, game: Served) -> Iterator[Person]:
    person = Person(chromium, game.url())
    yield person
    person.page.keyboard.up("w")
    person.close()


def again(person: Person) -> None:
    """Go back to the start page, whatever the game does."""
    person.wait("a frame", lambda: person.phase != "")
    if person.phase == "playing":
        person.press("p")
        person.wait_for_phase("paused")
    if person.phase in ("paused", "ended"):
        person.page.get_by_role("button", name="Levels").filter(visible=True).first.click()
    person.start()


def picture(person: Person) -> np.ndarray:
    shot = person.page.screenshot()
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def test_the_ball_rolls_as_long_as_a_key_is_held_and_the_coin_counts(person: Person) -> None:
    again(person)
    before = picture(person)
    assert before.std(axis=(0, 1)).min() > 10.0, "the level is drawn"
    person.hold_until("w", "the coin is collected", lambda: person.x > 1.2)
    assert person.keys in (0, 1)
    person.sees("1 of 1 coins")
    person.wait("no key pushes", lambda: person.keys == 0)
    after = picture(person)
    assert (np.abs(after - before).max(axis=2) > 20).mean() > 0.05, "the picture has changed"


def test_the_arrow_keys_steer_too(person: Person) -> None:
    again(person)
    person.hold_until("ArrowUp", "the ball rolls", lambda: person.x > 0.3)


def test_a_fall_begins_anew(person: Person) -> None:
    again(person)
    person.hold_until("s", "the ball falls", lambda: person.x < -3.0)
    person.wait("it begins anew", lambda: person.x > -1.0)
    assert person.phase == "playing"


def test_the_finish_shows_medal_and_time_and_goes_on(person: Person) -> None:
    again(person)
    person.hold_until("w", "the finish", lambda: person.phase == "ended")
    dialog = person.page.get_by_role("dialog").filter(visible=True)
    dialog.get_by_text("Finish!").wait_for()
    dialog.get_by_text("1 of 1").wait_for()
    dialog.get_by_role("button", name="Next: Open floor").wait_for()
    dialog.get_by_role("button", name="Play again").click()
    person.wait_for_phase("playing")
    assert person.x < 1.0


def test_the_ghost_of_the_best_run_rolls_beside(person: Person) -> None:
    again(person)
    person.hold_until("w", "the finish", lambda: person.phase == "ended")
    person.page.get_by_role("button", name="Play again").click()
    person.wait_for_phase("playing")
    person.press("p")
    person.wait_for_phase("paused")
    person.page.get_by_label("Race against").filter(visible=True).select_option("best")
    person.page.get_by_role("button", name="Go on", exact=True).click()
    person.wait("a ghost", lambda: person.ghost)


def test_a_page_that_loses_the_focus_pauses_and_lets_go(person: Person) -> None:
    again(person)
    person.page.keyboard.down("w")
    person.wait("a key pushes", lambda: person.keys == 1)
    person.page.evaluate("window.dispatchEvent(new Event('blur'))")
    person.wait_for_phase("paused")
    person.page.keyboard.up("w")
    person.page.get_by_role("button", name="Go on", exact=True).click()
    person.wait_for_phase("playing")
    person.wait("no key pushes", lambda: person.keys == 0)


def test_a_game_goes_on_where_it_was_after_a_reload(person: Person) -> None:
    again(person)
    person.hold_until("w", "the ball rolls", lambda: person.x > 0.5)
    person.page.reload()
    person.wait_for_phase("paused")
    assert person.x > 0.4
    person.page.get_by_role("button", name="Go on", exact=True).click()
    person.wait_for_phase("playing")


def test_a_second_browser_watches_and_has_nothing_to_steer_with(
    chromium: Any, game: Served, person: Person
) -> None:
    again(person)
    watcher = Person(chromium, game.url())
    watcher.wait("it sees the game", lambda: watcher.phase == "playing")
    watcher.page.keyboard.down("w")
    watcher.sees("watch")
    assert not any(message["type"] == "keys" for message in watcher.sent)
    for name in ("Restart (R)", "Pause (P)"):
        assert watcher.page.get_by_role("button", name=name).filter(visible=True).count() == 0
    watcher.close()


def test_time_goes_back_in_a_pause_and_on_from_there(person: Person) -> None:
    again(person)
    person.hold_until("w", "the ball rolls", lambda: person.x > 0.8)
    person.press("p")
    person.wait_for_phase("paused")
    person.page.get_by_role("button", name="Look back").click()
    slider = person.page.get_by_label("Moment").filter(visible=True)
    slider.fill("0")
    person.wait("the start", lambda: person.x < 0.1)
    person.page.get_by_role("button", name="Go on from here").filter(visible=True).first.click()
    person.wait_for_phase("playing")
    person.hold_until("w", "it goes on", lambda: person.x > 0.3)


@pytest.mark.parametrize("size", [(480, 360), (360, 640)])
def test_start_is_in_reach_on_a_small_screen(
    chromium: Any, game: Served, size: tuple[int, int]
) -> None:
    width, height = size
    somebody = Person(chromium, game.url(), viewport={"width": width, "height": height})
    again(somebody)
    somebody.press("p")
    somebody.wait_for_phase("paused")
    somebody.page.get_by_role("button", name="Levels").filter(visible=True).first.click()
    button = somebody.page.get_by_role("button", name="Start", exact=True)
    button.wait_for()
    box = button.bounding_box()
    assert box is not None
    assert box["y"] + box["height"] <= height
    assert box["x"] + box["width"] <= width
    somebody.close()


def test_a_finger_steers(chromium: Any, game: Served) -> None:
    somebody = Person(chromium, game.url(), viewport={"width": 640, "height": 400}, has_touch=True)
    somebody.wait_for_phase("start")
    somebody.page.get_by_role("button", name="Start", exact=True).tap()
    somebody.wait_for_phase("playing")
    touch = somebody.page.context.new_cdp_session(somebody.page)
    at = {"x": 120, "y": 300}
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [at]})
    touch.send(
        "Input.dispatchTouchEvent",
        {"type": "touchMove", "touchPoints": [{"x": 120, "y": 230}]},
    )
    somebody.wait("the ball rolls forward", lambda: somebody.x > 0.3)
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    somebody.wait("nothing pushes", lambda: somebody.keys == 0)
    somebody.close()


def test_the_page_comes_from_this_machine_and_is_small(chromium: Any, game: Served) -> None:
    somebody = Person(chromium, game.url())
    again(somebody)
    assert {url.partition("//")[2].partition("/")[0] for url in somebody.asked} == {
        f"localhost:{game.port}"
    }
    sizes = somebody.page.evaluate(
        "performance.getEntriesByType('resource').concat(performance.getEntriesByType"
        "('navigation')).reduce((sum, entry) => sum + entry.transferSize, 0)"
    )
    assert 0 < sizes < 1_500_000
    somebody.close()


def test_a_server_that_was_killed_and_is_back_is_found_again(
    chromium: Any, home: Path, tmp_path: Path
) -> None:
    words = ("play", str(home / "lane.yaml"), f"--records={tmp_path / 'r.sqlite3'}", *OPTIONS)
    first = Served(*words)
    somebody = Person(chromium, first.url())
    somebody.start()
    first.end(signal.SIGKILL)
    somebody.sees("connection")
    second = Served(*words, port=first.port)
    somebody.wait_for_phase("start")
    somebody.start()
    somebody.hold_until("w", "the ball rolls", lambda: somebody.x > 0.3)
    somebody.close()
    assert second.end()[0] == 0


def test_what_is_played_is_a_replay_that_verifies(
    chromium: Any, home: Path, tmp_path: Path
) -> None:
    directory = tmp_path / "replays"
    served = Served(
        "play",
        str(home / "lane.yaml"),
        f"--records={tmp_path / 'r.sqlite3'}",
        f"--replays={directory}",
        *OPTIONS,
    )
    somebody = Person(chromium, served.url())
    somebody.start()
    somebody.hold_until("w", "the finish", lambda: somebody.phase == "ended")
    somebody.close()
    # As when the terminal is closed.
    status, output = served.end(signal.SIGTERM)
    assert status == 0, output
    (file,) = directory.glob("*.replay")
    assert f"replay: {file}" in output
    replay = load_replay(file)
    assert replay.result.success
    assert (replay.force_n[:, 0] > 0.0).any()
    assert verify(replay).is_exact


def test_a_replay_in_one_file_plays_without_a_server(chromium: Any, tmp_path: Path) -> None:
    file = write_html(load_replay(shipped_replays()["flat"]), tmp_path / "flat.html")
    somebody = Person(chromium, file.as_uri())
    slider = somebody.page.get_by_label("Moment").filter(visible=True)
    slider.wait_for()
    somebody.wait("it plays", lambda: float(slider.input_value()) > 0.3)
    somebody.press("Space")
    slider.fill("2")
    somebody.sees("2.0")
    drawn = picture(somebody)
    assert drawn.std(axis=(0, 1)).min() > 10.0
    assert somebody.asked == [file.as_uri()]
    somebody.close()
