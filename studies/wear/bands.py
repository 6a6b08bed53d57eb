"""Does wear under the rig's stroke make the 80 um asperities smaller, and smaller in the direction of sliding?

The report, 4.D, on its Figs 30 and 31: before the tests "an important component of 80 micron scale with an amplitude of
13 to 18 microns, apparently isotropic"; after them "still visible but of much smaller amplitude, and with a smaller
amplitude in the x direction (the direction of sliding)". One trace of 1 mm in x and one in y, before and after.

Yes, if 6 um wear off each piece, which is assumed (nobody measured it). Waves of 60 to 110 um keep 0.55 of their
amplitude along x and 0.67 along y at a stroke of 6.4 um, 0.42 and 0.62 at 12.8 um; x over y is 0.83 and 0.67 (0.92 and
0.86 after 3 um; standard deviation 0.03 from surface to surface). It is lowest, 0.53, near a stroke of a third of a
wave; long strokes leave plateaus and no direction. Table 1 has strokes of 2 to 14 um.

One trace each way cannot prove it. From 5 to 95 % it shows x over y of 0.51 to 1.30 at 6.4 um and 0.38 to 1.09 at
12.8 um, and 0.64 to 1.55 on new, isotropic surfaces: it falls below these in 18 % and 45 % of cases. "Apparently
isotropic" before is as weak. That the amplitude fell along x is shown (0.34 to 0.88 of the one before at 6.4 um), along
y nearly (0.43 to 1.04). Rigid pieces, no debris, no fracture: plausible, not a fit.

Run: python studies/wear/bands.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from rubbing import periodic_amplitude, rub
from study_run import run_study
from synthetic import report_area

FOLDER = Path(__file__).parent
STEP = 3.2e-6  # [m] spacing of the surface
POINTS = 320  # points of the surface in each direction
UM = 1e-6  # [m] one micrometre
# strokes in steps of 3.2 um; Table 1 has relative displacements of 2 to 14 um (0.08 to 0.55 mil)
STROKES = (
    0,
    1,
    2,
    4,
    8,
    16,
    32,
)
# [m] assumed mean wear of each piece; 6 um, the rms height, halves the amplitude
DEPTHS = (3 * UM, 6 * UM)
INTERVAL = (0.05, 0.95)


class Row(NamedTuple):
    """Result for a stroke and a depth worn off each piece [m].

    `ratio` is the band amplitude x over y, as a mean of whole areas with the standard deviation
    `scatter`; `interval` (2,) is that of a single trace per direction; `seen` is how often such a
    ratio lies below the interval of new surfaces; `after` is the amplitude relative to that before
    in x and y, `after_interval` that of single traces.
    """

    stroke: float
    worn: float
    ratio: float
    scatter: float
    interval: np.ndarray
    seen: float
    after: tuple
    after_interval: tuple


def amplitudes(areas) -> np.ndarray:
    """Return the band amplitude (2, k, traces) [m] of every eighth trace along x and along y of k areas."""
    return np.array([[periodic_amplitude(z, STEP, axis)[::8] for z in areas] for axis in (1, 0)])


def area_amplitudes(traces) -> np.ndarray:
    """Return the band amplitude of each area, from those of its traces."""
    return np.sqrt((traces**2).mean(axis=-1))


def pairs(one, other) -> np.ndarray:
    """Return the ratio of every trace of an area to every trace of the same area in the other direction."""
    return (one[:, :, None] / other[:, None, :]).ravel()


def row(stroke: int, worn: float, before, after) -> Row:
    """Return the row of the amplitudes of all areas (2, k, traces) [m] before and after."""
    ratios = area_amplitudes(after[0]) / area_amplitudes(after[1])
    single = pairs(*after)
    along_x, along_y = map(area_amplitudes, after)
    fallen = (
        (along_x / area_amplitudes(before[0])).mean(),
        (along_y / area_amplitudes(before[1])).mean(),
    )
    return Row(
        stroke * STEP,
        worn,
        ratios.mean(),
        ratios.std(ddof=1),
        np.quantile(single, INTERVAL),
        (single < np.quantile(pairs(*before), INTERVAL[0])).mean(),
        fallen,
        tuple(
            np.quantile(pairs(after[axis], np.roll(before[axis], 1, 0)), INTERVAL)
            for axis in (0, 1)
        ),
    )


def wear(strokes, seeds: int, bite: float) -> tuple:
    """Return rows for the new surfaces and for every stroke and depth.

    Also return the first lower surface (before, {stroke: after}).
    """
    new = [
        [report_area((POINTS, POINTS), STEP, 2 * seed + piece)[2] for piece in (0, 1)]
        for seed in range(seeds)
    ]
    before = amplitudes([z for pair in new for z in pair])
    shown = {}
    rows = [row(0, 0.0, before, before)]
    for stroke in strokes:
        worn = new
        done = 0.0
        for depth in DEPTHS:
            out = [rub(*pair, STEP, stroke * STEP, 2 * (depth - done), bite=bite) for pair in worn]
            worn = [(one.lower, one.upper) for one in out]
            done = depth
            rows.append(row(stroke, depth, before, amplitudes([z for pair in worn for z in pair])))
        shown[stroke] = worn[0][0]
    return rows, (new[0][0], shown)


def _picture(rows: list, shown: tuple, path: Path) -> Path:
    """Plot traces of one surface, new and worn at 6.4 um, and the band ratio against the stroke."""
    new = shown[0]
    worn = shown[1][2]
    with drawing(path, (9.6, 3.8), 1, 2, width_ratios=(1.25, 1)) as (_, (left, right)):
        x = 1e3 * STEP * np.arange(POINTS)
        for z, up, colour, text in (
            (new[160], 126, GREY, "new, along x"),
            (new[:, 160], 84, GREY, "new, along y"),
            (worn[160], 42, BLUE, "6 um worn off, stroke 6.4 um: along x (sliding)"),
            (worn[:, 160], 0, ORANGE, "6 um worn off, stroke 6.4 um: along y"),
        ):
            left.plot(x, z / UM - z.mean() / UM + up, color=colour)
            left.text(0, up + 16, text, color=colour, fontsize=9)
        left.set(xlabel="along the trace [mm]", ylabel="height, shifted [um]", ylim=(-18, 152))
        single = rows[0].interval
        right.axhspan(*single, color="#e8e8e8", zorder=0)
        right.text(
            125, single[1] + 0.01, "grey: one trace each way, new surfaces", fontsize=8, ha="right"
        )
        for depth, colour, aside in zip(DEPTHS, (ORANGE, BLUE), (0.97, 1.03)):
            part = [r for r in rows if r.worn == depth and r.stroke]
            at = np.array([r.stroke for r in part]) / UM
            right.semilogx(
                at,
                [r.ratio for r in part],
                "o-",
                ms=4,
                color=colour,
                label=f"{depth / UM:.0f} um worn off each: whole area",
            )
            right.vlines(
                at * aside,
                *np.transpose([r.interval for r in part]),
                color=colour,
                lw=1.2,
                alpha=0.7,
            )
        right.plot([], [], color=GREY, lw=1.2, label="bars: one trace each way, 5-95 %")
        right.axvspan(2, 14, ymax=0.03, color=GREY)
        right.text(5.3, 0.27, "strokes of Table 1", fontsize=8, ha="center")
        right.set(
            xlabel="stroke: amplitude of the slide [um]",
            ylabel="band amplitude 60-110 um, x over y",
            ylim=(0.2, 1.95),
            xlim=(1.9, 130),
            xticks=(2, 5, 10, 20, 50, 100),
            yticks=np.arange(0.25, 1.8, 0.25),
        )
        right.set_xticklabels((2, 5, 10, 20, 50, 100))
        right.minorticks_off()
        right.legend(loc="upper left", fontsize=8)
    return path


def main(
    strokes=STROKES,
    seeds: int = 6,
    bite: float = 0.01 * UM,
    path: Path | None = FOLDER / "bands.svg",
) -> list:
    """Print, draw and return the rows; the first is that of new surfaces."""
    rows, shown = wear(strokes, seeds, bite)
    for r in rows:
        low, high = r.interval
        falls = ", ".join(
            f"{name} {a:.2f} ({b[0]:.2f}-{b[1]:.2f})"
            for name, a, b in zip("xy", r.after, r.after_interval)
        )
        print(
            f"stroke {r.stroke / UM:5.1f} um, worn {r.worn / UM:.0f} um: x/y {r.ratio:.3f} +- {r.scatter:.3f}, one "
            f"trace each way {low:.2f}-{high:.2f}, below new ones {100 * r.seen:.0f} %; after/before {falls}"
        )
    if path is not None:
        _picture(rows, shown, path)
    return rows


if __name__ == "__main__":
    run_study(main)
