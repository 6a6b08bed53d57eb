"""Does the rig without friction have the frequency response of Figure 26, and would a random modal test find this
response?

Yes. The response has one dominant peak, that of the axial mode at 143.00 Hz, with 165 times the base acceleration. From
80 s of random base motion the H1 estimate finds this peak at 143.00 Hz, with a damping ratio of 0.00305 (true value
0.003) and a height that is 2.3 % too low.

The curve is that of a scene with method "harmonic" over a sweep: 222 points, closer together where it bends, so that
straight lines between them miss it by 1 % at most; 121 even ones find the peak at 142.5 Hz with two thirds of its
height. Rocking at 73 Hz transmits 2.4 times the base acceleration where its share of the axial motion is a tenth, yaw
at 129 Hz is a dent at a share of 0.05; the report gives neither share. H1 is averaged over 9 windows of 16 s
that overlap by half; lines 1/16 Hz apart flatten a peak 0.86 Hz wide at half its power. Of the print only the caption
and "FREQRESP-BODE" could be read, neither axes nor input: drawn is acceleration over base acceleration.

Run: python studies/report/figure_26.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from modal_test import Estimate, fit_mode, h1, run_random_test
from study_run import run_study
from study_text import read_answer

import patchfem as pf
from patchfem.structure import compute_receptance

FOLDER = Path(__file__).parent
ANSWER = read_answer(__doc__)
VERDICT = "yes"
SCENE = FOLDER / "free.toml"
SECONDS = 80.0  # [s] duration of the random test
WINDOW = 16.0  # [s] window of the estimate
RMS = 0.1  # [g] rms of the random base acceleration
FIT_BAND = (140.0, 146.0)  # [Hz] band in which the axial mode is fitted


class Free(NamedTuple):
    """Steady response: frequencies (k,) [Hz], complex transmissibility (k,), and frequency [Hz] and height of its peak."""

    f: np.ndarray
    h: np.ndarray
    peak: tuple


def transmissibility(f) -> np.ndarray:
    """Return the complex acceleration (k,) of the block over that of the base at frequencies f (k,) [Hz]."""
    modes = pf.build(SCENE).rig.modes
    omega = 2 * np.pi * np.asarray(f, float)
    return (
        1
        + omega**2
        * modes.mass
        * compute_receptance(modes, omega, modes.output, modes.base)[:, 0, 0]
    )


def curve() -> Free:
    """Return the response at the frequencies that a sweep with method "harmonic" chooses."""
    found = pf.run(SCENE)
    f = found.motion.steady.curve["frequency"]
    h = transmissibility(f)
    k = int(np.argmax(found.motion.steady.curve["amplitude"]))
    return Free(f, h, (float(f[k]), float(np.abs(h[k]))))


def random_test() -> Estimate:
    """Return H1 of a random test from 60 to 210 Hz."""
    text = SCENE.read_text("utf-8").replace('method = "harmonic"', 'method = "exact"')
    return h1(run_random_test(text, SECONDS, RMS), WINDOW).between(60, 210)


def _picture(free: Free, seen: Estimate, path: Path) -> Path:
    """Plot magnitude, phase, and an enlarged view of the peak."""
    with drawing(path, (9.6, 5.4), 2, 2, height_ratios=(2, 1), width_ratios=(1.9, 1)) as (
        figure,
        axes,
    ):
        for column in (0, 1):
            for axis, of in (
                (axes[0, column], np.abs),
                (axes[1, column], lambda h: np.degrees(np.angle(h))),
            ):
                axis.plot(
                    seen.f,
                    of(seen.h),
                    color=ORANGE,
                    lw=3,
                    label="random base for 80 s, H1 estimate",
                )
                axis.plot(
                    free.f,
                    of(free.h),
                    ".-",
                    color=BLUE,
                    lw=0.8,
                    ms=4,
                    label="steady, points where it bends",
                )
            axes[1, column].set(xlabel="frequency [Hz]", ylim=(-190, 20), yticks=(-180, -90, 0))
        size, near = axes[0]
        for f, text, height in (
            (73, "rocking 73 Hz", 4),
            (127, "yaw 129 Hz", 9),
            (143, "axial 143 Hz", 220),
        ):
            size.text(f, height, text, ha="center", va="bottom", fontsize=9)
        size.set(
            yscale="log", ylabel="acceleration of block / base", ylim=(0.3, 500), xlim=(60, 210)
        )
        near.set(ylim=(0, 180), title="the axial peak by itself")
        near.axvline(142.5, color=GREY, lw=0.8, ls="--")
        near.text(142.45, 120, "nearest of\n121 even\npoints", color=GREY, ha="right", fontsize=9)
        axes[1, 0].set(xlim=(60, 210), ylabel="phase [deg]")
        for axis in axes[:, 1]:
            axis.set_xlim(141, 145)
        figure.legend(*size.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return path


def main(path: Path | None = FOLDER / "figure_26.svg") -> tuple:
    """Print and draw the steady curve, the random test and the fitted mode, and return all three."""
    free = curve()
    seen = random_test()
    found = fit_mode(seen.between(*FIT_BAND))
    at = int(np.argmax(np.abs(seen.h)))
    print(
        f"steady curve: {free.f.size} points, peak {free.peak[1]:.1f} at {free.peak[0]:.2f} Hz, rocking "
        f"{np.abs(free.h[free.f < 80]).max():.2f}"
    )
    print(
        f"random test: peak {np.abs(seen.h[at]):.1f} at {seen.f[at]:.2f} Hz; fitted {found[0]:.2f} Hz, damping "
        f"{found[1]:.5f}, coherence {seen.coherence[at]:.3f}"
    )
    if path is not None:
        _picture(free, seen, path)
    print(ANSWER)
    return free, seen, found


if __name__ == "__main__":
    run_study(main)
