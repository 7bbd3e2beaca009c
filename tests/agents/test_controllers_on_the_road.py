"""Parts of controllers: uncertainty weighting, steering and avoidance, with kinematic cars."""

import numpy as np
import pytest

from agents.controllers import CONTROLLERS
from agents.controllers.base import Certainty, Reader, length, split_fields
from agents.controllers.caution import shrunk, spread
from agents.controllers.correcting import AvoidanceParams, SteeringParams, corrected
from agents.controllers.range_only import RangeOnlyParams, correction
from relpos_env.interface.actions import MAX_SPEED, MAX_STEERING
from relpos_env.interface.observations import observation_mode, total_size

WHEELBASE, DT, DECISION = 0.30, 0.02, 5
PAIR = observation_mode("estimate", 2).fields
TRIO = observation_mode("estimate", 3).fields


class Cars:
    """Kinematic cars that follow commands at once."""

    def __init__(self, pos, heading):
        self.pos, self.heading = np.array(pos, float), np.array(heading, float)
        self.speed, self.steering = np.zeros(len(self.pos)), np.zeros(len(self.pos))

    def step(self, actions):
        self.speed, self.steering = (actions.astype(float) * [MAX_SPEED, MAX_STEERING]).T
        for _ in range(DECISION):
            self.heading += DT * self.speed * np.tan(self.steering) / WHEELBASE
            self.pos += DT * self.vel

    @property
    def vel(self):
        ahead = np.stack([np.cos(self.heading), np.sin(self.heading)], axis=1)
        return self.speed[:, None] * ahead

    def observe(self, fields, places, command):
        """Return observations, (car, size); places and command are in the room."""
        n, where = len(self.pos), split_fields(fields)
        o = np.zeros((n, total_size(fields)), np.float32)
        for k in range(n):
            c, s = np.cos(self.heading[k]), np.sin(self.heading[k])
            into = np.array([[c, -s], [s, c]])
            rest = np.delete(np.arange(n), k)
            told = dict(
                mask=1, pos=(self.pos[rest] - self.pos[k]) @ into,
                vel=(self.vel[rest] - self.vel[k]) @ into, has_target=1,
                target=(places[rest] - places[k]) @ into, command=command[k] @ into,
                heading=[c, s], motion=[self.speed[k], self.steering[k]],
            )  # fmt: skip
            for name, value in told.items():
                o[k, where[name]] = np.ravel(value)
        return o


def test_an_unsure_direction_counts_less():
    """The reference is W = (1 + P / s^2)^-1."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        ahead, left, mixed = *rng.uniform(0.01, 1.0, 2), rng.uniform(-0.95, 0.95)
        error, to = rng.uniform(-0.3, 0.3, 2), rng.normal(size=2)
        to /= np.linalg.norm(to)
        cov = np.array([[ahead**2, mixed * ahead * left], [mixed * ahead * left, left**2]])
        certainty = Certainty(np.array(ahead), np.array(left), np.array(mixed))
        expected = np.linalg.solve(np.eye(2) + cov / 0.3**2, error)
        np.testing.assert_allclose(shrunk(tuple(error), certainty, 0.3), expected)
        np.testing.assert_allclose(spread(tuple(to), certainty), np.sqrt(to @ cov @ to))


def test_range_only_goes_down_the_gradient():
    """The reference is finite differences of half the squared distance errors."""
    rng = np.random.default_rng(3)
    params = RangeOnlyParams(gain_ahead=1.0, gain_left=1.0)
    reader = Reader(TRIO, "", ("estimate",))
    for _ in range(10):
        pos, places = rng.normal(0.0, 2.0, (2, 3, 2))
        expected = np.linalg.norm(places[1:] - places[0], axis=1)

        def cost(own, pos=pos, expected=expected):
            return 0.5 * np.sum((np.linalg.norm(pos[1:] - own, axis=1) - expected) ** 2)

        o = Cars(pos, np.zeros(3)).observe(TRIO, places, np.zeros((3, 2)))
        steps = 1e-5 * np.eye(2)
        slope = [(cost(pos[0] + s) - cost(pos[0] - s)) / 2e-5 for s in steps]
        found = correction(reader.read(o[0]), params)
        np.testing.assert_allclose(found, -0.5 * np.array(slope), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("sent", [True, False])
@pytest.mark.parametrize("bearing", np.radians([-170, -130, -100, -60, -20, 10, 50, 90, 120, 179]))
def test_a_car_gets_to_where_it_wants(bearing, sent):
    """The car drives forwards or backwards; to a near target without a command it manoeuvres."""
    goal = (3.0 if sent else 0.4) * np.array([np.cos(bearing), np.sin(bearing)])
    # The other car is far away.
    cars, gears = Cars([[0.0, 0.0], [50.0, 0.0]], [0.0, 0.0]), []
    reader, nothing, still = Reader(PAIR, "", ("estimate",)), np.zeros((2, 2)), np.zeros(2)
    for _ in range(150):
        to = goal - cars.pos[0]
        if np.linalg.norm(to) < 0.1:
            break
        command = np.array([to, [0.0, 0.0]]) if sent else nothing
        sight = reader.read(cars.observe(PAIR, nothing, command))
        c, s = np.cos(cars.heading), np.sin(cars.heading)
        wish = (still, still) if sent else (c * to[0] + s * to[1], c * to[1] - s * to[0])
        cars.step(corrected(sight, wish, 0.9, SteeringParams(), AvoidanceParams()))
        gears.append(np.sign(cars.speed[0]))
    assert np.linalg.norm(goal - cars.pos[0]) < 0.12
    if sent:
        assert (gears[0] < 0) == (abs(bearing) >= np.radians(120))


def test_a_blocked_car_backs_out():
    """The car stands with a command and turned wheels: it backs out until it has some speed."""
    reader, told = Reader(PAIR, "", ("estimate",)), np.zeros(total_size(PAIR), np.float32)
    where = split_fields(PAIR)
    told[where["command"]] = [0.6, 0.4]
    still = (np.zeros(()), np.zeros(()))

    def act():
        return corrected(reader.read(told), still, 0.9, SteeringParams(), AvoidanceParams())

    forward = act()
    assert forward[0] > 0.0
    told[where["motion"]] = [0.0, MAX_STEERING * forward[1]]
    assert act()[0] < 0.0
    told[where["motion"]] = [-0.4, MAX_STEERING]
    assert act()[0] < 0.0
    told[where["motion"]] = [-0.8, MAX_STEERING]
    assert act()[0] > 0.0


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize("offset", [0.0, 0.05, -0.1, 0.3])
@pytest.mark.parametrize("turned", [0.0, 0.3])
def test_cars_heading_on_to_each_other_do_not_touch(name, offset, turned):
    """Cars of 0.42 m by 0.20 m are commanded through each other at 1 m/s each."""
    controller = CONTROLLERS[name](PAIR)
    cars = Cars([[-2.0, 0.0], [2.0, offset]], [turned, np.pi])
    command, nearest = np.array([[1.0, 0.0], [-1.0, 0.0]]), np.inf
    for _ in range(60):
        # Every car is in its place, so formation errors are zero.
        cars.step(controller.act(cars.observe(PAIR, cars.pos, command)))
        nearest = min(nearest, np.linalg.norm(cars.pos[0] - cars.pos[1]))
    assert nearest > 0.47


def test_who_is_unsure_keeps_farther_away():
    fields = observation_mode("estimate_cov", 2).fields
    where = split_fields(fields)
    o = np.zeros((2, total_size(fields)), np.float32)
    o[:, where["mask"]], o[:, where["pos"]], o[:, where["target"]] = 1.0, [1.0, 0.0], [1.0, 0.0]
    o[:, where["command"]] = [1.0, 0.0]
    o[1, where["std"]] = [0.4, 0.4, 0.0]
    sure, unsure = CONTROLLERS["consensus"](fields).act(o)[:, 0]
    assert 0.0 <= unsure < sure < 1.0 / MAX_SPEED


@pytest.mark.parametrize("name", ["consensus", "leader-follower"])
def test_cars_come_into_formation_on_the_way(name):
    """Three cars in a row form a triangle that drives north-east."""
    controller, places = CONTROLLERS[name](TRIO), np.array([[1.0, 0.0], [-0.5, 0.9], [-0.5, -0.9]])
    cars = Cars([[0.0, 0.0], [-0.5, 1.5], [0.3, -1.3]], [0.0, 0.5, 1.0])
    for _ in range(200):
        cars.step(controller.act(cars.observe(TRIO, places, np.full((3, 2), 0.5))))
    off = cars.pos - places
    assert np.max(length(tuple((off - off.mean(axis=0)).T))) < 0.02
