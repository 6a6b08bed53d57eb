"""What a person gets, as pictures of the README: first screen, pages of a run, a sweep and a comparison, the pieces.

Run it where Pillow and a Chromium are; it takes a minute.
"""

import html
import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

ROOT = Path(__file__).parents[2]
FOLDER = Path(__file__).parent / "pictures"
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome") or "chromium"
SCREEN = "<body style='margin:0;background:#14181e;color:#dfe6ee'><pre style='font:15px/1.32 monospace;padding:14px'>"


def patchfem(*words: str) -> str:
    """What a command prints."""
    return subprocess.run([sys.executable, "-m", "patchfem", *map(str, words)], check=True, capture_output=True,
                          text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}).stdout


def shot(page: Path, name: str, width: int, height: int) -> None:
    """A page as a browser of this size shows it."""
    path = FOLDER / f"{name}.png"
    subprocess.run([CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                    f"--window-size={width},{height}", f"--screenshot={path}", "--virtual-time-budget=15000",
                    page.as_uri()], check=True, capture_output=True)
    small(path)


def small(path: Path) -> None:
    """A picture in 256 colours, at most 1260 pixels wide."""
    from PIL import Image

    found = Image.open(path).convert("RGB")
    found.thumbnail((1260, 1260))
    found.quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)


def traces(folder: Path = ROOT / "studies/wear") -> None:
    """Write the made-up pair of the README's recipe: a ground surface before and after its crests wore off over the
    middle half, to 0.4 um over its mean line."""
    draw, x = np.random.default_rng(4), np.arange(0, 4e-3, 4e-6)
    waves = [(2e-6, 190e-6, 0.3), (1.2e-6, 83e-6, 1.1), (0.6e-6, 31e-6, 2.0)]
    height = sum(a * np.sin(2 * np.pi * x / length + 9e2 * x * phase) for a, length, phase in waves)
    height = height + np.convolve(draw.standard_normal(x.size), np.ones(8) / 8, "same") * 1e-6
    worn = np.where(abs(x - 2e-3) < 1e-3, np.minimum(height, 0.4e-6), height)
    for name, z in (("before", height), ("after", worn)):
        noisy = z + 2e-8 * draw.standard_normal(x.size)
        np.savetxt(folder / f"{name}.csv", np.c_[1e3 * x, 1e6 * noisy], "%.3f", delimiter=",", header="x [mm],z [um]",
                   comments="")


def main() -> None:
    """All pictures, anew."""
    FOLDER.mkdir(exist_ok=True)
    with TemporaryDirectory() as room:
        here = Path(room)
        os.chdir(here)
        (here / "screen.html").write_text(f"{SCREEN}$ patchfem\n{html.escape(patchfem())}", "utf-8")
        shot(here / "screen.html", "first_screen", 760, 700)
        patchfem("run", ROOT / "studies/rig/rig.toml", "-o", "rig")
        shot(here / "rig/report.html", "run", 1130, 760)
        patchfem("view", "rig", "-o", FOLDER / "pieces.png")
        small(FOLDER / "pieces.png")
        patchfem("new", "misalignment", "-o", "tilts.toml")
        patchfem("sweep", "tilts.toml", "-o", "tilts")
        shot(here / "tilts/report.html", "sweep", 1130, 900)
        traces()
        patchfem("compare", *(ROOT / f"studies/wear/{name}.csv" for name in ("before", "after")), "--direction", "x",
                 "-o", "worn")
        shot(here / "worn/report.html", "compare", 1130, 760)


if __name__ == "__main__":
    main()
