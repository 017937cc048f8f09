"""A small level to begin with, explained line by line."""

from __future__ import annotations

_TEXT = """\
# A level of Roller. 'roller level check' says what is wrong with it, 'roller level watch' draws it
# on every save, and 'roller play' plays it; docs/levels.md describes every field.
name: {name}
title: A first level
# Lengths are in quants, the original's inches; 'metre' is the other unit.
# x is forward, y left, z up.
units: quant
time_limit_s: 60

# The ball's centre: one radius, 16 quants, over the floor. Every game starts a little elsewhere.
start:
  at: [0, 0, 16]
  jitter: [16, 16]

# A floor is drawn as seen from above: up the page is forward. '#' is floor, 'o' floor with a coin,
# '.' nothing. The corner is the lower right one; each character is a square of 64 quants.
floors:
  - corner: [-96, -96, 0]
    cell: 64
    plan: |
      ###
      #o#
      .#.
      .o.
      .#.
      #o#
      ###
      ###

# The ball only has to touch this box.
finish:
  at: [352, 0, 32]
  size: [32, 96, 64]

# More to build with: boxes, ramps, walls, tubes, coins, plates and gates, lift_pads. What stands
# there more than once is written once: prefabs and place.
walls:
  - {{start: [412, -96], end: [412, 96], bottom: 0, height: 32}}

# One good way through; an agent's shaped reward pays for progress along it.
route:
  points:
    - [0, 0, 16]
    - [352, 0, 16]
"""


def new_level(name: str) -> str:
    """Return the text of a small level called ``name``."""
    return _TEXT.format(name=name)
