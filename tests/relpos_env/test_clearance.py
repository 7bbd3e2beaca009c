"""Clearance of cars: properties of the kernel, and values for cars in a room."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from relpos_env.formation_v0 import parallel_env
from relpos_env.geometry._clearance_kernels import FARTHEST, gap, read_clearances
from relpos_env.scenarios.rooms.overlap import distance, overlap
from relpos_env.world.pymunk_space import CAR_RADIUS, WALL_RADIUS

boxes = st.tuples(
    st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(0.05, 0.8), st.floats(0.05, 0.8),
    st.floats(-4.0, 4.0),
)  # fmt: skip


def row(x, y, half_l, half_w, angle):
    return np.array([x, y, half_l, half_w, np.cos(angle), np.sin(angle)])


def outline(box, n=400):
    """Return points along the edges of a box."""
    x, y, half_l, half_w, c, s = box
    share = np.linspace(-1.0, 1.0, n)
    one = np.ones(n)
    a = half_l * np.concatenate([share, share, one, -one])
    b = half_w * np.concatenate([one, -one, share, share])
    return np.stack([x + c * a - s * b, y + s * a + c * b], axis=1)


@given(a=boxes, b=boxes)
@settings(max_examples=200)
def test_the_gap_of_two_rectangles_is_that_of_their_outlines(a, b):
    a, b = row(*a), row(*b)
    offset = b[:2] - a[:2]
    found = gap(*offset, a[4], a[5], a[2], a[3], b[4], b[5], b[2], b[3])
    back = gap(*-offset, b[4], b[5], b[2], b[3], a[4], a[5], a[2], a[3])
    assert abs(found - back) < 1e-12
    if not overlap(a[None], b[None])[0, 0]:
        assert abs(found - distance(outline(a), b).min()) < 3e-3


def clearances(poses, room=(5.0, 3.0), box=None, present=None):
    body = np.zeros((1, len(poses), 6))
    body[0, :, :3] = poses
    out = np.full((1, len(poses)), np.nan)
    present = np.ones((1, len(poses)), bool) if present is None else np.array([present])
    standing = np.zeros((1, 1, 6)) if box is None else box[None, None]
    half = np.array([[0.5 * room[0], 0.5 * room[1]]])
    read_clearances(body, present, np.array([[0.15, 0.1]]), half, standing, out)
    return out[0]


def test_the_nearest_of_walls_boxes_and_cars_counts():
    np.testing.assert_allclose(clearances([(0.0, 0.0, 0.3)]), FARTHEST)
    # A wall ahead, and one next to a car that is rotated by a right angle.
    wall = 0.2 - CAR_RADIUS - WALL_RADIUS
    np.testing.assert_allclose(clearances([(2.5 - 0.15 - 0.2, 0.0, 0.0)]), wall)
    np.testing.assert_allclose(clearances([(2.5 - 0.10 - 0.2, 0.0, np.pi / 2)]), wall)
    # Two cars one behind the other; an absent car is near no one.
    pair = [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0)]
    np.testing.assert_allclose(clearances(pair), 0.2 - 2.0 * CAR_RADIUS)
    np.testing.assert_allclose(clearances(pair, present=[True, False]), FARTHEST)
    box = row(0.0, 0.4, 0.2, 0.1, 0.0)
    np.testing.assert_allclose(clearances([(0.0, 0.0, 0.0)], box=box), 0.2 - CAR_RADIUS)
    np.testing.assert_allclose(clearances([(0.0, 0.25, 0.0)], box=box), 0.0)


def test_a_car_that_presses_on_a_wall_has_no_room_and_is_told_so_at_every_decision():
    env = parallel_env(scenario="cars-los", task="hold", max_cycles=120)
    env.reset(seed=0)
    for _ in range(90):
        env.step({a: np.array([0.6, 0.0], np.float32) for a in env.agents})
    formation = env.formation
    pressing = 0
    for _ in range(10):
        env.step({a: np.array([0.6, 0.0], np.float32) for a in env.agents})
        nearness = formation.task.rewards[0, :, formation.task.terms.index("nearness")]
        clear = formation.state.clearance[0]
        assert np.array_equal(nearness == -1.0, clear == 0.0)
        pressing += int((clear == 0.0).any())
    assert pressing == 10


def test_to_crash_is_not_the_cheapest_end():
    """If time costs, a contact that ends the episode costs the remaining time."""
    arguments = {"task": "gap", "max_cycles": 150, "end_on_collision": True}
    env = parallel_env(**arguments)
    env.reset(seed=3)
    paid, steps = 0.0, 0
    while env.agents:
        _, _, ends, _, infos = env.step({a: np.array([1.0, 0.3], np.float32) for a in env.agents})
        paid += infos["car_0"]["reward_time"] / env.formation.weights[-1]
        steps += 1
    assert any(ends.values())
    assert steps < 150
    assert paid == -150.0
