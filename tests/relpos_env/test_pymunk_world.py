"""The world is a persistent `pymunk.Space`: it can be inspected, extended and changed."""

from dataclasses import replace

import numpy as np
import pymunk
import pytest
from runs import busy, drive, placed

from relpos_env.api.gym_env import FormationGymEnv
from relpos_env.api.vector_env import FormationVectorEnv
from relpos_env.errors import EnvError
from relpos_env.formation_v0 import parallel_env
from relpos_env.scenarios import SCENARIOS, load_scenario
from relpos_env.simulation.simulation import Simulation
from relpos_env.world import room_state as group_module
from relpos_env.world.arrays import NO_BOX
from relpos_env.world.pymunk_space import rectangle_of
from relpos_env.world.world import SPARE_BOXES

STILL = np.zeros(2, np.float32)
FAR = (-3.0, -3.0, 0.0)


def add_ball(space, position, radius=0.15, mass=0.2):
    ball = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0.0, radius))
    ball.position = position
    space.add(ball, pymunk.Circle(ball, radius))
    return ball


def two_balls(world, rng):
    """Add two balls, as a hook of a scenario."""
    for x in (0.0, 0.5):
        add_ball(world.space, (x, rng.uniform(-0.1, 0.1)))


def random_drive(env, seed=1, steps=60, opened=False):
    """Return poses after every step, and contacts."""
    env.reset(seed=seed)
    if opened:
        env.world.space  # noqa: B018
    rng = np.random.default_rng(0)
    poses, contacts = [], []
    for k in range(steps):
        if k % 10 == 0:
            speeds = rng.uniform(-1.0, 1.0, (len(env.possible_agents), 2)).astype(np.float32)
        env.step({a: speeds[env.possible_agents.index(a)] for a in env.agents})
        swarm = env.formation.loop.swarm
        poses.append(swarm.body.copy())
        contacts.append(swarm.contacts.copy())
    return np.array(poses), np.array(contacts)


def test_the_space_is_kept_for_the_episode_and_has_the_state():
    env = parallel_env(scenario="cars-nlos")
    with pytest.raises(EnvError, match="reset first"):
        env.world  # noqa: B018
    env.reset(seed=1)
    world = env.unwrapped.world
    for _ in range(20):
        env.step({a: np.array([0.5, 0.1], np.float32) for a in env.agents})
        assert env.world is world
        for n, body in world.cars.items():
            row = env.formation.loop.swarm.body[0, n]
            assert (*body.position, body.angle, *body.velocity) == tuple(row[:5])
    env.reset()
    assert env.world is not world


@pytest.mark.parametrize("scenario", ["cars-nlos", busy()], ids=["plain", "busy"])
def test_an_opened_world_moves_like_a_closed_one(scenario):
    env = parallel_env(scenario=scenario)
    closed, opened = (random_drive(env, opened=opened) for opened in (False, True))
    assert closed[1].sum() > 0
    for a, b in zip(closed, opened, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("physics", ["pymunk", "fast"])
def test_an_unknown_pymunk_is_stepped_by_its_public_interface(monkeypatch, physics):
    env = parallel_env(scenario="cars-nlos", physics=physics)
    by_address = random_drive(env)
    monkeypatch.setattr(group_module, "UNKNOWN", "another layout")
    for a, b in zip(by_address, random_drive(env), strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_ball_is_pushed_hides_and_counts_as_a_contact():
    swarm = placed([(-1.0, 0.0, 0.0), (1.5, -2.0, 0.0), (1.5, 2.0, 0.0)])
    world, met = swarm.world(0), []
    ball = add_ball(world.space, (1.5, 0.0), radius=0.4, mass=5.0)
    world.space.on_collision(begin=lambda arbiter, space, data: met.append(arbiter.shapes))
    drive(swarm, 0.1, 0.0)
    assert not swarm.line_of_sight(0)[1, 2]
    contacts = drive(swarm, 4.0, [1.0, 0.0, 0.0])
    assert ball.position.x > 1.6
    assert any(ball in (a.body, b.body) for a, b in met)
    assert contacts[0] >= 1
    assert contacts[1] == contacts[2] == 0
    world.space.remove(ball, *ball.shapes)
    drive(swarm, 0.1, 0.0)
    assert swarm.line_of_sight(0)[1, 2]


def test_a_sensor_neither_hides_nor_counts():
    swarm = placed([(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
    zone = pymunk.Circle(swarm.world(0).space.static_body, 0.5)
    zone.sensor = True
    swarm.world(0).space.add(zone)
    assert drive(swarm, 1.5, [1.0, 0.0]).sum() == 0
    assert swarm.line_of_sight(0)[0, 1]


def test_a_trailer_follows_and_a_car_that_is_moved_is_there():
    swarm = placed([(-1.0, 0.0, 0.0), FAR])
    world = swarm.world(0)
    car = world.cars[0]
    trailer = add_ball(world.space, (-1.5, 0.0), radius=0.1, mass=0.3)
    world.space.add(pymunk.PinJoint(car, trailer, (-0.2, 0.0)))
    drive(swarm, 2.0, [0.8, 0.0])
    assert np.hypot(*(trailer.position - car.position)) == pytest.approx(0.5, abs=0.25)
    assert trailer.position.x > -1.0
    car.position, trailer.position = (0.0, 2.0), (-0.5, 2.0)
    drive(swarm, 0.1, 0.0)
    np.testing.assert_allclose(swarm.state.pos_w[0, 0], (0.0, 2.0), atol=0.2)
    np.testing.assert_allclose(swarm._scene.pos1[0, 0, :2], swarm.state.pos_w[0, 0], atol=0.02)


def test_a_scenario_brings_bodies(tmp_path):
    scenario = replace(SCENARIOS["ring-los"], furnish=two_balls)
    file = tmp_path / "balls.toml"
    file.write_text(f'extends = "ring-los"\nname = "ring-los"\nfurnish = "{__name__}:two_balls"\n')
    boxes = []
    for s in (scenario, load_scenario(file)):
        env = FormationGymEnv(scenario=s)
        env.reset(seed=2)
        assert len(env.world.space.bodies) == s.n_cars + 2
        boxes.append(env.formation.loop.swarm.boxes.copy())
    np.testing.assert_array_equal(*boxes)
    assert (boxes[0][0, :, 2] > 0.0).sum() == 2
    simulation = Simulation(scenario, np.random.default_rng(0))
    assert (simulation.swarm.boxes[0, :, 2] > 0.0).sum() == 2
    with pytest.raises(EnvError, match="physics: expected 'pymunk' in scenario 'ring-los'"):
        FormationVectorEnv(2, scenario=scenario)
    file.write_text('extends = "ring-los"\nfurnish = "nowhere:at_all"\n')
    with pytest.raises(EnvError, match=r"balls.toml: furnish: cannot import 'nowhere:at_all'"):
        load_scenario(file)


def test_fast_physics_has_no_world_and_a_full_one_says_so():
    env = parallel_env(physics="fast")
    env.reset(seed=0)
    with pytest.raises(EnvError, match="world: expected physics 'pymunk'"):
        env.world  # noqa: B018
    swarm = placed([(-1.0, 0.0, 0.0), FAR])
    for k in range(SPARE_BOXES + 2):
        add_ball(swarm.world(0).space, (2.0, 0.3 * k - 1.0), radius=0.1)
    with pytest.raises(EnvError, match=r"world.space: expected at most \d+ added shapes, got 10"):
        drive(swarm, 0.1, 0.0)
    with pytest.raises(EnvError, match="physics: expected pymunk or fast, got 'slow'"):
        parallel_env(physics="slow")


def test_shapes_are_seen_as_rectangles():
    body = pymunk.Body(1.0, 1.0)
    circle = rectangle_of(pymunk.Circle(body, 0.5, (1.0, 2.0)))
    assert circle[:2] == (1.0, 2.0)
    assert circle[2] * circle[3] == pytest.approx(np.pi * 0.25)
    wall = rectangle_of(pymunk.Segment(body, (0.0, 0.0), (0.0, 2.0), 0.1))
    assert wall == pytest.approx((0.0, 1.0, 2.2, 0.2, np.pi / 2.0))
    turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    corners = np.array([[0, 0], [2, 0], [2, 1], [0, 1]]) @ turn + [1.0, 1.0]
    x, y, width, height, angle = rectangle_of(pymunk.Poly(body, corners.tolist()))
    np.testing.assert_allclose((x, y), np.array([1.0, 0.5]) @ turn + [1.0, 1.0])
    assert sorted((width, height)) == pytest.approx([1.0, 2.0])
    assert np.sin(2.0 * (angle - 0.3)) == pytest.approx(0.0, abs=1e-9)


def test_a_floor_plan_is_read_from_a_table(tmp_path):
    plan, file = tmp_path / "office.csv", tmp_path / "office.toml"
    plan.write_text("x1,y1,x2,y2,thickness\n-1,0,1,0,0.1\n\n0,0.5,0,1.5,0.2\n")
    file.write_text('extends = "open"\nname = "office"\nfloor_plan = "office.csv"\n')
    scenario = load_scenario(file)
    wall, other = scenario.obstacles
    assert (wall.x, wall.y, wall.width, wall.height, wall.angle) == (0.0, 0.0, 2.0, 0.1, 0.0)
    assert (other.y, other.width, other.angle) == pytest.approx((1.0, 1.0, np.pi / 2.0))
    for text, message in (
        ("x1,y1\n", "office.csv:1: expected the columns x1,y1,x2,y2,thickness"),
        ("x1,y1,x2,y2,thickness\n0,0,1,a,1\n", "office.csv:2: expected five numbers"),
        ("x1,y1,x2,y2,thickness\n0,0,0,0,1\n", "office.csv:2: width: expected 0.01"),
    ):
        plan.write_text(text)
        with pytest.raises(EnvError, match=message):
            load_scenario(file)
    plan.unlink()
    with pytest.raises(EnvError, match="office.toml: floor_plan: cannot read 'office.csv'"):
        load_scenario(file)


def test_queries_of_a_scenario_find_the_cars():
    found = []

    def look(world, rng):
        for body in world.cars.values():
            hits = world.space.point_query(body.position, 0.0, pymunk.ShapeFilter())
            found.append(any(hit.shape.body is body for hit in hits))

    env = parallel_env(scenario=replace(SCENARIOS["open"], furnish=look))
    env.reset(seed=1)
    assert found
    assert all(found)


def test_a_shape_is_seen_as_it_is_now_and_forgotten_once_it_is_gone():
    env = parallel_env(scenario="open")
    env.reset(seed=1)
    swarm, space = env.formation.loop.swarm, env.unwrapped.world.space
    ball = add_ball(space, (3.0, 3.0))
    (shape,) = ball.shapes
    for radius in (0.15, 0.5):
        shape.unsafe_set_radius(radius)
        env.step({agent: STILL for agent in env.agents})
        assert np.isclose(2.0 * swarm.boxes[0, 0, 2], np.sqrt(np.pi) * radius)
    space.remove(ball, shape)
    env.step({agent: STILL for agent in env.agents})
    np.testing.assert_array_equal(swarm.boxes[0, 0], NO_BOX)
