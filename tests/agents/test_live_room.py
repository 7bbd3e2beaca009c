"""Drawing of a drive in characters: cars, estimates and walls are in their places."""

import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from agents.reports.gif import WIDTH, Gif
from agents.simulation.terminal_view import ARROWS, PLAIN_ARROWS, LiveRoom, draw_room

ROOM = 8.0, 4.0


def frames(pos, heading=0.0, *, estimate=None, boxes=(), present=1):
    return {
        "room": ROOM, "dt": 0.1, "t": [0.0], "pos": [[pos]], "heading": [[heading]],
        "present": [[present]], "boxes": [boxes], "viewer": [0], "target": [[None]],
        "estimate": [[estimate]], "tracking": [None], "formation": [0.1],
    }  # fmt: skip


def lines_of(drive, width=64, height=20, **more):
    return draw_room(drive, 0, width=width, height=height, **more).plain.split("\n")


@settings(max_examples=50, deadline=None)
@given(
    x=st.floats(-3.9, 3.9), y=st.floats(-1.9, 1.9), width=st.integers(10, 200),
    height=st.integers(4, 60),
)  # fmt: skip
def test_a_car_is_drawn_in_its_place(x, y, width, height):
    lines = lines_of(frames([x, y]), width, height)
    assert len(lines) <= height
    assert len(lines[0]) <= width
    ((row, column),) = [(r, c) for r, line in enumerate(lines) for c in range(len(line))
                        if line[c] != " "]  # fmt: skip
    cell = ROOM[0] / len(lines[0]), ROOM[1] / len(lines)
    assert abs((column + 0.5) * cell[0] - 4.0 - x) <= 0.5 * cell[0] + 1e-9
    assert abs(2.0 - (row + 0.5) * cell[1] - y) <= 0.5 * cell[1] + 1e-9


@pytest.mark.parametrize("eighth", range(-8, 16))
def test_its_arrow_points_where_it_heads(eighth):
    drive = frames([0.0, 0.0], eighth * np.pi / 4.0)
    assert ARROWS[eighth % 8] in "".join(lines_of(drive))
    assert PLAIN_ARROWS[eighth % 8] in "".join(lines_of(drive, plain=True))


def test_a_wall_thinner_than_a_letter_is_seen():
    wall = [[-1.0, 0.001], [1.0, 0.001], [1.0, 0.06], [-1.0, 0.06]]
    text = "".join(lines_of(frames([3.0, 1.0], boxes=[wall])))
    assert 10 <= text.count("#") <= 20


def test_an_estimate_is_drawn_and_an_absent_car_is_not():
    text = "".join(lines_of(frames([0.0, 0.0], estimate=[1.0, 1.0, 0.1, 0.1, 0.0, 0.0])))
    assert sorted(text.replace(" ", "")) == sorted("→o")
    assert not "".join(lines_of(frames([0.0, 0.0], present=0))).strip()


def test_nothing_is_shown_where_there_is_no_terminal(capsys):
    with LiveRoom() as room:
        room.show(frames([0.0, 0.0]), "title")
    assert capsys.readouterr().err == ""


def test_a_gif_has_its_pictures_and_its_pace():
    gif = Gif(every=2, interval=0.1)
    for k in range(10):
        gif.add(np.full((300, 900, 3), 20 * k, dtype=np.uint8))
    film = Image.open(io.BytesIO(gif.to_bytes()))
    assert (film.n_frames, film.size) == (5, (WIDTH, 213))
    assert film.info["duration"] == 200
    film.seek(3)
    assert abs(int(film.convert("RGB").getpixel((10, 10))[0]) - 120) < 8
