"""Invariants of every driver with the firmware of its controller."""

from math import inf, isfinite, nan

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hardware_bridge.decoders.base import MOST_WAITING
from hardware_bridge.drivers import DRIVERS, make_driver
from hardware_bridge.emulator.cars import FIRMWARE, make_firmware
from hardware_bridge.readings import DriveReading

patient = settings(suppress_health_check=[HealthCheck.too_slow])

KEY = bytes(range(16))
REVERSING = {"pwm": {"reverse": [[0.5, 1440], [2.0, 1300]]}}
"""Options that differ from the defaults."""
EVERY = pytest.mark.parametrize("name", sorted(DRIVERS))
anything = st.floats(allow_nan=True, allow_infinity=True)
within = st.floats(0.5, 1.5), st.floats(-0.25, 0.25)
"""Speed [m/s] and steering [rad] within the default limits of every car."""


def pair(name):
    """Return a driver and the firmware that it communicates with."""
    options = REVERSING.get(name, {})
    key = KEY if DRIVERS[name].takes_key else None
    ticks = iter(range(0, 10**12, 10_000))
    driver = make_driver(name, 1, options, key, 7, lambda: next(ticks))
    return driver, make_firmware(name, 1, options, key)


def stands(reading):
    return reading.brake or reading.speed == 0.0


def test_every_driver_has_firmware():
    assert set(FIRMWARE) == set(DRIVERS)


@EVERY
def test_opening_moves_nothing(name):
    driver, firmware = pair(name)
    assert all(stands(reading) for reading in firmware.feed(driver.opening()))
    assert driver.baud == DRIVERS[name].baud


@EVERY
@patient
@given(speed=within[0], steering=within[1], is_back=st.booleans())
def test_what_is_said_is_what_is_read(name, speed, steering, is_back):
    driver, firmware = pair(name)
    firmware.feed(driver.opening())
    requested = -speed if is_back else speed
    (reading,) = firmware.feed(driver.drive(requested, steering))
    assert reading.to == "1"
    assert not reading.brake
    assert reading.speed == pytest.approx(requested, abs=0.01)
    assert reading.steering == pytest.approx(steering, abs=0.002)


@EVERY
@patient
@given(asked=st.lists(st.tuples(anything, anything), max_size=8))
def test_commands_stay_within_the_limits(name, asked):
    driver, firmware = pair(name)
    firmware.feed(driver.opening())
    low, high = [], []
    for steering in (-1e9, 1e9):
        for speed in (-1e9, 1e9):
            (reading,) = firmware.feed(driver.drive(speed, steering))
            (low if steering < 0 else high).append(reading)
    ends = [r.speed for r in (*low, *high)], [r.steering for r in (*low, *high)]
    assert max(map(abs, ends[0])) <= 3.0
    assert max(map(abs, ends[1])) <= 0.42 + 0.001
    for speed, steering in asked:
        (reading,) = firmware.feed(driver.drive(speed, steering))
        if not (isfinite(speed) and isfinite(steering)):
            assert stands(reading)
        assert min(ends[0]) <= reading.speed <= max(ends[0])
        assert min(ends[1]) <= reading.steering <= max(ends[1])


@EVERY
@patient
@given(asked=st.lists(st.tuples(anything, anything), max_size=5))
def test_neutral_stands_whatever_went_before(name, asked):
    driver, firmware = pair(name)
    firmware.feed(driver.opening())
    for speed, steering in asked:
        firmware.feed(driver.drive(speed, steering))
    (reading,) = firmware.feed(driver.neutral())
    assert stands(reading)


@EVERY
@pytest.mark.parametrize("bad", [(nan, 0.0), (0.0, nan), (inf, 0.0), (1.0, -inf)])
def test_no_number_is_neutral(name, bad):
    driver, firmware = pair(name)
    firmware.feed(driver.opening())
    (reading,) = firmware.feed(driver.drive(*bad))
    assert stands(reading)


@EVERY
@pytest.mark.parametrize("speed", [0.0, -0.0, 1e-9, -0.05])
def test_slower_than_it_can_is_standing(name, speed):
    driver, firmware = pair(name)
    firmware.feed(driver.opening())
    (reading,) = firmware.feed(driver.drive(speed, 0.1))
    assert stands(reading) or abs(reading.speed) <= abs(speed) + 0.01


def a_drive(driver):
    """Return the bytes of a short drive with all commands."""
    parts = [driver.opening()]
    for k in range(12):
        parts += [driver.drive(0.3 * k - 1.5, 0.05 * k - 0.25), driver.ask()]
    return b"".join([*parts, driver.neutral()])


def cut(data, places):
    ends = sorted({0, len(data), *(place % (len(data) + 1) for place in places)})
    return [data[a:b] for a, b in zip(ends, ends[1:], strict=False)]


@EVERY
@patient
@given(places=st.lists(st.integers(0, 10_000), max_size=20))
def test_any_cut_gives_the_same(name, places):
    driver, whole = pair(name)
    _, parts = pair(name)
    data = a_drive(driver)
    expected = whole.feed(data)
    assert len(expected) >= 13
    assert [r for part in cut(data, places) for r in parts.feed(part)] == expected
    assert parts.counts == whole.counts


@EVERY
def test_byte_by_byte(name):
    driver, whole = pair(name)
    _, parts = pair(name)
    data = a_drive(driver)
    assert [r for b in data for r in parts.feed(bytes((b,)))] == whole.feed(data)
    assert parts.counts == whole.counts
    assert whole.counts.damaged == whole.counts.strange == whole.counts.skipped == 0


@EVERY
@patient
@given(data=st.data())
def test_damage_is_survived(name, data):
    driver, firmware = pair(name)
    sent = bytearray(a_drive(driver))
    for at, value in data.draw(
        st.lists(st.tuples(st.integers(0, len(sent) - 1), st.integers(0, 255)), max_size=10)
    ):
        sent[at] = value
    for part in cut(bytes(sent), data.draw(st.lists(st.integers(0, 10_000), max_size=5))):
        for reading in firmware.feed(part):
            assert isinstance(reading, DriveReading)
            assert isfinite(reading.speed)
            assert isfinite(reading.steering)
        driver.telemetry.feed(part)
    # Whatever the length of a damaged frame, complete ones are read after it.
    for _ in range(400):
        read = firmware.feed(driver.neutral())
    assert len(read) == 1
    assert stands(read[0])


@EVERY
@patient
@given(noise=st.lists(st.binary(max_size=600), max_size=12))
def test_noise_is_survived_and_not_kept(name, noise):
    driver, firmware = pair(name)
    for part in noise:
        driver.telemetry.feed(part)
        firmware.feed(part)
        assert driver.telemetry.waiting <= MOST_WAITING
        firmware.encode([])
    assert driver.telemetry.counts.n_bytes == sum(map(len, noise))
