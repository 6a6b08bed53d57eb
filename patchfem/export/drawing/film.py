"""Film of the pressed pieces through the last cycle, .gif or .mp4, without OpenGL.

All frames have the same colour scale, factor of the motion and window, so that only the motion
changes. The slide of the upper piece as a whole is subtracted before the rest is magnified, and is
drawn with its own factor: the factor that makes the deformation of a pad visible would move the
block by half its length.
"""

import logging
import shutil
import subprocess
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path

import matplotlib
import numpy as np

from ...core import Missing, PatchfemError
from ..fields.series import Frame, Series, last_consecutive_frames
from .flat import STYLE, Picture
from .panels import find_contact_window, make_panels, round_down_factor, upper_piece_slide

FILM_EXTENSIONS = (".gif", ".mp4")
FRAME_SIZE = (12.0, 6.8)  # width and height of a frame [inch]
DPI = 100  # resolution [pixels per inch]; video formats require an even number of pixels per side
BIT_RATE = 4000  # bit rate of a video [kbit/s]
DRAWN_SLIDE = 0.03  # largest slide as drawn, relative to the length of the pieces
# Duration of a cycle [s], subject to the limits on the duration of a frame.
CYCLE_SECONDS = 2.4
MIN_FRAME_SECONDS = 0.04  # shortest duration of a frame [s]
MAX_FRAME_SECONDS = 0.3  # longest duration of a frame [s]


@dataclass(frozen=True, slots=True)
class Film:
    """Data and settings that all frames of an animation share.

    Attributes
    ----------
    numbers : tuple of int
        Numbers of its frames in the series.
    factors : tuple of float
        Factor of the motion in each panel.
    close : tuple
        Window [mm] of the second panel.
    slide_factor : float
        Factor of the slide.
    windows : tuple
        (left, right, bottom, top) [mm] of each panel.
    tops : tuple of float
        Stress at the upper end of the colours of each panel [Pa].
    is_cut : tuple of bool
        Whether the stress of some cell exceeds this value.
    reach : tuple
        Minimum and maximum stress on the interface [Pa].
    pressure : float
        Maximum normal stress on the interface [Pa].
    """

    numbers: tuple
    factors: tuple
    close: tuple
    slide_factor: float
    windows: tuple
    tops: tuple
    is_cut: tuple
    reach: tuple
    pressure: float

    @property
    def seconds(self) -> float:
        """Duration of a frame [s]."""
        return float(
            np.clip(CYCLE_SECONDS / len(self.numbers), MIN_FRAME_SECONDS, MAX_FRAME_SECONDS)
        )

    def panels(self, frame: Frame) -> tuple:
        """Return the panels of one frame of the film."""
        return tuple(
            replace(panel, window=window, top=top, is_cut=is_cut)
            for panel, window, top, is_cut in zip(
                make_panels(frame, self.factors, self.close, self.slide_factor),
                self.windows,
                self.tops,
                self.is_cut,
            )
        )


def make_film(series: Series, magnify: float | None = None) -> Film:
    """Return the settings that all frames of an animation share, such as windows and colours.

    Parameters
    ----------
    series : Series
    magnify : float, optional
        Factor of the motion in both panels; by default the largest that suits every frame, for each
        panel.

    Raises
    ------
    PatchfemError
        If there is only one frame.
    """
    numbers = last_consecutive_frames(series.times)
    if len(numbers) < 2:
        raise PatchfemError(
            f"{series.path}: contains only one frame, so there is no motion to show; write a picture "
            "with -o FILE.png"
        )
    first_panels = []
    windows = []
    slides = []
    stress_ranges = {"normal_stress": [], "shear_stress": []}
    for number in numbers:
        frame = series.frame(number)
        first_panels.append(make_panels(frame, magnify))
        windows.append(find_contact_window(frame))
        slides.append(abs(upper_piece_slide(frame)) * 1e3)
        line = frame.interface()
        for name in stress_ranges.keys() & frame.point_data.keys():
            stress_ranges[name] += [
                float(frame.point_data[name][line].min()),
                float(frame.point_data[name][line].max()),
            ]
    factors = tuple(
        min(values_or_factors)
        for values_or_factors in zip(*((frame.factor for frame in pair) for pair in first_panels))
    )
    close = (*_enclosing_window(windows)[:2], *windows[0][2:])
    left, right = np.array([pair[0].window for pair in first_panels])[:, :2].T
    length = float((right - left).max())
    slide_factor = round_down_factor(DRAWN_SLIDE * length / max(slides)) if max(slides) > 0 else 1.0
    values_or_factors = [value for values in stress_ranges.values() for value in values]
    film = Film(
        numbers,
        factors,
        close,
        slide_factor,
        (),
        (),
        (),
        (min(values_or_factors), max(values_or_factors)),
        max(stress_ranges["normal_stress"]),
    )
    final_panels = [
        make_panels(series.frame(number), factors, close, slide_factor) for number in numbers
    ]
    return replace(
        film,
        windows=tuple(_enclosing_window([pair[k].window for pair in final_panels]) for k in (0, 1)),
        tops=tuple(max(pair[k].top for pair in final_panels) for k in (0, 1)),
        is_cut=tuple(any(pair[k].is_cut for pair in final_panels) for k in (0, 1)),
    )


def _enclosing_window(windows: list) -> tuple:
    """Return the smallest window that encloses several windows."""
    low = np.min(windows, axis=0)
    high = np.max(windows, axis=0)
    return (float(low[0]), float(high[1]), float(low[2]), float(high[3]))


def write_film(series: Series, head: str, magnify: float | None, out: Path) -> str:
    """Write the animation of a series of fields to a file, in the format of its suffix.

    Parameters
    ----------
    series : Series
    head : str
        First line of the title of each frame.
    magnify : float or None
        Magnification of the motion; None for the largest that suits every frame.
    out : Path
        File with a suffix of `FILM_EXTENSIONS`.

    Returns
    -------
    str
        Number of frames and their times.

    Raises
    ------
    PatchfemError
        The series has a single frame.
    Missing
        ffmpeg is not installed or cannot write the file.
    """
    film = make_film(series, magnify)
    picture = None
    with matplotlib.rc_context(STYLE | {"savefig.bbox": None, "savefig.dpi": "figure"}):
        writer = _movie_writer(out, film.seconds)
        for number in film.numbers:
            frame = series.frame(number)
            text = f"{head}, {frame.time:.6g} s"
            panels = film.panels(frame)
            if picture is None:
                picture = Picture(frame, text, panels, FRAME_SIZE, film.reach)
                picture.freeze_layout(DPI)
                writer.setup(picture.figure, str(out), dpi=DPI)
            else:
                picture.show(frame, text, panels)
            try:
                writer.grab_frame()
            except BrokenPipeError:  # ffmpeg has ended early; `_finish_file` reports the reason
                break
        _finish_file(writer, out)
    first, last = series.times[list(film.numbers)][[0, -1]]
    return f"{len(film.numbers)} frames, {first:.6g} s to {last:.6g} s"


def check_ffmpeg(out: Path) -> None:
    """Raise Missing if `out` is an .mp4 file and no ffmpeg is installed."""
    if out.suffix == ".mp4":
        _find_ffmpeg(out)


def _find_ffmpeg(out: Path) -> str:
    """Return the path of the program ffmpeg, or of the one in imageio-ffmpeg if ffmpeg is not installed."""
    program = shutil.which("ffmpeg")
    if program is None and find_spec("imageio_ffmpeg"):
        from imageio_ffmpeg import get_ffmpeg_exe

        program = get_ffmpeg_exe()
    if program is None:
        raise Missing(
            f"{out}: writing .mp4 needs ffmpeg, which is not installed; run pip install imageio-ffmpeg, or "
            "write .gif or .html"
        )
    return program


def _movie_writer(out: Path, seconds: float):
    """Return a matplotlib writer for a .gif or .mp4 file with a given frame duration."""
    if out.suffix == ".gif":
        from .gif_writer import GifWriter

        return GifWriter(fps=1 / seconds)
    from matplotlib import animation

    # The log would repeat what `_finish_file` reports about ffmpeg.
    logging.getLogger(animation.__name__).setLevel(logging.ERROR)
    matplotlib.rcParams["animation.ffmpeg_path"] = _find_ffmpeg(out)
    return animation.FFMpegWriter(fps=1 / seconds, codec="h264", bitrate=BIT_RATE)


def _finish_file(writer, out: Path) -> None:
    """Close a movie file; raise Missing with the last line of ffmpeg if this fails."""
    try:
        writer.finish()
    except subprocess.CalledProcessError as error:
        lines = (error.stderr or error.output or "").strip().splitlines() or [
            f"code {error.returncode}"
        ]
        raise Missing(
            f"{out}: ffmpeg could not write this file ({lines[-1]}); use .gif or .html"
        ) from None
