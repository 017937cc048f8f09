"""Every predicted limit, by name."""

from __future__ import annotations

from typing import Final

from roller_env.lab.stability.cases import Case
from roller_env.lab.stability.friction import friction_cases
from roller_env.lab.stability.hop import hop_cases
from roller_env.lab.stability.impact import bounce_cases, impact_cases
from roller_env.lab.stability.resting import mocap_cases, resting_cases, seam_cases
from roller_env.lab.stability.smooth import smooth_cases
from roller_env.lab.stability.tunnelling import tunnelling_cases

_SOURCES: Final = (
    smooth_cases,
    impact_cases,
    bounce_cases,
    tunnelling_cases,
    friction_cases,
    mocap_cases,
    resting_cases,
    seam_cases,
    hop_cases,
)

CASES: Final[dict[str, Case]] = {case.name: case for cases in _SOURCES for case in cases()}
"""By name, in the order of the table."""

GROUPS: Final[tuple[str, ...]] = tuple(dict.fromkeys(case.group for case in CASES.values()))
"""What the cases are about."""
