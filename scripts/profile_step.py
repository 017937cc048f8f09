"""Say where the time of a vector step goes: physics (mujoco.batch), rules, observation."""

from __future__ import annotations

import argparse
import cProfile
import pstats

from gymnasium.vector import AutoresetMode

from roller_env.envs.vector import RollerVectorEnv

PARTS = {
    "physics (Batch.rollout)": ("batch.py", "rollout"),
    "  all of Stepper.advance": ("stepper.py", "advance"),
    "events": ("rules.py", "find_events"),
    "consequences": ("rules.py", "apply"),
    "controls": ("rules.py", "controls"),
    "shaping": ("simulation.py", "_shaping"),
    "observation": ("simulation.py", "observe"),
    "reset": ("simulation.py", "reset"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--level", default="classic")
    parser.add_argument("--physics", default="default")
    parser.add_argument("--reward", default="shaped")
    parser.add_argument("--num-envs", type=int, default=256)
    parser.add_argument("--steps", type=int, default=400)
    arguments = parser.parse_args()
    env = RollerVectorEnv(
        arguments.num_envs,
        autoreset_mode=AutoresetMode.SAME_STEP,
        level=arguments.level,
        physics=arguments.physics,
        reward=arguments.reward,
    )
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(arguments.steps)]
    profile = cProfile.Profile()
    profile.enable()
    for action in actions:
        env.step(action)
    profile.disable()
    stats = pstats.Stats(profile).stats  # type: ignore[attr-defined]

    def seconds(file: str, function: str) -> float:
        """Return the cumulative time of a function."""
        wanted = (key for key in stats if key[0].endswith(file) and key[2] == function)
        return float(sum(stats[key][3] for key in wanted))

    whole = seconds("envs/vector.py", "step")
    print(
        f"{arguments.level}, {arguments.physics}, {arguments.num_envs} environments, "
        f"{arguments.steps} steps: {arguments.num_envs * arguments.steps / whole:,.0f} "
        "environment steps/s (with the profiler's own cost)"
    )
    for name, (file, function) in PARTS.items():
        print(f"{name:28s} {100.0 * seconds(file, function) / whole:5.1f} %")


if __name__ == "__main__":
    main()
