"""A person plays what the agents play: the same Simulation, the same rules, the same bits.

`roller_env.play.session` is the game as a person meets it and knows of no screen;
`roller_env.play.app` puts it into a browser page or a window with MuJoCo Studio's plugins.
"""
