"""Trained policies next to controllers: their observations and their names."""

from dataclasses import replace

import pytest
from policy_files import card_of, model, perceptron, put

from agents.comparison.compare import compare
from agents.comparison.contender import Contender, find_entry
from agents.comparison.episode import run_episodes
from agents.comparison.setting import Setting
from agents.errors import UsageError
from agents.policies import Layout

SETTING = Setting(scenario="cars-nlos", seconds=3.0, settle=1.0)


def make(folder, layout, name):
    data = model(*perceptron(size=layout.size), size=layout.size).SerializeToString()
    put(folder, data, replace(card_of(data), name=name, layout=layout), name=name)
    return str(folder / f"{name}.onnx")


def test_an_episode_of_a_policy_is_the_same_alone_and_in_any_batch(tmp_path):
    who = Contender(make(tmp_path, Layout("estimate", 6), "six"), "estimate")
    batch = run_episodes(who, SETTING, [1000, 1001, 1002])
    (alone,) = run_episodes(who, SETTING, [1002])
    assert (batch[2].error == alone.error).all()
    assert batch[2].energy == alone.energy


def test_policies_are_compared_where_they_can_see(tmp_path):
    one = make(tmp_path, Layout("truth", 3), "seer")
    two = make(tmp_path, Layout("estimate", 2), "pair")
    result = compare(
        drivers=["consensus", one, two], observations=["estimate", "estimate_cov"],
        scenarios=["cars-nlos"], episodes=2, seconds=1.0, settle=0.0,
    )  # fmt: skip
    found = [(r["policy"], r["trained_on"], r["observation"]) for r in result.records]
    assert found == [
        ("consensus", None, "estimate"), ("consensus", None, "estimate_cov"),
        ("seer", "truth", "estimate"),
    ]  # fmt: skip
    assert result.records[2]["reference"].startswith("consensus on ")
    assert len(result.notes) == 3
    assert "more cars than the policy has slots for" in result.notes[1]


def test_a_history_is_the_policys_own(tmp_path):
    who = make(tmp_path, Layout("estimate", 3, 2), "past")
    result = compare(
        drivers=["consensus", who], scenarios=["cars-nlos"], episodes=1, seconds=1.0, settle=0.0
    )
    assert [r["policy"] for r in result.records] == ["consensus", "past"]


def test_beams_are_those_of_the_policies_unless_said(tmp_path):
    who = make(tmp_path, Layout("estimate", 3, 1, 4), "feeler")
    same = dict(scenarios=["cars-nlos"], episodes=1, seconds=1.0, settle=0.0)
    result = compare(drivers=["consensus", who], **same)
    assert [r["proximity"] for r in result.records] == [4, 4]
    assert result.rows[0].contender.label == "consensus on estimate, 4 distance sensors"
    result = compare(drivers=["consensus", who], proximity=0, **same)
    assert [(r["policy"], r["proximity"]) for r in result.records] == [("consensus", 0)]
    assert "the numbers of distance sensors differ" in result.notes[0]
    with pytest.raises(UsageError, match="--proximity: expected 0 to 32, got 40"):
        compare(drivers=["consensus"], proximity=40, **same)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(UsageError, match=r"gone\.onnx: no such file"):
        find_entry(str(tmp_path / "gone.onnx"))
