"""Times of samples at a constant rate, for any delays."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware_bridge.clocks import EvenTime
from hardware_bridge.clocks.even_time import MOST
from hardware_bridge.ingest.repeated_samples import FEWEST, STUCK, RepeatedSamples
from hardware_bridge.readings import Source

MS = 1_000_000
PERIOD = 10 * MS


def mapped(arrivals, rate=100.0):
    clock = EvenTime(rate)
    return [clock.map(None, t) for t in arrivals]


def gaps(times):
    return [b - a for a, b in zip(times, times[1:], strict=False)]


def in_order(delays, taken):
    """Return arrivals on a line where a late sample delays those behind it."""
    arrivals = []
    for t, delay in zip(taken, delays, strict=True):
        arrivals.append(max([t + delay, *arrivals[-1:]]))
    return arrivals


def test_in_time_it_is_the_arrival():
    arrivals = [k * PERIOD for k in range(50)]
    assert mapped(arrivals) == arrivals


@given(delays=st.lists(st.integers(0, 25 * MS), min_size=60, max_size=300))
def test_what_comes_in_bunches_has_no_gaps(delays):
    arrivals = in_order(delays, range(0, len(delays) * PERIOD, PERIOD))
    times = mapped(arrivals)
    assert all(t <= a for t, a in zip(times, arrivals, strict=True))
    assert all(0 <= gap <= 1.4 * PERIOD + 1 for gap in gaps(times))
    assert abs((times[-1] - times[0]) - PERIOD * (len(times) - 1)) <= 30 * MS


@given(
    delays=st.lists(st.integers(0, 200 * MS), min_size=2, max_size=200),
    lost=st.sets(st.integers(0, 199)),
    rate=st.floats(20.0, 400.0),
)
def test_laws_hold_whatever_comes(delays, lost, rate):
    arrivals = in_order(delays, range(0, len(delays) * PERIOD, PERIOD))
    arrivals = [t for k, t in enumerate(arrivals) if k not in lost]
    times = mapped(arrivals, rate)
    assert all(a - MOST * 1e9 - 1 <= t <= a for t, a in zip(times, arrivals, strict=True))
    assert all(gap >= 0 for gap in gaps(times))


def test_samples_that_were_lost_leave_a_gap():
    arrivals = [k * PERIOD for k in range(200) if k not in (50, 51, 120)]
    times = mapped(arrivals)
    assert times[-1] == arrivals[-1]
    assert sorted(gaps(times))[-2:] == [2 * PERIOD, 3 * PERIOD]
    assert set(gaps(times)[:-1]) <= {PERIOD, 2 * PERIOD, 3 * PERIOD}


@pytest.mark.parametrize("real", [9.9, 9.999, 10.001, 10.1])
def test_follows_a_device_that_is_not_as_fast_as_it_says(real):
    arrivals = [round(k * real * MS) for k in range(3000)]
    times = mapped(arrivals)
    assert max(abs(t - a) for t, a in zip(times, arrivals, strict=True)) < 0.4 * PERIOD
    assert max(gaps(times)) < 1.5 * PERIOD


def test_begins_anew():
    clock = EvenTime(100.0)
    assert [clock.map(None, t) for t in (0, PERIOD)] == [0, PERIOD]
    assert clock.map(None, 10**12) == 10**12
    clock.restart()
    assert clock.map(None, 10**12 + 15 * MS) == 10**12 + 15 * MS


NUMBERED, BARE = Source("1", 1, 1, 1), Source()


def judged(values, every_ms=10, source=NUMBERED):
    samples = RepeatedSamples([100.0])
    return [samples.refusal(0, source, (v, 0.0), k * every_ms * MS) for k, v in enumerate(values)]


def test_a_stuck_sensor_is_found_and_believed_again():
    said = judged([1.0, 2.0, *[3.0] * 100, 4.0])
    first = 2 + round(STUCK * 100)
    assert said == [""] * first + ["stuck"] * (102 - first) + [""]


@given(st.lists(st.integers(0, 1), max_size=100))
def test_what_changes_soon_is_never_stuck(values):
    for k, why in enumerate(judged(values)):
        assert not why or len(set(values[k - 25 : k + 1])) == 1
    for k, why in enumerate(judged(values, every_ms=1000)):
        assert bool(why) == (k + 1 >= FEWEST and len(set(values[k + 1 - FEWEST : k + 1])) == 1)


def test_copies_without_numbers_are_refused():
    samples = RepeatedSamples([100.0, 100.0])
    assert samples.refusal(0, BARE, (1.0, 0.0), 0) == ""
    assert samples.refusal(0, BARE, (1.0, 0.0), 3 * MS) == "duplicate"
    assert samples.refusal(1, BARE, (1.0, 0.0), 4 * MS) == ""
    assert samples.refusal(0, BARE, (1.0, 0.0), 8 * MS) == "", "measured once more"
    assert samples.refusal(0, BARE, (2.0, 0.0), 8 * MS) == ""
    assert samples.refusal(0, NUMBERED, (2.0, 0.0), 9 * MS) == ""
