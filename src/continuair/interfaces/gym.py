"""Gymnasium environments of `hovering`, registered as continuair/Hover-v0 when this is imported."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuair import checks
from continuair.errors import InputError, nearest, shown
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
    """A vehicle whose task is to hold a point; `Hovering` describes the task and the options.

    A copy, by `copy.deepcopy` or pickle, continues as the original does.
    """

    def __init__(self, vehicle: Any = None, render_mode: None = None, **options: Any) -> None:
        _check_not_rendered(render_mode)
        self.render_mode = None
        self._task = Hovering(1, vehicle, **options)
        self.observation_space, self.action_space = _spaces(self._task)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode; there are no options."""
        _options(options, ())
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

    autoreset_mode: as Gymnasium defines it. With "NextStep" an episode that ended restarts in the
    next step, which ignores its action. With "SameStep" it restarts in the step that ends it, and
    info["final_obs"] holds the last observation. With "Disabled" only `reset` restarts it.
    """

    def __init__(
        self,
        num_envs: int = 1,
        vehicle: Any = None,
        *,
        max_episode_steps: int = EPISODE,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        render_mode: None = None,
        **options: Any,
    ) -> None:
        _check_not_rendered(render_mode)
        self.render_mode, self.num_envs = None, num_envs
        self._mode = _autoreset_mode(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self._mode}
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
        """Start all episodes, or those of options["reset_mask"], booleans (num_envs,).

        A whole number seeds the environments with itself and its successors. Environments without a
        seed continue to draw from their generators.
        """
        which = self._mask(options)
        if isinstance(seed, int | np.integer):
            super().reset(seed=int(seed))
            seeds: Sequence[int | None] = [int(seed) + i for i in range(self.num_envs)]
        else:
            super().reset()
            seeds = [None] * self.num_envs if seed is None else seed
        if len(seeds) != self.num_envs:
            raise InputError(
                "seed", f"holds {len(seeds)} seeds", f"give {self.num_envs}, or one for all"
            )
        self._seed(seeds, which)
        self._begin(which)
        return self._task.observed().astype(np.float32), {}

    def step(self, actions: Array) -> tuple[Array, Array, Array, Array, dict[str, Any]]:
        """Advance all by a control period, except those that start again."""
        found_actions = _checked(actions, (self.num_envs, self._task.actions))
        anew = self._ended.copy()
        if self._mode is AutoresetMode.DISABLED and anew.any():
            raise InputError(
                "step",
                f"is not possible: episodes {shown(np.flatnonzero(anew))} have ended",
                "reset them first, by reset(options={'reset_mask': terminated | truncated})",
            )
        found = self._task.step(found_actions)
        self._steps += 1
        reward = np.where(anew, 0.0, found.reward)
        terminated = found.terminated & ~anew
        truncated = (self._steps >= self._longest) & ~anew
        self._ended = terminated | truncated
        observation = found.observation.astype(np.float32)
        info: dict[str, Any] = {}
        if self._mode is AutoresetMode.SAME_STEP:
            anew = self._ended.copy()
            for run in np.flatnonzero(anew):
                last = {"final_obs": observation[run].copy(), "final_info": {}}
                info = self._add_info(info, last, run)
        if anew.any():
            self._begin(anew)
            observation[anew] = self._task.observed()[anew]
        return observation, reward, terminated, truncated, info

    def _mask(self, options: dict[str, Any] | None) -> NDArray[np.bool_]:
        """Return which environments are reset (num_envs,)."""
        options = _options(options, ("reset_mask",))
        if "reset_mask" not in options:
            return np.ones(self.num_envs, bool)
        mask = options["reset_mask"]
        whole = isinstance(mask, np.ndarray) and mask.dtype == np.bool_
        if not whole or mask.shape != (self.num_envs,) or not mask.any():
            raise InputError(
                "options['reset_mask']",
                f"is {shown(mask)}",
                f"give a NumPy array of {self.num_envs} truth values, one of them True",
            )
        if not self._randoms and not mask.all():
            raise InputError(
                "options['reset_mask']",
                f"is {shown(mask)}, but no episode has begun",
                "reset all environments first",
            )
        return mask

    def _seed(self, seeds: Sequence[int | None], which: Array) -> None:
        """Create generators for reset environments that have a seed, or had no generator."""
        begun = bool(self._randoms)
        if not begun:
            self._randoms = [seeding.np_random(each)[0] for each in seeds]
        for run in np.flatnonzero(which).tolist() if begun else ():
            if seeds[run] is not None:
                self._randoms[run] = seeding.np_random(seeds[run])[0]

    def _begin(self, which: Array) -> None:
        runs = np.flatnonzero(which)
        self._task.begin(runs.tolist(), [self._randoms[run] for run in runs])
        self._steps[which], self._ended[which] = 0, False


def _check_not_rendered(render_mode: Any) -> None:
    """Raise InputError for any render mode, as there is none."""
    if render_mode is not None:
        raise InputError(
            "render_mode",
            f"is {shown(render_mode)}, but these environments render nothing",
            "leave it out, and see a flight by simulate and continuair view",
        )


def _options(given: dict[str, Any] | None, known: Sequence[str]) -> dict[str, Any]:
    """Return the options of a reset; raises InputError if one is unknown."""
    for name in given or {}:
        if name not in known:
            remedy = nearest(str(name), known) if known else "there are none"
            raise InputError("options", f"holds {shown(name)}", remedy)
    return given or {}


def _autoreset_mode(value: Any) -> AutoresetMode:
    if isinstance(value, AutoresetMode):
        return value
    return AutoresetMode(checks.choice("autoreset_mode", value, [m.value for m in AutoresetMode]))


def _checked(action: Any, shape: tuple[int, int]) -> Array:
    """Return an action, or those of all runs, as rows (runs, actions)."""
    found = checks.finite_array(action)
    if found is None:
        raise InputError("action", f"is {shown(action)}", "give finite numbers from -1 to 1")
    if found.shape not in (shape, shape[1:] if shape[0] == 1 else shape):
        raise InputError(
            "action",
            f"is {shown(action)}, of shape {found.shape}",
            f"give numbers of shape {shape}",
        )
    return found.reshape(shape)


gymnasium.register(
    id="continuair/Hover-v0",
    entry_point="continuair.interfaces.gym:HoverEnv",
    vector_entry_point="continuair.interfaces.gym:HoverVectorEnv",
    max_episode_steps=EPISODE,
)
