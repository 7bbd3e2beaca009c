"""Training beside an environment that costs nothing."""

import json

import pytest

pytest.importorskip("stable_baselines3")


def test_training_is_measured_beside_nothing(monkeypatch):
    from agents.bench.train import rows

    monkeypatch.setattr(rows, "CASES", {"a room": ("cars-los",)})
    monkeypatch.setattr(rows, "TURNS", 1)
    shares = []
    (row,) = rows.bench_train(updates=1, threads=1, after=2, progress=shares.append)
    assert json.loads(json.dumps(row, allow_nan=False)) == row
    assert row["case"] == "a room"
    assert 0.0 < row["ratio"] < 1.0
    assert row["value"] == pytest.approx(1e6 / row["us_per_frame"])
    assert row["ratio"] == pytest.approx(row["value"] / row["peer_value"])
    assert row["after_frames"] == 2 * 64 * 64 * 3
    assert shares == [1.0]
