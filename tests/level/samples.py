"""A small valid level for the tests of this directory to spoil."""

from __future__ import annotations

from typing import Any

from roller_env.level import Level

SMALL = """\
name: small
units: quant
start: {at: [0, 0, 16]}
finish: {at: [500, 0, 16], size: [32, 32, 32]}
boxes:
  - {at: [200, 0, -8], size: [800, 400, 16]}
"""
"""Six lines of file: what a test appends begins on line 7."""

COMPLETE = """\
name: complete
title: "Every field: of every piece"
description: Holds one of everything.
units: quant
gravity: 386
kill_height: -1129
falls: checkpoint
time_limit_s: 90
par_time_s: 45
ball: {radius: 16, mass_kg: 1, friction: 0.3, elasticity: 0}
start: {at: [0, 0, 16], jitter: [4, 4]}
finish: {at: [900, 0, 16], size: [32, 32, 32], needs_coins: 3}
materials:
  ice: {friction: 0.1, elasticity: 0.5, colour: "#eeffff", pattern: checker}
floors:
  - corner: [-64, -96, 0]
    cell: 64
    thickness: 16
    name: deck
    plan: |
      #o.
      ##W
      ###
    legend:
      W: {material: ice, coin: false, wall: 32}
boxes:
  - at: [500, 0, -8]
    size: [800, 200, 16]
    roll_deg: 0
    yaw_deg: 0
    pitch_deg: 0
    material: ice
    name: road
ramps:
  - {start: [900, 0, 0], end: [1000, 0, 50], width: 64, thickness: 8, material: default, name: up}
walls:
  - start: [200, 90]
    end: [800, 90]
    bottom: 0
    height: 20
    thickness: 8
    material: default
    name: rail
hulls:
  - points: [[250, 60, 0], [290, 60, 0], [270, 90, 0], [270, 70, 30]]
    material: ice
    name: rock
wedges:
  - {at: [150, 60, 4], size: [32, 32, 8], yaw_deg: 90, material: ice, name: kicker}
half_pipes:
  - start: [300, -300, 0]
    end: [500, -300, 10]
    radius: 60
    arc_deg: 160
    segments: 8
    thickness: 8
    material: ice
    name: trough
bowls:
  - {at: [700, -400, 0], radius: 90, arc_deg: 120, rings: 2, thickness: 8, material: ice, name: cup}
spirals:
  - centre: [1200, -400, 0]
    radius: 100
    width: 64
    rise: 50
    from_deg: 90
    turn_deg: 180
    bank_deg: 10
    segments: 12
    thickness: 8
    material: ice
    name: winding
tubes:
  - start: [300, 300, 0]
    end: [300, 300, 900]
    inner_radius: 40
    thickness: 4
    sides: 12
    opening: {toward_deg: 180, width_deg: 60}
    material: glass
    name: shaft
coins:
  - at: [100, 0, 16]
  - line: {start: [120, 0, 16], end: [160, 0, 16], count: 3}
  - arc: {centre: [200, 0, 16], radius: 30, from_deg: 0, to_deg: 90, count: 4}
  - grid: {centre: [300, 0, 16], spacing: [20, 20], count: [2, 3]}
plates:
  - {name: button, at: [400, 0, 72], size: [48, 48, 20], opens: [door], sinks_to: 67, speed: 1.6}
gates:
  - name: door
    at: [450, 0, 32]
    size: [8, 128, 64]
    yaw_deg: 5
    lowers_to: -32
    speed: 32
    needs: all
    closes: true
switches:
  - {at: [420, 60, 2], size: [32, 32, 4], sets: [door], mode: timed, duration_s: 3, name: field}
platforms:
  - name: ferry
    at: [1100, 0, -8]
    to: [1200, 0, -8]
    size: [64, 64, 16]
    yaw_deg: 0
    speed: 48
    wait_s: 1
    returns: true
    needs: any
    material: ice
fans:
  - at: [500, 0, 64]
    size: [64, 64, 64]
    force_n: [0, 2, 0]
    blows: true
    needs: any
    name: gust
springs:
  - {at: [550, 60, 2], size: [32, 32, 4], velocity: [0, 0, 200], name: hop}
bumpers:
  - {at: [580, 60, 16], size: [24, 24, 32], speed: 160, name: post}
teleporters:
  - {at: [600, 60, 32], size: [16, 32, 64], to: [700, 60, 16], name: portal}
hazards:
  - {at: [750, 60, 2], size: [32, 32, 4], name: lava}
lift_pads:
  - {at: [300, 300, 4], size: [32, 32, 8], force_n: 12.7, duration_s: 5, name: lift}
checkpoints:
  - {name: halfway, at: [0, 0, 16], size: [16, 128, 32]}
camera_triggers:
  - {kind: overhead, at: [350, 0, 32], size: [8, 128, 64]}
  - {kind: retreat, at: [600, 0, 32], size: [8, 128, 64]}
  - {kind: first_person, at: [700, 0, 16], reach: 10}
route:
  points: [[0, 0, 16], [900, 0, 16]]
  radius: 60
"""


def small_level(**changes: Any) -> Level:
    """A box of 20 m x 6 m with the ball standing on it, in metres, with the changes given."""
    plain: dict[str, Any] = {
        "name": "small",
        "start": {"at": (0.0, 0.0, 0.4064)},
        "finish": {"at": (15.0, 0.0, 0.5), "size": (1.0, 1.0, 1.0)},
        "boxes": [{"at": (8.0, 0.0, -0.5), "size": (20.0, 6.0, 1.0)}],
    }
    return Level.model_validate(plain | changes)
