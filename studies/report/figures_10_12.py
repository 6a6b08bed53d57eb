"""Do two rubbing masses ring below resonance, as in Figure 10, but not near or above resonance, as in Figures 11 and
12?

Yes. At a drive frequency of 0.1 w0, the rubbed mass reverses its motion about 14 times a cycle; the motion of the
driven mass stays within 5 % of a sine. From 0.5 w0 on, each mass reverses about twice a cycle. At w0 the motion of the
rubbed mass is a sine to 0.2 %.

Equations 2.6 and 2.7 with friction 0.1 P0, V0 = 0.01 P0/sqrt(K m) and 2 % of damping. Half peak to peak of x1 and x2 in
P0/k: 0.128 and 0.921 at 0.1 w0, 3.18 and 21.82 at w0, 0.0051 and 0.0402 at 5 w0. The ringing is not loudest in Fig. 10
but near a third of w0, where 65 % of the rubbed mass's motion is not its first harmonic. The interface slides on at
resonance, as the report says, but takes little there: friction takes 11 % of the energy of a cycle, dampers the rest;
96 % at 0.1 w0 and 94 % at 5 w0. Ranges and scales of the prints could not be read; their captions give the frequency.

Run: python studies/report/figures_10_12.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, ORANGE, drawing
from study_run import run_study
from study_text import read_answer

import patchfem as pf

FOLDER = Path(__file__).parent
ANSWER = read_answer(__doc__)
VERDICT = "yes"
FIGURES = {10: 0.1, 11: 1.0, 12: 5.0}  # figure: driving frequency / natural frequency
OTHER_RATIOS = (0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.7, 0.9, 1.1, 1.5, 2.0, 3.0)
DAMPING = 0.04  # coefficient c of the damper
TRANSIENT_TOL = 1e-5  # fraction of the initial motion that may remain


class Row(NamedTuple):
    """Last two cycles at a ratio of drive to natural frequency.

    Contains time [1/w0], x1 and x2 [P0/k]; for both masses half the peak-to-peak value, reversals
    per cycle and distortion (rms without the first harmonic over the rms); share of the friction in
    the energy that leaves a cycle.
    """

    ratio: float
    time: np.ndarray
    x1: np.ndarray
    x2: np.ndarray
    amplitude: tuple
    turns: tuple
    distortion: tuple
    friction: float


def turns_per_cycle(x) -> float:
    """Return the reversals per cycle of a motion x (k,) over two cycles whose first and last samples are equal."""
    rising = np.sign(np.diff(x[:-1], append=x[:1]))
    return float((rising != np.roll(rising, 1)).sum() / 2)


def distortion_ratio(x) -> float:
    """Return the rms without the first harmonic over the rms of a motion x (k,), sampled uniformly over two cycles."""
    power = np.abs(np.fft.rfft(x[:-1]))[1:] ** 2
    return float(np.sqrt(1 - power[1] / power.sum()))


def solve(ratio: float) -> Row:
    """Run until the transient has decayed, and return the row of the last two cycles."""
    cycles = max(8, int(np.ceil(ratio * np.log(1 / TRANSIENT_TOL) / (np.pi * DAMPING))))
    found = pf.run(
        FOLDER / "figures_10_12.toml",
        **{"drive.frequency": ratio / (2 * np.pi), "drive.cycles": cycles},
    )
    kept = found.to_xarray()
    period = 2 * np.pi / ratio
    begin = (cycles - 2) * period
    time = np.linspace(0, 2 * period, 1601)
    names = ("relative_displacement", "relative_velocity", "slide", "friction_force")
    x1, v1, slide, force = (
        np.interp(time, kept.time.values - begin, np.ravel(kept[name])) for name in names
    )
    speed = np.gradient(slide, time)
    x2 = x1 - slide
    v2 = v1 - speed
    rubbed = np.trapezoid(force * speed, time)
    damped = np.trapezoid(DAMPING * (v1**2 + v2**2), time)
    both = (x1, x2)
    return Row(
        ratio,
        time,
        x1,
        x2,
        tuple(float(np.ptp(x) / 2) for x in both),
        tuple(turns_per_cycle(x) for x in both),
        tuple(distortion_ratio(x) for x in both),
        float(rubbed / (rubbed + damped)),
    )


def picture(rows: list, path: Path) -> Path:
    """Plot both displacements over two cycles as in Figs 10, 11 and 12, and their distortion against frequency."""
    with drawing(path, (9.6, 6.2), 2, 2) as (figure, axes):
        by_ratio = {r.ratio: r for r in rows}
        for (number, ratio), axis in zip(FIGURES.items(), axes.ravel()):
            r = by_ratio[ratio]
            axis.plot(r.time, r.x2, color=BLUE, label="driven mass, x2")
            axis.plot(r.time, r.x1, color=ORANGE, label="rubbed mass, x1")
            axis.set(
                xlabel="ω0 t",
                ylabel="displacement [P0/k]",
                title=f"Fig. {number}: ω = {ratio:g} ω0",
                xlim=(0, r.time[-1]),
            )
        axis = axes[1, 1]
        ordered = sorted(rows)
        for which, colour in ((1, BLUE), (0, ORANGE)):
            axis.loglog(
                [r.ratio for r in ordered],
                [100 * r.distortion[which] for r in ordered],
                "o-",
                ms=3.5,
                color=colour,
            )
        axis.set(xlabel="ω/ω0", ylabel="not the first harmonic [%]", title="How far from a sine")
        axis.set_xticks((0.1, 0.2, 0.5, 1, 2, 5), ("0.1", "0.2", "0.5", "1", "2", "5"), minor=False)
        axis.set_yticks((0.01, 0.1, 1, 10, 100), ("0.01", "0.1", "1", "10", "100"))
        axis.minorticks_off()
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return path


def main(beside=OTHER_RATIOS, path: Path | None = FOLDER / "figures_10_12.svg") -> list:
    """Print, draw and return the rows of Figs 10, 11 and 12, then of nearby frequencies."""
    rows = [solve(ratio) for ratio in (*FIGURES.values(), *beside)]
    for r in rows:
        print(
            f"{r.ratio:4g} w0: "
            + "; ".join(
                f"{name} {amplitude:8.4f}, {turns:4.1f} turns a cycle, {100 * distortion:5.2f} % not the first harmonic"
                for name, amplitude, turns, distortion in zip(
                    ("x1", "x2"), r.amplitude, r.turns, r.distortion
                )
            )
            + f"; friction takes {100 * r.friction:.1f} %"
        )
    if path is not None:
        picture(rows, path)
    print(ANSWER)
    return rows


if __name__ == "__main__":
    run_study(main)
