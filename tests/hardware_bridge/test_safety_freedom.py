"""The gate is permissive enough to drive: formations, rings, and escapes."""

import numpy as np
import pytest
from safety_cars import DT, Cars
from safety_group import SQUARE, picture

from hardware_bridge.safety.gate import Gate
from hardware_bridge.safety.params import SafetyParams

TRIANGLE = np.array([[0.577, 0.0], [-0.289, 0.5], [-0.289, -0.5]])


class Estimated:
    """Groups of cars with known states, (env, car) or one group, and given commands."""

    def __init__(self, pos, heading, *, sigma=0.1, **options):
        self.params = SafetyParams(**options)
        pos, heading = np.array(pos, dtype=float), np.array(heading, dtype=float)
        if pos.ndim == 2:
            pos, heading = pos[None], heading[None]
        self.cars = Cars(pos, heading, np.random.default_rng(0))
        self.gate = Gate(self.params, *heading.shape)
        self.sigma, self.capped, self.tick = sigma, [], 0
        self.out = None

    def drive(self, seconds, decide):
        """Simulate; `decide(pos, heading, t)` returns speeds and steering angles."""
        shape = self.cars.heading.shape
        everyone = np.ones(shape, dtype=bool)
        for _ in range(round(seconds / DT)):
            now = np.full(shape[0], self.tick * DT)
            if self.tick % 10 == 0:
                self.q = picture(*shape, t=now[0])
                self.q.sigma[:] = self.sigma
                self.q.heading[:], self.q.speed[:] = self.cars.heading, self.cars.speed
                pos = self.cars.pos
                self.q.pos[:] = pos[:, None] - pos[:, :, None]
                self.q.place[:] = pos
                speed, steering = decide(pos, self.cars.heading, now[0])
                self.q.requested_speed[:], self.q.requested_steering[:] = speed, steering
            heard = np.repeat(now[:, None], shape[1], axis=1)
            self.out = self.gate.step(self.q, now, now, heard, everyone)
            self.gate.arm(now, everyone)
            self.capped.append(self.out.cap + 1e-6 < np.abs(self.q.requested_speed))
            self.cars.step(self.out.speed, self.out.steering, self.out.moving, everyone)
            self.tick += 1
        return self.out

    @property
    def share_capped(self):
        """Fraction of time with a capped speed, after the first second."""
        return float(np.mean(self.capped[100:]))


def straight(speed):
    return lambda pos, heading, t: (speed, 0.0)


@pytest.mark.parametrize("sigma", [0.05, 0.1])
def test_side_by_side_at_1_m_cars_drive_at_1_m_s(sigma):
    group = Estimated([[0, 0], [0, 1]], [0, 0], sigma=sigma)
    group.drive(3.0, straight(1.0))
    assert (group.out.speed > 0.9).all()


def test_behind_each_other_at_1_m_cars_drive_at_0_7_m_s():
    group = Estimated([[0, 0], [1, 0]], [0, 0], sigma=0.1)
    group.drive(3.0, straight(0.7))
    assert (group.out.speed > 0.65).all()


@pytest.mark.parametrize("course", np.arange(0.0, 6.0, 1.0))
def test_a_triangle_at_1_m_travels_at_half_a_metre_a_second(course):
    group = Estimated(TRIANGLE, [course] * 3, sigma=0.1)
    group.drive(3.0, straight(0.5))
    assert group.share_capped < 0.02


@pytest.mark.parametrize("other", [0.0, 1.5, 3.0])
@pytest.mark.parametrize("bearing", [np.pi / 2, 2.0, 2.5, np.pi])
def test_at_rest_at_1_m_cars_can_go_sideways_or_away(bearing, other):
    group = Estimated([[0, 0], [1, 0]], [bearing, other], sigma=0.1)
    group.drive(1.5, lambda pos, heading, t: ([1.0, 0.0], 0.0))
    assert group.out.cap[0, 0] > 0.5
    assert group.cars.speed[0, 0] > 0.5


def test_a_ring_at_1_m_s_with_2_m_between_is_not_slowed():
    """Drive as in the task `ring` in a room of 3 m x 5 m: half circles of 0.84 m and straights."""
    radius, half = 0.84, 1.2

    def curve(s):
        length = 4 * half + 2 * np.pi * radius
        s = s % length
        if s < 2 * half:
            return np.array([radius, s - half])
        s -= 2 * half
        if s < np.pi * radius:
            a = s / radius
            return np.array([radius * np.cos(a), half + radius * np.sin(a)])
        s -= np.pi * radius
        if s < 2 * half:
            return np.array([-radius, half - s])
        a = np.pi + (s - 2 * half) / radius
        return np.array([radius * np.cos(a), -half + radius * np.sin(a)])

    def decide(pos, heading, t):
        pos, heading = pos[0], heading[0]
        speed, steering = np.zeros((2, 3))
        grid = np.arange(0.0, 4 * half + 2 * np.pi * radius, 0.05)
        points = np.array([curve(s) for s in grid])
        for k in range(3):
            s = grid[np.linalg.norm(points - pos[k], axis=-1).argmin()]
            to = curve(s + 0.5) - pos[k]
            off = np.arctan2(to[1], to[0]) - heading[k]
            off = np.arctan2(np.sin(off), np.cos(off))
            steering[k] = np.arctan(2.0 * 0.3 * np.sin(off) / np.linalg.norm(to))
        return speed + 1.0, np.clip(steering, -0.42, 0.42)

    starts = [0.0, 3.36, 6.72]
    pos = np.array([curve(s) for s in starts])
    ahead = np.array([curve(s + 0.01) for s in starts]) - pos
    gaps = np.linalg.norm(pos[:, None] - pos, axis=-1) + 9.0 * np.eye(3)
    assert 1.6 < gaps.min() < 2.6
    group = Estimated(pos, np.arctan2(ahead[:, 1], ahead[:, 0]), sigma=0.1)
    group.drive(8.0, decide)
    assert group.share_capped < 0.05
    assert group.cars.speed.mean() > 0.9


def steer_to(course):
    """Let the first car turn to a course, forwards or backwards, whichever is nearer, (env)."""

    def decide(pos, heading, t):
        off = wrapped(course - heading[:, 0])
        sense = np.where(np.abs(off) <= 0.55 * np.pi, 1.0, -1.0)
        off = np.where(sense < 0.0, wrapped(off + np.pi), off)
        rest = np.zeros(len(off))
        steering = np.clip(2.0 * sense * off, -0.42, 0.42)
        return np.stack([sense, rest], axis=-1), np.stack([steering, rest], axis=-1)

    return decide


def wrapped(angle):
    return np.arctan2(np.sin(angle), np.cos(angle))


@pytest.mark.parametrize(("sigma", "stuck"), [(0.05, 0), (0.1, 0), (0.15, 0.15)])
def test_nobody_is_stuck_near_another(sigma, stuck):
    """Few bearings may be stuck if the position of the other car is uncertain."""
    bearing = np.linspace(-np.pi, np.pi, 49)
    away = 0.6 * np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
    pos = np.stack([0.0 * away, away], axis=1)
    group = Estimated(pos, np.zeros((49, 2)), sigma=sigma)
    group.drive(5.0, steer_to(bearing + np.pi))
    gaps = np.linalg.norm(group.cars.pos[:, 0] - group.cars.pos[:, 1], axis=-1)
    assert (gaps < 1.2).mean() <= stuck


def test_nobody_is_stuck_at_the_fence():
    heading = np.stack([np.linspace(-np.pi, np.pi, 49), np.zeros(49)], axis=-1)
    pos = np.broadcast_to([[3.93, 2.0], [0.7, 0.7]], (49, 2, 2))
    group = Estimated(pos, heading, sigma=0.1, fence=SQUARE)
    group.drive(4.0, steer_to(np.full(49, np.pi)))
    assert group.cars.pos[:, 0, 0].max() < 3.2
