"""Positions of an external tracker: estimates between and after the lines."""

import math

import numpy as np
import pytest

from hardware_bridge.errors import BridgeError
from hardware_bridge.external_tracker.headings import FARTHEST, Headings
from hardware_bridge.external_tracker.params import ReadyParams
from hardware_bridge.external_tracker.pending import HeadingReport, PendingReports, PositionReport
from hardware_bridge.external_tracker.perception import ReadyPerception
from hardware_bridge.external_tracker.tracks import Tracks
from hardware_bridge.live.picture import is_sound
from hardware_bridge.readings import UNNAMED, PairReading, PoseReading
from tracking.constellation import Constellation, NodeConfig
from tracking.estimate import Status
from tracking.measurements import Kind, MeasurementBlock


class Watcher:
    """A perception with manual input: nodes 0, 1, 2 move, node 3 is at rest."""

    def __init__(self, dimensions=2, **params):
        nodes = (*(NodeConfig(id=k) for k in range(3)), NodeConfig(id=3, kind="static"))
        self.group = Constellation(nodes=nodes, dimensions=dimensions)
        self.pending, self.block = PendingReports(), MeasurementBlock.empty(1, 4)
        self.block.valid[:] = False
        self.powered = np.ones((1, 3), dtype=bool)
        self.ready = ReadyPerception(
            self.group, ReadyParams(**params), self.pending, self.block, self.powered
        )

    def pair(self, t, i, j, pos, **said):
        self.pending.add_pair(t, (i, j), PairReading(UNNAMED, "", "", tuple(pos), **said))

    def node(self, t, k, pos=None, yaw=None, **said):
        q = None if yaw is None else (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
        pos = None if pos is None else tuple(pos)
        self.pending.add_pose(t, k, PoseReading(UNNAMED, "", pos, q_wb=q, **said))

    def see(self, now):
        self.ready.view.present[:] = True
        self.ready.view.now[0] = now
        self.ready.step()
        self.block.valid[:] = False
        return self.ready.view

    def status(self, i=0, j=1):
        return Status(self.ready.estimate.status[0, self.group.pair_index[i, j]])


def test_nothing_is_known_before_the_first_line():
    watcher = Watcher()
    view = watcher.see(1.0)
    assert not view.ok.any()
    assert not view.oriented.any()
    assert watcher.status() is Status.ABSENT
    assert (view.pos == 0.0).all()


def test_constant_velocity_is_carried_exactly():
    """Holds for a reported pair, and for a pair derived from the positions of its nodes."""
    watcher = Watcher(std=1e-6)
    start, vel = np.array([1.0, -2.0, 0.0]), np.array([0.5, 1.5, 0.0])
    for t in np.arange(0.0, 2.0, 0.02):
        watcher.pair(t, 1, 0, -(start + t * vel))  # reported in reverse order
        watcher.node(t, 2, start - t * vel)
        watcher.node(t, 1, (0.0, 0.0, 0.0))
        watcher.see(t)
    now = 2.07
    view = watcher.see(now)
    assert view.pos[0, 0, 1] == pytest.approx((start + now * vel)[:2], abs=1e-6)
    assert view.vel[0, 0, 1] == pytest.approx(vel[:2], abs=1e-6)
    assert view.pos[0, 1, 0] == pytest.approx(-view.pos[0, 0, 1])
    assert view.pos[0, 1, 2] == pytest.approx((start - now * vel)[:2], abs=1e-6)
    assert view.vel[0, 1, 2] == pytest.approx(-vel[:2], abs=1e-6)
    assert view.ok[0, 0, 1]
    assert view.ok[0, 1, 2]
    assert view.age[0, 0, 1] == pytest.approx(now - 1.98)


def test_a_pair_of_which_only_one_end_is_told_is_absent():
    watcher = Watcher()
    watcher.node(0.0, 0, (1.0, 2.0, 0.0))
    watcher.see(0.0)
    assert watcher.status(0, 1) is Status.ABSENT


def test_a_position_with_velocity_is_taken_as_it_is():
    watcher = Watcher(dimensions=3)
    cov = np.diag([1.0, 4.0, 9.0, 0.1, 0.2, 0.3]) + 0.01
    watcher.pair(0.0, 0, 1, (9.0, 9.0, 9.0))
    watcher.pair(
        0.5, 0, 1, (1.0, 2.0, 3.0), vel=(0.1, 0.2, 0.3), cov=tuple(cov.ravel().tolist()), nlos=0.25
    )
    view = watcher.see(0.5)
    e = watcher.ready.estimate
    assert e.pos_ij_w[0, 0].tolist() == [1.0, 2.0, 3.0]
    assert e.vel_ij_w[0, 0].tolist() == [0.1, 0.2, 0.3]
    assert e.cov[0, 0] == pytest.approx(cov)
    assert view.nlos[0, 0, 1] == 0.25
    assert view.cov[0, 0, 1] == pytest.approx((1.01, 4.01, 0.01))


def test_what_is_stale_is_lost_and_ever_less_certain():
    watcher = Watcher(stale=0.5)
    for k in range(20):
        watcher.pair(k * 0.05, 0, 1, (1.0, 0.0, 0.0))
    sigmas = []
    for age in (0.0, 0.25, 0.49, 0.51, 1.0, 3.0):
        view = watcher.see(0.95 + age)
        assert watcher.status() is (Status.OK if age < 0.5 else Status.LOST)
        assert view.ok[0, 0, 1] == (age < 0.5)
        assert view.age[0, 0, 1] == pytest.approx(age)
        assert is_sound(watcher.ready.estimate.cov[0])[0]
        sigmas.append(view.cov[0, 0, 1, 0])
    assert sigmas == sorted(sigmas)
    assert sigmas[-1] > 100 * sigmas[0]
    watcher.pair(5.0, 0, 1, (2.0, 0.0, 0.0))
    watcher.see(5.0)
    assert watcher.status() is Status.OK


def test_a_status_that_is_told_is_passed_on():
    watcher = Watcher()
    for status in Status:
        watcher.pair(1.0, 0, 1, (1.0, 0.0, 0.0), status=status)
        view = watcher.see(1.0)
        assert watcher.status() is status
        assert view.status[0, 1, 0] == status
        watcher.see(9.0)
        late = Status.LOST if status in (Status.OK, Status.LOST, Status.DOUBTFUL) else status
        assert watcher.status() is late


def test_the_newer_of_pair_and_places_is_taken():
    watcher = Watcher()
    watcher.pair(1.0, 0, 1, (1.0, 0.0, 0.0), vel=(0.0, 0.0, 0.0))
    watcher.node(0.9, 0, (0.0, 0.0, 0.0), vel=(0.0, 0.0, 0.0))
    watcher.node(1.2, 1, (5.0, 0.0, 0.0), vel=(0.0, 0.0, 0.0))
    assert watcher.see(1.2).pos[0, 0, 1, 0] == 1.0
    watcher.node(1.1, 0, (0.0, 0.0, 0.0), vel=(0.0, 0.0, 0.0))
    assert watcher.see(1.2).pos[0, 0, 1, 0] == 5.0


def test_what_stands_may_be_told_once():
    watcher = Watcher()
    watcher.node(0.0, 3, (1.0, 1.0, 0.0))
    leave(watcher, 3)
    for t in (8.0, 8.1):
        watcher.node(t, 0, (3.0, 2.0, 0.0))
        watcher.see(t)
    e = watcher.ready.estimate
    pos, vel = e.between(3, 0)
    assert watcher.status(0, 3) is Status.OK
    assert pos[0] == pytest.approx((2.0, 1.0, 0.0))
    assert vel[0] == pytest.approx(np.zeros(3), abs=1e-9)


def leave(watcher, node):
    watcher.block.valid[0, 0], watcher.block.kind[0, 0] = True, Kind.LEAVE
    watcher.block.i[0, 0] = watcher.block.j[0, 0] = node


def test_who_left_is_forgotten():
    watcher = Watcher()
    for i, j in ((0, 1), (0, 2), (1, 2)):
        watcher.pair(0.0, i, j, (1.0, 0.0, 0.0))
    watcher.node(0.0, 1, yaw=1.0)
    watcher.see(0.0)
    leave(watcher, 1)
    view = watcher.see(0.1)
    assert [watcher.status(*p) for p in ((0, 1), (1, 2), (0, 2))] == [0, 0, Status.OK]
    assert not view.oriented[0, 1]
    watcher.ready.reset()
    assert not watcher.see(0.2).ok.any()


def test_headings_are_told_or_unknown():
    watcher = Watcher(stale=0.5)
    watcher.node(0.0, 0, yaw=2.5)
    view = watcher.see(0.0)
    assert view.oriented[0].tolist() == [True, False, False]
    assert view.heading[0] == pytest.approx((2.5, 0.0, 0.0))
    assert watcher.see(0.4).oriented[0, 0]
    assert not watcher.see(0.6).oriented[0, 0]


@pytest.mark.parametrize("rate", [-3.0, 0.0, 0.7])
def test_what_turns_evenly_is_carried_exactly(rate):
    headings = Headings(1)
    for t in np.arange(0.0, 3.0, 0.02):  # across the wrap at pi and back
        yaw = 2.0 + rate * t
        headings.take([(0, HeadingReport(t, (math.cos(yaw / 2), 0, 0, math.sin(yaw / 2))))])
        assert headings.turns(t)[0] == 0.0
    assert headings.turns(t + 0.05)[0] == pytest.approx(0.05 * rate, abs=1e-12)
    assert headings.turns(t + 9.0)[0] == pytest.approx(FARTHEST * rate, abs=1e-12)


def test_a_position_is_a_distance_for_whoever_sees_ranges():
    watcher = Watcher()
    watcher.pair(0.3, 0, 1, (3.0, 4.0, 0.0), vel=(0.0, 0.0, 0.0))
    view = watcher.see(0.35)
    assert view.distance[0, 0, 1] == view.distance[0, 1, 0] == 5.0
    assert view.t_last_range[0, 0, 1] == pytest.approx(0.3)
    assert view.t_last_range[0, 0, 2] == -np.inf


def twin(pending, q, var, first_var):
    """Reference implementation of the filter of one axis, without matrices."""
    (t, z), *rest = pending
    p, v, a, b, c = z, 0.0, var, 0.0, first_var
    for t2, z2 in rest:
        dt, t = t2 - t, t2
        p += dt * v
        a, b, c = (
            a + 2 * dt * b + dt * dt * c + q * dt**3 / 3,
            b + dt * c + q * dt * dt / 2,
            c + q * dt,
        )
        k, m = a / (a + var), b / (a + var)
        innovation = z2 - p
        p, v = p + k * innovation, v + m * innovation
        a, b, c = (1 - k) * a, (1 - k) * b, c - m * b
    return p, v, a, b, c


def test_the_filter_is_its_twin():
    rng = np.random.default_rng(2)
    n = 3
    tracks = Tracks(n, np.array([1.5, 2.0, 0.5]), np.full(n, 3.0), 0.02, 0.1)
    t = np.cumsum(rng.uniform(0.0, 0.1, 40))
    z = rng.normal(size=(n, 40, 3))
    pending = [(k, PositionReport(t[m], tuple(z[k, m]), None, None, Status.OK, 0.0))
            for m in range(40) for k in range(n)]  # fmt: skip
    tracks.take(pending[:50])
    tracks.take(pending[50:])
    x, P = tracks.at(t[-1])
    for k, psd in enumerate((1.5, 2.0, 0.5)):
        for axis in range(3):
            p, v, a, b, c = twin(zip(t, z[k, :, axis], strict=True), psd**2, 0.02**2, 9.0)
            assert (x[k, axis], x[k, 3 + axis]) == pytest.approx((p, v), rel=1e-9, abs=1e-9)
            got = P[k, axis, axis], P[k, axis, 3 + axis], P[k, 3 + axis, 3 + axis]
            assert got == pytest.approx((a, b, c), rel=1e-7)


def test_the_covariance_is_that_of_the_errors():
    """The mean NEES over many runs is the dimension of the state."""
    rng = np.random.default_rng(5)
    n, steps, dt, psd, std = 400, 60, 0.05, 1.5, 0.03
    tracks = Tracks(n, np.full(n, psd), np.full(n, 3.0), std, 0.1)
    pos, vel = np.zeros((n, 3)), 3.0 * rng.normal(size=(n, 3))
    root = np.linalg.cholesky([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    for m in range(steps):
        z = pos + std * rng.normal(size=(n, 3))
        tracks.take([(k, PositionReport(m * dt, tuple(z[k]), None, None, Status.OK, 0.0))
                     for k in range(n)])  # fmt: skip
        last = np.concatenate([pos, vel], axis=1)
        noise = psd * rng.normal(size=(n, 3, 2)) @ root.T
        pos, vel = pos + dt * vel + noise[..., 0], vel + noise[..., 1]
    x, P = tracks.at((steps - 1) * dt)
    error = x - last
    nees = np.einsum("ki,kij,kj->k", error, np.linalg.inv(P), error)
    assert nees.mean() == pytest.approx(6.0, abs=4 * math.sqrt(12.0 / n))


def test_what_is_older_than_the_last_changes_nothing():
    watcher = Watcher()
    watcher.pair(1.0, 0, 1, (1.0, 0.0, 0.0))
    watcher.node(1.0, 0, yaw=1.0)
    watcher.see(1.0)
    watcher.pair(0.9, 0, 1, (7.0, 0.0, 0.0))
    watcher.node(0.9, 0, yaw=2.0)
    view = watcher.see(1.0)
    assert view.pos[0, 0, 1, 0] == pytest.approx(1.0)
    assert view.heading[0, 0] == pytest.approx(1.0)


def test_parameters_are_checked():
    with pytest.raises(BridgeError, match="stale: expected a number above 0"):
        ReadyParams(stale=0.0)
