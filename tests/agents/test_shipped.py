"""Policies included in the package."""

import numpy as np
import pytest

from agents.comparison.contender import Contender
from agents.comparison.episode import run_episodes
from agents.comparison.meter import IN_FORMATION
from agents.comparison.setting import Setting
from agents.policies import load_policy, shipped_names
from agents.policies.find import find_policy
from agents.settings import from_json, to_json
from agents.training.config import TrainConfig

EPISODES = range(2000, 2040)
"""Enough episodes that a single car stuck in one of them does not decide."""


def mean_error(name, **setting):
    layout = load_policy(name).card.layout
    contender = Contender(name, layout.observation, proximity=layout.proximity)
    episodes = run_episodes(contender, Setting(**setting), EPISODES)
    return float(np.mean([e.formation_error for e in episodes]))


def config_of(card):
    """Return the configuration of a card's training; newer settings keep their defaults."""
    told = card.training["config"]
    every = to_json(TrainConfig())
    parts = {k: {**every[k], **told[k]} for k in ("env", "net", "ppo")}
    return from_json(TrainConfig, {**every, **told, **parts})


def test_there_are_some():
    assert {"ring", "hold", "hold-beams"} <= set(shipped_names())


@pytest.mark.parametrize("name", shipped_names())
def test_cards_tell_how_a_policy_was_made_and_what_it_reached(name):
    card = load_policy(name).card
    assert card.name == name
    config = config_of(card)
    assert config.env.observation == card.training["observation"] == card.layout.observation
    assert config.env.cars == card.layout.n_cars
    assert card.training["frames"] <= config.frames * 1.2
    assert all({"scenario", "formation_error", "ci95"} <= set(r) for r in card.results)
    assert card.results


@pytest.mark.parametrize("name", shipped_names())
def test_networks_do_not_tell_where_they_were_written(name):
    network, _ = find_policy(name)
    assert b".py" not in network.read_bytes()


@pytest.mark.parametrize("name", shipped_names())
def test_they_keep_their_formation(name):
    config = config_of(load_policy(name).card)
    error = mean_error(
        name, task=config.env.task, scenario=config.env.scenarios[0], seconds=25.0, settle=15.0
    )
    assert error < IN_FORMATION


@pytest.mark.parametrize(
    ("name", "task", "scenario", "cars"),
    [
        *(("ring", "ring", "ring-nlos", n) for n in (3, 4, 5, 6)),
        ("hold-beams", "hold", "ring-nlos", 3),
        pytest.param(
            *("hold-beams", "hold", "ring-nlos", 4),
            marks=pytest.mark.xfail(strict=True, reason="formation error 0.36 m with four cars"),
        ),
        *(("hold-beams", "hold", "hall", n) for n in (4, 6)),
    ],
)
def test_one_policy_drives_groups_of_several_sizes_in_a_room_it_has_not_seen(
    name, task, scenario, cars
):
    error = mean_error(name, task=task, scenario=scenario, cars=cars, seconds=25.0, settle=15.0)
    assert error < IN_FORMATION
