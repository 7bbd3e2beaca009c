"""Folder of a training run: damaged, foreign, and on a full disk."""

import json
import os
from pathlib import Path

import pytest
import torch
from safetensors.torch import save
from small_runs import same, small, weights
from stable_baselines3.common.logger import TensorBoardOutputFormat

from agents.errors import UsageError
from agents.training.export import export_policy
from agents.training.run_folder import CONFIG, LAST, RunFolder
from agents.training.train import train


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Make an uninterrupted run."""
    return train(small(), tmp_path_factory.mktemp("runs") / "whole")


def test_a_full_disk_leaves_the_last_good_checkpoint(run, tmp_path, monkeypatch):
    folder = tmp_path / "run"
    before = {}

    def full(path, target):
        raise OSError(28, "No space left on device")

    def fill(share, row):
        if row is not None and row["interval"] == 0:
            before.update({p.name: p.read_bytes() for p in folder.iterdir() if p.is_file()})
            monkeypatch.setattr(Path, "replace", full)

    with pytest.raises(UsageError, match="No space left on device.*--resume"):
        train(small(), folder, progress=fill)
    monkeypatch.undo()
    assert before == {p.name: p.read_bytes() for p in folder.iterdir() if p.is_file()}
    train(None, folder)
    assert same(weights(run.folder), weights(folder))


BAD_CONFIG = [
    ("not json", "damaged"),
    ("[]", "format None"),
    ('{"format": 8, "config": {}}', "format 8, expected 11"),
    ('{"format": 11, "config": {}}', "missing field"),
    ('{"format": 11, "config": {"speed": 1}}', "unknown field 'speed'"),
]


@pytest.mark.parametrize(("text", "said"), BAD_CONFIG)
def test_runs_that_are_none_are_refused(tmp_path, text, said):
    with pytest.raises(UsageError, match="no training run"):
        train(None, tmp_path / "none")
    (tmp_path / CONFIG).write_text(text)
    with pytest.raises(UsageError, match=said):
        train(None, tmp_path)


def test_what_a_kill_left_of_the_first_file_is_in_nobodys_way(tmp_path):
    (tmp_path / f".{CONFIG}.new").write_text("{")
    RunFolder(tmp_path).create(small())
    assert RunFolder(tmp_path).config() == small()


@pytest.mark.parametrize("checks", [True, False])
def test_weights_that_are_no_numbers_any_more_are_reported(tmp_path, monkeypatch, checks):
    # TorchRL switches the checks of distributions off for a whole process.
    monkeypatch.setattr(torch.distributions.Distribution, "_validate_args", checks)
    with pytest.raises(UsageError, match=r"diverged in interval \d.*--learning-rate"):
        train(small(learning_rate="1", entropy="1", epochs="20"), tmp_path / "run")


def test_a_run_on_another_observation_layout_is_refused(run, tmp_path):
    record = json.loads((run.folder / CONFIG).read_text())
    (tmp_path / CONFIG).write_text(json.dumps({**record, "layout": "0" * 64}))
    for use in (lambda: train(None, tmp_path), lambda: export_policy(tmp_path, tmp_path / "out")):
        with pytest.raises(UsageError, match="another observation layout"):
            use()


def test_a_full_disk_is_told_whatever_is_being_written(run, tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", full)
        with pytest.raises(UsageError, match="--out .*No space left on device") as told:
            train(small(), tmp_path / "first")
    assert "--resume" not in str(told.value)
    for place in ("__init__", "write"):
        folder = tmp_path / place
        with monkeypatch.context() as patched:
            patched.setattr(TensorBoardOutputFormat, place, full)
            with pytest.raises(UsageError, match="No space left on device.*--resume"):
                train(small(), folder)
        train(None, folder)
        assert same(weights(run.folder), weights(folder))


@pytest.mark.parametrize("log", [5, [], [{}], [{"interval": 0, "frames": "x"}], [None]])
def test_a_checkpoint_that_does_not_say_where_it_stands_is_refused(run, tmp_path, log):
    (tmp_path / CONFIG).write_text((run.folder / CONFIG).read_text())
    data = save(weights(run.folder), {"progress": json.dumps({"log": log})})
    (tmp_path / LAST).write_bytes(data)
    with pytest.raises(UsageError, match="damaged checkpoint"):
        train(None, tmp_path)


def test_a_checkpoint_of_another_optimiser_is_refused(run, tmp_path):
    (tmp_path / CONFIG).write_text((run.folder / CONFIG).read_text().replace("1400", "5000"))
    progress = json.dumps({"log": run.records})
    data = save({**weights(run.folder), "optimizer.x": torch.zeros(1)}, {"progress": progress})
    (tmp_path / LAST).write_bytes(data)
    with pytest.raises(UsageError, match="of another optimiser"):
        train(None, tmp_path)


def test_damaged_checkpoints_are_refused(run, tmp_path):
    whole = (run.folder / LAST).read_bytes()
    text = (run.folder / CONFIG).read_text()
    (tmp_path / CONFIG).write_text(text)
    for damaged in (whole[:-1], whole[: len(whole) // 2], b"", b"\x80\x04N.", os.urandom(200)):
        (tmp_path / LAST).write_bytes(damaged)
        with pytest.raises(UsageError, match="damaged checkpoint"):
            train(None, tmp_path)
    other = json.loads(text)
    other["config"]["net"]["width"] = 16
    other["config"]["frames"] = 5000
    (tmp_path / CONFIG).write_text(json.dumps(other))
    (tmp_path / LAST).write_bytes(whole)
    with pytest.raises(UsageError, match="other networks"):
        train(None, tmp_path)
