"""Emulated cars stop by themselves without commands to their motor."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hardware_bridge.drivers import DRIVERS, make_driver
from hardware_bridge.drivers.vesc import VescDriver, VescOptions, set_servo
from hardware_bridge.emulator.cars import FIRMWARE, make_firmware
from hardware_bridge.emulator.cars.emulated_car import EmulatedCar
from hardware_bridge.emulator.cars.vesc import VescFirmware

patient = settings(suppress_health_check=[HealthCheck.too_slow])

MS = 1_000_000
EVERY = pytest.mark.parametrize("name", sorted(FIRMWARE))


def pair(name, deadman=None):
    key = bytes(16) if DRIVERS[name].takes_key else None
    ticks = iter(range(0, 10**12, 10_000))
    driver = make_driver(name, 1, {}, key, 1, lambda: next(ticks))
    return driver, EmulatedCar(make_firmware(name, 1, {}, key), deadman)


@EVERY
def test_stands_until_it_is_told(name):
    driver, car = pair(name)
    assert car.deadman == 0.2
    assert car.command(0) == (0.0, 0.0)
    assert car.last_ns is None
    assert car.is_stopped(0)
    car.feed(5 * MS, driver.opening())
    assert car.command(6 * MS)[0] == 0.0


@EVERY
def test_stops_when_commands_stop(name):
    driver, car = pair(name)
    car.feed(0, driver.opening())
    car.feed(1000 * MS, driver.drive(1.0, 0.2))
    assert car.last_ns == 1000 * MS
    for t in (1000, 1100, 1199):
        assert car.command(t * MS) == pytest.approx((1.0, 0.2), abs=0.01)
        assert not car.is_stopped(t * MS)
    for t in (1200, 1300, 10**6):
        speed, steering = car.command(t * MS)
        assert speed == 0.0
        assert steering == pytest.approx(0.2, abs=0.01)
        assert car.is_stopped(t * MS)
    car.feed(10**7 * MS, driver.drive(0.5, 0.0))
    assert car.command(10**7 * MS)[0] == pytest.approx(0.5, abs=0.01)


@EVERY
def test_neutral_stops_at_once(name):
    driver, car = pair(name)
    car.feed(0, driver.opening() + driver.drive(1.0, 0.0))
    car.feed(10 * MS, driver.neutral())
    assert car.command(10 * MS)[0] == 0.0
    assert not car.is_stopped(10 * MS)


@EVERY
@patient
@given(gaps=st.lists(st.integers(1, 400), min_size=1, max_size=20))
def test_moves_only_within_the_deadman(name, gaps):
    driver, car = pair(name, deadman=0.1)
    car.feed(0, driver.opening())
    t = 0
    for gap in gaps:
        car.feed(t * MS, driver.drive(1.0, 0.0))
        t += gap
        assert (car.command(t * MS)[0] != 0.0) == (gap < 100)


def test_servo_and_questions_keep_no_motor_going():
    driver, car = VescDriver(VescOptions()), EmulatedCar(VescFirmware(1, VescOptions()))
    car.feed(0, driver.drive(1.0, 0.0))
    for t in range(10, 400, 10):
        assert car.feed(t * MS, set_servo(600) + driver.ask()) == []
        assert (car.command(t * MS)[0] != 0.0) == (t < 200)
    assert car.encode([]) != b""
