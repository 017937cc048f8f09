"""`docs/original.md` says what the code does: its tables of numbers against the code's."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from pydantic import BaseModel

from roller_env.compile.textures import parse_colour

Float64 = npt.NDArray[np.float64]

PAGE: Final = (Path(__file__).parents[1] / "docs" / "original.md").read_text(encoding="utf-8")
HEADING: Final = "| what | listing | number | SI | code |"

QUANT_M: Final = 0.0254
TICKS_PER_S: Final = 16.0
FRAMES_PER_S: Final = 60.0

UNITS: Final = {
    "": ("", 1.0),
    "q": ("m", QUANT_M),
    "q/s²": ("m/s²", QUANT_M),
    "q/tick": ("m/s", QUANT_M * TICKS_PER_S),
    "q/frame": ("m/s", QUANT_M * FRAMES_PER_S),
    "kg": ("kg", 1.0),
    "kg q/s²": ("N", QUANT_M),
    "s": ("s", 1.0),
    "frames": ("s", 1.0 / FRAMES_PER_S),
    "%": ("", 0.01),
    "/tick": ("/s", TICKS_PER_S),
    "%/tick": ("%/s", TICKS_PER_S),
    "of 255": ("", 1.0 / 255.0),
}
"""Units of the listing: the SI unit, and how many of it one is."""


FUNCTIONS: Final = (
    "main",
    "baller",
    "camera1",
    "reset",
    "roller",
    "door1",
    "s1",
    "gate1",
    "flipcam",
    "camch",
    "flipcam2",
    "camch2",
    "goup",
    "jumpup",
    "btube",
    "warp",
    "smoke_property",
    "fire1",
    "warps",
    "EXPLOFLARE2",
    "collect",
    "cllct",
    "cam_switcher",
)


class Row(NamedTuple):
    """One number of the page, as it is written."""

    what: str
    listing: str
    number: str
    si: str
    code: str


def rows() -> list[Row]:
    found = []
    for table in PAGE.split(HEADING)[1:]:
        for line in table.strip().splitlines()[1:]:
            if not line.startswith("|"):
                break
            found.append(Row(*(cell.strip() for cell in line.strip("|").split("|"))))
    return found


ROWS: Final = rows()


def read(text: str) -> tuple[list[str], str]:
    """Return the numbers, as written, and the unit of a number or vector."""
    match = re.fullmatch(r"\(?(-?[\d.]+(?:, -?[\d.]+)*)\)? ?(\D.*|)", text)
    assert match, text
    return match[1].split(", "), match[2]


def in_si(text: str) -> tuple[Float64, str]:
    """Return a number of the listing, or a sum of them, in SI, and the SI unit."""
    total: Any = 0.0
    for part in text.split(" + "):
        numbers, unit = read(part)
        si, factor = UNITS[unit]
        total = total + np.array(numbers, dtype=float) * factor
    return total, si


def of_code(path: str) -> Float64:
    """Return a constant's value, or a field's default; of a colour its alpha, if it has one."""
    names = re.findall(r"\w+|\[\w+\]", path)
    value: Any = importlib.import_module("roller_env")
    for depth, name in enumerate(names):
        if name.startswith("["):
            key = name[1:-1]
            value = value[int(key) if key.isdigit() else key]
        elif isinstance(value, type) and issubclass(value, BaseModel):
            value = value.model_fields[name].default
        elif hasattr(value, name):
            value = getattr(value, name)
        else:
            value = importlib.import_module(".".join(["roller_env", *names[: depth + 1]]))
    if isinstance(value, str):
        rgb, alpha = parse_colour(value)
        value = alpha if len(value) == len("#rrggbbaa") else rgb
    return np.atleast_1d(np.asarray(value, dtype=float))


def test_the_page_has_the_originals_numbers() -> None:
    assert len(ROWS) > 40
    assert len({row.code for row in ROWS}) == len(ROWS), "each number has a home of its own"


@pytest.mark.parametrize("row", ROWS, ids=[row.code.strip("`") for row in ROWS])
def test_the_original_says_what_the_code_does(row: Row) -> None:
    expected, unit = in_si(row.number)
    np.testing.assert_allclose(of_code(row.code.strip("`")), expected, rtol=1e-9)
    shown, shown_unit = read(row.si)
    assert shown_unit == unit
    for written, value in zip(shown, expected, strict=True):
        places = len(written.partition(".")[2])
        assert float(written) == round(float(value), places)
        assert abs(float(written) - value) <= 2e-3 * max(abs(value), 1.0), "written to be of use"


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_of_the_listing_is_on_the_page(name: str) -> None:
    assert f"`{name}`" in PAGE


def test_the_modules_that_the_page_names_are_there() -> None:
    table = PAGE.split("| listing | here | where |")[1].split("\n\n")[0]
    for line in table.splitlines()[2:]:
        for module in re.findall(r"`([\w.]+)`", line.split("|")[3]):
            assert importlib.util.find_spec(f"roller_env.{module}"), module
