"""Rates of the protocol against the paper and the data sheet's arithmetic."""

import pytest

from tracking.ranging.airtime import PAPER_PHY, Phy, message_time, round_rate


@pytest.mark.parametrize(("n", "paper_hz"), [(3, 81.83), (6, 28.6)])
def test_rounds_as_in_the_paper(n, paper_hz):
    assert round_rate(PAPER_PHY, n) == pytest.approx(paper_hz, rel=0.02)


def test_gap_adds_to_every_message():
    assert message_time(Phy(gap=0.001), 3) - message_time(PAPER_PHY, 3) == pytest.approx(0.001)
