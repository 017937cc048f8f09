"""What a command line calls bodies, scenes, methods and keys."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from typing import TypeVar

from roller_env.lab.methods import MUJOCO, MujocoMethod
from roller_env.rigid_body import PiecewiseConstantForce, key_sequence

Named = TypeVar("Named")


def chosen(what: str, name: str, options: Mapping[str, Named]) -> Named:
    """Return the option called ``name``.

    Raises:
        ValueError: when there is none, with the nearest name.
    """
    if name not in options:
        near = difflib.get_close_matches(name, options, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(f"no {what} {name!r}: there are {', '.join(options)}{hint}")
    return options[name]


def chosen_several(what: str, name: str, options: Mapping[str, Named]) -> tuple[str, ...]:
    """Return the name asked for, or every name for ``all``; errors as `chosen`."""
    if name == "all":
        return tuple(options)
    chosen(what, name, {**options, "all": options})
    return (name,)


def mujoco_method(integrator_name: str) -> MujocoMethod:
    """Return MuJoCo with the integrator of that name; errors as `chosen`."""
    return chosen("MuJoCo integrator", integrator_name, {m.integrator: m for m in MUJOCO})


def parsed_keys(events: Iterable[str]) -> PiecewiseConstantForce:
    """Return the key sequence written as ``0=W 1=WA 2.5=``: time in s, and the keys from then on.

    Raises:
        ValueError: on anything else, an unknown key, or times that do not rise.
    """
    sequence = []
    for event in events:
        time, separator, keys = event.partition("=")
        try:
            when = float(time)
        except ValueError:
            when = math.nan
        if not separator or not math.isfinite(when):
            raise ValueError(f"keys: found {event!r}; a time in s and keys, such as 1.5=WA")
        sequence.append((when, keys.upper()))
    return key_sequence(sequence)
