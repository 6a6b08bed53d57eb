"""Films of the last cycle: every frame there, one scale for all, the slide not magnified with the rest; refusals."""

from __future__ import annotations

import stat
import sys

import matplotlib
import numpy as np
import pytest
from command_line import cli
from exported import write_small
from PIL import Image

from patchfem.export.drawing.film import DPI, FRAME_SIZE, make_film_settings
from patchfem.export.drawing.flat import STYLE, Picture
from patchfem.export.fields.series import MIN_STEP_RATIO, Series, last_consecutive_frames

WIDE, HIGH = 1200, 680
TITLE = 180  # rows of the titles, of which one names the folder
RECORDER = """\
#!{python}
import sys
data = b"" if {code} else sys.stdin.buffer.read()
print("the codec is missing", file=sys.stderr)
open(sys.argv[-1], "wb").write(" ".join(sys.argv[1:]).encode() + b"\\n" + data)
sys.exit({code})
"""


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """The pressed state and three frames of random fields long after it."""
    folder = tmp_path_factory.mktemp("film") / "<b>out"
    write_small(folder, 4, times=[0.0, 7.0, 7.1, 7.2])
    return folder


def pixels(series, film, number) -> np.ndarray:
    """(height, width, 3) of a frame that is drawn by itself."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    frame = series.frame(number)
    with matplotlib.rc_context(STYLE):
        picture = Picture(
            frame, f"out, {frame.time:.6g} s", film.panels(frame), FRAME_SIZE, film.reach
        )
        canvas = FigureCanvasAgg(picture.figure)
        picture.figure.set_dpi(DPI)
        canvas.draw()
    return np.array(canvas.buffer_rgba())[..., :3]


@pytest.fixture(scope="module")
def drawn(small):
    """(Film, pictures) of the small series, each frame drawn by itself."""
    with Series(small) as series:
        film = make_film_settings(series)
        return film, [pixels(series, film, number) for number in film.numbers]


def test_exact_the_last_cycle_is_without_the_pressed_state():
    cycle = 0.007 * np.arange(1, 17) / 16
    assert last_consecutive_frames(np.array([0.0, *(1.39 + cycle)])) == tuple(range(1, 17))
    # a bench's: as even as steps allow
    assert last_consecutive_frames(np.cumsum([0, 4, 6, 6, 4, 4, 6])) == tuple(range(7))
    assert last_consecutive_frames(np.array([0.0, 1.0, 2.0, 3.0 + MIN_STEP_RATIO])) == (3,)
    assert last_consecutive_frames(np.array([0.0])) == (0,) and last_consecutive_frames(
        np.array([0.0, 2.0])
    ) == (0, 1)


def test_exact_one_scale_holds_every_frame_and_the_pieces_stay_in_the_window(small):
    with Series(small) as series:
        film = make_film_settings(series)
        frames = [series.frame(number) for number in film.numbers]
    line = frames[0].interface()
    stress = [frame.point_data["normal_stress"][line] for frame in frames]
    assert film.reach == (np.min(stress), np.max(stress))
    for panels, window, top in zip(
        zip(*map(film.panels, frames)), film.windows, film.tops, strict=True
    ):
        places = []
        for panel, frame in zip(panels, frames):
            assert (panel.window, panel.top, panel.aside) == (window, top, film.aside)
            assert panel.factor == panels[0].factor
            cells = np.repeat(panel.cells, np.diff(frame.offsets))
            places.append(panel.places[np.unique(frame.connectivity[cells])])
        (left, bottom), (right, high) = np.min(places, axis=(0, 1)), np.max(places, axis=(0, 1))
        assert (left, right, bottom, high) == tuple(window)


def test_exact_the_range_of_colours_is_the_same_in_every_frame(small):
    with Series(small) as series:
        film = make_film_settings(series)
        first = series.frame(film.numbers[0])
        picture = Picture(first, "", film.panels(first), FRAME_SIZE, film.reach)
        assert len(picture.bodies[0].cells) == 2  # triangles and quadrilaterals
        for number in film.numbers:
            frame = series.frame(number)
            picture.show(frame, "", film.panels(frame))
            for bodies, top in zip(picture.bodies, film.tops):
                for mine, _, cells in bodies.cells:
                    assert cells.get_clim() == (0, top * bodies.scale)
                    assert np.array_equal(
                        cells.get_array(), frame.cell_data["von_mises"][mine] * bodies.scale
                    )


def test_exact_gif_has_every_frame_and_its_colours(small, drawn, tmp_path):
    film, pictures = drawn
    answer = cli("view", small, "-o", tmp_path / "a.gif")
    assert answer.code == 0 and "3 frames, 7 s to 7.2 s" in answer.out, answer.err
    with Image.open(tmp_path / "a.gif") as gif:
        assert (gif.n_frames, gif.size, gif.info["loop"]) == (len(film.numbers), (WIDE, HIGH), 0)
        frames = []
        for k in range(gif.n_frames):
            gif.seek(k)
            frames.append(np.array(gif.convert("RGB")).astype(int))
    still = [
        x
        for x in range(480, 640)
        if all(np.array_equal(one[TITLE:, x], pictures[0][TITLE:, x]) for one in pictures)
    ]
    bar = max(still, key=lambda x: len(np.unique(pictures[0][:, x], axis=0)))
    assert len(np.unique(frames[0][:, bar], axis=0)) > 50  # the bar of colours of the whole
    for one, picture in zip(frames, pictures, strict=True):
        assert np.array_equal(one[TITLE:, bar], frames[0][TITLE:, bar])
        off = np.abs(one - picture)[TITLE:]  # 256 colours stand for all
        assert off.mean() < 0.5 and np.percentile(off, 99) < 8  # but softened edges of lines
        assert (np.abs(one - pictures[0])[TITLE:].mean() > 1) == (picture is not pictures[0])
    assert [path.name for path in tmp_path.iterdir()] == ["a.gif"]


def recorder(folder, monkeypatch, code: int):
    program = folder / "ffmpeg"
    program.write_text(RECORDER.format(python=sys.executable, code=code))
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(folder))


def test_exact_mp4_gives_every_frame_to_ffmpeg(small, drawn, tmp_path, monkeypatch):
    (tmp_path / "bin").mkdir()
    recorder(tmp_path / "bin", monkeypatch, 0)
    answer = cli("view", small, "-o", tmp_path / "a.mp4")
    assert answer.code == 0, answer.err
    words, data = (tmp_path / "a.mp4").read_bytes().split(b"\n", 1)
    assert f"-s {WIDE}x{HIGH} ".encode() in words and WIDE % 2 == HIGH % 2 == 0
    read = np.frombuffer(data, np.uint8).reshape(-1, HIGH, WIDE, 4)[..., :3].astype(int)
    assert len(read) == len(drawn[1])
    for frame, picture in zip(read, drawn[1]):
        assert np.array_equal(frame[TITLE:], picture[TITLE:])


def test_refuses_mp4_that_ffmpeg_cannot_write_and_leaves_nothing(small, tmp_path, monkeypatch):
    (tmp_path / "bin").mkdir()
    recorder(tmp_path / "bin", monkeypatch, 1)
    answer = cli("view", small, "-o", tmp_path / "a.mp4")
    assert answer.code == 4 and "the codec is missing" in answer.err
    assert [path.name for path in tmp_path.iterdir()] == ["bin"]


def test_refuses_mp4_without_ffmpeg_before_anything_is_drawn(small, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    answer = cli("view", small, "-o", tmp_path / "a.mp4")
    assert answer.code == 4 and "pip install imageio-ffmpeg" in answer.err
    assert not list(tmp_path.iterdir())


def test_refuses_a_film_without_fields_of_one_frame_or_of_a_named_one(small, tmp_path):
    (tmp_path / "lumped").mkdir()
    answer = cli("view", tmp_path / "lumped", "-o", tmp_path / "a.gif")
    assert answer.code == 4 and "only a run with [contact] writes one" in answer.err
    write_small(tmp_path / "still", 1)
    answer = cli("view", tmp_path / "still", "-o", tmp_path / "a.gif")
    assert answer.code == 2 and "no motion to show" in answer.err and "-o FILE.png" in answer.err
    answer = cli("view", small, "-o", tmp_path / "a.gif", "--frame", "1")
    assert answer.code == 2 and "--frame" in answer.err
    for more in (("--frame", "1"), ("--magnify", "2")):
        answer = cli("view", small, "-o", tmp_path / "a.html", *more)
        assert answer.code == 2 and "sliders for frame and magnification" in answer.err
    answer = cli("view", small, "-o", tmp_path / "still" / "fields.vtkhdf" / "a.gif")
    assert answer.code == 4 and "cannot be written (Not a directory)" in answer.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lumped", "still"]
