"""Environments in which every episode may be on another generated level.

As in K. Cobbe et al., *Leveraging procedural generation to benchmark reinforcement learning*, 2020,
a set of levels is a number of them and the first one's seed: an agent is trained on some and judged
on others.
"""

from __future__ import annotations

from typing import Any, Final

from roller_env.envs.single import RollerEnv
from roller_env.envs.vector import RollerVectorEnv
from roller_env.level.generate import LATEST
from roller_env.level.proved import proved_levels

NUM_LEVELS: Final = 200
DIFFICULTY: Final = 0.25


class GeneratedEnv(RollerEnv):
    """A game on generated levels, each proved winnable: ``Roller/Generated-v1``.

    Version history:
        v1: levels of version 2 of the generator, which has every kind of piece; ``kinds="all"``.
        v0: the first version.
    """

    def __init__(
        self,
        *,
        num_levels: int = NUM_LEVELS,
        start_level: int = 0,
        difficulty: float = DIFFICULTY,
        version: int = LATEST,
        physics: Any = "rigid",
        **options: Any,
    ):
        """Make the environment.

        Args:
            num_levels: how many levels there are; every reset draws one.
            start_level: seed of the first.
            difficulty: one of those that there are proved levels of; the message of an error says
                which.
            version: of the generator; ``Roller/Generated-v0`` has the first.
            physics: ``rigid`` or ``relaxed``, unless there is one level only.
            options: the others of `roller_env.config.EnvConfig`, but for ``level``.

        Raises:
            TypeError: there is no option of that name.
            ValueError: an option's value is not allowed, or nobody has proved such a level.
        """
        levels = proved_levels(num_levels, start_level, difficulty, version=version)
        super().__init__(levels=levels, physics=physics, **options)


class GeneratedVectorEnv(RollerVectorEnv):
    """N games on generated levels; see `GeneratedEnv`.

    Version history:
        v1: levels of version 2 of the generator, which has every kind of piece; ``kinds="all"``.
        v0: the first version.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        num_levels: int = NUM_LEVELS,
        start_level: int = 0,
        difficulty: float = DIFFICULTY,
        version: int = LATEST,
        physics: Any = "rigid",
        **options: Any,
    ):
        """Make the environment; the options are those of `GeneratedEnv` and `RollerVectorEnv`.

        Raises:
            TypeError: there is no option of that name.
            ValueError: an option's value is not allowed, or nobody has proved such a level.
        """
        levels = proved_levels(num_levels, start_level, difficulty, version=version)
        super().__init__(num_envs, levels=levels, physics=physics, **options)
