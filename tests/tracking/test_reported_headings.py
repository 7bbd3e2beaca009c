"""The headings that `joint` reports: those told, less the errors that it found in them."""

import numpy as np
import pytest

from tracking import Tracker
from tracking.filters.joint._estimate_kernels import turn_heading
from tracking.geometry import quat_from_yaw, quat_multiply, yaw_of
from tracking.measurements import Kind, MeasurementBlock


def misread(block, node, error):
    """Samples of a node whose heading is told wrong by an angle [rad], and what goes with it."""
    values = block.values.copy()
    its = (block.kind == Kind.STATE) & (block.i == node)
    c, s = np.cos(error), np.sin(error)
    x, y = values[its, 4].copy(), values[its, 5].copy()
    values[its, 4], values[its, 5] = c * x - s * y, s * x + c * y
    values[its, :4] = quat_multiply(quat_from_yaw(np.array(error)), values[its, :4])
    return MeasurementBlock(*(values if a is block.values else a for a in block.arrays))


@pytest.mark.parametrize("dimensions", [2, 3])
def test_a_heading_that_is_told_wrong_is_reported_less_wrong(make_group, dimensions):
    """The nodes drive circles, so their ways say a little of how they are turned."""
    group, error = make_group(dimensions=dimensions, seconds=20.0), 0.08
    block = misread(group.block, 1, error)
    told = Tracker(group.constellation, filter="ekf-mds").run(block, group.t[-1:]).q_wb[0, -1]
    found = Tracker(group.constellation).run(block, group.t[-1:]).q_wb[0, -1]
    assert yaw_of(told)[1] == pytest.approx(error)
    assert np.abs(yaw_of(found)[1]) < 0.8 * error
    assert np.abs(np.delete(yaw_of(found), 1)).max() < 0.2 * error
    np.testing.assert_allclose(np.linalg.norm(found, axis=-1), 1.0, atol=1e-12)


def test_to_turn_a_heading_is_a_product_of_quaternions():
    q = np.random.default_rng(0).normal(size=4)
    expected = quat_multiply(quat_from_yaw(np.array(0.7)), q)
    turn_heading(q, 0.7)
    np.testing.assert_allclose(q, expected, atol=1e-15)
