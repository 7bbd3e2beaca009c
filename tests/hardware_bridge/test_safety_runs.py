"""Groups with adversarial policies and faults: the true states satisfy the guarantees.

The first two tests are 1000 runs of 5 s with 2 to 4 cars, seeds 0 and 1; figures are in
`docs/explanation/safety.md`.
"""

import pytest
from safety_faults import KINDS
from safety_world import CORNER, ROOM, run

from hardware_bridge.safety.params import SafetyParams

WIRED = tuple(kind for kind in KINDS if kind != "unlinked")


@pytest.mark.parametrize(("fence", "seed"), [(ROOM, 0), (CORNER, 1)], ids=["room", "corner"])
def test_no_crossing_in_500_runs_with_faults(fence, seed):
    params = SafetyParams(fence=fence)
    outcome = run(params, 500, 5.0, seed, kinds=WIRED)
    assert (outcome.nearest >= params.separation).all()
    assert (outcome.furthest <= 0.0).all()
    # The cars did drive, and were armed again after stops.
    assert outcome.way.mean() > 3.0
    assert outcome.armed > 0.5
    assert outcome.n_armings > 1500


def test_lost_ports_cost_no_more_than_the_way_until_the_deadman():
    """A car with a lost port moves until its own deadman; other cars are not affected."""
    params = SafetyParams(fence=CORNER)
    outcome = run(params, 150, 4.0, 2, kinds=("unlinked",))
    way = params.max_speed * params.deadman
    assert (outcome.nearest >= params.separation - way).all()
    assert (outcome.furthest <= way).all()
    assert (outcome.furthest > 0.0).mean() < 0.01


def test_with_the_deadman_in_the_reaction_lost_ports_cost_nothing():
    params = SafetyParams(fence=CORNER, reaction=0.45)
    outcome = run(params, 150, 4.0, 2, kinds=("unlinked",))
    assert (outcome.nearest >= params.separation).all()
    assert (outcome.furthest <= 0.0).all()


@pytest.mark.parametrize("options", [{"reaction": 0.01, "braking": 4.0}, {"confidence": 0.5}])
def test_the_world_is_hard_enough(options):
    """Overconfident rules cause crossings, so that the results of the runs are meaningful."""
    params = SafetyParams(fence=ROOM, **options)
    outcome = run(params, 100, 4.0, 3, kinds=WIRED)
    assert (outcome.furthest > 0.0).sum() >= 5
    assert (outcome.nearest < params.separation).sum() >= 1
