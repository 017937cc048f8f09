"""EpisodeResult: how an episode stands or ended, the one value that all who tell of it share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

REWARD_TERMS: Final = ("coin", "finish", "fall", "progress")
"""What a step is rewarded for, in the order in which the terms are added up: the fields of
`roller_env.game.rewards.RewardWeights`."""

Medal = Literal["gold", "silver", "bronze"]
Outcome = Literal["finish", "fall", "diverged", "time limit", "not ended"]


@dataclass(frozen=True, slots=True)
class EpisodeResult:
    """How an episode stands or ended.

    Attributes:
        success: at the finish.
        fall: below the kill height.
        diverged: the physics failed.
        truncated: the time is up.
        coins: collected.
        score_percent: of the level's coins, 0 to 100; see `roller_env.game.state.score_percent`.
        time_s: since it began.
        total_reward: undiscounted sum of the steps' rewards.
        reward_terms: of which terms that is the sum, by `REWARD_TERMS`;
            None where they are not known, as of a file. Results are equal without them.
    """

    success: bool
    fall: bool
    diverged: bool
    truncated: bool
    coins: int
    score_percent: float
    time_s: float
    total_reward: float
    reward_terms: Mapping[str, float] | None = field(default=None, compare=False)

    @property
    def outcome(self) -> Outcome:
        """The end in a word or two."""
        if self.success:
            return "finish"
        if self.fall:
            return "fall"
        if self.diverged:
            return "diverged"
        return "time limit" if self.truncated else "not ended"

    def medal(self, par_time_s: float | None) -> Medal | None:
        """Return what the game is worth beside a level's par time, None if nothing.

        Gold is the finish with every coin within the par time, silver with one of both, bronze the
        finish. A level without a par time has no medals.
        """
        if par_time_s is None or not self.success:
            return None
        met = (self.score_percent == 100.0) + (self.time_s <= par_time_s)
        medals: tuple[Medal, Medal, Medal] = ("bronze", "silver", "gold")
        return medals[met]
