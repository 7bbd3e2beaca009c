"""Paths around obstacles: shortest length, and progress rewards along them."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.sparse.csgraph import shortest_path

from relpos_env.config import FormationConfig
from relpos_env.core.env_core import EnvCore
from relpos_env.tasks import make_task
from relpos_env.tasks.geometry.shortest_paths import Ways
from relpos_env.tasks.kernels.path import BERTH, CORNER

HALF = (3.0, 2.5)
WALL_ACROSS = np.array([[0.0, 0.0, 0.1, 1.0, 1.0, 0.0]])
EVERYBODY = np.ones((1, 1), dtype=bool)


def some_boxes(rng, n):
    angle = rng.uniform(0.0, np.pi, n)
    size = rng.uniform(0.1, 0.5, (n, 2))
    turn = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.hstack([rng.uniform(-1.0, 1.0, (n, 2)) * [2.2, 1.7], size, turn])


def gaps(points, box):
    """Return the distance of points from a box along the side on which they are farther."""
    d = points - box[:2]
    u, v = box[4] * d[:, 0] + box[5] * d[:, 1], box[4] * d[:, 1] - box[5] * d[:, 0]
    return np.maximum(np.abs(u) - box[2], np.abs(v) - box[3])


def sees(a, b, boxes):
    """Return whether points from a to b, 2 mm apart, are as clear of boxes as its ends."""
    line = np.linspace(a, b, 2 + int(np.linalg.norm(b - a) / 0.002))
    for box in boxes:
        gap = gaps(line, box)
        if gap.min() < np.clip(min(gap[0], gap[-1]), 0.0, BERTH) - 1e-12:
            return False
    return True


def way_twin(start, goal, boxes):
    """Return the length of the shortest path, from the visibility graph."""
    points = [start, goal]
    for box in boxes:
        turn = np.array([[box[4], box[5]], [-box[5], box[4]]])
        for sign in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            corner = box[:2] + (np.array(sign) * (box[2:4] + CORNER)) @ turn
            inside = (np.abs(corner) <= np.array(HALF) - BERTH).all()
            if inside and all(gaps(corner[None], other)[0] >= BERTH for other in boxes):
                points.append(corner)
    graph = np.zeros((len(points), len(points)))
    for i, a in enumerate(points):
        for j, b in enumerate(points[:i]):
            graph[i, j] = np.linalg.norm(a - b) if sees(a, b, boxes) else 0.0
    return shortest_path(graph, directed=False, indices=0)[1]


def followed(boxes, goal, track):
    """Return the progress of a single car along a track, (point)."""
    ways = Ways(1, 1, HALF)
    ways.lay(0, boxes)
    gained = []
    for point in track:
        ways.follow(np.array([[point]]), EVERYBODY, np.array([[goal]]), 0, 1)
        gained.append(ways.progress[0, 0])
    return np.array(gained)


def test_without_boxes_the_way_is_straight():
    track = np.random.default_rng(0).uniform(-2.0, 2.0, (50, 2))
    goal = np.array([0.5, -1.0])
    distance = np.linalg.norm(track - goal, axis=1)
    gained = followed(np.zeros((0, 6)), goal, track)
    np.testing.assert_allclose(gained, [0.0, *(distance[:-1] - distance[1:])], atol=1e-12)
    # Boxes of size zero are absent.
    np.testing.assert_array_equal(followed(np.zeros((3, 6)), goal, track), gained)


@pytest.mark.parametrize("seed", range(12))
def test_ways_are_those_of_a_graph_of_all_that_is_seen(seed):
    rng = np.random.default_rng(seed)
    boxes = some_boxes(rng, 4)
    goal = rng.uniform(-2.0, 2.0, 2)
    track = rng.uniform(-2.0, 2.0, (12, 2))
    ways = np.array([way_twin(point, goal, boxes) for point in track])
    track, ways = track[np.isfinite(ways)], ways[np.isfinite(ways)]
    gained = followed(boxes, goal, track)
    np.testing.assert_allclose(gained[1:], ways[:-1] - ways[1:], atol=1e-9)
    assert (ways >= np.linalg.norm(track - goal, axis=1) - 1e-12).all()


def test_the_seeds_above_have_ways_that_bend():
    bent = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        boxes, goal = some_boxes(rng, 4), rng.uniform(-2.0, 2.0, 2)
        bent += sum(not sees(p, goal, boxes) for p in rng.uniform(-2.0, 2.0, (12, 2)))
    assert bent > 30


@pytest.mark.parametrize("x", [-0.25, -0.6, -1.5])
def test_by_a_small_step_the_way_gets_no_more_than_that_shorter(x):
    """Starts are past the end of a wall and past its margin, and at an almost too narrow slot."""
    for goal in ([0.8, 0.0], [0.3, 0.9], [0.12, -0.4]):
        track = np.stack([np.full(201, x), np.linspace(-2.0, 2.0, 201)], axis=1)
        gained = followed(WALL_ACROSS, np.array(goal), track)
        assert np.abs(gained).max() < 0.021
        assert np.abs(gained).max() > 0.01
    for slot in (0.25, 0.3, 0.4):
        beside = np.array([[0.0, s * (1.0 + 0.5 * slot), 0.1, 1.0, 1.0, 0.0] for s in (1, -1)])
        gained = followed(beside, np.array([0.8, 0.0]), track)
        assert np.abs(gained).max() < 0.05


@pytest.mark.parametrize("axis", [0, 1])
def test_no_way_leads_between_a_box_and_a_wall_that_it_nearly_touches(axis):
    """The path goes around the other end, even if this one is nearer."""
    half = np.array(HALF)
    goal, start, box = np.zeros(2), np.zeros(2), np.array([0.0, 0.0, 0.1, 0.1, 1.0, 0.0])
    box[axis], box[2 + axis] = half[axis] - 1.2, 1.0  # 0.2 m from the wall
    goal[axis] = start[axis] = half[axis] - 0.5
    goal[1 - axis], start[1 - axis] = 0.6, -0.6
    apart = start.copy()
    apart[axis] -= 1.0
    gained = followed(box[None], goal, [start, apart])
    assert gained[1] > 0.9


def test_behind_a_wall_it_pays_to_leave_the_straight_line():
    """From before the wall to its end: farther in a straight line, nearer along the path."""
    goal, start, corner = np.array([0.8, 0.0]), np.array([-0.5, 0.1]), np.array([-0.23, 1.13])
    track = np.linspace(start, corner, 20)
    gained = followed(WALL_ACROSS, goal, track)
    assert (gained[1:] > 0.0).all()
    assert np.linalg.norm(corner - goal) > np.linalg.norm(start - goal)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_gained_is_lost_on_the_way_back(seed):
    rng = np.random.default_rng(seed)
    boxes, goal = some_boxes(rng, 3), rng.uniform(-2.0, 2.0, 2)
    there = np.cumsum(rng.normal(0.0, 0.1, (200, 2)), axis=0)
    gained = followed(boxes, goal, [*there, *there[::-1]])
    assert np.abs(gained).sum() > 1.0
    assert gained.sum() == pytest.approx(0.0, abs=1e-9)


def test_new_goals_absent_cars_and_places_out_of_reach_bring_nothing():
    across = np.array([[0.0, 0.0, 0.1, 2.5, 1.0, 0.0]])  # from wall to wall
    track = np.linspace([-2.0, 0.0], [-1.0, 0.5], 10)
    assert not followed(across, np.array([1.0, 0.0]), track).any()
    ways = Ways(2, 1, HALF)
    ways.lay(0, WALL_ACROSS)
    pos, goal = np.array([[[-1.0, 0.0], [-1.0, 0.0]]]), np.array([[[1.0, 0.0], [1.0, 0.0]]])
    both, one = np.array([[True, True]]), np.array([[True, False]])
    ways.follow(pos, both, goal, 0, 1)
    ways.follow(pos + [0.0, 0.3], one, goal, 0, 1)
    assert ways.progress[0, 0] > 0.0
    assert ways.progress[0, 1] == 0.0
    ways.follow(pos - [0.0, 0.2], both, goal, 0, 1)  # the second car is back: it starts again
    assert ways.progress[0, 0] < 0.0
    assert ways.progress[0, 1] == 0.0
    for other in ([0.1, 0.0], [0.0, 0.1]):
        ways.follow(pos + [0.0, 0.3], both, goal + other, 0, 1)
        assert not ways.progress.any()
        ways.follow(pos, both, goal, 0, 1)
        assert not ways.progress.any()
    ways.lay(0, WALL_ACROSS)  # another episode, with the same goals
    ways.follow(pos + [0.0, 0.3], both, goal, 0, 1)
    assert not ways.progress.any()


def test_nothing_is_gained_where_no_way_leads_out():
    """From into a pen to outside: the difference is paid when the car is out."""
    pen = np.array(
        [[*middle, *half, 1.0, 0.0] for middle, half in (
            ([-1.0, 0.6], [0.6, 0.1]), ([-1.0, -0.6], [0.6, 0.1]),
            ([-1.6, 0.0], [0.1, 0.6]), ([-0.4, 0.0], [0.1, 0.6]),
        )]
    )  # fmt: skip
    goal, before, after = np.array([1.0, 0.0]), np.array([0.0, 0.0]), np.array([-2.0, 1.0])
    inside = np.array([-1.0, 0.1])
    gained = followed(pen, goal, [before, inside, inside + 0.1, after])
    assert not gained[:3].any()
    assert gained[3] == pytest.approx(way_twin(before, goal, pen) - way_twin(after, goal, pen))
    assert not followed(pen, goal, [inside, before])[:2].any()


def test_rooms_do_not_know_of_each_other():
    """One room gets more boxes than there was capacity for, or fewer than before."""
    rng = np.random.default_rng(8)
    layouts = [some_boxes(rng, n) for n in (2, 5, 3)]
    goal = rng.uniform(-2.0, 2.0, (3, 1, 2))
    tracks = rng.uniform(-2.0, 2.0, (12, 3, 1, 2))
    for env, boxes in enumerate(layouts):
        points, to = tracks[:, env, 0], goal[env, 0]
        ways = np.array([way_twin(p, to, boxes) for p in points])
        assert np.isfinite(ways).sum() >= 10
        assert sum(not sees(p, to, boxes) for p in points) >= 2
    together = Ways(1, 3, HALF)
    present = np.ones((3, 1), dtype=bool)
    together.lay(0, layouts[0])
    together.follow(tracks[0], present, goal, 0, 1)
    together.lay(2, layouts[1])
    for env in (1, 2):
        together.lay(env, layouts[env])
        together.follow(tracks[0], present, goal, env, env + 1)
    others = rng.uniform(-2.0, 2.0, (3, 1, 2))
    gained = np.zeros((2, len(tracks), 3))
    for k, to in enumerate((goal, others)):
        for n, pos in enumerate(tracks):
            together.follow(pos, present, to, 0, 3)
            gained[k, n] = together.progress[:, 0]
    for env, boxes in enumerate(layouts):
        for k, to in enumerate((goal, others)):
            alone = followed(boxes, to[env, 0], tracks[:, env, 0])
            np.testing.assert_array_equal(gained[k, :, env], alone)
            assert np.abs(alone).sum() > 1.0


def test_cars_that_gather_are_paid_for_it():
    """The term of `hold` is the gain in distance, also while cars come and go."""
    parts = FormationConfig(scenario="swarm-nlos", task="hold", max_cycles=300).resolve()
    formation = EnvCore(parts, 2)
    for env in range(2):
        formation.seed(env, np.random.default_rng(env))
        formation.begin([env])
    task = formation.task
    column = task.terms.index("progress")
    assert not task.rewards[..., column].any()
    twins = [Ways(parts.n_cars, 1, tuple(0.5 * np.array(parts.scenario.room))) for _ in range(2)]
    gained = np.zeros(2)
    rng = np.random.default_rng(0)
    state = formation.state
    for env, ways in enumerate(twins):
        ways.lay(0, formation.loop.swarm.boxes[env])
        here = slice(env, env + 1)
        ways.follow(state.pos_w[here], state.present[here], task.goal_w[here], 0, 1)
    for _ in range(150):
        formation.step(
            rng.uniform(-1, 1, (2, parts.n_cars)), rng.uniform(-0.4, 0.4, (2, parts.n_cars))
        )
        for env, ways in enumerate(twins):
            here = slice(env, env + 1)
            ways.follow(state.pos_w[here], state.present[here], task.goal_w[here], 0, 1)
            np.testing.assert_array_equal(task.rewards[env, :, column], ways.progress[0])
            gained[env] += np.abs(ways.progress).sum()
    assert (gained > 1.0).all()
    formation.close()


def test_an_update_of_some_rooms_takes_nothing_from_others():
    rng = np.random.default_rng(5)
    pos = rng.uniform(-2.0, 2.0, (2, 3, 2))
    present, nothing = np.ones((2, 3), dtype=bool), np.zeros((2, 3))

    def truth(at):
        still = np.zeros((2, 3, 2))
        return SimpleNamespace(
            pos_w=at, vel_w=still, accel_w=still, clearance=nothing + 1.0, present=present
        )

    task, twin = (make_task("hold", 3, 2, (9.0, 8.0)) for _ in range(2))
    for one in (task, twin):
        one.reset(truth(pos), slice(None))
        one.update(truth(pos), np.zeros(2), nothing, slice(None))
    moved = truth(pos + 0.2)
    task.update(moved, np.zeros(2), nothing, slice(0, 1))
    task.update(moved, np.zeros(2), nothing, slice(1, 2))
    twin.update(moved, np.zeros(2), nothing, slice(None))
    assert np.abs(twin.rewards[..., 5]).min() > 0.0
    np.testing.assert_array_equal(task.rewards, twin.rewards)
