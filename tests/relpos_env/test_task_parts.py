"""Parts of tasks: shapes, places, curves, options and weights."""

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from relpos_env.errors import EnvError
from relpos_env.scenarios import Gap
from relpos_env.tasks import DEFAULT_WEIGHTS, TASKS, make_task, reward_weights
from relpos_env.tasks.geometry.assignment import assign
from relpos_env.tasks.geometry.curves import CURVES, Curve, rounded
from relpos_env.tasks.geometry.shapes import SHAPES, Formation

ROOM = (9.0, 8.0)


@pytest.mark.parametrize("seed", range(5))
def test_places_are_the_nearest_in_sum_of_squares_and_paths_do_not_cross(seed):
    rng = np.random.default_rng(seed)
    pos, places = rng.uniform(-2.0, 2.0, (2, 9, 2))
    places += pos.mean(axis=0) - places.mean(axis=0)
    chosen = assign(pos, places)
    cost = np.sum((pos[:, None] - places[None]) ** 2, axis=-1)
    best = cost[linear_sum_assignment(cost)].sum()
    assert cost[np.arange(9), chosen].sum() == pytest.approx(best)
    assert np.array_equal(chosen, assign(pos + [3.0, -1.0], places))
    # CAPT: all cars at equal shares of their paths, none meet.
    for share in np.linspace(0.0, 1.0, 21):
        now = pos + share * (places[chosen] - pos)
        gaps = np.linalg.norm(now[:, None] - now[None], axis=-1) + 9.0 * np.eye(9)
        least = min(np.linalg.norm(p[:, None] - p[None], axis=-1)[~np.eye(9, dtype=bool)].min()
                    for p in (pos, places))  # fmt: skip
        assert gaps.min() >= least / np.sqrt(2.0) - 1e-9


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("n", [1, 2, 3, 8, 20])
def test_neighbours_of_a_shape_keep_their_distance(shape, n):
    formation = Formation(shape, 20, 0.8)
    places = formation.places(n)
    assert places.shape == (n, 2)
    assert np.allclose(places.mean(axis=0), 0.0)
    gaps = np.linalg.norm(places[:, None] - places[None], axis=-1)
    if n > 1:
        least = gaps[~np.eye(n, dtype=bool)].min()
        assert 0.8 * np.sqrt(0.75) - 1e-9 <= least <= 0.8 + 1e-9


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("half", [(2.0, 1.2), (1.0, 3.0)])
def test_curves_are_smooth_closed_and_stay_in_the_room(name, half):
    curve = Curve.through(CURVES[name](np.array(half)), True)
    s = np.linspace(0.0, curve.length, 4000)
    at = curve.at(s)
    speed = np.linalg.norm(np.diff(at, axis=0), axis=1) / np.diff(s)
    assert np.abs(speed - 1.0).max() < 0.02
    assert np.all(np.abs(at) <= np.array(half) + 0.01)
    assert np.allclose(at[0], curve.at(np.array([curve.length]))[0])
    # The direction changes at most as fast as in the tightest bend, without jumps.
    bend = np.diff(np.unwrap(np.arctan2(*np.diff(at, axis=0).T[::-1]))) / np.diff(s)[1:]
    assert np.abs(bend).max() < 1.2 / min(0.7, *half)
    assert np.abs(np.diff(bend)).max() < 0.05


def test_corners_are_rounded():
    trace = rounded(np.array([(-2.0, 0.0), (0.0, 0.0), (0.0, 2.0)]), closed=False)
    arc = np.linalg.norm(np.diff(trace, axis=0), axis=1).sum()
    assert arc == pytest.approx(4.0 - 2 * 0.7 + 0.5 * np.pi * 0.7, abs=1e-3)
    curve = Curve.through(trace, False)
    assert arc - 0.1 < curve.length < arc
    assert np.allclose(curve.at(np.array([0.0, 99.0])), [(-2.0, 0.0), (0.0, 2.0)])


BAD = [
    ("hold", {"shape": "cube"}, "shape"),
    ("hold", {"shape": [(0.0, 0.0)]}, "shape"),
    ("hold", {"shape": [(0.0, 0.0)] * 3}, "shape"),
    ("hold", {"spacing": -1.0}, "spacing"),
    ("hold", {"spacing": 50.0}, "spacing"),
    ("hold", {"heading": np.nan}, "heading"),
    ("hold", {"speed": 1.0}, "task_options"),
    ("travel", {"speed": 0.0}, "speed"),
    ("travel", {"speed": "fast"}, "speed"),
    ("travel", {"path": "spiral"}, "path"),
    ("travel", {"path": [(0.0, 0.0)]}, "path"),
    ("travel", {"path": [(0.0, 0.0), (2.0, 0.0), (0.0, 0.0)]}, "path"),
    ("travel", {"path": [(0.0, 0.0), (40.0, 0.0)]}, "path"),
    ("travel", {"lookahead": -0.1}, "lookahead"),
    ("follow", {"informed": "nobody"}, "informed"),
    ("ring", {"half_axes": (0.2, 0.2)}, "half_axes"),
    ("ring", {"half_axes": (9.0, 1.0)}, "half_axes"),
    ("ring", {"half_axes": 1.0}, "half_axes"),
    ("ring", {"half_axes": "wide"}, "half_axes"),
    ("gap", {"gap": Gap(x=4.45, width=1.0)}, "spacing"),
    ("gap", {"waypoints": [(0.0, 0.0)]}, "waypoints"),
    ("gap", {"waypoints": [(-1.0, 0.0), (-2.0, 0.0)]}, "waypoints"),
    ("gap", {"headway": 0.0}, "headway"),
    ("rendezvous", {"radius": 30.0}, "radius"),
    ("rendezvous", {"stay": -1.0}, "stay"),
    ("rendezvous", {"place": (99.0, 0.0)}, "place"),
    ("none", {}, "task"),
]


@pytest.mark.parametrize(("name", "options", "said"), BAD)
def test_bad_options_are_named(name, options, said):
    with pytest.raises(EnvError, match=f"^{said}:"):
        make_task(name, 3, 1, ROOM, **options)


@pytest.mark.parametrize("name", TASKS)
def test_sizes_out_of_range_are_named(name):
    for n_cars in (1, 21):
        with pytest.raises(EnvError, match=r"^n_cars:"):
            make_task(name, n_cars, 1, (50.0, 50.0))
    with pytest.raises(EnvError, match=r"^n_envs:"):
        make_task(name, 3, 0, ROOM)
    with pytest.raises(EnvError, match=r"^room:"):
        make_task(name, 3, 1, (0.0, 5.0))
    make_task(name, 20, 2, (30.0, 30.0))


@pytest.mark.parametrize("name", TASKS)
def test_every_term_has_a_weight(name):
    task = make_task(name, 3, 1, ROOM)
    weights = reward_weights(name, task, {"collision": 7.0})
    assert weights.shape == (len(task.terms),)
    assert weights[task.terms.index("collision")] == 7.0
    assert set(task.terms) <= set(DEFAULT_WEIGHTS[name])
    with pytest.raises(EnvError, match="weights: expected terms among"):
        reward_weights(name, task, {"joy": 1.0})
    if "time" in task.terms:
        # Being through is better than the best step before.
        best = DEFAULT_WEIGHTS[name]["formation"] + DEFAULT_WEIGHTS[name][task.terms[1]]
        assert DEFAULT_WEIGHTS[name]["time"] >= best
