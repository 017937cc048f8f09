"""How every chart of the laboratory looks, so that a colour means the same method everywhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import matplotlib
from matplotlib.figure import Figure

from roller_env.lab.provenance import header

STYLE: Final[dict[Any, Any]] = {
    "axes.edgecolor": "#888888",
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.dpi": 110,
    "font.size": 10,
    "grid.color": "#e6e6e6",
    "legend.frameon": False,
    "svg.hashsalt": "roller",
}
"""For ``matplotlib.rc_context``. The salt makes the same chart the same SVG."""

COLOURS: Final[dict[str, str]] = {
    "MuJoCo Euler": "#2f6db3",
    "MuJoCo implicit": "#7a5bb5",
    "MuJoCo implicitfast": "#1b998b",
    "MuJoCo discrete": "#7d8597",
    "MuJoCo RK4": "#d1495b",
    "ours explicit_euler": "#8d6e63",
    "ours semi_implicit_euler": "#b58900",
    "ours rk4": "#ef8e19",
    "ours rk4_body": "#c9a227",
    "ours lie_rk4": "#3a8f5c",
    "ours buss2": "#9ccc65",
    "ours buss3": "#5f9ea0",
    "ours splitting2": "#c77dba",
    "ours splitting4": "#8e4585",
}
"""By the method's name. MuJoCo's with the pyramidal cone share the elliptic's colour, dashed."""

FAILURE: Final = "#b00020"
PREDICTION: Final = "#555555"


def colour(method_name: str) -> str:
    """Return the method's colour, whatever its cone."""
    return COLOURS[method_name.partition(",")[0]]


def save(figure: Figure, facts: dict[str, str], stem: Path) -> tuple[Path, Path]:
    """Write the figure as ``stem.png`` and ``stem.svg`` with its provenance along the foot.

    Returns:
        Both paths.
    """
    figure.text(
        0.005, 0.004, header(facts), fontsize=6, color="#777777", ha="left", va="bottom", wrap=True
    )
    stem.parent.mkdir(parents=True, exist_ok=True)
    # Not with_suffix: a scene's name may have a point in it.
    png, svg = (stem.with_name(f"{stem.name}.{kind}") for kind in ("png", "svg"))
    with matplotlib.rc_context(STYLE):
        figure.savefig(png, dpi=150, facecolor="white")
        figure.savefig(svg, facecolor="white", metadata={"Date": None})
    return png, svg
