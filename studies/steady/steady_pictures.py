"""The pictures of the studies of steady motions, each from the rows of its study."""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing


def backbone(rows: list, path: Path) -> Path:
    """Plot frequency and damping against amplitude; lines are free motions, markers are the bench."""
    with drawing(path, (8.5, 3.4), 1, 2) as (_, axes):
        for r, colour in zip(rows, (BLUE, ORANGE, GREY)):
            for axis, line, mark in zip(axes, r.free, r.bench):
                axis.loglog(1e6 * r.amplitude, line, "-", color=colour, label=r.case)
                axis.loglog(1e6 * r.amplitude, mark, "o", color=colour, ms=3.5)
        for axis, name in zip(axes, ("frequency [Hz]", "damping ratio")):
            axis.set(xlabel="amplitude [um]", ylabel=name)
        axes[0].axhline(143, color="#bbbbbb", lw=0.8, zorder=0)
        axes[0].text(
            0.04, 146, "143 Hz, the mode by itself", color="#777777", fontsize=9, va="bottom"
        )
        axes[0].legend(
            fontsize=9,
            title="lines: free motion, marks: bench",
            title_fontsize=9,
            loc="upper right",
        )
    return path


def fold(steady, sweeps: list, path: Path, ends: tuple) -> Path:
    """Plot the curve of steady motions with the slowest sweeps, and the frequencies of their jumps against the rate.

    ends: lowest and highest frequency shown [Hz].
    """
    slow = min(s.rate for s in sweeps)
    with drawing(path, (9.5, 3.8), 1, 2, {"dpi": 200}, width_ratios=(2, 1)) as (_, (left, right)):
        for s in sweeps:
            colour, name = (ORANGE, "up") if s.up else (GREY, "down")
            if s.rate == slow:
                left.plot(
                    s.frequency[::5],
                    1e3 * s.amplitude[::5],
                    ".",
                    color=colour,
                    ms=1.5,
                    rasterized=True,
                )
                left.plot([], [], ".", color=colour, label=f"marched {name}, {s.rate:g} Hz/s")
        for part, style in ((steady.stable, "-"), (~steady.stable, "--")):
            near = part | np.roll(part, 1) | np.roll(part, -1) if style == "--" else part
            left.plot(
                np.where(near, steady.frequency, np.nan),
                1e3 * np.where(near, steady.amplitude, np.nan),
                style,
                color=BLUE,
                lw=1.2,
                label="steady" if style == "-" else "steady, unstable",
            )
        left.set(xlim=ends, xlabel="frequency [Hz]", ylabel="amplitude [mm]")
        left.legend(fontsize=8)
        for up, colour, at in ((True, ORANGE, steady.folds[0]), (False, GREY, steady.folds[1])):
            mine = [s for s in sweeps if s.up == up]
            right.plot(
                [s.rate ** (2 / 3) for s in mine], [s.jump for s in mine], "o-", color=colour, ms=4
            )
            right.plot([0], [at], "x", color=BLUE)
        right.set(xlabel="rate$^{2/3}$ [(Hz/s)$^{2/3}$]", ylabel="jump [Hz] (x: folds)")
    return path
