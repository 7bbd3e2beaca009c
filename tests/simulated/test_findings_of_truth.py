"""Truth that is late or of other nodes is a finding, and is not taken for errors of the tracker."""

from dataclasses import replace

import numpy as np
import pytest

from agents.simulation.simulate import simulate
from tracking.findings.truth import find_truth_errors
from tracking.measurements import Kind


@pytest.fixture(scope="module", params=["cars-los", "human", "swarm-nlos"])
def log(request):
    return simulate(scenario=request.param, seconds=30.0, seed=24)


def test_right_truth_is_no_finding(log):
    assert find_truth_errors(log) == []


@pytest.mark.parametrize("late", [0.3, -0.3, 2.0])
def test_truth_on_another_clock_is_a_finding(log, late):
    wrong = replace(log, truth=replace(log.truth, t=log.truth.t + late))
    (found,) = find_truth_errors(wrong)
    assert (found.name, found.severity) == ("truth-clock", "warning")
    assert f"{abs(late):.1f} s {'later' if late > 0.0 else 'earlier'}" in found.text


def test_truth_of_other_nodes_is_a_finding(log):
    node = log.truth.node
    exchanged = np.where(node == 0, 2, np.where(node == 2, 0, node))
    (found,) = find_truth_errors(replace(log, truth=replace(log.truth, node=exchanged)))
    assert found.name == "truth-nodes"
    assert found.nodes == tuple(log.constellation.ids[n] for n in (0, 2))


@pytest.mark.parametrize("factor", [1.1, 0.9, 3.281, 1000.0])
def test_a_factor_between_ranges_and_truth_is_a_finding(log, factor):
    block = log.block
    values, ranges = block.values.copy(), block.kind[0] == Kind.RANGE
    values[0, ranges, 0] *= factor
    wrong = replace(log, block=replace(block, values=values))
    (found,) = find_truth_errors(wrong)
    assert (found.name, found.severity) == ("truth-scale", "warning")


def test_nodes_without_truth_are_no_finding(log):
    one = log.truth.node == 0
    t = log.truth
    only = type(t)(*(getattr(t, name)[one] for name in t.__slots__))
    assert find_truth_errors(replace(log, truth=only)) == []
