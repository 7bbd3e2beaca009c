"""`relpos bench codec`: rows with a peer, and errors."""

import json

import pytest
from click.testing import CliRunner

from agents.cli.main import cli
from agents.errors import UsageError


def test_bench_lines_have_a_peer():
    shown = CliRunner().invoke(cli, ["bench", "codec", "--frames", "50", "--json"])
    assert shown.exit_code == 0, shown.output
    rows = [json.loads(line) for line in shown.output.splitlines()]
    for row in rows:
        assert list(row) == ["bench", "case", "value", "unit", "peer", "peer_value", "ratio"]
        assert row["unit"] == "frames/s"
        assert row["peer"].startswith("pymavlink ")
        assert row["ratio"] == pytest.approx(row["value"] / row["peer_value"])
        assert row["value"] > 0.0
    assert {row["case"].split(" ")[0] for row in rows} == {"decode", "encode"}
    assert any(", MAC" in row["case"] for row in rows)


def test_a_table_is_shown():
    shown = CliRunner().invoke(cli, ["bench", "codec", "--frames", "20"])
    assert shown.exit_code == 0, shown.output
    assert "decode to readings, IMU" in shown.output


@pytest.mark.parametrize("frames", ["0", "100001"])
def test_no_frames_are_refused(frames):
    with pytest.raises(UsageError, match="--frames: expected 1 to 100000"):
        CliRunner().invoke(cli, ["bench", "codec", "--frames", frames], catch_exceptions=False)
