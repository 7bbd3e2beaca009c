"""Training benchmark with an environment of no cost."""

import json

import pytest

pytest.importorskip("stable_baselines3")


def test_training_is_measured_beside_nothing(monkeypatch):
    from agents.bench.train import rows

    monkeypatch.setattr(rows, "CASES", {"a room": ("cars-los",)})
    monkeypatch.setattr(rows, "TURNS", 1)
    shares = []
    found = rows.bench_train(updates=1, threads=1, after=2, progress=shares.append)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert [row["peer"] for row in found] == list(rows.PEERS)
    for row in found:
        assert row["case"] == "a room"
        assert row["value"] == pytest.approx(1e6 / row["us_per_frame"])
        assert row["ratio"] == pytest.approx(row["value"] / row["peer_value"])
        assert row["after_frames"] == 2 * 64 * 64 * 3
    assert shares == [1.0]


def test_the_peer_computes_the_same(monkeypatch):
    import torch

    from agents.bench.train.plain import make_plain
    from agents.settings import from_options
    from agents.training.config import TrainConfig
    from agents.training.environments import make_rooms
    from agents.training.ppo import learner, network
    from agents.training.ppo.hyperbolic import FromLogistic
    from agents.training.ppo.learner import make_model
    from agents.training.ppo.network import SwarmFeatures

    # As on processors where torch's own tanh is slow.
    for module in (learner, network):
        monkeypatch.setattr(module, "Tanh", FromLogistic)
    config = from_options(TrainConfig, {"scenarios": "swarm-nlos", "envs": "2", "proximity": "8"})
    rooms = make_rooms(config, None)
    seen = torch.from_numpy(rooms.reset())
    fast, plain = make_model(config, rooms).policy, make_plain(make_model(config, rooms)).policy
    torch.testing.assert_close(fast(seen, True), plain(seen, True))
    assert any(isinstance(module, FromLogistic) for module in fast.modules())
    assert any(type(module) is torch.nn.Tanh for module in plain.modules())
    for policy, skips in ((fast, True), (plain, False)):
        features = [m for m in policy.modules() if isinstance(m, SwarmFeatures)]
        assert [m.skips_absent for m in features] == [skips, skips]
        assert bool(policy.optimizer.param_groups[0]["fused"]) == skips
    assert not any("hyperbolic" in type(module).__module__ for module in plain.modules())
    assert {id(w) for w in plain.optimizer.param_groups[0]["params"]} == {
        id(w) for w in plain.parameters()
    }
    rooms.close()
