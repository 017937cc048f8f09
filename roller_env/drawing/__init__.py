"""Pictures of the game. Drawing reads a simulation and never changes it.

Importing these modules needs no OpenGL: it is asked for when the first picture is drawn.
"""
