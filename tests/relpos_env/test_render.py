"""Pictures: shape, repeatability, contents, and rendering without a screen."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relpos_env.errors import EnvError
from relpos_env.render import Renderer, Snapshot, palette, save_snapshot
from relpos_env.render.layout import Layout, size_for
from relpos_env.render.parts import car_shape
from relpos_env.render.parts.boxes import hatching
from relpos_env.render.parts.dashes import dashed
from relpos_env.render.parts.error_plot import error_axis, stretches
from relpos_env.render.parts.estimates import ellipse, placed_estimate
from tracking.estimate import Status

SIZE = (480, 360)


def make_snapshot(n=4, **changes):
    """Return cars on a ring around two obstacles, with every status and kind of link."""
    angle = 2.0 * np.pi * np.arange(n) / n + 0.3
    pos = 1.6 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    pairs = [(i, j, (i + j) % 3) for i in range(n) for j in range(i + 1, n)]
    t = np.arange(0.0, 25.0, 0.1)
    status = np.array([3, 3, 2, 5, 4, 1, 0])[np.arange(n) % 7]
    made = {
        "t": 25.0,
        "room": (5.0, 5.0),
        "boxes": np.array([[0.0, 0.0, 0.7, 0.1, 1.0, 0.0], [1.0, -2.0, 0.2, 0.2, 0.6, 0.8]]),
        "movable": np.array([False, True]),
        "pose": np.column_stack([pos, angle + 0.5 * np.pi]),
        "steering": np.full(n, 0.3),
        "present": np.ones(n, dtype=bool),
        "powered": np.arange(n) != 1,
        "car_size": (0.42, 0.2),
        "viewer": 0,
        "estimate": pos - pos[0] + 0.2,
        "estimate_cov": np.tile(np.diag([0.03, 0.01]), (n, 1, 1)),
        "estimate_ok": status == Status.OK,
        "estimate_status": status,
        "estimate_heading": angle + 0.5 * np.pi,
        "links": np.array(pairs).reshape(-1, 3),
        "target": pos - pos[0],
        "has_target": np.ones(n, dtype=bool),
        "goal": 0.5 * pos,
        "path": np.array([[-2.0, -2.0], [-2.0, 2.0], [2.0, 2.0]]),
        "history_t": t,
        "formation_error": 0.3 * np.exp(-t / 5.0),
        "tracking_error": np.where((t > 8) & (t < 10), np.nan, 0.1),
        "title": "a ring",
    }
    return Snapshot(**{**made, **changes})


def draw(snapshot, size=SIZE, **options):
    renderer = Renderer(size=size, **options)
    picture = renderer.draw(snapshot)
    renderer.close()
    return picture


def empty_room(**changes):
    """Return a room without drawings that could hide others."""
    changes = {
        "boxes": np.zeros((0, 6)), "movable": np.zeros(0, dtype=bool), "goal": None, "path": None,
        "links": np.zeros((0, 3), dtype=np.int64), "has_target": np.zeros(4, dtype=bool),
        "estimate_status": np.zeros(4, dtype=np.int64), "powered": np.ones(4, dtype=bool),
        **changes,
    }  # fmt: skip
    return make_snapshot(**changes)


def pixel(picture, snapshot, point):
    """Return the colour at a point of the room."""
    height, width = picture.shape[:2]
    x, y = Layout.fit((width, height), snapshot.room).pixels(np.asarray(point, dtype=float))
    return picture[int(y), int(x)].astype(int)


@pytest.mark.parametrize("size", [(480, 360), (960, 720), (300, 200), (641, 403)])
def test_a_picture_is_rows_of_rgb(size):
    picture = draw(make_snapshot(), size)
    assert picture.shape == (size[1], size[0], 3)
    assert picture.dtype == np.uint8
    assert picture.flags.writeable
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50


def test_size_follows_the_room_until_closed():
    renderer = Renderer()
    wide, narrow = make_snapshot(room=(8.0, 4.0)), make_snapshot(room=(3.0, 5.0))
    assert renderer.draw(wide).shape[:2] == size_for(wide.room)[::-1]
    assert renderer.draw(narrow).shape[:2] == size_for(wide.room)[::-1]
    renderer.close()
    assert renderer.draw(narrow).shape[:2] == size_for(narrow.room)[::-1]
    assert all(side % 2 == 0 for side in size_for((3.3, 4.7)))


def test_same_snapshot_same_picture_whatever_came_before():
    renderer, snapshot = Renderer(size=SIZE), make_snapshot()
    first = renderer.draw(snapshot)
    kept = first.copy()
    other = renderer.draw(make_snapshot(n=6, room=(7.0, 4.0), title="another", t=3.0))
    assert not np.array_equal(first, other)
    np.testing.assert_array_equal(first, kept)
    np.testing.assert_array_equal(renderer.draw(snapshot), first)
    np.testing.assert_array_equal(draw(make_snapshot()), first)


CHANGES = {
    "pose": lambda s: s.pose + [0.1, 0.0, 0.0],
    "steering": lambda s: -s.steering,
    "present": lambda s: np.arange(4) != 2,
    "powered": lambda s: ~s.powered,
    "viewer": lambda s: 2,
    "estimate": lambda s: s.estimate + 0.2,
    "estimate_cov": lambda s: 2.0 * s.estimate_cov,
    "estimate_ok": lambda s: ~s.estimate_ok,
    "estimate_status": lambda s: np.roll(s.estimate_status, 1),
    "estimate_heading": lambda s: s.estimate_heading + 0.3,
    "links": lambda s: s.links[::-1] % 3 * [1, 1, 0] + [0, 0, 1],
    "target": lambda s: 1.2 * s.target,
    "has_target": lambda s: ~s.has_target,
    "goal": lambda s: None,
    "path": lambda s: s.path[:2],
    "boxes": lambda s: s.boxes * [1, 1, 1.5, 1.5, 1, 1],
    "movable": lambda s: ~s.movable,
    "formation_error": lambda s: 0.5 * s.formation_error,
    "tracking_error": lambda s: s.tracking_error + 0.05,
    "t": lambda s: 26.0,
    "title": lambda s: "another title",
    "room": lambda s: (6.0, 5.0),
    "car_size": lambda s: (0.5, 0.3),
}


@pytest.mark.parametrize("field", CHANGES)
def test_every_field_shows(field):
    snapshot = make_snapshot()
    changed = replace(snapshot, **{field: CHANGES[field](snapshot)})
    assert not np.array_equal(draw(changed), draw(snapshot))


@pytest.mark.parametrize("n", [2, 3, 7, 20])
def test_any_number_of_cars(n):
    assert draw(make_snapshot(n=n)).std() > 1.0


def test_absent_cars_leave_an_empty_room():
    nobody = np.zeros(4, dtype=bool)
    busy = make_snapshot(present=nobody, path=None, goal=None)
    bare = empty_room(present=nobody, boxes=busy.boxes, movable=busy.movable)
    np.testing.assert_array_equal(draw(busy), draw(bare))


def test_a_viewer_that_is_absent_believes_nothing():
    gone = {"present": np.arange(4) != 0}
    ideas = draw(
        empty_room(**gone, estimate_status=np.full(4, 3), has_target=np.ones(4, dtype=bool))
    )
    np.testing.assert_array_equal(ideas, draw(empty_room(**gone)))


def test_no_boxes_and_no_history():
    none = np.zeros(0)
    picture = draw(empty_room(history_t=none, formation_error=none, tracking_error=none))
    assert picture.shape == (SIZE[1], SIZE[0], 3)


@pytest.mark.parametrize("heading", [0.0, 1.0, -2.5])
def test_cars_are_where_they_are_and_point_ahead(heading):
    # Seen from above: paint at the nose, glass ahead of the roof.
    pose = np.array([[0.5, -0.75, heading], [-2, 2, 0], [-2, 0, 0], [2, 2, 0]])
    snapshot = empty_room(pose=pose, viewer=3)
    picture = draw(snapshot, (960, 720), fine=4)
    ahead = np.array([np.cos(heading), np.sin(heading)])
    at = lambda x: pixel(picture, snapshot, pose[0, :2] + x * 0.42 * ahead)  # noqa: E731
    np.testing.assert_allclose(at(0.33), palette.CARS[0], atol=6)
    np.testing.assert_allclose(at(0.18), palette.GLASS, atol=6)
    np.testing.assert_allclose(at(0.75), palette.FLOOR, atol=20)


def test_ghosts_stand_at_the_viewer_plus_the_belief():
    pose = np.array([[1.0, 1.0, 0.0], [-2, 2, 0], [-2, 0, 0], [2, 2, 0]])
    estimate = np.array([[0.0, 0.0], [-1.5, -2.5], [0, 0], [0, 0]])
    status = np.array([0, int(Status.OK), 0, 0])
    snapshot = empty_room(
        pose=pose, estimate=estimate, estimate_status=status, estimate_ok=status == 3,
        estimate_heading=None, estimate_cov=np.zeros((4, 2, 2)),
    )  # fmt: skip
    with_ghost = draw(snapshot, (960, 720))
    without = draw(replace(snapshot, estimate_status=np.zeros(4, dtype=np.int64)), (960, 720))
    inside = np.array([-0.5, -1.55])
    np.testing.assert_array_equal(pixel(without, snapshot, inside), palette.FLOOR)
    np.testing.assert_array_less(
        pixel(with_ghost, snapshot, inside)[2], 230
    )  # vermillion: less blue


def test_belief_turns_with_the_error_of_the_viewers_heading():
    pose = np.zeros((2, 3))
    pose[0] = [1.0, 0.0, 0.7]
    snapshot = make_snapshot(
        n=2, pose=pose, estimate=np.array([[0.0, 0.0], [2.0, 0.0]]),
        estimate_heading=np.array([0.7 - 0.5 * np.pi, 0.2]),
    )  # fmt: skip
    pos, cov, turn = placed_estimate(snapshot)
    np.testing.assert_allclose(pos[1], [1.0, 2.0], atol=1e-12)
    np.testing.assert_allclose(cov[1], np.diag([0.01, 0.03]), atol=1e-12)
    assert turn == pytest.approx(0.5 * np.pi)


def test_what_is_not_finite_or_far_off_is_not_drawn():
    blank = empty_room()
    for estimate in (np.nan, np.inf, 1e9):
        wild = empty_room(estimate=np.full((4, 2), estimate), estimate_status=np.full(4, 3))
        np.testing.assert_array_equal(draw(wild), draw(blank))
    vast = empty_room(
        estimate_cov=np.tile(1e12 * np.eye(2), (4, 1, 1)), estimate_status=np.full(4, 3)
    )
    assert draw(vast).shape == (SIZE[1], SIZE[0], 3)


@given(
    a=st.floats(0.1, 3.0), b=st.floats(0.1, 3.0), angle=st.floats(-4.0, 4.0),
    sigmas=st.floats(0.5, 4.0),
)  # fmt: skip
def test_ellipse_is_a_level_of_the_normalised_distance(a, b, angle, sigmas):
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, -s], [s, c]])
    cov = rotation @ np.diag([a, b]) ** 2 @ rotation.T
    outline = ellipse(cov, sigmas)
    level = np.einsum("pi,ij,pj->p", outline, np.linalg.inv(cov), outline)
    np.testing.assert_allclose(level, sigmas**2, rtol=1e-6)


@given(
    corners=st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=2, max_size=6),
    pattern=st.sampled_from([(3.0, 2.0), (1.5, 3.0), (7.0, 3.0, 1.5, 3.0)]),
)
def test_dashes_cover_their_share_of_the_line(corners, pattern):
    length = np.sum(np.linalg.norm(np.diff(corners, axis=0), axis=1))
    strokes = dashed(corners, pattern)
    drawn = sum(np.hypot(x1 - x0, y1 - y0) for (x0, y0), (x1, y1) in strokes)
    ends = np.cumsum(np.tile(pattern, 200))
    at = np.concatenate([[0.0], ends])
    covered = np.concatenate(
        [[0.0], np.cumsum(np.tile(pattern, 200) * (np.arange(len(ends)) % 2 == 0))]
    )
    assert drawn == pytest.approx(np.interp(length, at, covered), abs=1e-6)


@given(w=st.floats(0.05, 3.0), d=st.floats(0.05, 3.0), spacing=st.floats(0.05, 1.0))
def test_hatching_ends_on_the_border(w, d, spacing):
    for stroke in hatching(w, d, spacing):
        reach = np.max(np.abs(stroke) / [w, d], axis=1)
        np.testing.assert_allclose(reach, 1.0, atol=1e-9)
        run = stroke[1] - stroke[0]
        assert run[0] == pytest.approx(run[1], abs=1e-9)


def test_car_is_one_long_one_wide_and_symmetric():
    wheels = np.vstack([car_shape.FRONT_WHEELS, car_shape.REAR_WHEELS])
    tyres = (wheels[:, None] + car_shape.TYRE).reshape(-1, 2)
    both = np.vstack([car_shape.BODY, tyres])
    assert np.max(np.abs(both)) <= 0.51
    for outline in (car_shape.BODY, car_shape.ROOF, car_shape.WINDSCREEN, car_shape.REAR_WINDOW):
        mirrored = outline * [1.0, -1.0]
        apart = np.linalg.norm(outline[:, None] - mirrored, axis=-1).min(axis=1)
        np.testing.assert_allclose(apart, 0.0, atol=1e-12)


@pytest.mark.parametrize("room", [(3.0, 5.0), (5.0, 5.0), (14.0, 5.0), (0.8, 0.6), (60.0, 40.0)])
@pytest.mark.parametrize("size", [(960, 720), (480, 360), (300, 200), (240, 180), (1280, 400)])
def test_the_whole_room_is_on_the_floor(room, size):
    layout = Layout.fit(size, room)
    corners = layout.pixels(0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * room)
    assert np.all(corners >= (layout.floor.left, layout.floor.top))
    assert np.all(corners <= (layout.floor.right, layout.floor.bottom))
    assert corners[0, 1] > corners[2, 1]  # y is up
    assert not layout.panel or layout.card.right <= size[0]
    assert not layout.panel or layout.card.bottom <= size[1]


def test_error_axis_has_room_for_all_that_is_shown():
    snapshot = make_snapshot()
    assert error_axis(snapshot) == 0.2  # the first 5 s, with 0.3 m, are outside the window
    assert error_axis(replace(snapshot, t=20.0)) == 0.4
    assert error_axis(replace(snapshot, tracking_error=np.full(250, 7.0))) == 10.0
    assert error_axis(replace(snapshot, t=100.0)) == 0.05


def test_stretches_are_the_runs_of_a_mask():
    shown = np.array([1, 1, 0, 1, 0, 0, 1, 1, 1], dtype=bool)
    assert stretches(shown) == [slice(0, 2), slice(6, 9)]
    assert stretches(np.zeros(0, dtype=bool)) == []


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"pose": np.zeros((4, 2))}, "pose"),
        ({"steering": np.zeros(5)}, "steering"),
        ({"estimate_cov": np.zeros((4, 2))}, "estimate_cov"),
        ({"movable": np.zeros(3, dtype=bool)}, "movable"),
        ({"tracking_error": np.zeros(3)}, "tracking_error"),
        ({"goal": np.zeros((7, 2))}, "goal"),
        ({"viewer": 4}, "viewer"),
        ({"links": np.array([[0, 4, 0]])}, "links"),
        ({"room": (0.0, 5.0)}, "room"),
    ],
)
def test_a_wrong_snapshot_is_refused_by_name(changes, named):
    with pytest.raises(EnvError, match=named):
        make_snapshot(**changes)


@pytest.mark.parametrize(
    ("options", "named"),
    [({"mode": "ansi"}, "mode"), ({"size": (10, 10)}, "size"), ({"fps": 0.0}, "fps"),
     ({"fine": 0}, "fine")],
)  # fmt: skip
def test_a_wrong_option_is_refused_by_name(options, named):
    with pytest.raises(EnvError, match=named):
        Renderer(**options)


def test_close_can_be_repeated_and_undone():
    renderer, snapshot = Renderer(size=SIZE), make_snapshot()
    renderer.close()
    first = renderer.draw(snapshot)
    renderer.close()
    renderer.close()
    np.testing.assert_array_equal(renderer.draw(snapshot), first)


def test_arrays_need_no_screen():
    import pygame

    pygame.display.quit()
    draw(make_snapshot())
    assert not pygame.display.get_init()


@pytest.fixture
def screen(monkeypatch):
    """Use an invisible screen."""
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield pygame
    pygame.display.quit()


def test_a_window_shows_the_same_picture(screen):
    renderer, snapshot = Renderer(mode="human", size=SIZE, fps=1000.0), make_snapshot()
    assert renderer.draw(snapshot) is None
    assert screen.display.get_caption()[0] == snapshot.title
    shown = screen.surfarray.array3d(screen.display.get_surface()).swapaxes(0, 1)
    np.testing.assert_array_equal(shown, draw(snapshot))
    renderer.close()
    renderer.close()
    assert not screen.display.get_init()
    assert renderer.draw(snapshot) is None
    renderer.close()


def test_a_window_waits_for_its_rate(screen, monkeypatch):
    asked = []

    class Clock:
        def tick(self, fps):
            asked.append(fps)

    monkeypatch.setattr(screen.time, "Clock", Clock)
    renderer = Renderer(mode="human", size=SIZE, fps=12.0)
    renderer.draw(make_snapshot())
    renderer.draw(make_snapshot())
    renderer.close()
    assert asked == [12.0, 12.0]


def test_a_window_the_user_closed_stays_closed(screen):
    renderer, snapshot = Renderer(mode="human", size=SIZE, fps=1000.0), make_snapshot()
    renderer.draw(snapshot)
    screen.event.post(screen.event.Event(screen.QUIT))
    renderer.draw(snapshot)
    assert renderer.dismissed
    renderer.draw(snapshot)
    assert not screen.display.get_init()
    renderer.close()
    assert not renderer.dismissed


def test_without_pygame_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(EnvError, match=r"pip install -e '\.\[render\]'"):
        Renderer()
    with pytest.raises(EnvError, match=r"pip install -e '\.\[render\]'"):
        save_snapshot(make_snapshot(), "never.png")


def test_importing_it_imports_no_pygame():
    code = "import sys, relpos_env.render; print('pygame' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_a_saved_picture_is_the_drawn_one(tmp_path):
    import pygame

    path = tmp_path / "scene.png"
    save_snapshot(make_snapshot(), path, size=SIZE, fine=2)
    saved = pygame.surfarray.array3d(pygame.image.load(str(path))).swapaxes(0, 1)
    np.testing.assert_array_equal(saved, draw(make_snapshot()))
