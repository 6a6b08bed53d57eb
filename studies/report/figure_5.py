"""A slowly moving frame rubs a block. Does the block ring as in Figure 5, or is the ringing an artefact of Euler's
method?

The block rings in the exact solution too, at its own natural frequency, which is ten times that of the frame. The first
swing has an amplitude of 0.137 a0, where a0 is the amplitude of the frame; each further swing has 0.939 times the
amplitude of the swing before. With Euler's method the first swing is too large: its amplitude is 0.156 a0 with a time
step of 0.1/w0, and 0.190 a0 with a time step of 0.2/w0.

Equations 2.4 and 2.5 with the report's numbers: friction 0.1 K a0 tanh of the relative velocity over 0.01 a0 w0, the
frame at 0.1 w0, 2 % of damping. Twice a cycle the frame turns and carries the block along, for 22 % of the time, until
the spring gives way; then it swings freely about 0.1 a0, and exp(-0.02 pi) is what damping leaves of a swing. Euler
adds -w0 h/2 to the damping ratio: at h = 0.04/w0 nothing is left of the 2 % and the ringing lasts, above it the ringing
grows as long as the block slides. The report names no step. The frame is a mass of 1e9 times that of the block, so that
the motion of the block in space is the output of the run. Range and scale of the print could not be read; a typical
cycle is drawn, as there.

Run: python studies/report/figure_5.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from report_methods import solve_euler
from study_run import run_study
from study_text import read_answer

import patchfem as pf
from patchfem.model import build
from patchfem.motion_measures import find_extremes
from patchfem.scene import load as load_scene

FOLDER = Path(__file__).parent
ANSWER = read_answer(__doc__)
VERDICT = "yes"
# time steps of Euler's method [1/w0]; above 2 m v0/F0 = 0.2 the friction force oscillates
STEPS = (
    0.01,
    0.02,
    0.04,
    0.07,
    0.1,
    0.15,
    0.2,
)
FREQUENCY = 0.1  # frequency of the frame / natural frequency of the block


class Motion(NamedTuple):
    """Last cycle of a run.

    Contains time [1/w0] from its start, displacements of block and frame [a0], friction on the
    block [K a0], and half the peak-to-peak displacement of the block.
    """

    time: np.ndarray
    block: np.ndarray
    frame: np.ndarray
    friction: np.ndarray
    peak: float


def motion(step: float | None = None) -> Motion:
    """Return the motion by Euler's method with steps of `step` [1/w0], or by the engine of the tolerance for None.

    The signs are turned about, so that the frame moves as + a0 sin(w t).
    """
    period = 2 * np.pi / FREQUENCY
    if step is not None:
        return _by_euler(round(period / step), period)
    found = pf.run(FOLDER / "figure_5.toml")
    kept = found.to_xarray()
    kept = kept.isel(time=kept.time.values >= 7 * period - 1e-6)
    block = -kept.relative_displacement.values
    slide = -kept.slide.values
    return Motion(
        kept.time.values - 7 * period,
        block,
        block - slide,
        kept.friction_force.values,
        found.measures["relative_displacement_amplitude"].value,
    )


def _by_euler(steps: int, period: float) -> Motion:
    """Return the last cycle by Euler's method with this number of steps per cycle."""
    rig = build(load_scene(FOLDER / "figure_5.toml")).rig
    numbers = rig.friction.interfaces[0].numbers
    motion = solve_euler(
        rig.modes,
        rig.drive.signal,
        numbers.static,
        numbers.reference_speed,
        (rig.drive.cycles * rig.drive.signal.period, steps),
        rig.start,
    )
    last = slice(-steps - 1, None)
    displacement = motion.z[last] @ rig.modes.output
    velocity = motion.v[last] @ rig.modes.output
    low, high = find_extremes(motion.time[last], displacement, velocity)
    frame = motion.z[last] @ rig.modes.slide - displacement
    return Motion(
        motion.time[last] - 7 * period,
        -displacement,
        frame,
        motion.force[last],
        float(high - low) / 2,
    )


def turns(one: Motion) -> np.ndarray:
    """Return the displacements (k,) [a0] of the reversals of the block, in order of time."""
    rising = np.diff(one.block) > 0
    return one.block[1:-1][rising[1:] != rising[:-1]]


def swings(one: Motion) -> np.ndarray:
    """Return the sizes (k,) [a0] of the oscillations about 0.1 a0 while the block slides under full forward friction."""
    rising = np.diff(one.block) > 0
    at = 1 + np.flatnonzero(rising[1:] != rising[:-1])
    return np.abs(one.block[at[one.friction[at] > 0.0999]] - 0.1)


def carried_time_fraction(one: Motion) -> float:
    """Return the fraction of time in which friction carries the block along: relative speed below v0, |F| < F0 tanh 1."""
    return float(
        np.trapezoid(1.0 * (np.abs(one.friction) < 0.1 * np.tanh(1.0)), one.time) / one.time[-1]
    )


def _picture(exact: Motion, euler: dict, path: Path) -> Path:
    """Plot block, frame and friction over a cycle, and the largest displacement against Euler's step."""
    with drawing(path, (9.6, 6.4), 2, 2, height_ratios=(1.35, 1), width_ratios=(1.5, 1)) as (
        figure,
        axes,
    ):
        whole = figure.add_subplot(axes[0, 0].get_gridspec()[0, :])
        for axis in axes[0]:
            axis.remove()
        for one, colour, text in (
            (euler[0.1], ORANGE, "block, Euler, h = 0.1/ω0"),
            (euler[0.04], GREY, "block, Euler, h = 0.04/ω0"),
            (exact, BLUE, "block, exact"),
        ):
            whole.plot(one.time, one.block, color=colour, label=text)
        whole.plot(exact.time, 0.2 * exact.frame, color="black", lw=0.8, ls=":", label="frame / 5")
        whole.set(xlabel="ω0 t", ylabel="displacement [a0]", xlim=(0, 62.9), ylim=(-0.22, 0.22))
        figure.legend(*whole.get_legend_handles_labels(), loc="outside upper center", ncols=4)
        left, right = axes[1]
        left.plot(exact.time, 10 * exact.friction, color=BLUE)
        left.set(xlabel="ω0 t", ylabel="friction on the block [F0]", xlim=(0, 62.9))
        right.plot(STEPS, [euler[h].peak for h in STEPS], "o-", ms=4, color=ORANGE)
        right.axhline(exact.peak, color=BLUE)
        right.text(0.2, exact.peak - 0.001, "exact", color=BLUE, ha="right", va="top")
        right.text(0.135, 0.172, "Euler", color=ORANGE, ha="right")
        right.set(
            xlabel="step h [1/ω0]",
            ylabel="half peak to peak [a0]",
            xlim=(0, 0.21),
            ylim=(0.13, 0.195),
        )
    return path


def main(steps=STEPS, path: Path | None = FOLDER / "figure_5.svg") -> tuple:
    """Print and draw the exact motion and those by Euler's method, and return both."""
    exact = motion()
    euler = {h: motion(h) for h in steps}
    for name, one in [("exact", exact), *[(f"Euler, h = {h:g}", one) for h, one in euler.items()]]:
        swung = swings(one)
        print(
            f"{name:14} largest {one.peak:.4f} a0, turns a cycle {turns(one).size:3}, swing over the one before "
            f"{swung[2] / swung[1]:.3f}, carried along {carried_time_fraction(one):.3f}"
        )
    if path is not None:
        _picture(exact, euler, path)
    print(ANSWER)
    return exact, euler


if __name__ == "__main__":
    run_study(main)
