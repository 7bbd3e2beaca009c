"""Several scenarios side by side: agent slots, and independence of threads."""

import numpy as np
from small_runs import small

from agents.policies.layout import Layout
from agents.training.environments import make_rooms


def test_rooms_of_several_scenarios_share_the_seats():
    config = small(scenarios=("cars-nlos", "hall"), cars="6")
    rooms = make_rooms(config, None)
    rooms.seed(3)
    seen = rooms.reset()
    assert seen.shape == (1 * 3 + 2 * 5, Layout("estimate", 6).size)
    rooms.step_async(np.zeros((13, 2), np.float32))
    seen, rewards, dones, infos = rooms.step_wait()
    assert len(seen) == len(rewards) == len(dones) == len(infos) == 13
    again = make_rooms(config, None)
    again.seed(3)
    again.reset()
    again.step_async(np.zeros((13, 2), np.float32))
    assert np.array_equal(again.step_wait()[0], seen)


def test_rooms_are_the_same_on_any_number_of_threads():
    """One thread, as many as rooms, and more: rooms are then stepped in parts."""
    driven = []
    for threads in ("1", "2", "3"):
        config = small(scenarios=("cars-nlos", "hall"), threads=threads, envs="8")
        rooms = make_rooms(config, None)
        rooms.seed(3)
        steps = [(rooms.reset(),)]
        rng = np.random.default_rng(0)
        for _ in range(125):
            rooms.step_async(rng.uniform(-1.0, 1.0, (rooms.num_envs, 2)).astype(np.float32))
            seen, rewards, dones, infos = rooms.step_wait()
            last = [i["terminal_observation"] for i in infos if "terminal_observation" in i]
            steps.append((seen, rewards, dones, np.array(last)))
        rooms.close()
        driven.append(steps)
    assert any(step[2].any() for step in driven[0][1:])
    for other in driven[1:]:
        for a, b in zip(driven[0], other, strict=True):
            assert all(map(np.array_equal, a, b))
