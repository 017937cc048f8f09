"""The rules of the game: NumPy arrays with a leading axis of environments, loops by Numba."""
