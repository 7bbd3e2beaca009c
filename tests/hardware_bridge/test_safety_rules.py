"""Every rule of the gate alone: at its thresholds, and with NaN."""

import numpy as np
import pytest
from safety_group import SQUARE, check, picture

from hardware_bridge.errors import BridgeError
from hardware_bridge.safety.moment import FREE
from hardware_bridge.safety.params import Fence, SafetyParams
from tracking.estimate import Status

P = SafetyParams()
NO_TIMES = (np.nan, np.inf, -np.inf, 5.0)
"""Times that are neither in the past nor recent; the clock is at 0."""


def caps(verdict):
    return float(verdict.forward[0, 0]), bool(verdict.hold[0, 0])


@pytest.mark.parametrize(("age", "hold"), [(0.0, False), (0.06, False), (0.0601, True)])
def test_silence(age, hold):
    q = picture()
    assert caps(check("silence", q, word=-age)) == (0.0 if hold else FREE, hold)


@pytest.mark.parametrize("t", NO_TIMES)
def test_no_times_are_unwell(t):
    assert caps(check("silence", picture(), word=t)) == (0.0, True)
    assert caps(check("stale", picture(), t_last_message=t)) == (0.0, True)
    assert caps(check("stale", picture(t=t))) == (0.0, True)
    q = picture()
    q.status[:], q.ranged[:] = Status.STARTING, t
    assert caps(check("unknown", q)) == (0.0, True)


@pytest.mark.parametrize(("age", "cap", "hold"), [
    (0.15, FREE, False), (0.1501, P.slow, False), (0.3, P.slow, False), (0.3001, 0.0, True),
])  # fmt: skip
def test_stale(age, cap, hold):
    assert caps(check("stale", picture(), t_last_message=-age)) == (cap, hold)
    assert caps(check("stale", picture(t=-age))) == (cap, hold)


def test_who_takes_no_part_stands():
    q = picture()
    q.present[0, 0] = 0.0
    assert caps(check("absent", q)) == (0.0, True)
    q.present[0, 0] = np.nan
    assert caps(check("absent", q)) == (0.0, True)
    assert not check("absent", q).hold[0, 1]


def test_link():
    linked = np.array([[True, False]])
    verdict = check("link", picture(), linked=linked)
    assert verdict.hold.tolist() == [[False, True]]
    assert verdict.forward.tolist() == [[FREE, 0.0]]


@pytest.mark.parametrize("sound", [0.0, np.nan])
def test_covariance_of_one_pair(sound):
    q = picture(n_cars=3)
    q.sound[0, 0, 2] = sound
    assert check("covariance", q).hold.tolist() == [[True, False, False]]
    q.status[0, 0, 2] = Status.STARTING  # there is no estimate then
    assert not check("covariance", q).hold.any()


@pytest.mark.parametrize(("sigma", "was_slow", "cap", "hold"), [
    (0.5, False, FREE, False), (0.501, False, P.slow, False), (0.45, True, P.slow, False),
    (0.4, True, FREE, False), (1.0, True, P.slow, False), (1.001, False, 0.0, True),
    (np.nan, False, 0.0, True), (np.inf, False, 0.0, True),
])  # fmt: skip
@pytest.mark.parametrize("status", [Status.OK, Status.LOST])
def test_sigma(sigma, was_slow, cap, hold, status):
    q = picture()
    q.sigma[0, 0, 1], q.status[:] = sigma, status
    assert caps(check("sigma", q, was_slow=was_slow)) == (cap, hold)


@pytest.mark.parametrize("status", [Status.STARTING, Status.AMBIGUOUS, np.nan])
def test_unknown_is_slow_where_the_range_says_far_and_stands_where_near(status):
    q = picture(spacing=3.0)
    q.status[:] = status
    assert caps(check("unknown", q)) == (P.slow, False)
    q.distance[:] = P.separation + P.range_error
    assert caps(check("unknown", q)) == (0.0, False)
    q.distance[:] = np.nan
    assert caps(check("unknown", q)) == (0.0, True)


def test_doubt_caps_by_the_distance_alone():
    q = picture(spacing=3.0)
    q.status[:] = Status.DOUBTFUL
    far = caps(check("unknown", q))[0]
    assert far > P.slow
    q.distance[:] = 1.0
    assert 0.0 < caps(check("unknown", q))[0] < 0.5 * far
    q.distance[:] = P.separation + P.range_error
    assert caps(check("unknown", q)) == (0.0, False)


@pytest.mark.parametrize(
    ("age", "cap", "hold"), [(1.0, 0.0, False), (1.001, 0.0, False), (61.0, 0.0, True)]
)
def test_a_range_says_nothing_after_a_second(age, cap, hold):
    q = picture(spacing=30.0)
    q.status[:] = Status.AMBIGUOUS
    q.ranged[:] = -age
    found = caps(check("unknown", q))
    assert found == (P.slow if age <= P.range_limit else cap, hold)


def test_a_place_that_is_no_number_is_not_known():
    q = picture()
    q.pos[0, 0, 1] = np.nan, 0.0
    q.distance[:], q.ranged[:] = np.nan, -np.inf
    assert caps(check("unknown", q)) == (0.0, True)
    assert np.isinf(check("separation", q).forward[0, 0])


def test_others_who_take_no_part_are_not_judged():
    q = picture()
    q.present[0, 1] = 0.0
    q.status[:], q.sound[:], q.sigma[:], q.pos[:] = Status.ABSENT, 0.0, np.nan, np.nan
    for name in ("covariance", "sigma", "unknown", "separation"):
        assert caps(check(name, q)) == (FREE, False)


@pytest.mark.parametrize("spoil", [("oriented", 0.0), ("heading", np.nan), ("heading", np.inf)])
def test_without_a_heading_it_stands(spoil):
    q = picture()
    getattr(q, spoil[0])[0, 0] = spoil[1]
    assert caps(check("heading", q)) == (0.0, False)


def pair(d, headings, speeds=(0.0, 0.0), sigma=0.1):
    q = picture(spacing=d, sigma=sigma)
    q.heading[0], q.speed[0] = headings, speeds
    return q


def test_separation_leaves_each_half_and_away_all():
    q = pair(2.0, (0.0, np.pi), (1.0, 1.0))
    verdict = check("separation", q)
    assert verdict.forward[0, 0] == pytest.approx(verdict.forward[0, 1])
    assert 0.5 < verdict.forward[0, 0] < P.max_speed
    assert verdict.backward[0, 0] > P.max_speed
    alone = check("separation", pair(2.0, (0.0, np.pi)))
    assert alone.forward[0, 0] > verdict.forward[0, 0]


@pytest.mark.parametrize("sigma", [0.05, 0.1, 0.2])
def test_separation_at_its_limit_lets_nobody_nearer(sigma):
    d = P.separation + P.confidence * sigma
    verdict = check("separation", pair(d, (0.0, 0.0), sigma=sigma))
    assert verdict.forward.tolist() == [[0.0, pytest.approx(verdict.forward[0, 1])]]
    assert verdict.forward[0, 1] > 0.5
    assert verdict.backward[0, 0] > 0.5
    assert verdict.backward[0, 1] == 0.0


def test_whoever_nobody_holds_to_rules_gets_all_the_room():
    armed = np.array([[True, False]])
    q = pair(2.0, (0.0, np.pi), (1.0, 1.3))
    both = check("separation", q).forward[0, 0]
    assert check("separation", q, armed=armed).forward[0, 0] < 0.9 * both


@pytest.mark.parametrize("way", [(-1.0, 0.0), (0.0, 1.0), (1.0, 0.0)])
def test_whoever_is_no_car_of_ours_is_as_fast_as_it_is_seen_to_be(way):
    """A person with a node has no telemetry, and may turn at any time."""
    armed, walking = np.array([[True, False]]), 1.4
    stands = pair(2.0, (0.0, np.pi))
    walks = pair(2.0, (0.0, np.pi))
    walks.vel[0, 0, 1] = walking * np.array(way)
    told = pair(2.0, (0.0, np.pi), (0.0, walking))
    caps = [check("separation", q, armed=armed).forward[0, 0] for q in (stands, walks, told)]
    assert caps[1] == pytest.approx(caps[2], abs=0.05)
    assert caps[1] < 0.5 * caps[0]
    # A car approaching one at rest sees it come nearer through its own motion.
    drives = pair(2.0, (0.0, np.pi), (1.0, 0.0))
    drives.vel[0, 0, 1] = -1.0, 0.0
    assert check("separation", drives, armed=armed).forward[0, 0] == pytest.approx(caps[0])


def test_a_lost_port_counts_as_a_longer_reaction():
    q = pair(2.2, (0.0, np.pi), (0.0, 0.8))
    linked = np.array([[True, False]])
    assert (
        check("separation", q, linked=linked).forward[0, 0] < check("separation", q).forward[0, 0]
    )


def test_the_age_of_the_picture_counts():
    q = pair(1.5, (0.0, np.pi))
    speeds = [check("separation", q, now=age).forward[0, 0] for age in (0.0, 0.1, 0.2)]
    assert speeds[0] > speeds[1] > speeds[2]


@pytest.mark.parametrize("name", ["sigma", "speed", "pos"])
def test_separation_of_what_is_no_number_is_none(name):
    q = pair(3.0, (0.0, np.pi))
    getattr(q, name)[:] = np.nan
    cap = check("separation", q).forward[0, 0]
    # An unknown position is handled by another rule, see above.
    assert np.isinf(cap) if name == "pos" else not cap > 0.0


def at(x, y, heading, sigma=0.05):
    q = picture(n_cars=1)
    q.place[0, 0], q.heading[0, 0], q.place_sigma[0, 0] = (x, y), heading, sigma
    return check("fence", q, SafetyParams(fence=SQUARE))


def test_fence_stops_towards_and_lets_away():
    margin = P.confidence * 0.05
    verdict = at(4.0 - margin, 2.0, 0.0)
    assert verdict.forward[0, 0] == 0.0
    assert verdict.backward[0, 0] > 0.5
    assert not verdict.hold.any()
    assert at(2.0, 2.0, 0.0).forward[0, 0] > 1.5


def test_fence_in_a_corner_leaves_the_way_out():
    assert at(3.88, 3.88, 0.25 * np.pi).forward[0, 0] == 0.0
    assert at(3.88, 3.88, 1.25 * np.pi).forward[0, 0] > 0.5


def test_outside_for_certain_is_for_good():
    assert at(4.2, 2.0, np.pi).hold[0, 0]
    near = at(4.1, 2.0, np.pi)
    assert not near.hold[0, 0]
    assert near.forward[0, 0] > 0.5
    assert near.backward[0, 0] == 0.0


@pytest.mark.parametrize("spoil", [
    ("placed", 0.0), ("placed", np.nan), ("place", np.nan), ("place", np.inf),
    ("place_sigma", np.nan), ("place_sigma", np.inf),
])  # fmt: skip
def test_no_place_no_motion(spoil):
    q = picture(n_cars=1)
    getattr(q, spoil[0])[:] = spoil[1]
    verdict = check("fence", q, SafetyParams(fence=SQUARE))
    assert not verdict.forward[0, 0] > 0.0
    assert check("fence", q).forward[0, 0] == FREE


@pytest.mark.parametrize(("options", "message"), [
    ({"silence": 0.2}, "silence"), ({"slow": 2.0}, "slow"), ({"hysteresis": 1.1}, "hysteresis"),
    ({"stale_slow": 0.4}, "stale_slow"), ({"sigma_stop": 0.4}, "sigma_slow"),
    ({"max_speed": float("nan")}, "max_speed"), ({"separation": 0.0}, "separation"),
    ({"max_steering": 24.0}, "max_steering"), ({"hardest": 1.0}, "hardest"),
])  # fmt: skip
def test_limits_that_cannot_be_meant(options, message):
    with pytest.raises(BridgeError, match=f"^{message}:"):
        SafetyParams(**options)


@pytest.mark.parametrize("corners", [
    ((0.0, 0.0), (1.0, 0.0)), ((0.0, 0.0), (1.0, 0.0), (2.0, 0.0)),
    ((0.0, 0.0), (1e5, 0.0), (0.0, 1.0)), ((0.0, 0.0), (float("nan"), 0.0), (0.0, 1.0)),
])  # fmt: skip
def test_fences_that_are_none(corners):
    with pytest.raises(BridgeError, match="^corners:"):
        Fence(node=1, corners=corners)
