"""Is a level winnable? A search that plays it, and a player that plays what was found again.

- `archive`: the games worth going on from, by where the ball is and what is done;
- `search`: plays on from them until the finish is found, with more coins while the budget lasts;
- `reference`: a play as something to follow, and the law that steers along it;
- `tracker`: follows a play from any start, on any physics, and looks ahead with a model;
- `proof`: how robust a play is, by following it from many starts.

Found plays are replays, which anyone can verify. What was not found in the budget may be there all
the same.
"""

from roller_env.solver.proof import Proof, Robustness, prove, robustness
from roller_env.solver.search import Search, Solution, Won, solve, won_level

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
