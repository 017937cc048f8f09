"""Thin faces over `roller_env.simulation.Simulation`: gym.Env, gym.vector.VectorEnv, SB3's VecEnv."""
