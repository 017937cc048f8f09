"""Thin faces over `Simulation`: gym.Env, gym.vector.VectorEnv and SB3's VecEnv."""
