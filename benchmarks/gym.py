"""Steps per second of the learning environments, of one, some and many at once.

    python benchmarks/gym.py

Every step is a control period of 20 ms under actions at random, observations, rewards and new
beginnings included; the best of REPEATS is told, as a busy machine makes steps longer, never
shorter.
"""

from __future__ import annotations

from time import perf_counter
from typing import Any

import gymnasium
from machine import described_machine

import continuair as ca
import continuair.interfaces.gym  # noqa: F401
from continuair.interfaces.hovering import ROTORS

COUNTS, REPEATS, SECONDS = (1, 256, 4096), 25, 0.2


def vehicles() -> dict[str, Any]:
    one = ca.load_vehicle("slender").replace({"uav.rotors": ROTORS, "arm.damping_ratio": 0.05})
    return {"two sections (default)": None, "one section": one}


def steps_per_second(env: Any) -> float:
    actions, steps = env.action_space.sample(), 0
    start = perf_counter()
    while perf_counter() - start < SECONDS:
        env.step(actions)
        steps += 1
    return steps * int(env.num_envs) / (perf_counter() - start)


def main() -> None:
    print(described_machine())
    for name, vehicle in vehicles().items():
        for count in COUNTS:
            env = gymnasium.make_vec("continuair/Hover-v0", num_envs=count, vehicle=vehicle)
            env.reset(seed=0)
            env.step(env.action_space.sample())
            best = max(steps_per_second(env) for _ in range(REPEATS))
            print(f"{name}, {count} environments: {best:,.0f} steps/s")


if __name__ == "__main__":
    main()
