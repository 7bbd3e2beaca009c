"""Alignment states of a group follow the transition table under any measurements."""

import re
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tracking
from tests.exact_motion import ExactGroup
from tracking import Tracker
from tracking.filters.joint.hypotheses.alignment import TRANSITIONS, Alignment, set_alignment
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.records import GROUP
from tracking.filters.joint.supervision.faults import CATALOGUE, Fault
from tracking.measurements import Kind


def test_every_state_follows_the_first_one_and_ends():
    assert set(TRANSITIONS) == set(Alignment)
    found, new = {Alignment.NONE}, [Alignment.NONE]
    while new:
        new = [b for a in new for b in TRANSITIONS[a] if b not in found]
        found.update(new)
    assert found == set(Alignment)
    for state in set(Alignment) - {Alignment.NONE}:
        assert Alignment.NONE in TRANSITIONS[state]


def test_only_its_own_file_writes_the_alignment():
    """So that no step goes past the table."""
    writes = re.compile(r"""\.alignment = |\.alignment, .* = |\["alignment"\] = """)
    root = Path(tracking.__file__).parent
    found = {path.name for path in root.rglob("*.py") if writes.search(path.read_text("utf-8"))}
    assert found == {"alignment.py"}


def walk(group, silences=(), reflected=None):
    """Return alignment and number of hypotheses after every event, and invalid transitions."""
    block, tracker = group.block, Tracker(group.constellation)
    t, kind = block.t[0], block.kind[0]
    kept = np.ones(len(t), dtype=bool)
    for begin, seconds in silences:
        kept &= (t < begin) | (t > begin + seconds)
    if reflected is not None:
        # Later accelerations point elsewhere: they contradict the alignment of the group.
        later = (t > reflected) & (kind == Kind.STATE)
        block.values[0, later, 4:6] *= -1.0
    states = []
    for k in np.flatnonzero(kept):
        tracker.step(block.take(slice(int(k), int(k) + 1)), t[k])
        record = tracker.save()["filter"].group[0, 0]
        states.append((Alignment(record["alignment"]), int(record["n_alive"])))
    return states, tracker.save()["filter"].group[0, 0]["n_illegal_steps"]


@pytest.mark.parametrize(
    ("vehicle", "dimensions", "n"),
    [("car", 2, 3), ("human", 2, 4), ("hand", 3, 3), ("drone", 3, 4), ("hand", 3, 5)],
)
@settings(max_examples=5, deadline=None)
@given(data=st.data())
def test_only_transitions_of_the_table_occur(vehicle, dimensions, n, data):
    silence = st.tuples(st.floats(0.5, 5.0), st.floats(0.5, 7.0))
    group = ExactGroup(
        vehicle,
        data.draw(st.permutations(range(n))),
        at_rest=data.draw(st.booleans()),
        dimensions=dimensions,
        seconds=9.0,
        hz=28.0,
    )
    silences = data.draw(st.lists(silence, max_size=2))
    states, n_illegal = walk(group, silences, data.draw(st.none() | st.floats(3.0, 6.0)))
    assert n_illegal == 0
    assert all((n_alive == 0) == (state == Alignment.NONE) for state, n_alive in states)


def test_a_step_that_is_not_in_the_table_is_counted():
    group = np.zeros(1, dtype=GROUP).view(np.recarray)[0]
    set_alignment(group, Alignment.STATIC)
    assert group.n_illegal_steps == 0
    set_alignment(group, Alignment.CANDIDATES)
    assert group.n_illegal_steps == 1


def test_a_group_in_space_that_moves_is_filtered_in_its_modes():
    states = [a for a, _ in walk(ExactGroup("hand", range(5), at_rest=True, dimensions=3))[0]]
    order = list(dict.fromkeys(states))
    assert order[:3] == [Alignment.NONE, Alignment.STATIC, Alignment.LINEAR]
    assert order[3] == Alignment.MODES


@pytest.mark.parametrize("vehicle", ["robot", "human"])
def test_rotations_of_a_small_group_at_rest_are_not_split(vehicle, monkeypatch):
    """At rest, rotations are not distinguishable, regardless of uncertain range errors."""
    monkeypatch.setattr("tests.exact_motion.STAND", 30.0)
    group = ExactGroup(vehicle, range(4), at_rest=True, hz=10.0, seconds=29.0)
    group.block.values[0, group.block.kind[0] == Kind.RANGE, 0] *= 0.06
    assert set(walk(group)[0]) <= {(Alignment.NONE, 0), (Alignment.STATIC, 1)}


def test_the_limits_of_the_catalogue_are_parameters():
    assert set(CATALOGUE) == set(Fault) - {Fault.NONE}
    for remedy in CATALOGUE.values():
        assert attrgetter(remedy.limit)(JointParams()) > 0.0, remedy.limit
