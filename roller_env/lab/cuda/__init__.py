"""Whole games on a graphics card, one thread an env, by the kernels that the CPU runs."""
