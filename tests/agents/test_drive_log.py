"""The log of a drive does not grow with its length."""

from types import SimpleNamespace

import numpy as np
import pytest

from agents.hardware.drive.log import MOST_KEPT, DriveLog

N = 3


def drive_of(decisions, cycles):
    """Return a log of `decisions` steps, each identified by its number."""
    task = SimpleNamespace(
        target=np.zeros((1, N, N, 2)), has_target=np.ones((1, N, N), bool), error=np.zeros((1, N))
    )
    group = SimpleNamespace(
        task=task,
        estimated=SimpleNamespace(present=np.ones((1, N), bool)),
        t_ns=0,
        asked=np.zeros((N, 2)),
    )
    report = SimpleNamespace(speed=np.zeros(N), steering=np.zeros(N), lag=0.0, missed=2)
    notices = [(0, "cars.1 stopped: its port is lost"), (1, "cars.1 up")]
    feed = SimpleNamespace(report=report, n_late=4, notices=notices)
    bridge = SimpleNamespace(
        feed=feed,
        config=SimpleNamespace(n_slots=N, cars=range(N), slot_of=int),
        recording_lost=None,
    )
    log = DriveLog("test", bridge, SimpleNamespace(group=group), cycles)
    log.first()
    feed.n_late = 5
    for k in range(decisions):
        group.t_ns = 1_000 + k * 100_000_000
        task.error[:], group.asked[:], report.speed[:], report.lag = k, k, 2 * k, 1.0 + k
        log.add()
    return log.result(armed=True)


@pytest.mark.parametrize("decisions", [0, 1, 7, 10])
def test_short_drives_are_kept_whole(decisions):
    result = drive_of(decisions, 10)
    assert result.decisions == len(result.t_ns) == decisions
    assert result.error.tolist() == list(range(decisions))
    assert result.command.shape == result.passed.shape == (decisions, N, 2)
    assert result.target.shape == (decisions, N, N, 2)
    assert result.passed[..., 0].tolist() == [[2.0 * k] * N for k in range(decisions)]
    assert result.seconds == pytest.approx(0.1 * max(decisions - 1, 0))
    assert (result.late_decisions, result.missed_ticks) == (1, 2)
    assert result.stops == ("cars.1 stopped: its port is lost",)
    assert result.summary["decisions"] == decisions


def test_of_long_drives_the_end_is_kept():
    result = drive_of(MOST_KEPT + 500, 10**6)
    assert result.decisions == MOST_KEPT + 500
    assert len(result.t_ns) == len(result.error) == MOST_KEPT
    assert result.error[0] == 500
    assert result.error[-1] == MOST_KEPT + 499
    assert (np.diff(result.t_ns) == 100_000_000).all()
    assert result.seconds == pytest.approx(0.1 * (MOST_KEPT + 499))
