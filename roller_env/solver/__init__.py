"""Is a level winnable? A search that plays it, and a player that plays what was found again.

- `archive`: the games worth going on from, by where the ball is and what is done;
- `search`: plays on from them until the finish is found, with more coins while the budget lasts;
- `tracker`: follows a play from any start, on any physics: how robust it is.

Found plays are replays, which anyone can verify. What was not found in the budget may be there all
the same.
"""

from roller_env.solver.search import Search, Solution, Won, solve, won_level
from roller_env.solver.tracker import Proof, Robustness, prove, robustness

__all__ = [
    "Proof",
    "Robustness",
    "Search",
    "Solution",
    "Won",
    "prove",
    "robustness",
    "solve",
    "won_level",
]
