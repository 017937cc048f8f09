"""What needs the extra ``train``: `tests.envs` is collected and passes without it."""
