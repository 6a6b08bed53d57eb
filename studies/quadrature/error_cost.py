"""What does accuracy of the sum over bonds (eq. 2.17) cost?

Little, and less than the steps of the path do. Cutting off old bonds loses less than the tail asked for (0.7 of it at
A = 0.1, 0.1 of it at A = 50 and 1e-2). Merging to a width w loses less than 0.75 w^2 of the friction limit at every
amplitude (w = 0.02: 2e-4 at A = 0.1, 1e-5 at A = 3, 4e-6 at A = 50) with at most 8/w + 300 strips however long the run;
keeping every bond takes 10,000 strips and six times the time at A = 0.1 and 50, two to four times between, in two to
five cycles and ever more after. Where strokes are long (A = 50) cutting off alone is as fast. The steps of the path
matter more: 400 a cycle still miss the force at reversals of growing bonds by about 1e-2 (A <= 10), a thousand times
what w = 0.02 costs at A = 3.

Path: q = A sin t, printed law of order 1, growing bonds (a_s = 0.3 A omega^2, l_k = 0.05, eps_k = 0.5, all in bond
lengths), 200 steps a cycle, as long as bonds live. Error: largest of the run against every bond kept, over mu_s N.
`error_cost.svg` is drawn from the same rows.

Run: python studies/quadrature/error_cost.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import drawing
from list_runs import along, bonds, slide

from patchfem.export.drawing.pictures import BLUE, GREY, ORANGE

HERE = Path(__file__).parent
AMPLITUDES = (0.1, 1.0, 3.0, 10.0, 50.0)
TAILS = (1e-2, 1e-3, 1e-4, 1e-6)
WIDTHS = (0.2, 0.1, 0.05, 0.02, 0.01)
STEPS = (50, 100, 200, 400)
FINEST = 1600


class Row(NamedTuple):
    """One run: amplitude [eps_0], engine, knob and its value, error [mu_s N], microseconds per step, longest list."""

    amplitude: float
    engine: str
    knob: str
    value: float
    error: float
    micro: float
    strips: int


def main(amplitudes=AMPLITUDES, repeats=2) -> list:
    """Rows of every amplitude: direct, truncated, merged, and direct on coarser steps."""
    rows = []
    along(bonds(1.0), slide(1.0, 50)[0], 0.1, 1e-3, 0.1)  # load the compiled loop
    for amplitude in amplitudes:
        law, (path, dt) = bonds(amplitude), slide(amplitude, 200)
        truth, micro, strips = along(law, path, dt, 0.0, 0.0)
        rows.append(Row(amplitude, "direct", "none", 0.0, 0.0, micro, strips))
        for tail in TAILS:
            force, micro, strips = along(law, path, dt, tail, 0.0, repeats)
            rows.append(
                Row(
                    amplitude,
                    "truncated",
                    "tail",
                    tail,
                    float(np.abs(force - truth).max()),
                    micro,
                    strips,
                )
            )
        for width in WIDTHS:
            force, micro, strips = along(law, path, dt, 1e-6, width, repeats)
            rows.append(
                Row(
                    amplitude,
                    "merged",
                    "width",
                    width,
                    float(np.abs(force - truth).max()),
                    micro,
                    strips,
                )
            )
        fine = along(law, *slide(amplitude, FINEST), 1e-6, 0.01)[0][:: FINEST // 50]
        for steps in STEPS:
            force, micro, strips = along(law, *slide(amplitude, steps), 1e-6, 0.01)
            error = float(np.abs(force[:: steps // 50] - fine).max())
            rows.append(Row(amplitude, "steps", "steps", steps, error, micro, strips))
    return rows


def table(rows) -> str:
    """The rows as text."""
    lines = [
        f"{'A/eps_0':>8} {'engine':>10} {'knob':>7} {'value':>8} {'error':>9} {'us/step':>9} {'strips':>7}"
    ]
    lines += [
        f"{r.amplitude:8g} {r.engine:>10} {r.knob:>7} {r.value:8g} {r.error:9.1e} {r.micro:9.2f} {r.strips:7d}"
        for r in rows
    ]
    return "\n".join(lines)


def draw(rows, path: Path = HERE / "error_cost.svg") -> Path:
    """Error against time per step, one panel per amplitude."""
    amplitudes = sorted({r.amplitude for r in rows})
    wide = min(len(amplitudes) + 1, 3)  # the last place is that of the legend
    tall = -(-(len(amplitudes) + 1) // wide)
    with drawing(path, (9.6, 2.9 * tall), tall, wide, sharex=True, sharey=True, squeeze=False) as (
        _,
        axes,
    ):
        axes = axes.ravel()
        for ax, amplitude in zip(axes, amplitudes):
            for engine, color, mark in (
                ("truncated", ORANGE, "o"),
                ("merged", BLUE, "s"),
                ("steps", GREY, "^"),
            ):
                part = [r for r in rows if r.amplitude == amplitude and r.engine == engine]
                ax.loglog(
                    [r.micro for r in part],
                    [max(r.error, 1e-12) for r in part],
                    mark + "-",
                    color=color,
                    ms=4,
                    lw=1.0,
                    label=engine,
                )
            whole = next(r for r in rows if r.amplitude == amplitude and r.engine == "direct")
            ax.axvline(whole.micro, color=GREY, lw=1.0, ls=":", label="every bond kept")
            ax.set(title=f"A = {amplitude:g} ε₀")
            ax.set_xlabel("µs per step")
            ax.xaxis.set_tick_params(labelbottom=True)
        for ax in axes[: len(amplitudes) : wide]:
            ax.set_ylabel("error [share of μₛ N]")
        for ax in axes[len(amplitudes) :]:
            ax.axis("off")
        axes[-1].legend(*axes[0].get_legend_handles_labels(), frameon=False, loc="center")
    return path


if __name__ == "__main__":
    found = main()
    print(table(found))
    draw(found)
