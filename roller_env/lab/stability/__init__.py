"""Where methods break: limits predicted and then found, failures with their cures, hard cases.

`smooth` and `contacts` have the limits, `failures` a picture for every way to fail, `hard_cases`
what the game's own levels can do to the ball. ``scripts/stability.py`` runs all; what people read
of a case is in the CSV file of its table."""
