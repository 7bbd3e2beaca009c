"""Distance sensors: reference implementation, closed forms, symmetries, noise, no side effects."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from relpos_env.errors import EnvError
from relpos_env.interface.rangefinders import FARTHEST, rangefinder_directions, rangefinder_origins
from relpos_env.scenarios import scenario
from relpos_env.sensors._proximity_kernels import read_proximity
from relpos_env.sensors.proximity import PROXIMITY, ProximitySimParams, fill_proximity
from relpos_env.world.arrays import box_row
from tracking.records import as_records

EXACT = ProximitySimParams(noise_std=0.0, noise_share=0.0)
SIZE = (0.21, 0.10)
HALL = (500.0, 500.0)
"""Half sides of a room whose walls are out of range."""
MIDDLE = [[0.0, 0.0, 0.0]]


def read(
    cars, *, boxes=(), room=(3.0, 2.0), n_rangefinders=16, params=EXACT, tick=1, seeds=(7,), gone=()
):
    """Return readings of cars at (x, y, heading) in one room per seed; (env, car, sensor)."""
    e, n = len(seeds), len(cars)
    p = np.zeros(e, dtype=PROXIMITY)
    for record in p:
        fill_proximity(record, params)
    body = np.zeros((e, n, 6))
    body[..., :3] = cars
    present = np.ones((e, n), dtype=bool)
    present[:, list(gone)] = False
    rows = np.tile(np.array([box_row(*b) for b in boxes]).reshape(-1, 6), (e, 1, 1))
    out = np.full((e, n, n_rangefinders), np.nan)
    read_proximity(
        as_records(p), np.array(seeds, dtype=np.uint64), np.full(e, tick),
        rangefinder_directions(n_rangefinders), body, present, np.tile(SIZE, (e, 1)),
        np.tile(room, (e, 1)), rows, out,
    )  # fmt: skip
    return out


def corners(x, y, width, depth, angle):
    c, s = math.cos(angle), math.sin(angle)
    half = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width, depth]
    return half @ np.array([[c, s], [-s, c]]) + [x, y]


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def in_cone(tip, angle, half, polygon):
    """Return the distance from the tip of a cone to a polygon in it, by clipping its sides."""
    right, left = ((math.cos(angle + h), math.sin(angle + h)) for h in (-half, half))
    shifted = polygon - tip
    sides = list(zip(shifted, np.roll(shifted, -1, axis=0), strict=True))
    if all(cross(a, b) >= 0.0 for a, b in sides):
        return 0.0
    best = math.inf
    for a, b in sides:
        low, high = 0.0, 1.0
        for at_a, at_b in (
            (cross(right, a), cross(right, b)),
            (-cross(left, a), -cross(left, b)),
        ):
            if at_a < 0.0 and at_b < 0.0:
                low, high = 1.0, 0.0
            elif at_a < 0.0 or at_b < 0.0:
                share = at_a / (at_a - at_b)
                low, high = (max(low, share), high) if at_a < 0.0 else (low, min(high, share))
        if low <= high:
            step = b - a
            share = min(max(-(a @ step) / (step @ step), low), high)
            best = min(best, float(np.hypot(*(a + share * step))))
    return best


def twin(cars, boxes, room, n_rangefinders, params):
    """Return the readings of one environment without noise, as `read`."""
    w, d, t = *room, 10.0
    solids = [
        corners(w + t, 0, 2 * t, 200, 0), corners(-w - t, 0, 2 * t, 200, 0),
        corners(0, d + t, 200, 2 * t, 0), corners(0, -d - t, 200, 2 * t, 0),
        *(corners(*b) for b in boxes),
    ]  # fmt: skip
    bodies = [corners(x, y, 2 * SIZE[0], 2 * SIZE[1], angle) for x, y, angle in cars]
    starts = rangefinder_origins(rangefinder_directions(n_rangefinders), *SIZE)
    out = np.zeros((len(cars), n_rangefinders))
    for n, (x, y, heading) in enumerate(cars):
        others = [*solids, *(body for m, body in enumerate(bodies) if m != n)]
        for b, start in enumerate(starts):
            angle = heading + 2.0 * math.pi * b / n_rangefinders
            tip = np.array([x + start * math.cos(angle), y + start * math.sin(angle)])
            found = min(in_cone(tip, angle, 0.5 * params.cone, solid) for solid in others)
            out[n, b] = min(found, params.max_range)
    return out


def scene(seed):
    """Return cars and boxes at random positions, some overlapping."""
    rng = np.random.default_rng(seed)
    cars = np.column_stack([rng.uniform(-3, 3, 4), rng.uniform(-2, 2, 4), rng.uniform(-7, 7, 4)])
    boxes = [
        (rng.uniform(-3, 3), rng.uniform(-2, 2), *rng.uniform(0.05, 1.5, 2), rng.uniform(-4, 4))
        for _ in range(3)
    ]
    return cars, boxes


@settings(max_examples=60)
@given(
    st.integers(0, 2**32),
    st.integers(1, 32),
    st.floats(0.01, 1.4),
    st.floats(0.2, FARTHEST),
)
def test_without_noise_it_is_the_twin(seed, n_rangefinders, cone, most):
    cars, boxes = scene(seed)
    params = ProximitySimParams(max_range=most, cone=cone, noise_std=0.0, noise_share=0.0)
    got = read(cars, boxes=boxes, n_rangefinders=n_rangefinders, params=params)[0]
    np.testing.assert_allclose(
        got, twin(cars, boxes, (3.0, 2.0), n_rangefinders, params), atol=1e-9
    )


@settings(max_examples=40)
@given(st.integers(0, 2**32), st.integers(1, 32), st.floats(0.0, 1.0))
def test_readings_are_within_reach(seed, n_rangefinders, noise):
    cars, boxes = scene(seed)
    params = ProximitySimParams(max_range=2.0, noise_std=noise)
    got = read(cars, boxes=boxes, n_rangefinders=n_rangefinders, params=params, gone=(1,))[0]
    assert got.min() >= 0.0
    assert got.max() <= 2.0
    assert not got[1].any()


@settings(max_examples=40)
@given(
    st.integers(0, 2**32), st.floats(-7, 7), st.floats(-50, 50), st.floats(-50, 50)
)  # fmt: skip
def test_moving_everything_changes_nothing(seed, turn, dx, dy):
    cars, boxes = scene(seed)
    c, s = math.cos(turn), math.sin(turn)

    def moved(x, y):
        return c * x - s * y + dx, s * x + c * y + dy

    there = [(*moved(x, y), heading + turn) for x, y, heading in cars]
    boxes_there = [(*moved(x, y), w, d, angle + turn) for x, y, w, d, angle in boxes]
    np.testing.assert_allclose(
        read(there, boxes=boxes_there, room=HALL), read(cars, boxes=boxes, room=HALL), atol=1e-9
    )


@given(st.integers(0, 2**32))
@settings(max_examples=20)
def test_a_quarter_turn_of_the_room_changes_nothing(seed):
    cars, boxes = scene(seed)
    turned = [(-y, x, heading + 0.5 * math.pi) for x, y, heading in cars]
    boxes_turned = [(-y, x, w, d, angle + 0.5 * math.pi) for x, y, w, d, angle in boxes]
    np.testing.assert_allclose(
        read(turned, boxes=boxes_turned, room=(2.0, 3.0)), read(cars, boxes=boxes), atol=1e-9
    )


@pytest.mark.parametrize("heading", np.linspace(-1.5, 1.5, 13))
@pytest.mark.parametrize("cone", [0.0, 0.3, math.radians(27.0)])
def test_a_wall_in_front(heading, cone):
    """The nearest side of the cone counts, from the edge of the body."""
    params = ProximitySimParams(cone=cone, noise_std=0.0, noise_share=0.0)
    got = read([[9.0, 0.0, heading]], room=(10.0, 500.0), n_rangefinders=1, params=params)[0, 0, 0]
    away = 1.0 - SIZE[0] * math.cos(heading)
    expected = min(away / math.cos(max(abs(heading) - 0.5 * cone, 0.0)), FARTHEST)
    assert got == pytest.approx(expected, rel=1e-12)


def test_beams_stand_round_the_car():
    """At 0, the clearance of each side; the first sensor points ahead, the next to the left."""
    ahead, left, behind, right = read([[0.5, 0.25, 0.0]], n_rangefinders=4)[0, 0]
    assert [ahead, left, behind, right] == pytest.approx([2.29, 1.65, 3.0, 2.15])
    assert read(MIDDLE, room=HALL, n_rangefinders=5).tolist() == [[[FARTHEST] * 5]]
    assert read(MIDDLE, boxes=[(0.71, 0.0, 0.4, 0.4, 0.0)], n_rangefinders=4)[
        0, 0, 0
    ] == pytest.approx(0.3)


def test_other_cars_and_nobody_who_is_gone():
    cars = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.5 * math.pi]]
    assert read(cars, room=HALL, n_rangefinders=4)[0, 0, 0] == pytest.approx(1.0 - 0.21 - 0.10)
    assert read(cars, room=HALL, n_rangefinders=4, gone=(1,))[0, 0].min() == FARTHEST
    touching = [[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]
    assert read(touching, room=HALL, n_rangefinders=4)[0, 0, 0] == 0.0


def test_noise():
    params = ProximitySimParams(noise_std=0.02, noise_share=0.03)
    x = np.array([
        read(MIDDLE, room=(1.21, 1.6), n_rangefinders=4, params=params, tick=k, seeds=range(20))
        for k in range(300)
    ]).reshape(-1, 4)  # fmt: skip
    np.testing.assert_allclose(x.mean(axis=0), [1.0, 1.5, 1.0, 1.5], atol=0.003)
    np.testing.assert_allclose(x.std(axis=0), [0.05, 0.065, 0.05, 0.065], rtol=0.04)
    assert np.abs(np.corrcoef(x.T) - np.eye(4)).max() < 0.05
    assert (read(MIDDLE, room=HALL, params=params) == FARTHEST).all()


def test_an_environment_of_a_batch_is_that_environment_alone():
    cars, boxes = scene(3)
    noisy = ProximitySimParams()
    batch = read(cars, boxes=boxes, params=noisy, seeds=(4, 5, 6))
    for k, seed in enumerate((4, 5, 6)):
        alone = read(cars, boxes=boxes, params=noisy, seeds=(seed,))
        assert alone[0].tobytes() == batch[k].tobytes()
    assert batch[0].tobytes() != batch[1].tobytes()


def drive(n_envs=1, steps=12, **arguments):
    """Return observations of a drive, (step, env, car, size), and the formation."""
    parts = configure({"scenario": "ring-nlos", "max_cycles": 50, **arguments})
    formation = EnvCore(parts, n_envs)
    for e in range(n_envs):
        formation.seed(e, np.random.default_rng(e))
        formation.begin([e])
    seen = []
    for k in range(steps):
        commanded = np.full((n_envs, parts.n_cars), 1.0)
        formation.step(commanded, 0.3 * math.sin(k) * commanded)
        seen.append(formation.observations.copy())
    return np.array(seen), formation


@pytest.mark.parametrize("mode", ["estimate", "estimate_cov", "ranges", "truth"])
def test_beams_change_nothing_else(mode):
    without, _ = drive(observation=mode)
    with_rangefinders, formation = drive(observation=mode, proximity=8)
    assert with_rangefinders[..., :-8].tobytes() == without.tobytes()
    near = with_rangefinders[..., -8:]
    assert near.tobytes() == near.clip(0.0, FARTHEST).tobytes()
    last = formation.parts.mode.fields[-1]
    assert (last.name, last.size, last.unit, last.limit, last.signed) == (
        "near",
        8,
        "m",
        3.0,
        False,
    )
    np.testing.assert_array_equal(
        formation.observations[..., -8:], formation.loop.swarm.proximity.astype(np.float32)
    )


def test_the_room_is_what_is_seen():
    """The check is in mid-drive, within the effects of noise and one control period."""
    place = scenario("ring-nlos")
    _, formation = drive(proximity=16)
    swarm = formation.loop.swarm
    boxes = [(o.x, o.y, o.width, o.height, o.angle) for o in place.obstacles]
    room = (0.5 * place.room[0], 0.5 * place.room[1])
    expected = twin(swarm.body[0, :, :3], boxes, room, 16, ProximitySimParams())
    np.testing.assert_allclose(swarm.proximity[0], expected, atol=0.25)


def test_a_batch_is_its_environments():
    batch, _ = drive(3, proximity=5, scenario="swarm-nlos", level=2)
    for e in range(3):
        parts = configure(
            {"scenario": "swarm-nlos", "level": 2, "max_cycles": 50, "proximity": 5}
        )  # fmt: skip
        alone = EnvCore(parts)
        alone.seed(0, np.random.default_rng(e))
        alone.begin([0])
        for k in range(len(batch)):
            commanded = np.full((1, parts.n_cars), 1.0)
            alone.step(commanded, 0.3 * math.sin(k) * commanded)
            assert alone.observations[0].tobytes() == batch[k, e].tobytes()
    absent = ~alone.state.present[0]
    assert not batch[-1, 2][absent].any()


@pytest.mark.parametrize("wrong", [-1, 33, 2.0, True, "8"])
def test_a_number_of_beams_is_refused(wrong):
    with pytest.raises(EnvError, match="^proximity: expected a whole number from 0 to 32"):
        configure({"proximity": wrong})


def test_a_scenario_file_says_what_the_sensors_do(tmp_path):
    text = "room = [4.0, 4.0]\nring = [1.0, 1.0]\n[proximity]\nmax_range = 1.5\nnoise_std = 0.0\n"
    (tmp_path / "mine.toml").write_text(text)
    parts = configure({"scenario": tmp_path / "mine.toml", "proximity": 4})
    assert parts.scenario.proximity == ProximitySimParams(max_range=1.5, noise_std=0.0)
    (tmp_path / "bad.toml").write_text(text.replace("1.5", "4.0"))
    with pytest.raises(EnvError, match="proximity.max_range: expected 0.1 to 3, got 4"):
        configure({"scenario": tmp_path / "bad.toml"})
