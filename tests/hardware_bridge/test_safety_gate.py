"""The gate: arming, latched stops, limits of the output, and its invariants."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule
from safety_group import SQUARE, TICK, Driven, picture

from hardware_bridge.safety.gate import EMERGENCY, NOT_ARMED, Gate, reason_text
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.picture import Picture
from hardware_bridge.safety.rules import RULES
from tracking.estimate import Status

NAMES = [rule.name for rule in RULES]


def test_nothing_moves_before_it_is_armed():
    group = Driven()
    out = group.tick(200)
    assert not out.moving.any()
    assert not out.speed.any()
    assert (out.reason == NOT_ARMED).all()


@pytest.mark.parametrize(("ticks", "armed"), [(49, False), (50, False), (52, True)])
def test_arming_takes_half_a_second_of_health(ticks, armed):
    group = Driven()
    group.tick(ticks)  # the first tick is at 0 s of health
    assert (group.arm() == armed).all()


def test_health_begins_anew_after_every_fault():
    group = Driven()
    group.tick(40)
    group.q.sound[0, 0, 1] = 0.0
    group.tick()
    group.q.sound[:] = 1.0
    group.tick(45)
    assert group.arm().tolist() == [[False, True]]
    group.tick(10)
    assert group.arm().all()


def spoil(group, fault):
    """Inject a fault of car 0."""
    q = group.q
    if fault == "link":
        group.linked[0, 0] = False
    elif fault == "covariance":
        q.sound[0, 0, 1] = 0.0
    elif fault == "sigma":
        q.sigma[0, 0, 1] = 1.5
    elif fault == "unknown":
        q.status[0, 0, 1], q.ranged[0, 0, 1] = Status.LOST + 1, -np.inf
        q.distance[0, 0, 1] = np.nan
    elif fault == "absent":
        q.present[0, 0] = 0.0
    elif fault == "fence":
        q.place[0, 0] = 5.0, 2.0


@pytest.mark.parametrize("fault", ["link", "covariance", "sigma", "unknown", "absent", "fence"])
def test_what_was_stopped_for_good_moves_only_after_arming(fault):
    group = Driven(SafetyParams(fence=SQUARE)).drive()
    well = Picture(*(each.copy() for each in group.q))
    spoil(group, fault)
    out = group.tick()
    assert out.moving.tolist() == [[False, True]]
    assert out.speed[0, 0] == out.steering[0, 0] == 0.0
    assert out.reason[0, 0] == NAMES.index(fault)
    assert not group.arm()[0, 0]
    group.q, group.linked[:] = well, True
    out = group.tick(300)
    assert not out.moving[0, 0]
    assert out.reason[0, 0] == NAMES.index(fault)  # the reason is kept
    assert group.arm().all()
    assert group.tick(10).speed[0, 0] > 0.0


def test_silence_stops_all_and_a_word_alone_starts_nothing():
    group = Driven().drive()
    assert group.tick(5, word=False).moving.all()
    out = group.tick(2, word=False)
    assert not out.moving.any()
    assert "sign of life" in reason_text(int(out.reason[0, 0]))
    assert not group.tick(100).moving.any()


def test_a_stale_node_is_slow_and_then_stops():
    group = Driven().drive()
    group.tick(14, heard=False)
    assert (group.out.speed > 0.5).all()
    group.tick(2, heard=False)
    assert (group.out.speed == group.params.slow).all()
    group.tick(15, heard=False)
    assert not group.out.moving.any()
    group.tick(49)
    assert not group.arm().any()
    group.tick(3)
    assert group.arm().all()


def test_a_car_that_is_slow_by_sigma_is_slow_until_it_is_well_below():
    group = Driven(spacing=5.0).drive()
    for sigma, slow in ((0.49, False), (0.51, True), (0.45, True), (0.39, False), (0.49, False)):
        group.q.sigma[:] = sigma
        assert (group.tick(50).cap <= group.params.slow).all() == slow


def test_emergency_is_latched_until_cleared_and_armed():
    group = Driven().drive()
    group.gate.stop()
    out = group.tick()
    assert not out.moving.any()
    assert (out.reason == EMERGENCY).all()
    group.tick(100)
    assert not group.arm().any()
    group.gate.clear()
    assert not group.tick(100).moving.any()
    assert (group.out.reason == NOT_ARMED).all()
    assert group.arm().all()
    assert group.tick().moving.all()


def test_disarmed_cars_stand():
    group = Driven().drive()
    group.gate.disarm()
    out = group.tick()
    assert not out.moving.any()
    assert not out.speed.any()


def test_commands_rise_no_faster_than_allowed_and_fall_at_once():
    group = Driven()
    group.tick(60)
    group.arm()
    speeds, angles = [0.0], [0.0]
    group.q.requested_steering[:] = 1.0
    for _ in range(30):
        out = group.tick()
        speeds.append(out.speed[0, 0])
        angles.append(out.steering[0, 0])
    p = group.params
    assert np.diff(speeds).max() <= p.max_accel * TICK + 1e-12
    assert np.diff(angles).max() <= p.max_steering_rate * TICK + 1e-12
    assert angles[-1] == p.max_steering
    group.q.requested_speed[:] = 0.0
    assert (group.tick().speed == 0.0).all()
    group.q.requested_speed[:] = -3.0
    assert group.tick().speed == pytest.approx(np.full((1, 2), -p.max_accel * TICK))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e308, -1e308])
@pytest.mark.parametrize("name", Picture._fields)
def test_what_is_no_number_moves_nothing_beyond_what_is_allowed(name, value):
    group = Driven(SafetyParams(fence=SQUARE), spacing=1.5).drive()
    before = group.tick()
    p = group.params
    fresh = name not in ("t", "ranged")
    getattr(group.q, name)[:] = value
    for _ in range(20):
        out = group.tick(fresh=fresh)
        assert np.isfinite(out.speed).all()
        assert np.isfinite(out.steering).all()
        assert (np.abs(out.speed) <= p.max_speed).all()
        assert (np.abs(out.steering) <= p.max_steering).all()
    if name in ("requested_speed", "requested_steering", "distance", "ranged", "vel"):
        return  # commands, and values without effect while positions are known
    if name == "speed":
        assert (out.speed <= before.speed + 1e-9).all()
    elif name in ("status", "pos"):
        assert (out.speed <= p.slow).all() or np.isfinite(value)  # ranges are known
    elif not (name in ("heading", "place") and np.isfinite(value)):
        assert not out.speed.any(), name


def test_one_of_a_batch_is_as_if_alone():
    rng = np.random.default_rng(4)
    n_envs, n_cars = 5, 3
    params = SafetyParams(fence=SQUARE)
    batch = Gate(params, n_envs, n_cars)
    alone = [Gate(params, 1, n_cars) for _ in range(n_envs)]
    everyone = np.ones((n_envs, n_cars), dtype=bool)
    for tick in range(150):
        now = np.full(n_envs, tick * TICK)
        if tick % 10 == 0:
            q = picture(n_envs, n_cars, t=tick * TICK, spacing=1.3)
            for each in (q.requested_speed, q.requested_steering, q.speed):
                each[:] = rng.uniform(-2.0, 2.0, each.shape)
            q.heading[:] = rng.uniform(-3.0, 3.0, q.heading.shape)
            q.place[:] = rng.uniform(0.2, 3.8, q.place.shape)
            q.sigma[:] = rng.uniform(0.02, 0.55, q.sigma.shape)
        word = now - rng.choice([0.0, 0.2], n_envs, p=[0.99, 0.01])
        linked = rng.random((n_envs, n_cars)) < 0.998
        heard = now[:, None] - rng.uniform(0.0, 0.2, (n_envs, n_cars))
        out = batch.step(q, now, word, heard, linked)
        batch.arm(now, everyone)
        for e in range(n_envs):
            here = slice(e, e + 1)
            own = alone[e].step(
                Picture(*(each[here] for each in q)), now[here], word[here], heard[here],
                linked[here],
            )  # fmt: skip
            alone[e].arm(now[here], everyone[here])
            for name in ("speed", "steering", "moving", "armed", "cap", "reason"):
                assert np.array_equal(getattr(own, name), getattr(out, name)[here]), name
    assert batch.armed.any()


numbers = st.one_of(st.floats(-4.0, 4.0), st.floats(allow_nan=True, allow_infinity=True))


class Gates(RuleBasedStateMachine):
    """Any sequence of events at a gate."""

    def __init__(self):
        super().__init__()
        self.group = Driven(SafetyParams(fence=SQUARE))
        self.group.tick()
        self.may_move = np.zeros((1, 2), dtype=bool)

    def seen(self, out):
        """Check that a stopped car does not move before it is armed again."""
        assert not (out.moving & ~self.may_move).any()
        self.may_move &= out.moving

    @rule(n=st.integers(1, 80))
    def all_well(self, n):
        for _ in range(n):
            self.seen(self.group.tick())

    @rule()
    def mend(self):
        self.group.q = picture(t=float(self.group.now[0]))
        self.group.linked[:] = True

    @rule(n=st.integers(1, 40), word=st.booleans(), heard=st.booleans(), fresh=st.booleans())
    def partly(self, n, word, heard, fresh):
        for _ in range(n):
            self.seen(self.group.tick(word=word, heard=heard, fresh=fresh))

    @rule()
    def fall_silent(self):
        """After the timeout all cars stop, from any state."""
        for _ in range(7):
            out = self.group.tick(word=False)
            self.seen(out)
        assert not out.moving.any()
        assert not out.speed.any()

    @rule(name=st.sampled_from(Picture._fields), value=numbers, car=st.integers(0, 1))
    def spoil(self, name, value, car):
        getattr(self.group.q, name)[(0,) if name == "t" else (0, car)] = value

    @rule(car=st.integers(0, 1), up=st.booleans())
    def port(self, car, up):
        self.group.linked[0, car] = up

    @rule()
    def arm(self):
        well = self.group.gate.well_for(self.group.now) >= self.group.params.health
        was = self.group.gate.armed.copy()
        armed = self.group.arm()
        assert not (armed & ~was & ~well).any()
        assert not (armed & self.group.gate.emergency[:, None]).any()
        self.may_move |= armed

    @rule()
    def stop(self):
        self.group.gate.stop()
        self.may_move[:] = False

    @rule()
    def clear(self):
        self.group.gate.clear()

    @rule()
    def disarm(self):
        self.group.gate.disarm()
        self.may_move[:] = False

    @invariant()
    def within_limits(self):
        out, p = self.group.out, self.group.params
        assert (np.abs(out.speed) <= p.max_speed).all()
        assert (np.abs(out.steering) <= p.max_steering).all()
        assert not out.speed[~out.moving].any()


Gates.TestCase.settings = settings(max_examples=20, stateful_step_count=20)
TestGates = Gates.TestCase


@given(st.lists(st.floats(-3.0, 3.0), min_size=5, max_size=30))
@settings(max_examples=8)
def test_whatever_is_wanted_the_cap_holds(wishes):
    group = Driven(SafetyParams(fence=SQUARE), spacing=1.0).drive()
    for wish in wishes:
        group.q.requested_speed[:] = wish
        out = group.tick(3)
        assert (np.abs(out.speed) <= out.cap + 1e-12).all()
