"""Stamps of devices are unwrapped exactly and mapped to host time within a fraction of a
millisecond, whatever the delays of the link."""

import math
import random
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware_bridge.clocks import ClockParams, DeviceTime, HostTime
from hardware_bridge.clocks.envelope import LowerEnvelope
from hardware_bridge.readings import MICROSECONDS_32, MICROSECONDS_64, RADIO_40, DeviceClock

S = 1_000_000_000
MS = 1_000_000
WRAPPING = [MICROSECONDS_32, RADIO_40]


class Device:
    """A counter with drift, and a link with delays."""

    def __init__(self, clock=MICROSECONDS_32, ppm=0.0, wander=0.0, ticks=123, seed=0):
        self.clock, self.ppm, self.wander, self.start = clock, ppm, wander, ticks
        self.random = random.Random(seed)
        self.until = self.busy_until = 0

    def count(self, t):
        """Return unwrapped ticks at true time t [s]; the rate varies by `wander` ppm in 10 min."""
        swing = 600.0 / (2.0 * math.pi)
        phase = self.wander * swing * (1.0 - math.cos(t / swing))
        return self.start + round(self.clock.hz * (t + 1e-6 * (self.ppm * t + phase)))

    def ticks(self, t):
        return self.count(t) % self.clock.modulus

    def arrival(self, t):
        """Return the arrival on a serial port: 1 to 3 ms late, with pauses of up to 100 ms."""
        if self.random.random() < 0.01:
            self.busy_until = max(self.busy_until, t + self.random.uniform(0.0, 0.1))
        came = max(t + self.random.uniform(1e-3, 3e-3), self.busy_until)
        self.until = max(self.until, round(came * S))
        return self.until


def errors(device, stream, seconds, hz=100.0):
    """Return t [s], error [s] and dt error [-] of every stamp, less the least delay of 1 ms."""
    out, before = [], None
    for k in range(1, int(seconds * hz)):
        t = k / hz
        mapped = stream.map(device.ticks(t), device.arrival(t))
        dt = 0.0 if before is None else (mapped - before) / S * hz - 1.0
        out.append((t, mapped / S - t - 1e-3, dt))
        before = mapped
    return out


def rms(values):
    values = list(values)
    return math.sqrt(sum(v * v for v in values) / len(values))


@pytest.mark.parametrize("ppm", [-50.0, 0.0, 50.0])
@pytest.mark.parametrize("clock", WRAPPING)
def test_times_are_right_to_a_fraction_of_a_millisecond(clock, ppm):
    got = errors(Device(clock, ppm, wander=20.0), DeviceTime(clock), 200.0)
    assert rms(e for t, e, _ in got if 2.0 < t < 10.0) < 0.3e-3
    assert rms(e for t, e, _ in got if t > 10.0) < 0.15e-3
    assert max(abs(e) for t, e, _ in got if t > 10.0) < 0.5e-3


def test_times_are_smooth_once_the_stream_is_known():
    got = errors(Device(ppm=50.0, wander=20.0), DeviceTime(MICROSECONDS_32), 120.0)
    # Slew, drift and one tick in 10 ms; a faster stamp than all earlier ones shifts the time.
    assert max(abs(dt) for t, _, dt in got if t > 2.1) < 10e-3
    assert max(abs(dt) for t, _, dt in got if t > 10.0) < 2.5e-3


def test_the_drift_is_found():
    stream = DeviceTime(RADIO_40)
    errors(Device(RADIO_40, ppm=-80.0), stream, 60.0)
    assert stream.drift == pytest.approx(80e-6, abs=3e-6)


@pytest.mark.parametrize("clock", WRAPPING)
@pytest.mark.parametrize("ppm", [-200.0, 200.0])
def test_a_thousand_wraps_are_unwrapped_exactly(clock, ppm):
    device, stream = Device(clock, ppm), DeviceTime(clock)
    period = clock.modulus / clock.hz
    t = 1.0
    while t < 1001.0 * period:
        stream.map(device.ticks(t), device.arrival(t))
        assert stream.ticks == device.count(t)
        t += 0.3 * period
    assert stream.ticks // clock.modulus >= 1000
    assert (stream.steps, stream.strays) == (0, 0)


@settings(max_examples=60)
@given(
    st.sampled_from(WRAPPING),
    st.floats(-200.0, 200.0),
    st.lists(st.tuples(st.floats(1e-4, 3000.0), st.floats(0.0, 0.3)), min_size=1, max_size=40),
)
def test_any_silence_is_unwrapped_exactly(clock, ppm, gaps):
    """The silences have up to 170 wraps of the radio's counter."""
    device, stream = Device(clock, ppm), DeviceTime(clock, ClockParams(stray=0.5))
    t, arrival = 0.0, 0
    stream.map(device.ticks(0.0), 0)
    for gap, delay in gaps:
        t += gap
        arrival = max(arrival, round((t + delay) * S))
        mapped = stream.map(device.ticks(t), arrival)
        assert stream.ticks == device.count(t)
        assert mapped <= arrival
    assert (stream.steps, stream.strays) == (0, 0)


@settings(max_examples=100)
@given(
    st.floats(-200.0, 200.0),
    st.lists(
        st.tuples(st.floats(1e-6, 0.2), st.one_of(st.floats(0.0, 0.1), st.floats(0.0, 3.0))),
        max_size=200,
    ),
)
def test_times_never_fall_and_never_come_after_the_arrival(ppm, stamps):
    device, stream = Device(RADIO_40, ppm), DeviceTime(RADIO_40)
    t, arrival, newest = 0.0, 0, -1
    for gap, delay in stamps:
        t += gap
        arrival = max(arrival, round((t + delay) * S))
        mapped = stream.map(device.ticks(t), arrival)
        assert newest <= mapped <= arrival
        newest = mapped
    assert stream.steps == 0


@settings(max_examples=200)
@given(
    st.sampled_from([*WRAPPING, MICROSECONDS_64, DeviceClock(999.7, 5000)]),
    st.lists(
        st.tuples(
            st.integers(-(1 << 70), 1 << 70) | st.integers(0, 1 << 20) | st.none(),
            st.integers(-S, 100 * S) | st.just(0),
        ),
        max_size=60,
    ),
)
def test_any_stamps_and_arrivals_are_survived(clock, stamps):
    """The arrivals may decrease, unlike those of a monotonic clock."""
    twice = []
    for _ in range(2):
        stream, arrival = DeviceTime(clock), 0
        out = []
        for ticks, gap in stamps:
            arrival += gap
            out.append(stream.map(ticks, arrival))
            assert out[-1] <= arrival
        twice.append(out)
    assert twice[0] == twice[1]


def settled(clock=MICROSECONDS_32, ticks=3_000_000_000, seconds=5.0):
    device, stream = Device(clock, 30.0, ticks=ticks), DeviceTime(clock)
    errors(device, stream, seconds)
    return device, stream


def test_a_counter_that_began_anew_is_a_step_and_counted():
    _, stream = settled()
    again = Device(ticks=0)
    for k in range(200):
        t = 6.0 + 0.01 * k
        mapped = stream.map(again.ticks(t - 5.9), round((t + 1e-3) * S))
        assert abs(mapped / S - t - 1e-3) < 1e-4
    assert (stream.steps, stream.strays) == (1, 0)


@pytest.mark.parametrize("hours", [-1.0, 1.0])
def test_a_device_clock_that_is_set_is_a_step(hours):
    device, stream = settled(MICROSECONDS_64)
    for k in range(200):
        t = 5.0 + 0.01 * k
        ticks = device.ticks(t) + round(hours * 3.6e9)
        mapped = stream.map(ticks, round((t + 1e-3) * S))
        assert abs(mapped / S - t - 1e-3) < 1e-3
    assert stream.steps == 1


def test_a_clock_that_stood_still_is_a_step_after_a_while():
    device, stream = settled()
    for k in range(1000):
        t = 15.0 + 0.01 * k
        mapped = stream.map(device.ticks(t - 10.0), round((t + 1e-3) * S))
    assert abs(mapped / S - t - 1e-3) < 1e-4
    assert stream.steps == 1


def test_the_wall_clock_is_not_asked(monkeypatch):
    def forbidden():
        raise AssertionError("wall clock")

    before = errors(Device(), DeviceTime(MICROSECONDS_32), 2.0)
    monkeypatch.setattr(time, "time", forbidden)
    monkeypatch.setattr(time, "time_ns", forbidden)
    assert errors(Device(), DeviceTime(MICROSECONDS_32), 2.0) == before


def test_a_known_restart_is_no_step():
    _, stream = settled()
    stream.restart()
    drift = stream.drift
    assert stream.map(17, 6 * S) == 6 * S
    assert (stream.ticks, stream.steps, stream.drift) == (17, 0, drift)


@pytest.mark.parametrize("back", [0.0, 0.01, 0.1, 0.4])
def test_a_late_stamp_is_put_where_it_belongs(back):
    device, stream = settled()
    now = stream.map(device.ticks(5.0), round(5.002 * S))
    late = stream.map(device.ticks(5.0 - back), round(5.003 * S))
    assert now - late == pytest.approx(back * S, abs=0.1 * MS)
    assert (stream.steps, stream.strays) == (0, 0)
    assert stream.map(device.ticks(5.01), round(5.0125 * S)) == pytest.approx(now + 10 * MS, abs=MS)


@pytest.mark.parametrize("bit", range(15, 32))
def test_one_damaged_stamp_does_no_harm(bit):
    damaged = settled()
    whole = settled()
    damaged[1].map(damaged[0].ticks(5.0) ^ (1 << bit), round(5.002 * S))
    whole[1].map(whole[0].ticks(5.0), round(5.002 * S))
    for k in range(1, 500):
        t = 5.0 + 0.01 * k
        a, b = (s.map(d.ticks(t), round((t + 2e-3) * S)) for d, s in (damaged, whole))
        assert abs(a - b) < 0.5 * MS
    assert damaged[1].steps == 0


def test_a_batch_after_a_stalled_host_is_put_where_it_belongs():
    device, stream = settled()
    for k in range(1, 300):
        t = 5.0 + 0.01 * k
        mapped = stream.map(device.ticks(t), round(max(t, 7.0) * S + MS))
        assert abs(mapped / S - t - 1e-3) < 0.5e-3
    assert stream.steps == 0


def test_a_port_that_was_always_congested_is_learned_anew():
    device, stream = Device(), DeviceTime(MICROSECONDS_32)
    for k in range(2000):
        t = 0.01 * k
        delay = 0.08 if t < 5.0 else 0.001
        mapped = stream.map(device.ticks(t), round((t + delay) * S))
    assert abs(mapped / S - t - 1e-3) < 1e-4
    assert stream.steps == 0


def follow(device, stream, delays, start, hz=50.0):
    """Return the errors [s] of mapped times of messages with given delays."""
    out = []
    for k, delay in enumerate(delays):
        t = start + k / hz
        out.append(stream.map(device.ticks(t), round((t + delay) * S)) / S - t)
    return out


@pytest.mark.parametrize(("more", "seconds"), [(0.015, 60), (0.2, 90)])
def test_a_way_that_became_longer_is_followed_smoothly(more, seconds):
    device, stream = settled()
    got = follow(device, stream, [0.001 + more] * (50 * seconds), 5.0)
    rates = [50.0 * (b - a) for a, b in zip(got, got[1:], strict=False)]
    assert max(abs(r) for r in rates) < max(2e-3, more / 10.0) + 0.5e-3
    # Initially the delay is indistinguishable from drift.
    assert got[30 * 50] == pytest.approx(0.001, abs=0.01)
    assert got[-1] == pytest.approx(0.001 + more, abs=2e-3)


def test_a_way_that_became_shorter_is_known_with_the_next_stamp():
    device, stream = settled()
    got = follow(device, stream, [0.016] * 3000 + [0.001, 0.003] * 20, 5.0)
    assert max(abs(e - 0.001) for e in got[3000:]) < 0.3e-3


def test_times_do_not_fall_when_a_doubted_stamp_is_believed():
    device, stream = settled()
    # The fit rises to 80 ms after its window, mapped times follow slowly; then delays decrease.
    follow(device, stream, [0.08] * 850, 5.0, hz=20.0)
    after = follow(device, stream, [0.045] * 50, 47.5, hz=200.0)
    times = [round((k / 200.0 + error) * S) for k, error in enumerate(after)]
    assert times == sorted(times)
    assert after[0] == pytest.approx(0.045, abs=1e-6)


def test_memory_is_bounded():
    stream = LowerEnvelope(ClockParams())
    for k in range(20_000):
        stream.add(k * S // 10, k * S // 10 + k % 7)
    assert len(stream._kept) <= 81


@settings(max_examples=60)
@given(st.lists(st.tuples(st.integers(1, S), st.integers(0, S)), min_size=1, max_size=300))
def test_the_line_is_below_the_newest_point_and_its_inverse_is_right(points):
    line = LowerEnvelope(ClockParams())
    x = 0
    for gap, delay in points:
        x += gap
        line.add(x, x + delay)
        assert line.at(x) <= x + delay
        assert abs(line.inverse(line.at(x)) - x) <= 1


def test_the_line_of_clean_points_is_exact():
    line = LowerEnvelope(ClockParams())
    for k in range(400):
        x = k * S // 4
        line.add(x, 5 * S + x + x * 100 // 1_000_000 + (0 if k % 9 == 0 else 3 * MS))
    assert line.slope / (1 << 40) == pytest.approx(100e-6, abs=1e-9)
    assert line.at(99 * S) == pytest.approx(5 * S + 99 * S + 9_900_000, abs=1000)


def test_formats_without_time_were_measured_when_they_came():
    stream = HostTime()
    stream.restart()
    assert stream.map(None, 17) == stream.map(5, 17) == 17
    assert DeviceTime(MICROSECONDS_32).map(None, 17) == 17


@pytest.mark.parametrize("clock", [DeviceClock(1e6, 1 << 16), DeviceClock(0.0, 1 << 32)])
def test_a_counter_that_wraps_at_once_is_refused(clock):
    with pytest.raises(ValueError, match="clock"):
        DeviceTime(clock)


@pytest.mark.parametrize("wrong", [{"drift": 0.0}, {"window": 0.6}, {"slew": float("nan")}])
def test_parameters_are_checked(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        ClockParams(**wrong)
