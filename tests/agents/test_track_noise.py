"""Range noise stated in a log is used in place of an estimate."""

import re
from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.track import track_log
from agents.simulation.simulate import simulate
from tracking.errors import LogError
from tracking.filters.joint.params import JointParams, NoiseLearningParams, RangeErrorParams
from tracking.filters.params import FilterParams
from tracking.log import read_log, write_log
from tracking.tracker import TrackerParams


def test_a_log_may_state_the_noise_of_its_ranges(tmp_path):
    log = replace(simulate(scenario="cars-los", seconds=8.0, seed=4), range_noise=0.08)
    write_log(tmp_path / "log", log)
    assert read_log(tmp_path / "log").range_noise == 0.08
    joint = JointParams(
        range_error=RangeErrorParams(white_std=0.08),
        noise_learning=NoiseLearningParams(learns=False),
    )
    stated = track_log(tmp_path / "log", findings=())
    by_hand = track_log(
        replace(log, range_noise=None),
        findings=(),
        params=TrackerParams(filter=FilterParams(joint=joint)),
    )
    np.testing.assert_array_equal(stated.estimate.pos_ij_w, by_hand.estimate.pos_ij_w)
    meta = tmp_path / "log" / "meta.toml"
    for value, message in (("'x'", "a number"), ("0.0", "0.001 to 10"), ("true", "a number")):
        meta.write_text(re.sub("range_noise_m = .*", f"range_noise_m = {value}", meta.read_text()))
        with pytest.raises(LogError, match=f"range_noise_m: expected {message}"):
            read_log(tmp_path / "log")
