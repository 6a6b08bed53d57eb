"""Pictures one after the other as a file: .gif by Pillow, .mp4 by ffmpeg where there is one, .html as one page."""

import base64
import io
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from html import escape
from importlib.util import find_spec
from itertools import chain
from pathlib import Path

import numpy as np

from ...core import Missing
from .pictures import BLUE, ORANGE

ENDINGS = (".gif", ".mp4", ".html")
BIT_RATE = "4M"


def write(path: Path, images: Iterable, head: str, seconds: float) -> None:
    """Write pictures that last `seconds` each; images: (text, picture (height, width, 3) uint8), all of one size.

    Missing where an .mp4 is asked for and no ffmpeg is there; it is looked for before a picture is drawn.
    """
    {".gif": _gif, ".mp4": _mp4, ".html": _page}[path.suffix](path, iter(images), head, seconds)


def ready(path: Path) -> None:
    """Missing where what writes files of the ending of `path` is not there, with the line that installs it."""
    if path.suffix == ".mp4":
        _ffmpeg(path)


def _gif(path: Path, images: Iterator, head: str, seconds: float) -> None:
    from PIL import Image

    held = Image.new("P", (1, 1))
    held.putpalette(palette().tobytes())
    # no dithering: the same colour is the same in every picture, and what stands still is packed away
    first, *rest = [Image.fromarray(one).quantize(palette=held, dither=Image.Dither.NONE) for _, one in images]
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
        raise Missing(f"{path}: .mp4 is written by ffmpeg, which is not there; pip install imageio-ffmpeg, or name a "
                      ".gif or .html")
    return program


def _mp4(path: Path, images: Iterator, head: str, seconds: float) -> None:
    program = _ffmpeg(path)
    first = next(images)[1]
    high, wide = first.shape[:2]
    words = [program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{wide}x{high}",
             "-r", f"{1 / seconds:.6g}", "-i", "-", "-an", "-pix_fmt", "yuv420p", "-b:v", BIT_RATE, str(path)]
    run = subprocess.Popen(words, stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        for one in chain([first], (one for _, one in images)):
            run.stdin.write(np.ascontiguousarray(one).tobytes())
    except BrokenPipeError:
        pass  # it has ended early, and says why
    said = run.communicate()[1].decode(errors="replace").strip().splitlines()[-1:]
    if run.returncode:
        said = said or [f"code {run.returncode}"]
        raise Missing(f"{path}: ffmpeg could not write it ({said[0]}); name a .gif or .html")


def _page(path: Path, images: Iterator, head: str, seconds: float) -> None:
    from PIL import Image

    shown = []
    for text, one in images:
        held = io.BytesIO()
        Image.fromarray(one).save(held, "png", optimize=True)
        data = base64.b64encode(held.getvalue()).decode()
        shown.append(f'<img alt="{escape(text)}" src="data:image/png;base64,{data}">')
    text = PAGE.replace("MILLISECONDS", str(round(1e3 * seconds))).replace("LAST", str(len(shown) - 1))
    before, between, after = text.split("HEAD")
    path.write_text(f"{before}{escape(head)}{between}{escape(head)}{after.replace('IMAGES', chr(10).join(shown))}",
                    "utf-8")


PAGE = """\
<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>HEAD</title>
<style>
:root{color-scheme:light dark}
body{font:15px/1.5 system-ui,sans-serif;max-width:1200px;margin:1rem auto;padding:0 1rem}
#frames img{display:none;width:100%;height:auto}#frames img.on{display:block}
form{display:flex;gap:1rem;align-items:center;flex-wrap:wrap}input[type=range]{flex:1;min-width:12rem}
@media print{form{display:none}}
</style>
</head>
<body>
<h1>HEAD</h1>
<form>
<button type="button" id="play">pause</button>
<input type="range" id="at" min="0" max="LAST" value="0" aria-label="frame">
<label>pace <select id="pace"><option value="4">1/4</option><option value="2">1/2</option>
<option value="1" selected>1</option><option value="0.5">2</option></select></label>
</form>
<div id="frames">
IMAGES
</div>
<script>
"use strict";
const frames = [...document.querySelectorAll("#frames img")];
const [at, play, pace] = ["at", "play", "pace"].map(name => document.getElementById(name));
let timer = 0;
function show(number) {
  at.value = number;
  frames.forEach((frame, k) => frame.classList.toggle("on", k === number));
  at.setAttribute("aria-valuetext", frames[number].alt);
}
function step() {
  show((Number(at.value) + 1) % frames.length);
  timer = setTimeout(step, MILLISECONDS * Number(pace.value));
}
function run(on) {
  clearTimeout(timer);
  timer = on ? setTimeout(step, MILLISECONDS * Number(pace.value)) : 0;
  play.textContent = on ? "pause" : "play";
}
play.onclick = () => run(!timer);
at.oninput = () => { run(false); show(Number(at.value)); };
show(0);
run(!matchMedia("(prefers-reduced-motion: reduce)").matches);
</script>
</body>
</html>
"""
