"""The learning environments: what Gymnasium asks of them, and the physics of what they tell."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.interfaces.hovering import BOUND, ROTORS, default_vehicle
from tests.refusals import refused
from tests.sections.strains import flying, rod

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402

import continuair.interfaces.gym  # noqa: E402, F401

Array = np.ndarray
HOVER = "continuair/Hover-v0"
ONE_SECTION = ca.load_vehicle("slender").replace(
    {"uav.rotors": ROTORS | {"thrust_limits": (0.0, 12.0)}, "arm.damping_ratio": 0.05}
)


def vector(count: int, **options: Any) -> Any:
    return gymnasium.make_vec(HOVER, num_envs=count, vehicle=ONE_SECTION, **options)


@pytest.mark.long
@pytest.mark.filterwarnings("error", "ignore:.*infinity")
@pytest.mark.parametrize("options", [{}, {"vehicle": ONE_SECTION, "bend_moment": 0.5}])
def test_gymnasium_finds_no_fault_with_the_environment(options: dict[str, Any]) -> None:
    env = gymnasium.make(HOVER, **options)
    check_env(env.unwrapped, skip_render_check=True)


@pytest.mark.long
def test_stepped_together_environments_do_what_they_do_one_by_one() -> None:
    """Ends and new beginnings included: thrusts at random let episodes end soon."""
    together, apart = vector(5), vector(5, vectorization_mode="sync")
    actions = np.random.default_rng(1).uniform(-1.0, 1.0, (100, *together.action_space.shape))
    seen, expected = together.reset(seed=3)[0], apart.reset(seed=3)[0]
    ended = 0
    for action in actions.astype(np.float32):
        np.testing.assert_allclose(seen, expected, rtol=1e-6, atol=1e-6)
        found, wanted = together.step(action), apart.step(action)
        seen, expected = found[0], wanted[0]
        np.testing.assert_allclose(found[1], wanted[1], rtol=1e-6, atol=1e-6)
        for mine, theirs in zip(found[2:4], wanted[2:4], strict=True):
            np.testing.assert_array_equal(mine, theirs)
        ended += int(found[2].sum())
    assert ended >= 5


def test_an_episode_is_cut_off_after_its_steps_and_begins_anew() -> None:
    env = vector(2, max_episode_steps=3, disturbance=0.0, hold="uav")
    first = env.reset(seed=0)[0]
    hover = _hover_action(ONE_SECTION, 2)
    cut = [env.step(hover)[3].tolist() for _ in range(3)]
    assert cut == [[False, False], [False, False], [True, True]]
    again, reward, _, truncated, _ = env.step(hover)
    np.testing.assert_array_equal(again, first)
    assert not reward.any() and not truncated.any()


@pytest.mark.long
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_each_mode_of_autoreset_does_what_gymnasium_does(mode: str) -> None:
    """Observations, rewards, ends and last observations; Gymnasium steps single environments."""
    mine = vector(4, autoreset_mode=mode)
    theirs = vector(4, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode})
    assert mine.metadata["autoreset_mode"] is theirs.metadata["autoreset_mode"]
    mine.reset(seed=5), theirs.reset(seed=5)
    actions = np.random.default_rng(2).uniform(-1.0, 1.0, (100, *mine.action_space.shape))
    ended = 0
    for action in actions.astype(np.float32):
        found, wanted = mine.step(action), theirs.step(action)
        for one, other in zip(found[:4], wanted[:4], strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-6)
        assert found[4].keys() == wanted[4].keys()
        for run in np.flatnonzero(found[4].get("_final_obs", [])):
            last, expected = (each[4]["final_obs"][run] for each in (found, wanted))
            np.testing.assert_allclose(last, expected, rtol=1e-6, atol=1e-6)
            assert np.linalg.norm(last[:3]) > BOUND
        if "final_info" in wanted[4]:
            np.testing.assert_array_equal(found[4]["_final_info"], wanted[4]["_final_info"])
        ended += int(found[2].sum())
    assert ended >= 4


def test_without_autoreset_ended_episodes_are_reset_by_a_mask() -> None:
    env = vector(2, autoreset_mode="Disabled", max_episode_steps=3)
    env.reset(seed=0)
    for _ in range(3):
        seen, _, terminated, truncated, _ = env.step(_hover_action(ONE_SECTION, 2))
    assert truncated.all()
    with refused("step"):
        env.step(_hover_action(ONE_SECTION, 2))
    again, _ = env.reset(options={"reset_mask": terminated | truncated})
    assert not np.array_equal(again, seen)
    assert not env.step(_hover_action(ONE_SECTION, 2))[3].any()


@pytest.mark.long
def test_a_mask_resets_its_environments_and_leaves_the_others_as_they_are() -> None:
    env, same = vector(3), vector(3)
    mask = np.array([False, True, False])
    for each in (env, same):
        each.reset(seed=1)
        for _ in range(5):
            before = each.step(_hover_action(ONE_SECTION, 3))[0]
    after, _ = env.reset(options={"reset_mask": mask}, seed=[None, 40, None])
    np.testing.assert_array_equal(after[~mask], before[~mask])
    np.testing.assert_array_equal(after[1], gymnasium_start(40))
    stepped, expected = (each.step(_hover_action(ONE_SECTION, 3))[0] for each in (env, same))
    np.testing.assert_array_equal(stepped[~mask], expected[~mask])
    # Only the step count of what was reset begins anew.
    for _ in range(500 - 6):
        truncated = env.step(_hover_action(ONE_SECTION, 3))[3]
        assert not truncated[1]
    # Without a seed, the generators go on: another start.
    later, _ = env.reset(options={"reset_mask": mask})
    assert not np.array_equal(later[1], after[1])


def gymnasium_start(seed: int) -> Array:
    found: Array = gymnasium.make(HOVER, vehicle=ONE_SECTION).reset(seed=seed)[0]
    return found


def test_a_masked_reset_takes_back_the_reset_of_the_next_step() -> None:
    env = vector(2, max_episode_steps=2)
    env.reset(seed=0)
    for _ in range(2):
        _, _, _, truncated, _ = env.step(_hover_action(ONE_SECTION, 2))
    assert truncated.all()
    begun, _ = env.reset(options={"reset_mask": np.array([True, False])})
    stepped, reward, *_ = env.step(_hover_action(ONE_SECTION, 2))
    assert reward[0] > 0.0 and reward[1] == 0.0
    assert not np.array_equal(stepped[0], begun[0])


@pytest.mark.parametrize(
    "options",
    [
        {"mask": np.array([True, False])},
        {"reset_mask": [True, False]},
        {"reset_mask": np.array([1, 0])},
        {"reset_mask": np.array([True])},
        {"reset_mask": np.array([False, False])},
    ],
)
def test_options_of_a_reset_that_mean_nothing_are_refused(options: dict[str, Any]) -> None:
    env = vector(2)
    env.reset(seed=0)
    field = "options" if "mask" in options else "options['reset_mask']"
    with refused(field):
        env.reset(options=options)
    one = gymnasium.make(HOVER, vehicle=ONE_SECTION, disable_env_checker=True)
    with refused("options"):
        one.reset(options=options)


def test_a_mask_before_the_first_reset_is_refused() -> None:
    with refused("options['reset_mask']"):
        vector(2).reset(options={"reset_mask": np.array([True, False])})


@pytest.mark.long
@pytest.mark.parametrize("copied", [copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))])
@pytest.mark.parametrize("count", [1, 3])
def test_a_copy_continues_as_the_original_does(copied: Callable[[Any], Any], count: int) -> None:
    env: Any = vector(3) if count == 3 else gymnasium.make(HOVER, vehicle=ONE_SECTION)
    env.reset(seed=4)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (60, *env.action_space.shape))
    for action in actions[:5]:
        env.step(action)
    other = copied(env)

    def flown(each: Any) -> list[Any]:
        """Steps, and where an episode ends, also starts that are drawn."""
        rows = []
        for action in actions:
            seen, reward, terminated, *_ = each.step(action)
            rows.append(np.append(np.ravel(seen), reward))
            if count == 1 and terminated:
                rows.append(each.reset()[0])
        return rows

    for one, same in zip(flown(env), flown(other), strict=True):
        np.testing.assert_array_equal(one, same)


def test_modes_of_rendering_are_refused() -> None:
    for mode in ("rgb_array", "human"):
        with refused("render_mode"):
            gymnasium.make_vec(HOVER, num_envs=2, vehicle=ONE_SECTION, render_mode=mode)
        with (
            refused("render_mode"),
            pytest.warns(UserWarning, match="render"),
        ):
            gymnasium.make(HOVER, vehicle=ONE_SECTION, render_mode=mode)


def test_a_seed_makes_the_same_start_and_another_another() -> None:
    env = gymnasium.make(HOVER, vehicle=ONE_SECTION)
    first, other, same = (env.reset(seed=seed)[0] for seed in (7, 8, 7))
    np.testing.assert_array_equal(first, same)
    assert not np.array_equal(first, other)
    # A vector's environments are seeded one after the other.
    for seven in (7, np.int64(7)):
        np.testing.assert_array_equal(vector(2).reset(seed=seven)[0], [first, other])


def test_an_undisturbed_hover_stays_at_its_goal() -> None:
    for hold in ("tip", "uav"):
        env = vector(1, disturbance=0.0, hold=hold)
        seen, _ = env.reset(seed=0)
        for _ in range(25):
            seen, reward, *_ = env.step(_hover_action(ONE_SECTION, 1))
        assert np.abs(seen[0, :3]).max() < 1e-6
        assert reward[0] == pytest.approx(1.0, abs=1e-6)


def _hover_action(vehicle: ca.Vehicle, count: int) -> Array:
    assert vehicle.uav.rotors is not None
    thrust = 9.81 * float(vehicle.mass) / vehicle.uav.rotors.count
    share = 2.0 * thrust / vehicle.uav.rotors.highest - 1.0
    return np.full((count, vehicle.uav.rotors.count), share)


@pytest.mark.long
def test_a_law_on_what_is_observed_brings_disturbed_vehicles_to_their_goal() -> None:
    """Force towards the goal, attitude towards the force: each sign and unit takes part."""
    vehicle = default_vehicle()
    env = gymnasium.make_vec(HOVER, num_envs=4, hold="uav")
    seen, _ = env.reset(seed=0)
    for _ in range(250):
        seen, _, terminated, truncated, _ = env.step(_law(vehicle, seen.astype(float)))
        assert not terminated.any() and not truncated.any()
    assert np.linalg.norm(seen[:, :3], axis=1).max() < 0.05


def _law(vehicle: ca.Vehicle, seen: Array) -> Array:
    rotors, mass = vehicle.uav.rotors, float(vehicle.mass)
    assert rotors is not None
    way, turn, velocity, spin = (
        seen[:, :3],
        seen[:, 3:12].reshape(-1, 3, 3),
        seen[:, 12:15],
        seen[:, 15:18],
    )
    force = mass * (1.5 * way - 2.0 * velocity + np.array([0.0, 0.0, 9.81]))
    up = turn[:, :, 2]
    wanted = force / np.linalg.norm(force, axis=1, keepdims=True)
    lean = np.einsum("nji,nj->ni", turn, np.cross(up, wanted))
    moment = np.array([0.05, 0.05, 0.035]) * (16.0 * lean - 6.0 * spin)
    lift = np.einsum("ni,ni->n", force, up)
    wrench = np.column_stack([np.zeros((len(seen), 2)), lift, moment])
    return 2.0 * rotors.thrusts_for(wrench) / rotors.highest - 1.0


def test_an_episode_ends_beyond_the_bound() -> None:
    env = vector(1, disturbance=0.0)
    env.reset(seed=0)
    for _ in range(100):
        seen, reward, terminated, *_ = env.step(-np.ones((1, 4)))
        if terminated[0]:
            break
    assert BOUND < np.linalg.norm(seen[0, :3]) < BOUND + 0.2
    assert reward[0] == 0.0


def test_bend_moments_bend_the_arm_along_their_axes() -> None:
    env = vector(2, disturbance=0.0, bend_moment=0.2)
    env.reset(seed=0)
    hover = _hover_action(ONE_SECTION, 2)
    for _ in range(5):
        seen, *_ = env.step(np.hstack([hover, np.array([[1.0, 0.0], [0.0, 1.0]])]))
    bends = seen[:, 18:20]
    assert bends[0, 0] > 0.01 and bends[1, 1] > 0.01
    assert np.abs(bends[[0, 1], [1, 0]]).max() < 1e-6


def test_sections_of_any_kind_are_seen_as_simulate_returns_them() -> None:
    """An arc beyond a linear strain: bent alike at the start, then moved by their moments."""
    rotors = ROTORS | {"lag": 0.0}
    arm = flying(rod(bending=1, nodes=4), rod()).replace({"uav.rotors": rotors})
    env = gymnasium.make_vec(HOVER, num_envs=1, vehicle=arm, hold="uav", bend_moment=0.1)
    first = env.reset(seed=0)[0][0]
    assert np.all(first[[18, 20, 22, 23]]) and not first[[19, 21, *range(24, 30)]].any()
    task = gymnasium.make_vec(
        HOVER, num_envs=1, vehicle=arm, hold="uav", bend_moment=0.1, disturbance=0.0
    )
    task.reset(seed=0)
    action = np.array([[0.2, 0.3, 0.1, 0.25, 1.0, -0.5, 0.3, 0.2, 0.4, -0.8]])
    for _ in range(3):
        seen, *_ = task.step(action)
    held = ca.Scenario(
        "held", np.zeros(12), rotor_command=5.0 * (1.0 + action[0, :4]),
        bend_moment=0.1 * action[0, 4:], duration=0.06,
    )  # fmt: skip
    flight = ca.simulate(arm, held, sample=0.02, rtol=1e-9, atol=1e-11).isel(time=-1)
    wanted = np.concatenate([flight["strain"], flight["strain_rate"]])
    assert np.abs(wanted).min() > 1e-3
    np.testing.assert_allclose(seen[0, 18:30], wanted, rtol=1e-4, atol=1e-5)


def test_every_environment_may_have_a_vehicle_of_its_own() -> None:
    masses = np.array([1.8, 2.0, 2.2])
    env = gymnasium.make_vec(
        HOVER, num_envs=3, vehicle=ONE_SECTION.replace({"uav.mass": masses}), disturbance=0.0
    )
    env.reset(seed=0)
    for _ in range(10):
        seen, *_ = env.step(_hover_action(ONE_SECTION, 3))
    # The way to the goal is upwards for what is too heavy for the thrust.
    assert seen[0, 2] < -1e-3 < np.abs(seen[1, 2]) < 1e-6 + 1e-3 < seen[2, 2]


def test_speeds_seen_are_those_whose_squares_give_the_thrust_also_without_lag() -> None:
    lag = np.array([0.0, 0.01])
    env = gymnasium.make_vec(
        HOVER, num_envs=2, vehicle=ONE_SECTION.replace({"uav.rotors.lag": lag}), period=0.1
    )
    env.reset(seed=0)
    thrusts = np.array([0.0, 3.0, 6.0, 12.0])
    seen, *_ = env.step(np.tile(thrusts / 6.0 - 1.0, (2, 1)).astype(np.float32))
    wanted = np.sqrt(thrusts / 12.0)
    np.testing.assert_allclose(seen[0, -4:], wanted, atol=1e-6)
    np.testing.assert_allclose(seen[1, -4:], wanted, atol=1e-4)


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"vehicle": "slender"}, "vehicle"),
        ({"vehicle": "no such"}, "vehicle"),
        ({"hold": "arm"}, "hold"),
        ({"bend_moment": -1.0}, "bend_moment"),
        ({"period": 0}, "period"),
        ({"model": "rigid"}, "model"),
        (
            {"vehicle": ONE_SECTION.replace({"uav.mass": np.array([2.0, 2.1])})},
            "vehicle",
        ),
    ],
)
def test_options_that_cannot_be_used_are_refused(options: dict[str, Any], field: str) -> None:
    with refused(field):
        gymnasium.make(HOVER, **options)


def test_actions_that_are_no_numbers_or_too_few_are_refused() -> None:
    env = gymnasium.make(HOVER, vehicle=ONE_SECTION, disable_env_checker=True)
    env.reset(seed=0)
    with refused("action"):
        env.step(np.array([0.0, np.nan, 0.0, 0.0]))
    with refused("action"):
        env.step(np.zeros(3))
