"""Gymnasium environments of `hovering`, registered as continuair/Hover-v0 when this is imported."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown
from continuair.interfaces.hovering import Hovering

checks.installed("gymnasium", "gym")

import gymnasium  # noqa: E402
from gymnasium.spaces import Box  # noqa: E402
from gymnasium.utils import seeding  # noqa: E402
from gymnasium.vector import AutoresetMode, VectorEnv  # noqa: E402
from gymnasium.vector.utils import batch_space  # noqa: E402

Array = np.ndarray

EPISODE = 500
"""Steps after which an episode is cut off: 10 s."""


def _spaces(task: Hovering) -> tuple[Box, Box]:
    """Return the spaces of observations and of actions of one environment."""
    return (
        Box(-np.inf, np.inf, (task.observations,), np.float32),
        Box(-1.0, 1.0, (task.actions,), np.float32),
    )


class HoverEnv(gymnasium.Env[Array, Array]):  # type: ignore[misc]
    """A vehicle whose task is to hold a point; `Hovering` describes the task and the options."""

    def __init__(self, vehicle: Any = None, render_mode: None = None, **options: Any) -> None:
        self.render_mode = render_mode
        self._task = Hovering(1, vehicle, **options)
        self.observation_space, self.action_space = _spaces(self._task)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode."""
        super().reset(seed=seed)
        self._task.begin([0], [self.np_random])
        return self._task.observed()[0].astype(np.float32), {}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Advance by a control period."""
        found = self._task.step(_checked(action, (1, self._task.actions)))
        observation = found.observation[0].astype(np.float32)
        return observation, float(found.reward[0]), bool(found.terminated[0]), False, {}


class HoverVectorEnv(VectorEnv[Array, Array, Array]):  # type: ignore[misc]
    """The same vehicle many times, or one each of a batch, all stepped in one launch.

    An episode that ended begins anew in the next step, which ignores its action.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        vehicle: Any = None,
        *,
        max_episode_steps: int = EPISODE,
        render_mode: None = None,
        **options: Any,
    ) -> None:
        self.render_mode, self.num_envs = render_mode, num_envs
        self._task, self._longest = Hovering(num_envs, vehicle, **options), max_episode_steps
        self.single_observation_space, self.single_action_space = _spaces(self._task)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._steps, self._ended = np.zeros(num_envs, int), np.zeros(num_envs, bool)
        self._randoms: list[np.random.Generator] = []

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Start all episodes; a whole number seeds them with itself and its successors."""
        count = self.num_envs
        if isinstance(seed, int | np.integer):
            super().reset(seed=int(seed))
            seeds: Sequence[int | None] | None = [int(seed) + i for i in range(count)]
        else:
            super().reset()
            seeds = seed
        if seeds is not None and len(seeds) != count:
            raise InputError(f"seed holds {len(seeds)} seeds; give {count}, or one for all.")
        if seeds is not None or not self._randoms:
            self._randoms = [seeding.np_random(each)[0] for each in seeds or [None] * count]
        self._begin(np.ones(count, bool))
        return self._task.observed().astype(np.float32), {}

    def step(self, actions: Array) -> tuple[Array, Array, Array, Array, dict[str, Any]]:
        """Advance all by a control period, except those that start again."""
        anew = self._ended.copy()
        found = self._task.step(_checked(actions, (self.num_envs, self._task.actions)))
        self._steps += 1
        observation, reward = found.observation, np.where(anew, 0.0, found.reward)
        if anew.any():
            self._begin(anew)
            observation = self._task.observed()
        terminated = found.terminated & ~anew
        truncated = (self._steps >= self._longest) & ~anew
        self._ended = terminated | truncated
        return observation.astype(np.float32), reward, terminated, truncated, {}

    def _begin(self, which: Array) -> None:
        runs = np.flatnonzero(which)
        self._task.begin(runs.tolist(), [self._randoms[run] for run in runs])
        self._steps[which], self._ended[which] = 0, False


def _checked(action: Any, shape: tuple[int, int]) -> Array:
    """Return an action, or those of all runs, as rows (runs, actions)."""
    found = checks.finite_array(action)
    if found is None:
        raise InputError(f"action is {shown(action)}; give finite numbers from -1 to 1.")
    if found.shape not in (shape, shape[1:] if shape[0] == 1 else shape):
        raise InputError(
            f"action is {shown(action)}, of shape {found.shape}; give numbers of shape {shape}."
        )
    return found.reshape(shape)


gymnasium.register(
    id="continuair/Hover-v0",
    entry_point="continuair.interfaces.gym:HoverEnv",
    vector_entry_point="continuair.interfaces.gym:HoverVectorEnv",
    max_episode_steps=EPISODE,
)
