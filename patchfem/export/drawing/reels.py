"""Pictures one after the other as a file: .gif by Pillow, .mp4 by ffmpeg where there is one."""

import shutil
import subprocess
from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from itertools import chain
from pathlib import Path

import numpy as np

from ...core import Missing
from .pictures import BLUE, ORANGE

ENDINGS = (".gif", ".mp4")
BIT_RATE = "4M"


def write(path: Path, images: Iterable, seconds: float) -> None:
    """Write pictures (height, width, 3) uint8, all of one size, that last `seconds` each.

    Missing where an .mp4 is asked for and no ffmpeg is there; it is looked for before a picture is drawn.
    """
    {".gif": _gif, ".mp4": _mp4}[path.suffix](path, iter(images), seconds)


def ready(path: Path) -> None:
    """Missing where what writes files of the ending of `path` is not there, with the line that installs it."""
    if path.suffix == ".mp4":
        _ffmpeg(path)


def _gif(path: Path, images: Iterator, seconds: float) -> None:
    from PIL import Image

    held = Image.new("P", (1, 1))
    held.putpalette(palette().tobytes())
    # no dithering: the same colour is the same in every picture, and what stands still is packed away
    first, *rest = [Image.fromarray(one).quantize(palette=held, dither=Image.Dither.NONE) for one in images]
    first.save(path, save_all=True, append_images=rest, duration=round(1e3 * seconds), loop=0, optimize=False)


def palette() -> np.ndarray:
    """The 256 colours (256, 3) uint8 of a .gif: the scale of the stresses, greys, and tints of both curves."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    share = np.linspace(0, 1, 24)[:, None]
    parts = [colormaps["viridis"](np.linspace(0, 1, 176))[:, :3], np.linspace(0, 1, 32)[:, None] * np.ones(3),
             *(1 - share * (1 - np.array(to_rgb(colour))) for colour in (BLUE, ORANGE))]
    return np.round(255 * np.concatenate(parts)).astype(np.uint8)


def _ffmpeg(path: Path) -> str:
    program = shutil.which("ffmpeg")
    if program is None and find_spec("imageio_ffmpeg"):
        from imageio_ffmpeg import get_ffmpeg_exe

        program = get_ffmpeg_exe()
    if program is None:
        raise Missing(f"{path}: writing .mp4 needs ffmpeg, which is not installed; run pip install imageio-ffmpeg, or "
                      "write .gif or .html")
    return program


def _mp4(path: Path, images: Iterator, seconds: float) -> None:
    program = _ffmpeg(path)
    first = next(images)
    high, wide = first.shape[:2]
    words = [program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{wide}x{high}",
             "-r", f"{1 / seconds:.6g}", "-i", "-", "-an", "-pix_fmt", "yuv420p", "-b:v", BIT_RATE, str(path)]
    run = subprocess.Popen(words, stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        for one in chain([first], images):
            run.stdin.write(np.ascontiguousarray(one).tobytes())
    except BrokenPipeError:
        pass  # it has ended early, and says why
    said = run.communicate()[1].decode(errors="replace").strip().splitlines()[-1:]
    if run.returncode:
        said = said or [f"code {run.returncode}"]
        raise Missing(f"{path}: ffmpeg could not write this file ({said[0]}); use .gif or .html")
