"""Maps with paths."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from roller_env.drawing.topdown import OUTCOME_STYLES, draw_paths
from roller_env.level import load_level, shipped_levels


def straight(low: float, high: float) -> npt.NDArray[np.float64]:
    """Return a path along the flat level."""
    return np.column_stack([np.linspace(low, high, 50), np.zeros(50), np.full(50, 0.41)])


def pixels_of(file: Path, colour: str) -> int:
    """Return how many pixels of a picture have about a colour."""
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    picture = np.asarray(Image.open(file).convert("RGB")).astype(int)
    return int((np.abs(picture - wanted).max(axis=-1) < 25).sum())


@pytest.mark.parametrize("name", shipped_levels())
def test_every_level_has_a_map(name: str, tmp_path: Path) -> None:
    file = tmp_path / "new" / "map.png"
    draw_paths(load_level(name), [], [], file)
    assert np.asarray(Image.open(file).convert("L")).std() > 10.0


@pytest.mark.parametrize("outcome", OUTCOME_STYLES)
def test_a_path_has_the_colour_of_its_outcome(outcome: str, tmp_path: Path) -> None:
    file = tmp_path / "map.png"
    draw_paths(load_level("flat"), [straight(0.0, 8.0)], [outcome], file)
    for name, (colour, _) in OUTCOME_STYLES.items():
        assert (pixels_of(file, colour) > 300) == (name == outcome)


def test_an_outcome_without_a_colour_of_its_own_is_drawn_too(tmp_path: Path) -> None:
    file = tmp_path / "map.png"
    draw_paths(load_level("flat"), [straight(0.0, 8.0)], ["diverged"], file)
    assert file.stat().st_size > 0


def test_a_level_with_decks_over_one_another_has_a_map_of_each(tmp_path: Path) -> None:
    one, two = tmp_path / "flat.png", tmp_path / "lift.png"
    draw_paths(load_level("flat"), [], [], one)
    draw_paths(load_level("lift"), [], [], two)
    assert panels(one) == 1
    assert panels(two) == 3


def panels(file: Path) -> int:
    """Count the framed plots of a map by the black lines of their frames."""
    dark = np.asarray(Image.open(file).convert("L")) < 60
    count = 0
    seen: list[tuple[int, int]] = []
    for row in np.flatnonzero(dark.sum(axis=1) > 80):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], dark[row], [False]]).astype(int)))
        for left, right in zip(edges[::2], edges[1::2], strict=True):
            if right - left > 80 and (int(left), int(right)) not in seen:
                seen.append((int(left), int(right)))
                count += 1
    return count


def test_paths_and_outcomes_must_be_as_many(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="found 2 for 1 paths"):
        draw_paths(load_level("flat"), [straight(0.0, 1.0)], ["finish", "fall"], tmp_path / "m.png")
