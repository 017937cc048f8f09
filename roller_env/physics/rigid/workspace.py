"""Working memory of the kernels: one record a thread, made once for all balls and steps."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from roller_env.physics.rigid.kernels import Record, Records, kernel
from roller_env.physics.rigid.scene import MOST_NEAR, Scenes

MOST_CONTACTS: Final = 8

CONTACT: Final = np.dtype(
    [
        ("solid", np.int64),
        ("kind", np.int64),  # of the feature that is touched
        ("axis", np.int64),
        ("gap", np.float64),
        ("normal", np.float64, 3),  # from the solid to the ball
        ("pivot", np.float64, 3),  # a point of the edge, or the corner, that is touched
        ("edge", np.float64, 3),  # direction of the edge that is touched
        ("friction", np.float64),
        ("elasticity", np.float64),
        ("reversal", np.float64),
        ("dilatancy", np.float64),
        ("shift", np.float64),  # displacement of the solid along its line
        ("speed", np.float64),  # the same of its velocity
        ("carried", np.float64, 3),  # that velocity in the world
        # The problem of impulses or forces:
        ("surface", np.float64, 3),  # what the slip is measured against: s
        ("bias", np.float64),  # b
        ("slides", np.int64),  # 1 if the slip has a direction already
        ("direction", np.float64, 3),  # that direction
        ("start", np.float64, 3),  # that direction when the motion began
        # Its answer:
        ("status", np.int64),  # `OPEN`, `STICKS` or `SLIPS`
        ("push", np.float64),  # N
        ("drag", np.float64, 3),  # T
        ("first", np.int64),  # place of its unknowns in `system`
        ("kept_push", np.float64),
        ("kept_drag", np.float64, 3),
    ],
    align=True,
)
"""A contact of the ball, and what it does to its velocity."""

NEAR: Final = np.dtype(
    [
        ("solid", np.int64),
        ("kind", np.int64),  # of its feature that is nearest
        ("gap", np.float64),
        ("normal", np.float64, 3),
        ("shift", np.float64),
        ("speed", np.float64),
        ("carried", np.float64, 3),
    ],
    align=True,
)
"""A solid that the ball may meet."""

SLAB: Final = np.dtype(
    [
        ("shift", np.float64),  # displacement along its line
        ("speed", np.float64),  # of that
        ("stop", np.float64),  # displacement at its end
    ],
    align=True,
)
"""A slab of one ball's level."""

_SIZE: Final = 3 * MOST_CONTACTS


def work_record(most_near: int = MOST_NEAR) -> np.dtype[np.void]:
    """Return what one thread needs for one ball at a time, near ``most_near`` solids."""
    return np.dtype(
        [
            ("contact", CONTACT, MOST_CONTACTS + 1),  # the last is spare
            ("response", np.float64, (_SIZE, _SIZE)),  # rates of change by unit impulses
            ("system", np.float64, (_SIZE, _SIZE + 1)),
            ("columns", np.int64, _SIZE),
            ("frame", np.float64, (_SIZE, 3)),  # normal and two tangents of every active contact
            ("active", np.int64, MOST_CONTACTS),
            ("near", NEAR, most_near),
            ("found", np.int64),  # how many of `near` there are
            # What the step of a ball took, as `states.Counts` says.
            ("segments", np.int64),
            ("forced", np.int64),
            ("unsolved", np.int64),
            ("blocked", np.int64),
        ],
        align=True,
    )


WORK: Final = work_record()
"""Enough for any scenes: Numba compiles anew for a record of another size."""


class Workspace(NamedTuple):
    """Working memory of T threads."""

    work: Records  # (T,) of `WORK`
    slab: Records  # (T, P) of `SLAB`


def make_workspace(scenes: Scenes, threads: int = 1) -> Workspace:
    """Return working memory for ``threads`` threads that advance balls in ``scenes``."""
    return Workspace(
        work=np.zeros(threads, WORK).view(np.recarray),
        slab=np.zeros((threads, scenes.slab_stop.shape[1]), SLAB).view(np.recarray),
    )


@kernel
def swap(work: Record, i: int, j: int) -> None:
    """Exchange two contacts."""
    if i != j:
        work.contact[MOST_CONTACTS] = work.contact[i]
        work.contact[i] = work.contact[j]
        work.contact[j] = work.contact[MOST_CONTACTS]
