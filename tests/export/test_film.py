"""Animations of the last cycle: their frames agree with the pictures of single frames; refused options."""

from __future__ import annotations

import stat
import sys

import matplotlib
import numpy as np
import pytest
from command_line import run_cli
from exported import write_small_series
from PIL import Image

from patchfem.export.drawing.film import DPI, FRAME_SIZE, make_film
from patchfem.export.drawing.flat import STYLE, Picture
from patchfem.export.fields.series import MIN_STEP_RATIO, Series, last_consecutive_frames

WIDTH, HEIGHT = 1200, 680
TITLE_HEIGHT = 180  # Height of the titles, one of which names the folder [px].
RECORDER = """\
#!{python}
import sys
data = b"" if {code} else sys.stdin.buffer.read()
print("the codec is missing", file=sys.stderr)
open(sys.argv[-1], "wb").write(" ".join(sys.argv[1:]).encode() + b"\\n" + data)
sys.exit({code})
"""


@pytest.fixture(scope="module")
def small_folder(tmp_path_factory):
    """Return the folder of a pressed state and, long after it, three frames of random fields."""
    folder = tmp_path_factory.mktemp("film") / "<b>out"
    write_small_series(folder, 4, times=[0.0, 7.0, 7.1, 7.2])
    return folder


def frame_pixels(series, settings, number) -> np.ndarray:
    """Return the pixels (height, width, 3) of a single frame."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    frame = series.frame(number)
    with matplotlib.rc_context(STYLE):
        picture = Picture(
            frame, f"out, {frame.time:.6g} s", settings.panels(frame), FRAME_SIZE, settings.reach
        )
        canvas = FigureCanvasAgg(picture.figure)
        picture.figure.set_dpi(DPI)
        canvas.draw()
    return np.array(canvas.buffer_rgba())[..., :3]


@pytest.fixture(scope="module")
def drawn_frames(small_folder):
    """Return the settings of the small series and the pixels of each of its frames."""
    with Series(small_folder) as series:
        settings = make_film(series)
        return settings, [frame_pixels(series, settings, number) for number in settings.numbers]


def test_exact_last_cycle_excludes_pressed_state():
    """The frames of the last cycle are consecutive and exclude the pressed state long before them."""
    cycle = 0.007 * np.arange(1, 17) / 16
    assert last_consecutive_frames(np.array([0.0, *(1.39 + cycle)])) == tuple(range(1, 17))
    # the frames of a bench are as evenly spaced as its steps allow
    assert last_consecutive_frames(np.cumsum([0, 4, 6, 6, 4, 4, 6])) == tuple(range(7))
    assert last_consecutive_frames(np.array([0.0, 1.0, 2.0, 3.0 + MIN_STEP_RATIO])) == (3,)
    assert last_consecutive_frames(np.array([0.0])) == (0,) and last_consecutive_frames(
        np.array([0.0, 2.0])
    ) == (0, 1)


def test_exact_gif_frames_agree_with_pictures(small_folder, drawn_frames, tmp_path):
    """The frames of a .gif agree with the single pictures within the 256 colours of the format."""
    settings, pictures = drawn_frames
    answer = run_cli("view", small_folder, "-o", tmp_path / "a.gif")
    assert answer.code == 0 and "3 frames, 7 s to 7.2 s" in answer.out, answer.err
    with Image.open(tmp_path / "a.gif") as gif:
        assert (gif.n_frames, gif.size, gif.info["loop"]) == (
            len(settings.numbers),
            (WIDTH, HEIGHT),
            0,
        )
        frames = []
        for k in range(gif.n_frames):
            gif.seek(k)
            frames.append(np.array(gif.convert("RGB")).astype(int))
    constant_columns = [
        x
        for x in range(480, 640)
        if all(
            np.array_equal(frame[TITLE_HEIGHT:, x], pictures[0][TITLE_HEIGHT:, x])
            for frame in pictures
        )
    ]
    colour_bar = max(constant_columns, key=lambda x: len(np.unique(pictures[0][:, x], axis=0)))
    assert (
        len(np.unique(frames[0][:, colour_bar], axis=0)) > 50
    )  # the colour bar that all frames share
    for frame, picture in zip(frames, pictures, strict=True):
        assert np.array_equal(
            frame[TITLE_HEIGHT:, colour_bar], frames[0][TITLE_HEIGHT:, colour_bar]
        )
        difference = np.abs(frame - picture)[
            TITLE_HEIGHT:
        ]  # differences arise from the reduction to 256 colours
        # the remaining pixels are smoothed edges of lines
        assert difference.mean() < 0.5 and np.percentile(difference, 99) < 8
        assert (np.abs(frame - pictures[0])[TITLE_HEIGHT:].mean() > 1) == (
            picture is not pictures[0]
        )
    assert [path.name for path in tmp_path.iterdir()] == ["a.gif"]


def install_fake_ffmpeg(folder, monkeypatch, code: int):
    """Put a program named ffmpeg on the path that records its arguments and input, and ends with a code."""
    program = folder / "ffmpeg"
    program.write_text(RECORDER.format(python=sys.executable, code=code))
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(folder))


def test_exact_ffmpeg_receives_all_frames(small_folder, drawn_frames, tmp_path, monkeypatch):
    """For an .mp4 every frame is passed to ffmpeg unchanged."""
    (tmp_path / "bin").mkdir()
    install_fake_ffmpeg(tmp_path / "bin", monkeypatch, 0)
    answer = run_cli("view", small_folder, "-o", tmp_path / "a.mp4")
    assert answer.code == 0, answer.err
    arguments, data = (tmp_path / "a.mp4").read_bytes().split(b"\n", 1)
    assert f"-s {WIDTH}x{HEIGHT} ".encode() in arguments and WIDTH % 2 == HEIGHT % 2 == 0
    received = np.frombuffer(data, np.uint8).reshape(-1, HEIGHT, WIDTH, 4)[..., :3].astype(int)
    assert len(received) == len(drawn_frames[1])
    for frame, picture in zip(received, drawn_frames[1]):
        assert np.array_equal(frame[TITLE_HEIGHT:], picture[TITLE_HEIGHT:])


def test_refuses_mp4_that_ffmpeg_cannot_write(small_folder, tmp_path, monkeypatch):
    """If ffmpeg fails, its message is printed and no file remains."""
    (tmp_path / "bin").mkdir()
    install_fake_ffmpeg(tmp_path / "bin", monkeypatch, 1)
    answer = run_cli("view", small_folder, "-o", tmp_path / "a.mp4")
    assert answer.code == 4 and "the codec is missing" in answer.err
    assert [path.name for path in tmp_path.iterdir()] == ["bin"]


def test_refuses_mp4_without_ffmpeg(small_folder, tmp_path, monkeypatch):
    """Without ffmpeg an .mp4 is refused before a frame is drawn."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    answer = run_cli("view", small_folder, "-o", tmp_path / "a.mp4")
    assert answer.code == 4 and "pip install imageio-ffmpeg" in answer.err
    assert not list(tmp_path.iterdir())


def test_refuses_animation_without_motion(small_folder, tmp_path):
    """An animation of a run without fields, of a single frame or with the option --frame is refused."""
    (tmp_path / "lumped").mkdir()
    answer = run_cli("view", tmp_path / "lumped", "-o", tmp_path / "a.gif")
    assert answer.code == 4 and "only a run with [contact] writes one" in answer.err
    write_small_series(tmp_path / "still", 1)
    answer = run_cli("view", tmp_path / "still", "-o", tmp_path / "a.gif")
    assert answer.code == 2 and "no motion to show" in answer.err and "-o FILE.png" in answer.err
    answer = run_cli("view", small_folder, "-o", tmp_path / "a.gif", "--frame", "1")
    assert answer.code == 2 and "--frame" in answer.err
    for options in (("--frame", "1"), ("--magnify", "2")):
        answer = run_cli("view", small_folder, "-o", tmp_path / "a.html", *options)
        assert answer.code == 2 and "sliders for frame and magnification" in answer.err
    answer = run_cli("view", small_folder, "-o", tmp_path / "still" / "fields.vtkhdf" / "a.gif")
    assert answer.code == 4 and "cannot be written (Not a directory)" in answer.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lumped", "still"]
