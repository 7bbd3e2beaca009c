"""Invalid input raises an error with the argument's name and the allowed values."""

from dataclasses import replace

import numpy as np
import pytest

from relpos_env.api.gym_env import FormationGymEnv
from relpos_env.api.sb3_vec_env import FormationVecEnv
from relpos_env.api.vector_env import FormationVectorEnv
from relpos_env.config import FormationConfig
from relpos_env.errors import EnvError
from relpos_env.formation_v0 import parallel_env
from relpos_env.scenarios import SCENARIOS
from relpos_env.sensors.operator import OperatorSimParams

BAD_ARGUMENTS = [
    ({"scenario": "moon"}, "scenario: expected one of .* got 'moon'"),
    ({"scenario": "human"}, "scenario: 'human' has a person"),
    ({"scenario": "nowhere.toml"}, "scenario: cannot read 'nowhere.toml'"),
    ({"scenario": 7}, "scenario: expected a name, a path or a scenario, got 7"),
    ({"scenario": "hall", "task": "gap"}, "scenario: task 'gap' expected one with a gap"),
    ({"observation": "all"}, "observation: expected one of estimate, .* got 'all'"),
    (
        {"actions": "smooth"},
        "actions: expected one of continuous, discrete or .*:Name, got 'smooth'",
    ),
    ({"filter": "magic"}, "filter: expected one of"),
    ({"task": "none"}, "task: expected one of ring, .* got 'none'"),
    (
        {"task": "ring", "task_options": {"colour": 1}},
        "task_options: .* got 'colour'",
    ),
    ({"task": "ring", "task_options": {"half_axes": (1.0, -1.0)}}, "half_axes: expected"),
    ({"weights": {"beauty": 1.0}}, "weights: expected terms among"),
    ({"weights": {"formation": np.nan}}, "weights: formation"),
    ({"n_cars": 1}, "n_cars: expected a whole number from 2 to 20, got 1"),
    ({"n_cars": 99}, "n_cars: expected a whole number from 2 to 20, got 99"),
    ({"n_cars": 2.5}, "n_cars: expected a whole number"),
    ({"n_cars": True}, "n_cars: expected a whole number"),
    ({"scenario": "gap", "n_cars": 20}, "n_cars|cars"),
    ({"level": 5}, "level: expected 0 to 4 or one of easy, medium, hard, expert, got 5"),
    ({"level": "tough"}, "level: expected 0 to 4 or one of easy, .*, got 'tough'"),
    ({"level": True}, "level: expected 0 to 4 or one of easy, .*, got True"),
    ({"max_cycles": 0}, "max_cycles: expected a whole number from 1 to"),
    ({"max_cycles": 1.5}, "max_cycles: expected a whole number"),
    ({"history": 0}, "history: expected a whole number from 1 to 64, got 0"),
    ({"render_mode": "ansi"}, "render_mode: expected None, rgb_array or human, got 'ansi'"),
    (
        {"task": "ring", "task_options": {"room": (9.0, 9.0)}},
        "task_options: .* got 'room'",
    ),
    ({"task": "gap", "task_options": {"gap": 0.8}}, "gap: expected a relpos_env.scenarios.Gap"),
    ({"task_options": None}, "task_options: expected Mapping, got None"),
    ({"weights": ["collision"]}, "weights: expected Mapping or None, got"),
    ({"params": {"a": 1}}, "params: expected TrackerParams or None, got"),
    ({"operator": {}}, "operator: expected OperatorSimParams, got"),
    ({"end_on_collision": "no"}, "end_on_collision: expected bool, got 'no'"),
    ({"task": ["ring"]}, "task: expected one of ring"),
    ({"observation": ["estimate"]}, "observation: expected one of estimate"),
    ({"filter": ["joint"]}, "filter: expected one of joint"),
    ({"task": "travel", "task_options": {"closed": "no"}}, "closed: expected True or False"),
    ({"task": "travel", "task_options": {"turning": 1}}, "turning: expected True or False"),
    (
        {"task": "gap", "task_options": {"waypoints": [[3, 0], [3, 1]]}},
        "waypoints: .* the first one before the wall",
    ),
    ({"frames": 3}, "unexpected keyword argument 'frames', expected one of scenario, task"),
]


@pytest.mark.parametrize(("kwargs", "message"), BAD_ARGUMENTS)
@pytest.mark.parametrize("form", [parallel_env, FormationGymEnv, FormationVectorEnv])
def test_bad_arguments_are_named(form, kwargs, message):
    with pytest.raises(EnvError, match=message):
        form(**kwargs)


def test_whole_numbers_of_numpy_are_whole_numbers():
    env = parallel_env(n_cars=np.int64(4), max_cycles=np.int32(3), history=np.int8(2))
    assert len(env.possible_agents) == 4
    env.reset(seed=0)


def test_an_environment_does_not_change_its_arguments():
    options = {"half_axes": (1.0, 1.0)}
    config = FormationConfig(task_options=options)
    config.resolve()
    assert options == {"half_axes": (1.0, 1.0)}
    assert config == FormationConfig(task_options={"half_axes": (1.0, 1.0)})


@pytest.mark.parametrize("n", [0, -1, 1.5, "2"])
def test_impossible_numbers_of_environments_are_named(n):
    with pytest.raises(EnvError, match="num_envs: expected a whole number from 1"):
        FormationVectorEnv(n)


@pytest.mark.parametrize("threads", [0, 3, 1.0])
def test_impossible_numbers_of_threads_are_named(threads):
    with pytest.raises(EnvError, match="threads: expected a whole number from 1 to 2"):
        FormationVectorEnv(2, threads=threads)


BAD_ACTIONS = [
    (lambda a: a.pop("car_1"), "actions: none for car_1"),
    (lambda a: a.update(car_1=np.zeros(3)), r"action of car_1: expected shape \(2,\), got \(3,\)"),
    (lambda a: a.update(car_1=0.5), r"action of car_1: expected shape \(2,\), got \(\)"),
    (
        lambda a: a.update(car_2=np.array([np.nan, 0])),
        "action of car_2: expected finite .* got nan",
    ),
    (lambda a: a.update(car_0=np.array([0, -np.inf])), "action of car_0: expected finite"),
    (lambda a: a.update(car_0=["a", "b"]), "action of car_0: expected numbers"),
]


@pytest.mark.parametrize(("change", "message"), BAD_ACTIONS)
def test_bad_actions_are_named(change, message):
    env = parallel_env(max_cycles=5)
    env.reset(seed=0)
    actions = {a: np.zeros(2, np.float32) for a in env.agents}
    change(actions)
    before = env.state()
    with pytest.raises(EnvError, match=message):
        env.step(actions)
    assert np.array_equal(env.state(), before)


def test_actions_beyond_all_reason_are_clipped():
    envs = [parallel_env(max_cycles=5) for _ in range(2)]
    for env, most in zip(envs, (1.0, 1e308), strict=True):
        env.reset(seed=0)
        env.step({a: np.full(2, most) for a in env.agents})
    assert np.array_equal(envs[0].state(), envs[1].state())


@pytest.mark.parametrize("action", [15, -1, 2.0, np.nan, "left"])
def test_bad_discrete_actions_are_named(action):
    env = parallel_env(actions="discrete")
    env.reset(seed=0)
    actions = dict.fromkeys(env.agents, 3)
    actions["car_1"] = action
    with pytest.raises(EnvError, match="action of car_1: expected whole numbers from 0 to 14"):
        env.step(actions)


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        (np.zeros((2, 5)), r"actions: expected shape \(2, 6\), got \(2, 5\)"),
        (np.zeros(6), r"actions: expected shape \(2, 6\), got \(6,\)"),
        (np.full((2, 6), np.nan), "actions: expected finite numbers, got nan"),
        (None, r"actions: expected shape \(2, 6\)"),
    ],
)
def test_bad_actions_of_a_vector_are_named(actions, message):
    env = FormationVectorEnv(2)
    env.reset(seed=0)
    with pytest.raises(EnvError, match=message):
        env.step(actions)


def test_bad_actions_of_the_gymnasium_form_are_named():
    env = FormationGymEnv(actions="discrete")
    env.reset(seed=0)
    with pytest.raises(EnvError, match=r"action: expected shape \(3,\), got \(2,\)"):
        env.step(np.zeros(2, int))
    with pytest.raises(EnvError, match="action: expected whole numbers from 0 to 14"):
        env.step(np.full(3, 15))


@pytest.mark.parametrize("value", [1.0, 7.0, 1e300])
def test_actions_beyond_the_space_are_clipped(value):
    env = parallel_env(max_cycles=5)
    results = []
    for size in (1.0, value):
        env.reset(seed=0)
        env.step({a: np.array([size, -size]) for a in env.agents})
        results.append(env.state().tolist())
    assert results[0] == results[1]


@pytest.mark.parametrize("seeds", [[1, 2], [1, 2, 3, 4], []])
def test_wrong_numbers_of_seeds_are_named(seeds):
    env = FormationVectorEnv(3)
    with pytest.raises(EnvError, match=f"seed: expected 3 seeds, got {len(seeds)}"):
        env.reset(seed=seeds)


def test_masks_of_resets_are_checked():
    env = FormationVectorEnv(3)
    with pytest.raises(EnvError, match="reset_mask: expected True everywhere at the first reset"):
        env.reset(options={"reset_mask": [True, False, True]})
    env.reset(seed=0)
    for mask in ([True, False], [False, False, False]):
        with pytest.raises(EnvError, match="reset_mask: expected 3 flags, some True"):
            env.reset(options={"reset_mask": mask})


def test_a_vector_has_no_window():
    with pytest.raises(EnvError, match="render_mode: expected None or rgb_array, got 'human'"):
        FormationVectorEnv(2, render_mode="human")


FORMS = [
    (parallel_env, {"car_0": np.zeros(2)}),
    (FormationGymEnv, np.zeros(6)),
    (FormationVectorEnv, np.zeros((1, 6))),
]


@pytest.mark.parametrize(("form", "action"), FORMS)
def test_step_before_reset(form, action):
    env = form()
    with pytest.raises(EnvError, match="must be reset first"):
        env.step(action)


@pytest.mark.parametrize(("form", "action"), FORMS[:2])
def test_nothing_can_be_asked_before_the_reset(form, action):
    env = form(render_mode="rgb_array")
    with pytest.raises(EnvError, match="must be reset first"):
        _ = env.formation
    env.reset(seed=0)
    env.close()
    with pytest.raises(EnvError, match="must be reset first"):
        env.step(action)


def test_a_log_without_record_is_refused():
    env = parallel_env()
    env.reset(seed=0)
    with pytest.raises(EnvError, match="record: expected True"):
        env.recorded_log("x")


def test_a_scenario_as_an_object():
    assert parallel_env(scenario=SCENARIOS["hall"]).scenario is SCENARIOS["hall"]


def test_seats_are_checked():
    pytest.importorskip("stable_baselines3")
    from relpos_env.api.sb3_vec_env import FormationVecEnv

    with pytest.raises(EnvError, match="n_envs: expected a whole number from 1"):
        FormationVecEnv(0)
    env = FormationVecEnv(2)
    with pytest.raises(EnvError, match="must be reset first"):
        env.step(np.zeros((6, 2)))
    env.reset()
    with pytest.raises(EnvError, match=r"actions: expected shape \(6, 2\), got \(3, 2\)"):
        env.step(np.zeros((3, 2)))
    with pytest.raises(EnvError, match="actions: expected finite"):
        env.step(np.full((6, 2), np.inf))


def test_flags_and_numbers_that_are_none_are_named():
    with pytest.raises(EnvError, match="record: expected True or False"):
        parallel_env(record="no")
    with pytest.raises(EnvError, match="with_truth: expected True or False"):
        FormationVecEnv(with_truth="no")
    with pytest.raises(EnvError, match="operator gain: expected at least 0, finite, got None"):
        OperatorSimParams(gain=None)
    with pytest.raises(EnvError, match="obstacles: expected a tuple"):
        replace(SCENARIOS["rooms-5x5"], obstacles=[])


def test_slots_are_for_as_many_cars_as_can_be_there():
    drawn = replace(SCENARIOS["open"].randomisation, n_cars=(2, 3))
    scenario = replace(SCENARIOS["open"], randomisation=drawn)
    assert FormationConfig(scenario=scenario).resolve().n_cars == 3
    assert FormationConfig(scenario="open").resolve().n_cars == SCENARIOS["open"].n_cars


def test_what_is_written_into_an_info_stays_there():
    env = FormationVecEnv(n_envs=1, max_cycles=5)
    env.reset()
    for _ in range(2):
        *_, infos = env.step(np.zeros((env.num_envs, 2), np.float32))
        assert all("mine" not in info for info in infos)
        infos[0]["mine"] = 1
    assert all("mine" not in info for info in env.reset_infos)


FORMS_OF_ONE = [parallel_env, FormationGymEnv]


@pytest.mark.parametrize("options", [5, [1], "goals"])
@pytest.mark.parametrize("form", [*FORMS_OF_ONE, lambda: FormationVectorEnv(2)])
def test_options_that_are_no_dict_are_named(form, options):
    with pytest.raises(EnvError, match="options: expected a dict, got"):
        form().reset(seed=0, options=options)


@pytest.mark.parametrize("form", [*FORMS_OF_ONE, lambda: FormationVectorEnv(2)])
def test_a_scenario_of_another_type_is_named(form):
    with pytest.raises(EnvError, match="options: scenario: expected a name, .*, got 5"):
        form().reset(seed=0, options={"scenario": 5})


@pytest.mark.parametrize("seed", [1.5, "a", True, -1, [0, -1], [0, "b"]])
def test_seeds_of_batches_that_are_no_whole_numbers_are_named(seed):
    with pytest.raises(EnvError, match="seed: expected a whole number of at least 0, got"):
        FormationVectorEnv(2).reset(seed=seed)
