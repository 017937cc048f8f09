"""Experiments: what each method of moving a body costs, how wrong it is, and where it breaks.

Nothing that plays or trains imports this. Start with ``scripts/accuracy.py``,
``scripts/stability.py`` and ``scripts/parallel_cube.py``.

Two errors are kept apart everywhere. **Discretisation** error is the distance from the same model
advanced with a vanishing time step; **model** error is the distance from the rigid closed form,
which MuJoCo's soft contacts do not approach however small the step.
"""
