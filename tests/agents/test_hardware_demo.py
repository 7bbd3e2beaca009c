"""Scores of a drive through the bridge, and early checks of commands."""

import numpy as np
import pytest
from click.testing import CliRunner

from agents.cli.main import cli
from agents.hardware.demo import _settled


def test_a_drive_that_was_over_early_is_scored_by_its_end():
    nothing, every = np.zeros(0), np.array([0.9, 0.4, 0.2, np.nan])
    assert _settled(np.array([0.1, np.nan, 0.3]), every) == pytest.approx(0.2)
    assert _settled(nothing, every) == 0.2
    assert _settled(np.array([np.nan]), every) == 0.2
    assert _settled(nothing, np.array([np.nan])) is None


def test_the_mean_is_that_of_drives_with_both_errors():
    from types import SimpleNamespace

    from agents.reports.hardware_report import demo_rows

    def drive(seed, ours, theirs):
        summary = {
            "seed": seed, "formation_error": ours, "simulated_error": theirs, "collisions": 0,
            "simulated_collisions": 0, "lag_p99_ms": None,
            "ratio": None if ours is None else ours / theirs,
        }  # fmt: skip
        return SimpleNamespace(summary=summary)

    drives = [drive(0, 0.10, 0.10), drive(1, 0.12, 0.10), drive(2, None, 0.40)]
    mean = next(row for row in demo_rows(drives) if row[0] == "mean")
    assert mean[1:4] == ["0.110", "0.100", "1.10"]
    none = next(row for row in demo_rows(drives[2:] * 2) if row[0] == "mean")
    assert none[1:4] == ["-", "-", "-"]


def test_demo_looks_at_its_folder_before_it_drives(tmp_path, monkeypatch):
    monkeypatch.setattr("agents.simulation.demo.demo", lambda **_: pytest.fail("it drove"))
    (tmp_path / "file").write_text("")
    done = CliRunner().invoke(cli, ["demo", "--out", str(tmp_path / "file")])
    assert "is a file, expected a new or empty folder" in str(done.exception)
