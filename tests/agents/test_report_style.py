"""Figures of reports share a style that does not leak to others."""

import matplotlib as mpl

from agents.reports.style import COLOURS, in_style, new_figure, plain_ticks, svg


@in_style
def draw():
    figure = new_figure(3.0, 2.0)
    ax = figure.subplots()
    ax.fill_between([1, 2, 3], [1, 2, 3], [2, 3, 4], label="band")
    ax.plot([1, 2, 3], [1.2, 2.0, 3.1], "C1", label="line")
    ax.set_yscale("log")
    plain_ticks(ax.yaxis)
    ax.legend(title="2 runs")
    return figure


def test_the_same_figure_is_the_same_bytes():
    assert svg(draw()) == svg(draw())


def test_colours_are_those_of_the_style_and_no_date_is_in_it():
    text = svg(draw()).decode()
    assert COLOURS[0] in text
    assert COLOURS[1] in text
    assert "<dc:date>" not in text


def test_figures_of_others_keep_their_style():
    before = dict(mpl.rcParams)
    svg(draw())
    assert dict(mpl.rcParams) == before


def test_a_logarithmic_axis_has_plain_numbers():
    figure = draw()
    figure.draw_without_rendering()
    shown = {tick.get_text() for tick in figure.axes[0].get_yticklabels()}
    assert {"1", "2"} <= shown
