"""Initial values of the joint filter: headings, NLOS probabilities, and speeds after an impact."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracking import Constellation, NodeConfig
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.ekf.columns import DV, NOISE
from tracking.filters.joint.ekf.preintegration import process_attitude
from tracking.filters.joint.hypotheses.initialisation import (
    initial_nlos_prob,
    initialise_node,
    initialise_pair,
)
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.state import JointState, make_state
from tracking.measurements import N_VALUES
from tracking.records import as_records
from tracking.vehicles import VEHICLES


def one_env(vehicle="car"):
    """Return the coefficients and one environment of three nodes, before any measurement."""
    nodes = tuple(NodeConfig(id=k, vehicle=vehicle) for k in (1, 2, 3))
    constellation = Constellation(nodes=nodes, dimensions=2)
    c = as_records(make_coefficients(constellation, JointParams()))[0]
    batch = make_state(constellation, JointParams(), 1, 1)
    return c, JointState._make(as_records(a[0]) if a.dtype.names else a[0] for a in batch)


@pytest.mark.parametrize(("vehicle", "accel", "is_blow"), [
    ("car", 60.0, False), ("car", 78.5, True), ("hand", 78.5, False),
])  # fmt: skip
def test_after_a_blow_the_speed_is_uncertain(vehicle, accel, is_blow):
    c, s = one_env(vehicle)
    values = np.zeros((1, 3, N_VALUES))
    values[..., 0] = 1.0  # level, and pointing along x
    values[0, 1, 4] = accel
    for k, t in enumerate((0.0, 0.01, 0.02)):
        process_attitude(c, s.nodes, s.last_attitude_accel, s.preintegrated, 0, t, values, 0, k)
    carrier = VEHICLES[vehicle]
    expected = (carrier.impact_noise_ratio * accel * 0.01) ** 2 * is_blow
    assert s.preintegrated[0, NOISE] == pytest.approx(expected)
    # Half before and half after the sample: the saturated part is unknown.
    assert s.preintegrated[0, DV] == pytest.approx(accel * 0.01)


@pytest.mark.parametrize("at_rest", [True, False])
def test_a_tilt_that_is_being_found_leaves_the_bias_uncertain(at_rest):
    """Its error is the mean acceleration since the first sample, unless the node was at rest."""
    c, s = one_env("drone" if not at_rest else "hand")
    s.alive[:], s.nodes["present"] = True, True
    s.nodes["has_state"], s.nodes["t_state"] = True, 4.0
    s.nodes["t_moved"] = s.nodes["t_first"] = 0.0 if at_rest else 4.0
    carrier = VEHICLES["hand"]
    for t_oriented, age in ((0.0, 4.0), (-96.0, 100.0)):
        s.nodes["t_oriented"] = t_oriented
        initialise_node(c, s, 0, 0, 4.0)
        at = s.nodes["i_tilt_bias"][0]
        unsettled = 0.0 if at_rest else carrier.initial_tilt_speed / age
        assert s.P[0, at, at] == pytest.approx(carrier.bias_std**2 + unsettled**2)


@pytest.mark.parametrize(("gap", "again"), [(0.01, False), (0.4, False), (0.6, True)])
def test_an_orientation_goes_on_over_gaps_that_are_filled(gap, again):
    """Over a filled gap the orientation keeps its age; a longer one restarts it."""
    c, s = one_env("hand")
    values = np.zeros((1, 2, N_VALUES))
    values[..., 0] = 1.0
    for k, t in enumerate((7.0, 7.0 + gap)):
        process_attitude(c, s.nodes, s.last_attitude_accel, s.preintegrated, 0, t, values, 0, k)
    assert s.nodes["t_oriented"][0] == (7.0 + gap if again else 7.0)


@given(st.floats(-30.0, 30.0))
def test_range_errors_begin_as_those_of_both_sights(evidence):
    """The slow error has the mean and variance of the LOS/NLOS mixture."""
    c, s = one_env()
    s.pairs["start_nlos_llr"][0] = evidence
    hidden = initial_nlos_prob(c, s.pairs[0])
    initialise_pair(c, s, 0, 0, hidden)
    at, p = s.pairs["i_range_error"][0] + 1, JointParams().nlos
    assert 0.0 < hidden < 1.0
    mean = hidden * p.nlos_bias
    squared = hidden * (p.nlos_bias**2 + p.nlos_bias_std**2)
    assert s.nlos[0, 0] == hidden
    assert s.x[0, at] == pytest.approx(mean)
    assert s.P[0, at, at] == pytest.approx(c["slow_var"] + squared - mean**2)


def test_without_powers_sight_is_as_likely_at_first_as_it_is_in_the_long_run():
    c, s = one_env()
    p = JointParams().nlos
    assert initial_nlos_prob(c, s.pairs[0]) == pytest.approx(
        p.los_to_nlos_rate / (p.los_to_nlos_rate + p.nlos_to_los_rate)
    )


def test_a_compass_that_has_driven_is_believed_when_its_node_comes_back():
    c, s = one_env()
    node = s.nodes[0]
    for drove, var in ((0.0, "first_heading_var"), (100.0, "heading_var")):
        node["t_first"], node["t_moved"] = 10.0, 10.0 + drove
        initialise_node(c, s, 0, 0, 200.0)
        assert s.P[0, node["i_heading"], node["i_heading"]] == pytest.approx(node[var], rel=0.05)
