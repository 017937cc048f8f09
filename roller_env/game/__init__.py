"""The rules of the game. Pure NumPy with a leading axis of environments."""
