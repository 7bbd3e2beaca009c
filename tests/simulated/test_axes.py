"""Sensor axes that differ from those of the body: readings are converted to body axes."""

from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest

from agents.simulation.simulate import simulate
from tracking.axes import Axes
from tracking.errors import ConfigError, LogError
from tracking.log import read_log, write_log
from tracking.measurements import Kind

EVERY = [
    tuple(("-" if sign else "") + name for name, sign in zip(order, signs, strict=True))
    for order in permutations("xyz")
    for signs in product((False, True), repeat=3)
]


def matrix(names):
    """Return a matrix whose rows are the body's axes in the sensor's."""
    R = np.zeros((3, 3))
    for row, name in enumerate(names):
        R[row, "xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    return R


@pytest.mark.parametrize("names", EVERY, ids=" ".join)
def test_readings_are_turned_by_the_matrix_of_the_axes(names):
    readings = np.random.default_rng(1).standard_normal((5, 3))
    axes = Axes.parse(names, mirrored=True)
    np.testing.assert_array_equal(axes.turn(readings), readings @ matrix(names).T)
    assert axes.turn_one(tuple(readings[0])) == tuple(axes.turn(readings[0]))


def test_half_of_all_axes_are_those_of_an_imu():
    right = [n for n in EVERY if np.linalg.det(matrix(n)) > 0.0]
    assert len(right) == 24
    for names in right:
        Axes.parse(names, mirrored=False)
    for names in set(EVERY) - set(right):
        with pytest.raises(ConfigError, match="right-handed"):
            Axes.parse(names, mirrored=False)


@pytest.mark.parametrize("names", [("x", "y"), ("x", "x", "z"), ("x", "y", "up"), ()])
def test_what_are_no_axes_is_refused(names):
    with pytest.raises(ConfigError, match="expected x, y and z"):
        Axes.parse(names, mirrored=True)


def test_a_log_of_a_sensor_that_is_mounted_otherwise_reads_as_one_that_is_not(tmp_path):
    log = simulate(scenario="cars-los", seconds=4.0, seed=3)
    block, imu, mag = log.block, ("-y", "x", "z"), ("-x", "-y", "z")
    values = block.values.copy()
    for kind, names, firsts in ((Kind.IMU, imu, (0, 3)), (Kind.MAG, mag, (0,))):
        rows = (block.kind[0] == kind) & (block.i[0] == 0)
        for first in firsts:
            values[0, rows, first : first + 3] @= matrix(names)  # as the sensor reads it
    folder = write_log(tmp_path / "log", replace(log, block=replace(block, values=values)))
    said = f"imu_axes = {list(imu)}\nmag_axes = {list(mag)}\n".replace("'", '"')
    meta = folder / "meta.toml"
    meta.write_text(meta.read_text().replace("[nodes.1]\n", f"[nodes.1]\n{said}"))
    read = read_log(folder)
    np.testing.assert_array_equal(read.block.values, log.block.values)
    # A log is written in axes of the body.
    again = read_log(write_log(tmp_path / "again", read))
    np.testing.assert_array_equal(again.block.values, log.block.values)
    meta.write_text(meta.read_text().replace('"-y", "x"', '"y", "x"'))
    with pytest.raises(LogError, match=r"nodes\.1\.imu_axes: expected right-handed axes"):
        read_log(folder)
