"""Scenarios: rooms and floors, shipped scenarios, and invalid ones."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relpos_env.errors import EnvError
from relpos_env.scenarios import (
    RECORDABLE,
    SCENARIOS,
    Gap,
    Obstacle,
    Randomisation,
    Scenario,
    load_scenario,
    recordable,
    scenario,
)
from relpos_env.scenarios.cars import CARS_LOS, CARS_NLOS
from relpos_env.scenarios.catalogue import FILES
from relpos_env.scenarios.rooms.floor import Floor
from relpos_env.scenarios.rooms.obstacle import boxes_of
from relpos_env.scenarios.rooms.overlap import beyond_walls, car_boxes, distance, overlap


def rng(seed=0):
    return np.random.default_rng(seed)


boxes = st.tuples(
    st.floats(-2, 2), st.floats(-2, 2), st.floats(0.1, 2), st.floats(0.1, 2), st.floats(-4, 4)
).map(lambda v: Obstacle(x=v[0], y=v[1], width=v[2], height=v[3], angle=v[4]))


@given(boxes, boxes)
@settings(max_examples=200)
def test_boxes_overlap_where_points_of_one_lie_in_the_other(a, b):
    rows = boxes_of((a, b))
    share = np.linspace(-1.0, 1.0, 41)
    grid = np.stack(np.meshgrid(share, share), axis=-1).reshape(-1, 2)
    x, y, w, h, c, s = rows[0]
    points = grid * [w, h] @ np.array([[c, s], [-s, c]]) + [x, y]
    nearest = distance(points, rows[1]).min()
    both = overlap(rows, rows)
    np.testing.assert_array_equal(both, both.T)
    assert both[0, 0]
    assert both[1, 1]
    if nearest == 0.0 and distance(points, rows[1] - [0, 0, 0.01, 0.01, 0, 0]).min() == 0.0:
        assert both[0, 1]
    if nearest > 0.1:  # beyond the resolution of the grid
        assert not both[0, 1]


def test_scattered_cars_fill_a_room_without_touching():
    floor = Floor((4.0, 4.0), CARS_LOS.car, boxes_of(CARS_NLOS.obstacles))
    poses = floor.scatter(100, None, np.zeros((0, 2)), rng())
    taken = car_boxes(poses, CARS_LOS.car)
    assert floor.room_for(floor.patches(floor.clearance)[2]) <= len(poses) < 40
    assert overlap(taken, taken).sum() == len(poses)
    assert not overlap(taken, boxes_of(CARS_NLOS.obstacles)).any()
    assert not beyond_walls(taken, (4.0, 4.0)).any()


def test_a_wall_across_makes_two_patches_and_a_gap_one():
    wall = Gap(width=0.8).wall((6.0, 4.0))
    with_gap = Floor((6.0, 4.0), CARS_LOS.car, boxes_of(wall))
    assert with_gap.patches(with_gap.clearance)[0] == 1
    with_gap.add(boxes_of((Obstacle(x=0.0, y=0.0, width=0.3, height=0.3),))[0])
    assert with_gap.patches(with_gap.clearance)[0] == 2


def test_the_scenarios_of_the_tables_are_what_they_were():
    los = Scenario(name="cars-los", room=(3.0, 5.0), ring=(0.95, 1.8))
    assert los == CARS_LOS
    box = Obstacle(x=0.0, y=0.0, width=0.5, height=1.2)
    assert replace(los, name="cars-nlos", obstacles=(box,)) == CARS_NLOS
    ring = Scenario(name="ring-los", room=(5.0, 5.0), ring=(1.4, 1.4))
    assert ring == SCENARIOS["ring-los"]
    wall = Obstacle(x=0.0, y=0.0, width=1.45, height=0.2)
    assert replace(ring, name="ring-nlos", obstacles=(wall,)) == SCENARIOS["ring-nlos"]
    # Initial poses of recorded seeds.
    expected = [[-0.68589, -1.24543, -1.03988], [0.88261, -0.66585, 1.44622]]
    np.testing.assert_allclose(CARS_NLOS.start(rng(0))[:2], expected, atol=1e-5)


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_shipped_file_is_a_scenario_of_its_name(name):
    assert SCENARIOS[name].name == name
    assert scenario(name) is SCENARIOS[name] is RECORDABLE[name] is recordable(name)
    assert load_scenario(FILES / f"{name}.toml") == SCENARIOS[name]


def test_all_are_listed_cars_first():
    assert list(RECORDABLE) == [*SCENARIOS, "human", "human-mocap"]
    with pytest.raises(EnvError, match=r"scenario: expected one of cars-los, .* got 'moon'"):
        scenario("moon")


def test_in_line_is_a_layout():
    line = replace(CARS_NLOS, in_line=True)
    assert line == replace(CARS_NLOS, layout="line")
    assert replace(line, layout="ring") == CARS_NLOS


def test_the_gap_is_where_it_says_it_is():
    gap = SCENARIOS["gap"].gap
    wide = SCENARIOS["gap"].with_gap(replace(gap, width=1.5, y=0.5, direction=np.pi))
    assert len(wide.obstacles) == 2
    points = np.array([[0.0, y] for y in np.linspace(-2.4, 2.4, 97)])
    solid = np.min([distance(points, box) for box in boxes_of(wide.obstacles)], axis=0) == 0.0
    np.testing.assert_array_equal(solid, np.abs(points[:, 1] - 0.5) >= 0.75)
    assert wide.with_gap(None).obstacles == ()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n_cars": 14}, "n_cars: 14 do not fit .*expected at most 10"),
        ({"n_cars": 8, "layout": "line"}, "n_cars: 8 do not fit .*expected at most 7"),
        ({"n_cars": 19, "layout": "scattered"}, "n_cars: 19 do not fit"),
        ({"room": (40.0, 40.0), "ring": (9.0, 9.0), "n_cars": 21}, "n_cars: expected 2 to 20"),
        ({"name": "../up"}, "name: expected 1 to 80 letters"),
        ({"n_cars_range": (2, 30)}, "n_cars_range: expected 2 <= low <= high <= 20"),
        ({"randomisation": Randomisation(n_cars=(2, 18))}, "randomisation.n_cars: 18 do not fit"),
        ({"ring": (1.4, 1.8)}, "ring: cars would start in a wall"),
        ({"ring": (1.6, 1.8)}, "ring: expected above 0 and below 1.5"),
        (
            {"obstacles": (Obstacle(x=0.9, y=0.0, width=0.3, height=0.3),)},
            r"ring: cars would start in obstacles\[0\]",
        ),
        (
            {"obstacles": (Obstacle(x=2.0, y=0.0, width=0.3, height=0.3),)},
            r"obstacles\[0\]: expected its centre in the room",
        ),
        ({"gap": Gap(width=0.8)}, "gap: expected walls at both its sides"),
        ({"car": replace(CARS_LOS.car, mass=1000.0)}, "car.mass: expected 0.1 to 100"),
        ({"room": (float("nan"), 5.0)}, "room: expected"),
        ({"start_area": (1.0, 0.0, -1.0, 2.0)}, "start_area: expected"),
        (
            {"layout": "scattered", "start_area": (0.0, 0.0, 0.3, 0.3)},
            "n_cars: 3 do not fit .* at most 0",
        ),
    ],
)
def test_impossible_scenarios_are_named(change, message):
    with pytest.raises(EnvError, match=message):
        replace(CARS_LOS, **change)


def test_impossible_gaps_are_named():
    s = SCENARIOS["gap"]
    for gap, message in (
        (Gap(width=6.0), "gap.width: expected less than 4.98 m"),
        (Gap(width=0.2), "gap.width: expected at least 0.3 m"),
        (Gap(width=0.8, x=9.0), "gap: expected its middle in the room"),
    ):
        with pytest.raises(EnvError, match=message):
            s.with_gap(gap)
    box = Obstacle(x=0.0, y=0.0, width=0.2, height=0.2)
    with pytest.raises(EnvError, match=r"gap: obstacles\[2\] blocks it"):
        replace(s, obstacles=(*s.obstacles, box))
