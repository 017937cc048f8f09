"""A person plays what the agents play: the same Simulation, the same rules, the same bits.

`roller_env.play.session` is the game as a person meets it and knows of no screen; `.room` is who
plays it and who watches, `.server` serves the page that shows it.
"""
