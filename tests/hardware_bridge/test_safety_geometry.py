"""Stopping distances, turns and polygons: closed forms against simulation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware_bridge.safety.geometry.braking import stopping_speed, stopping_way
from hardware_bridge.safety.geometry.polygon import area, outwards, to_edges
from hardware_bridge.safety.geometry.turning import gain, way_within
from hardware_bridge.safety.recent import at_rest

angles = st.floats(0.0, np.pi)
ways = st.floats(0.0, 5.0)
radii = st.floats(0.3, 3.0)


@given(st.floats(0.0, 5.0), st.floats(0.01, 1.0), st.floats(0.5, 5.0))
def test_stopping_speed_is_the_inverse_of_the_way(speed, reaction, braking):
    way = stopping_way(np.array(speed), reaction, braking)
    assert stopping_speed(way, reaction, braking) == pytest.approx(speed, abs=1e-9)


def test_no_way_no_speed():
    assert (stopping_speed(np.array([0.0, -1.0]), 0.2, 2.0) == 0.0).all()


@given(ways, angles, radii)
def test_way_within_is_the_inverse_of_gain(room, angle, radius):
    assert gain(way_within(room, angle, radius), angle, radius) == pytest.approx(room, abs=1e-7)


@given(ways, angles, radii)
def test_no_steering_brings_a_car_nearer(way, angle, radius):
    """With any steering that switches twice, the approach never exceeds `gain`."""
    n = 400
    s = (np.arange(n) + 0.5) * way / n
    most = gain(way, angle, radius)
    for bends in [(1, 0), (1, -1), (0, 1), (1, 1), (-1, 1)]:
        for switch in (0.3, 0.6):
            curvature = np.where(s < switch * way, bends[0], bends[1]) / radius
            course = angle - np.cumsum(curvature) * way / n
            assert np.cumsum(np.cos(course)).max() * way / n <= most + 3e-2 * way + 1e-12


@given(st.floats(0.05, 2.0), radii)
def test_the_tightest_turn_reaches_it(share, radius):
    """The bound is tight: an immediate full turn reaches it."""
    angle = 0.5 * np.pi
    way = share * angle * radius
    s = (np.arange(4000) + 0.5) * way / 4000
    course = np.maximum(angle - s / radius, 0.0)
    assert np.cos(course).mean() * way == pytest.approx(gain(way, angle, radius), abs=1e-5)


def test_a_car_that_drives_away_has_half_a_circle():
    assert way_within(0.0, np.pi, 0.5) == pytest.approx(0.5 * np.pi)
    assert way_within(0.0, 0.0, 0.5) == 0.0


CORNER = np.array([(0, 0), (6, 0), (6, 3), (3, 3), (3, 6), (0, 6)], dtype=float)


@pytest.mark.parametrize(("place", "inside", "nearest"), [
    ((1.0, 1.0), True, 1.0), ((2.0, 5.0), True, 1.0), ((2.0, 2.0), True, 2**0.5),
    ((4.0, 4.0), False, 1.0), ((-1.0, 2.0), False, 1.0), ((7.0, -1.0), False, 2**0.5),
    ((5.0, 2.5), True, 0.5),
])  # fmt: skip
@pytest.mark.parametrize("order", [1, -1])
def test_places_in_a_polygon(place, inside, nearest, order):
    got, offset = to_edges(np.array(place), CORNER[::order])
    assert got == inside
    assert np.linalg.norm(offset, axis=-1).min() == pytest.approx(nearest)


@pytest.mark.parametrize("order", [1, -1])
def test_normals_point_out(order):
    corners = CORNER[::order]
    middle = 0.5 * (corners + np.roll(corners, -1, axis=0))
    normal = outwards(corners)
    assert to_edges(middle - 0.01 * normal, corners)[0].all()
    assert not to_edges(middle + 0.01 * normal, corners)[0].any()
    assert area(corners) == pytest.approx(27.0 * order)


def test_what_was_told_fades_no_faster_than_cars_brake():
    recent = at_rest((1, 1))
    one = np.ones((1, 1))
    recent = recent.after(one, 0.4 * one, 0.01 * one, 2.0)
    for _ in range(10):
        recent = recent.after(0.0 * one, -0.1 * one, 0.01 * one, 2.0)
    assert recent.speed == 0.0
    assert recent.forward == pytest.approx(0.8)
    assert recent.backward == 0.0
    assert recent.left == pytest.approx(0.2)
    assert recent.right == pytest.approx(0.1)
