"""Rates of the protocol against the paper and the arithmetic of the data sheet."""

from dataclasses import replace

import pytest

from tracking.ranging.frames.airtime import PAPER_PHY, message_time, round_rate


@pytest.mark.parametrize(("n", "paper_hz"), [(3, 81.83), (6, 28.6)])
def test_rounds_as_in_the_paper(n, paper_hz):
    assert round_rate(PAPER_PHY, n) == pytest.approx(paper_hz, rel=0.02)


def test_processing_adds_to_every_message():
    slow = replace(PAPER_PHY, processing=PAPER_PHY.gap + 0.001)
    assert message_time(slow, 3) - message_time(PAPER_PHY, 3) == pytest.approx(0.001)


def test_a_message_without_its_gap_is_as_long_as_the_data_sheet_says():
    assert message_time(PAPER_PHY, 3) - PAPER_PHY.gap == pytest.approx(4.07e-3, rel=0.005)
    assert message_time(PAPER_PHY, 6) - PAPER_PHY.gap == pytest.approx(5.84e-3, rel=0.005)


def test_a_long_table_is_sent_in_parts():
    long_frames = replace(PAPER_PHY, max_frame=1023)
    assert message_time(PAPER_PHY, 15) == message_time(long_frames, 15)
    assert message_time(PAPER_PHY, 16) > message_time(long_frames, 16) + 1e-3
