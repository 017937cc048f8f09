"""What can be wrong with a replay."""


class ReplayError(ValueError):
    """A replay that cannot be read, written or played; the message says in one line why."""
