"""Checks of a live swarm: they find what a recording of it would show."""

import pickle
import time
from dataclasses import replace

import numpy as np
import pytest

from agents.hardware.live import checks
from agents.hardware.live.checks import PERIOD, Checks
from agents.simulation.simulate import simulate
from tracking.measurements import Kind, MeasurementBlock


@pytest.fixture(scope="module")
def log():
    return simulate(scenario="cars-los", seconds=PERIOD + 2.0, seed=11)


def feed(running, log):
    """Feed a log second by second, then wait for the findings."""
    found, t = [], log.block.t[0]
    for second in range(int(log.duration) + 1):
        found += running.step(second + 1.0, log.block.take((t >= second) & (t < second + 1)))
    return found + wait(running, log.duration)


def wait(running, now):
    """Step without measurements until no check runs; return its findings."""
    deadline, nothing = time.monotonic() + 240.0, MeasurementBlock.empty(1, 1)
    found = running.step(now, nothing)
    while running._process is not None and time.monotonic() < deadline:
        time.sleep(0.1)
        found += running.step(now, nothing)
    assert running._process is None
    return found


def in_g(log, node):
    """Return a log with the accelerations of one node in g."""
    rows = np.flatnonzero((log.block.kind[0] == Kind.IMU) & (log.block.i[0] == node))
    values = log.block.values.copy()
    values[0, rows, 3:6] /= 9.81
    return replace(log, block=replace(log.block, values=values))


def test_nothing_is_found_in_a_right_swarm(log):
    running = Checks(log.name, log.constellation, None)
    try:
        assert feed(running, log) == running.findings == []
    finally:
        running.close()


def test_a_wrong_unit_is_reported_once_while_the_swarm_runs(log):
    running = Checks(log.name, log.constellation, None)
    try:
        first = feed(running, in_g(log, 1))
        running._due = 0.0
        again = wait(running, log.duration)
    finally:
        running.close()
    node = log.constellation.ids[1]
    assert [(f.name, f.nodes) for f in running.findings] == [("accel-units", (node,))]
    (text,) = first
    assert "they seem to be in g" in text
    assert again == []


def test_a_check_that_fails_ends_the_checks_and_not_the_run(log, monkeypatch):
    nonsense = pickle.dumps("no log")
    monkeypatch.setattr(checks.pickle, "dumps", lambda log: nonsense)
    running = Checks(log.name, log.constellation, None)
    try:
        (text,) = feed(running, log)
        assert text.startswith("measurements are no longer checked")
        running._due = 0.0
        assert wait(running, log.duration) == []
    finally:
        running.close()


def test_a_full_disk_ends_the_checks_and_not_the_run(log, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(checks.Path, "write_bytes", full)
    running = Checks(log.name, log.constellation, None)
    try:
        (text,) = feed(running, log)
    finally:
        running.close()
    assert "No space left" in text


def test_too_few_ranges_are_not_checked(log):
    running = Checks(log.name, log.constellation, None)
    few = replace(log, block=log.block.take(log.block.kind[0] != Kind.RANGE))
    try:
        assert feed(running, few) == []
    finally:
        running.close()
