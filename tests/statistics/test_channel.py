"""Radio channel against real ranges, published figures and its own properties."""

import itertools
from dataclasses import replace
from pathlib import Path
from runpy import run_path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from relpos_env.sensors.radio._air_kernels import make_nodes, next_window, receive_message
from relpos_env.sensors.radio._air_state import LATENT, NODE, RECEPTION, make_channel
from relpos_env.sensors.radio._channel_kernels import KNOT
from relpos_env.sensors.radio._occlusion_kernels import crosses_box, crosses_capsule
from relpos_env.sensors.radio.channel import CALIBRATED, EXACT, HALL, INDOOR, OUTDOOR
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.sensors.radio.radio import Radio
from tracking.ranging.frames.timestamps import METRES_PER_TICK, SPEED_OF_LIGHT

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = run_path(str(ROOT / "examples" / "channel_against_data.py"))
simulate = EXAMPLE["simulate"]
IN_SIGHT, BEHIND = False, True


def standing(channel, nlos, pairs=4000, distance=4.0, seconds=0.05):
    """Return ranges of pairs at rest: place, time and (error, received power, gap) of each."""
    return simulate(channel, np.full(pairs, distance), np.full(pairs, nlos), seconds)


def independent(channel, nlos):
    """Return one range of every pair: (error, received power, gap)."""
    place, _, values = standing(channel, nlos)
    return values[np.unique(place, return_index=True)[1]]


def circling(channel, speed, seconds, pairs, radius=5.0, dt=0.01):
    """Move one node around the other; return (way [m], error [m]) of the ranges of every pair."""
    radio = Radio(RadioSimParams(channel=channel), 2, list(range(pairs)), dt)
    for k, node in itertools.product(range(pairs), range(2)):
        radio.switch_on(k, node, boot=node, after=0.002 * node)

    def where(t):
        angle = speed * t / radius
        pos = np.zeros((pairs, 2, 3))
        pos[:, 1, :2] = radius * np.cos(angle), radius * np.sin(angle)
        return pos

    found = []
    chord = 2.0 * radius * np.sin(0.5 * speed * dt / radius)
    for w in range(round(seconds / dt)):
        ranges = radio.step(where(w * dt), where((w + 1) * dt))
        k, slot = np.nonzero(np.arange(ranges.t.shape[1]) < ranges.count[:, None])
        t = ranges.t[k, slot]
        share = t / dt % 1.0  # nodes move straight within a window
        true = np.sqrt(radius**2 - share * (1.0 - share) * chord**2)
        found.append((k, t * chord / dt, ranges.values[k, slot, 0] - true))
    pair, way, error = (np.concatenate(part) for part in zip(*found, strict=True))
    return [(way[pair == k], error[pair == k]) for k in range(pairs)]


def autocorrelation(tracks, lag, width):
    """Return the autocorrelation of errors at a distance lag, over tracks of zero mean."""
    products, square = [], np.mean(np.concatenate([error for _, error in tracks]) ** 2)
    for way, error in tracks:
        later = np.searchsorted(way, way + lag - width)
        k = np.flatnonzero(later < len(way))
        k = k[way[later[k]] < way[k] + lag + width]
        products.append(error[k] * error[later[k]])
    return np.mean(np.concatenate(products)) / square


class Line:
    """Nodes and single messages between them, as in `radio.air`."""

    def __init__(self, channel, pos, seed=1, clock_offset=0.0):
        n = len(pos)
        self.channel, self.seed = make_channel(channel, KNOT), np.uint64(seed)
        self.nodes, self.heard = np.zeros(n, dtype=NODE), np.zeros(n, dtype=RECEPTION)
        self.latents = np.zeros((n, n), dtype=LATENT)
        self.latents["knot"] = -1
        make_nodes(self.nodes, self.seed, clock_offset, 0.0)
        self.pos, self.dt, self.window = np.array(pos, dtype=np.float64), 0.01, 0

    def move(self, pos):
        """Move to other places in one window."""
        pos = np.array(pos, dtype=np.float64)
        self.nodes["step"] = np.linalg.norm(pos - self.pos, axis=1)
        next_window(self.nodes, self.seed, self.window, 0.0, self.dt)
        self.window += 1
        self.pos, self.nodes["step"] = pos, 0.0

    def send(self, s, r, boxes=(), capsules=(), t=0.0):
        """Return the reception by r of a message of s at a time in the window, None if lost."""
        boxes = np.array(boxes, dtype=np.float64).reshape(-1, 6)
        capsules = np.array(capsules, dtype=np.float64).reshape(-1, 7)
        heard = receive_message(
            self.channel, self.latents, self.seed, self.nodes, s, r, t,
            (self.pos, self.pos, self.dt), boxes, capsules, self.heard,
        )  # fmt: skip
        self.nodes["sent"][s] += 1
        return self.heard[r].copy() if heard else None

    def flown(self, r, heard):
        """Return the distance given by the stamp of a message sent at time 0 [m]."""
        node = self.nodes[r]
        ticks = float(heard["stamp"] - node["base"]) - node["frac"]
        return ticks / node["rate"] * SPEED_OF_LIGHT


# Real ranges


def test_the_outdoor_channel_is_that_of_the_real_ranges(data):
    limits = dict(zip(EXAMPLE["QUANTITIES"], (0.015, 1.2, 0.3), strict=True))
    for (name, label), (real, simulated, weight) in EXAMPLE["compare"](
        data / "uwb_error" / "outdoor_static_hanyang.csv.gz"
    ).items():
        off = EXAMPLE["quantiles"](simulated, weight) - EXAMPLE["quantiles"](real)
        assert np.abs(off).max() < limits[name], (name, label, off)


@pytest.mark.parametrize("distance", [3.0, 30.0])
def test_nodes_that_stand_keep_their_error(distance):
    """2.5 cm of white noise about a constant error."""
    pairs = 200
    place, _, values = standing(OUTDOOR, IN_SIGHT, pairs, distance, seconds=1.0)
    errors = [values[place == k, 0] for k in range(pairs)]
    assert np.sqrt(np.mean([e.var() for e in errors])) == pytest.approx(0.025, abs=0.003)
    halves = np.array([[e[: len(e) // 2].mean(), e[len(e) // 2 :].mean()] for e in errors])
    # Means of 65 ranges that are slightly correlated, since successive ones share stamps.
    assert np.std(halves[:, 0] - halves[:, 1]) < 1.3 * 0.025 * np.sqrt(2 / 65)
    assert np.std(halves[:, 0]) == pytest.approx(np.hypot(0.0246, 0.015), rel=0.2)
    for lag in (2, 3, 5, 20):
        r = [np.mean((e[lag:] - e.mean()) * (e[:-lag] - e.mean())) / e.var() for e in errors]
        assert abs(np.mean(r)) < 0.05, lag


# Published figures


@pytest.fixture(scope="module")
def in_sight():
    return {name: independent(channel, IN_SIGHT) for name, channel in PLACES.items()}


@pytest.fixture(scope="module")
def behind():
    return {name: independent(channel, BEHIND) for name, channel in PLACES.items()}


PLACES = {"calibrated": CALIBRATED, "indoor": INDOOR, "hall": HALL}


@pytest.mark.parametrize(("place", "std"), [("calibrated", 0.06), ("indoor", 0.11), ("hall", 0.11)])
def test_errors_in_sight(in_sight, place, std):
    error = in_sight[place][:, 0]
    assert error.std() == pytest.approx(std, rel=0.05)
    assert abs(error.mean()) < 4.0 * std / np.sqrt(len(error))


def test_errors_indoors_behind_obstacles(behind):
    error = behind["indoor"][:, 0]
    assert error.mean() == pytest.approx(0.23, abs=0.025)
    assert error.std() == pytest.approx(0.38, abs=0.025)
    assert np.mean(error > 0.5) == pytest.approx(0.17, abs=0.02)


def test_errors_in_a_hall_behind_obstacles(behind):
    error = behind["hall"][:, 0]
    assert error.mean() == pytest.approx(0.94, abs=0.06)
    assert error.std() == pytest.approx(0.94, abs=0.06)
    assert np.median(error) == pytest.approx(0.58, abs=0.07)


@pytest.mark.parametrize("place", PLACES)
def test_power_gaps(in_sight, behind, place):
    gap = in_sight[place][:, 2]
    assert 2.0 < np.quantile(gap, 0.16) < np.quantile(gap, 0.84) < 4.0
    assert np.mean(gap > 6.0) < 0.02
    assert behind[place][:, 2].mean() == pytest.approx(8.0, abs=0.2)
    assert np.mean(behind[place][:, 2] > 6.0) > 0.7


def test_errors_indoors_follow_the_way():
    """The reference is for a person who walks at 2 m/s: after 50 ms and after a second."""
    tracks = circling(INDOOR, speed=2.0, seconds=8.0, pairs=800)
    assert np.concatenate([error for _, error in tracks]).std() == pytest.approx(0.11, rel=0.05)
    assert autocorrelation(tracks, 0.1, 0.008) == pytest.approx(0.85, abs=0.03)
    assert autocorrelation(tracks, 2.0, 0.008) == pytest.approx(0.50, abs=0.03)


# No errors


@pytest.mark.parametrize("nlos", [IN_SIGHT, BEHIND])
@pytest.mark.parametrize("distance", [0.5, 5.0, 59.0])
def test_without_noise_a_range_is_the_distance(distance, nlos):
    _, _, values = standing(EXACT, nlos, 100, distance, seconds=0.2)
    assert np.abs(values[:, 0]).max() < METRES_PER_TICK
    assert abs(values[:, 0].mean()) < 3e-4
    np.testing.assert_allclose(values[:, 2], 8.0 if nlos else 3.0)
    arrives = EXACT.power_1m - 20.0 * np.log10(distance) - (EXACT.attenuation if nlos else 0.0)
    above = EXACT.knee * np.logaddexp(0.0, (EXACT.ceiling - arrives) / EXACT.knee)
    np.testing.assert_allclose(values[:, 1], EXACT.ceiling - above)


def test_without_noise_a_range_is_the_distance_of_its_moment():
    error = np.concatenate([error for _, error in circling(EXACT, 4.0, 1.0, 20)])
    assert np.abs(error).max() < METRES_PER_TICK
    assert abs(error.mean()) < 3e-4


def test_a_message_tells_the_distance_and_the_clocks():
    line = Line(EXACT, [[0.0, 0, 0], [7.3, 0, 0], [7.3, 4.1, 1.2]], clock_offset=1e-5)
    rate = line.nodes["rate"]
    for s, r in itertools.permutations(range(3), 2):
        heard = line.send(s, r)
        distance = np.linalg.norm(line.pos[s] - line.pos[r])
        assert line.flown(r, heard) == pytest.approx(distance, abs=0.51 * METRES_PER_TICK)
        assert heard["carrier"] == pytest.approx(rate[r] / rate[s] - 1.0, abs=1e-12)


# Properties

WALL = [2.0, 0.0, 0.1, 5.0, 1.0, 0.0]


def story(channel, seed, skip=0, walls=()):
    """Exchange messages while node 1 walks away; some are not received."""
    line = Line(channel, [[0.0, 0, 0], [3.0, 0, 0]], seed)
    heard = []
    for k in range(300):
        s = k % 2
        if skip and k % skip == 0:
            line.nodes["sent"][s] += 1
            heard.append(None)
        else:
            heard.append(line.send(s, 1 - s, walls, t=0.005))
        if k % 3 == 0:
            line.move(line.pos + [[0.0, 0, 0], [0.017, 0.011, 0]])
    return heard


def assert_same(some, others):
    """Assert that messages received in both are equal in every number."""
    both = [(a, b) for a, b in zip(some, others, strict=True) if a is not None and b is not None]
    assert all(a == b for a, b in both)
    return len(both)


@pytest.mark.parametrize("walls", [(), (WALL,)])
@pytest.mark.parametrize("channel", [INDOOR, OUTDOOR])
def test_same_seed_same_messages(channel, walls):
    once = story(channel, 5, walls=walls)
    assert assert_same(once, story(channel, 5, walls=walls)) > 200
    other = story(channel, 6, walls=walls)
    different = [a != b for a, b in zip(once, other, strict=True) if not (a is None or b is None)]
    assert all(different)


@pytest.mark.parametrize("walls", [(), (WALL,)])
def test_a_lost_message_changes_no_other(walls):
    sure = replace(INDOOR, loss=0.0, loss_nlos=0.0)
    often = replace(INDOOR, loss=0.5, loss_nlos=0.5)
    whole = story(sure, 5, walls=walls)
    assert all(heard is not None for heard in whole)
    assert 100 < assert_same(whole, story(often, 5, walls=walls)) < 200
    assert assert_same(whole, story(sure, 5, skip=3, walls=walls)) == 200


def test_as_many_messages_are_lost_as_the_place_says():
    line = Line(replace(INDOOR, loss=0.1, loss_nlos=0.4), [[0.0, 0, 0], [4.0, 0, 0]])
    n = 4000
    for walls, share in (((), 0.1), ((WALL,), 0.4)):
        lost = sum(line.send(0, 1, walls) is None for _ in range(n)) / n
        assert abs(lost - share) < 4.0 * np.sqrt(share * (1.0 - share) / n)


def test_both_ways_share_the_error_of_the_path_but_no_noise():
    line = Line(INDOOR, [[0.0, 0, 0], [4.0, 0, 0]])
    sent = [[line.send(s, 1 - s) for _ in range(1000)] for s in (0, 1)]
    flown = [
        np.array([line.flown(1 - s, heard) for heard in sent[s] if heard is not None])
        for s in (0, 1)
    ]
    noise = INDOOR.stamp_std * SPEED_OF_LIGHT
    assert abs(flown[0].mean() - flown[1].mean()) < 4.0 * noise * np.sqrt(2 / 1000)
    n = min(map(len, flown))
    assert abs(np.corrcoef(flown[0][:n], flown[1][:n])[0, 1]) < 4.0 / np.sqrt(n)
    assert flown[0].std() == pytest.approx(noise, rel=0.1)


# Obstacles

POINT = st.tuples(*[st.floats(-3.0, 3.0)] * 3)
ALONG = np.linspace(0.0, 1.0, 1001)[:, None]


@settings(max_examples=400, derandomize=True)
@given(POINT, POINT, POINT, st.floats(0.01, 2.0), st.floats(0.01, 2.0), st.floats(-4.0, 4.0))
def test_boxes_hide_what_points_along_the_line_say(a, b, centre, width, depth, angle):
    c, s = np.cos(angle), np.sin(angle)
    box = np.array([centre[0], centre[1], width, depth, c, s])
    points = np.array(a[:2]) + ALONG * (np.array(b[:2]) - a[:2]) - centre[:2]
    # Distance of each point outside the box along the axis on which it is farthest.
    outside = np.maximum(np.abs(points @ [c, s]) - width, np.abs(points @ [-s, c]) - depth).min()
    spacing = 0.001 * np.linalg.norm(np.subtract(b, a)[:2])
    hidden = crosses_box(a[0], a[1], b[0], b[1], box, 0.0)
    if outside < -1e-9:
        assert hidden
    if outside > 0.5 * spacing + 1e-9:
        assert not hidden


def nearest(points, p, q):
    """Return the distance of the nearest point from a segment."""
    p, v = np.array(p), np.subtract(q, p)
    length2 = v @ v
    t = np.clip((points - p) @ v / length2, 0.0, 1.0) if length2 > 0.0 else np.zeros(len(points))
    return np.linalg.norm(points - p - t[:, None] * v, axis=1).min()


def check_capsule(a, b, p, q, radius, skin):
    away = nearest(np.array(a) + ALONG * np.subtract(b, a), p, q)
    spacing = 0.001 * np.linalg.norm(np.subtract(b, a))
    hidden = crosses_capsule(*a, *b, np.array([*p, *q, radius]), skin)
    if away < skin * radius - 1e-6:
        assert hidden
    if away > skin * radius + 0.5 * spacing + 1e-6:
        assert not hidden


@settings(max_examples=400, derandomize=True)
@given(POINT, POINT, POINT, POINT, st.floats(0.01, 1.0), st.floats(0.5, 1.0))
@example((-2.0, 0.1, 0.0), (2.0, 0.1, 0.0), (-0.5, 0.0, 0.0), (0.5, 0.0, 0.0), 0.2, 0.9)
@example((-2.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (-0.5, 0.0, 0.0), (0.5, 0.0, 0.0), 0.2, 0.9)
def test_capsules_hide_what_points_along_the_line_say(a, b, p, q, radius, skin):
    check_capsule(a, b, p, q, radius, skin)


def test_a_ball_hides_what_is_behind_it():
    check_capsule((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.2, 0.9)
