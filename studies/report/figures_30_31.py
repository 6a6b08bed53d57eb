"""The report reads from Figures 30 and 31 that the waves of 80 um are isotropic before the tests, that they are much
lower after the tests, and that after the tests the waves along x are the lowest. Do the figures show this?

Partly. The study cuts sets of four traces from a synthetic surface, on which wear multiplies the height of the waves by
0.55 along x and 0.67 along y. In 14 of 20 such sets the ratio of the waves shows that those along x became lower; in 8
sets it shows the same for the waves along y. In 2 sets the waves along x are found to be lower than those along y. A
single trace in each direction is too short to decide whether the report is right.

The surface is made, so that its larger swings are the report's 13 to 18 um, and worn as in studies/wear/bands.py: 6 um
off each piece at a stroke of 6.4 um, both assumed. Its traces are 1 mm long, as those of the print, before and after at
different lines, as a stylus set down twice would run. Twice the amplitude that `profile` reads for the waves of 60 to
110 um is 6 to 18 um before and 3 to 12 um after. At a stroke of 12.8 um, where waves wear to 0.42 and 0.62, the counts
are 18, 11 and 5. Before the tests 1 set is called lower along x. The intervals, 95 %, hold the ratios of the whole
areas in 37 and 37 of 40 cases. No set gives a worn depth: with 6 um off, valleys are worn too, and the traces have no
common place to count from. For this reason `compare` states no ratio of the waves of these traces either.

The curves of the print could not be read, the heads above them can: the vertical distance of two cursors is 305.626 and
-215.831 A before, 178.602 and 148.619 A after. With the point read as the comma of thousands these are 30.6, 21.6, 17.9
and 14.9 um, and after over before is 0.58 and 0.69, if each figure gives x first, as its words do. Where the cursors
stood is not known. From highest to lowest point (Pt) the made traces have 19 to 39 um before and 12 to 24 um after, and
Pt after over before is 0.36 to 0.94 along x and 0.47 to 0.90 along y: both ratios of the print lie inside, and so would
most others. At 12.8 um they are 0.34 to 0.83 and 0.43 to 0.81. The wear to 0.55 and 0.67 is therefore not contradicted,
and not proved either.

The drawn set as files: python studies/report/figures_30_31.py FOLDER; `patchfem profile` reads them, and so does
`patchfem compare before_x.csv after_x.csv`.

Run: python studies/report/figures_30_31.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "wear"))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import bands
from drawing import drawing
from study_run import run_study
from study_text import read_answer

from patchfem.core import frozen_array
from patchfem.surface import Profile, level, make_report
from patchfem.surface.compare.compare import Options, compare_surfaces
from patchfem.surface.compare.waves import compare_waves
from patchfem.surface.spectrum import wave_spectrum

FOLDER = Path(__file__).parent
ANSWER = read_answer(__doc__)
VERDICT = (
    "in part: synthetic surfaces were compared with the four heights that are printed above the curves. The "
    "curves themselves could not be read, and four traces cannot prove everything that the report says"
)
# heights printed above Figs 30 and 31 [m], first and second scan
PRINTED_HEIGHTS = (
    (30.5626e-6, 21.5831e-6),
    (17.8602e-6, 14.8619e-6),
)
STROKES = (2, 4)  # strokes in steps of 3.2 um
SETS = 20  # number of sets of four traces
LINES_BETWEEN = 160  # number of lines between the traces before and after
UM = 1e-6  # [m] one micrometre
BITE = 0.03e-6  # [m] depth worn off in one pass
BLUE = "#1f5f99"
ORANGE = "#c8551b"
GREY = "#8a8a8a"


class Set(NamedTuple):
    """Four traces, before and after wear along x and y.

    Contains their Comparison along x and y, and as Quantity the amplitude ratios after over before along x and y, and x
    over y before and after.
    """

    traces: tuple
    parts: list
    along: tuple
    across: tuple


def rub_surface(stroke: int) -> tuple:
    """Return the heights [m] of the lower surface before and after rubbing, and the row of its whole areas."""
    rows, (new, after) = bands.wear((stroke,), 1, BITE)
    return new, after[stroke], rows[-1]


def trace(heights, name: str) -> Profile:
    """Return the heights along one line as a trace."""
    return Profile(frozen_array(bands.STEP * np.arange(heights.size)), frozen_array(heights), name)


def cut(before, after, line: int) -> Set:
    """Return the set at a line of the raster; the traces after are APART lines from those before."""
    other = (line + LINES_BETWEEN) % bands.POINTS
    pairs = (
        (trace(before[line], "before, x"), trace(after[other], "after, x")),
        (trace(before[:, line], "before, y"), trace(after[:, other], "after, y")),
    )
    parts = [compare_surfaces(*pair, Options(direction=way)) for pair, way in zip(pairs, "xy")]
    along = tuple(divide_waves(*pair) for pair in pairs)
    across = tuple(divide_waves(along_y, along_x) for along_x, along_y in zip(*pairs))
    return Set(pairs, parts, along, across)


def divide_waves(first: Profile, second: Profile):
    """Return the amplitude of the waves of a trace over that of the first one, as Quantity."""
    lines = [level(each).z[None] for each in (first, second)]
    return compare_waves(lines, bands.STEP, 0.0)["amplitude_ratio"]


def is_reduced(ratio) -> bool:
    """Return whether the interval of a ratio lies below one."""
    return ratio.high is not None and ratio.high < 1


def counts(sets: list) -> tuple:
    """Count the sets whose waves are reduced along x, reduced along y, and lower along x than along y after and before."""
    ratios = [(*one.along, one.across[1], one.across[0]) for one in sets]
    return tuple(sum(is_reduced(each[k]) for each in ratios) for k in range(4))


def count_held(sets: list, row) -> int:
    """Count the comparisons of the sets whose interval contains the ratio of the whole areas."""
    ratios = [(one.along[way], row.after[way]) for one in sets for way in (0, 1)]
    return sum(ratio.low < truth < ratio.high for ratio, truth in ratios)


def amplitude(trace: Profile) -> float:
    """Return the amplitude [m] of the waves in the band."""
    return wave_spectrum(trace, is_tapered=True).measure_band()


def heights(sets: list, when: int) -> np.ndarray:
    """Return the wave heights (2 sets,) [m] of all traces before (0) or after (1): twice the amplitude in the band."""
    return np.array([2 * amplitude(pair[when]) for one in sets for pair in one.traces])


def totals(sets: list, way: int) -> np.ndarray:
    """Return the total heights Pt (2, sets) [m] of the traces along x (0) or y (1), before and after."""
    return np.array([[np.ptp(level(one.traces[way][when]).z) for one in sets] for when in (0, 1)])


def middle(sets: list) -> Set:
    """Return the set through the middle of the surface, which is drawn and written."""
    return sets[len(sets) // 2]


def spread(values, digits: int) -> str:
    """Format the smallest and the largest value."""
    return f"{min(values):.{digits}f} to {max(values):.{digits}f}"


def picture(sets: list, path: Path) -> Path:
    """Plot the four traces of a set as in Figs 30 and 31, and the wave heights of all sets after and before."""
    with drawing(path, (9.6, 8.2), 3, 2) as (_, axes):
        for when, number, colour in ((0, 30, GREY), (1, 31, BLUE)):
            for way, axis in zip((0, 1), axes[when]):
                one = middle(sets).traces[way][when]
                found = make_report(one)["band_amplitude"]
                axis.plot(1e3 * one.x, (one.z - one.z.mean()) / UM, color=colour, lw=1)
                axis.set(
                    xlabel="along the trace [mm]",
                    ylabel="height [um]",
                    xlim=(0, 1.02),
                    ylim=(-24, 24),
                    title=f"Fig. {number}, {('before', 'after')[when]}, along {'xy'[way]}: waves "
                    f"{2 * found.value / UM:.1f} um",
                )
                axis.title.set_fontsize(10)
        at = np.arange(1, len(sets) + 1)
        along = [[one.along[way] for one in sets] for way in (0, 1)]
        across = [[one.across[when] for one in sets] for when in (0, 1)]
        for axis, pair, colours, names in (
            (axes[2, 0], along, (BLUE, ORANGE), ("along x", "along y")),
            (axes[2, 1], across, (GREY, BLUE), ("before", "after")),
        ):
            for several, colour, name, aside in zip(pair, colours, names, (-0.17, 0.17)):
                values = np.array([[one.low, one.value, one.high] for one in several]).T
                axis.vlines(at + aside, values[0], values[2], color=colour, lw=1.2)
                axis.plot(
                    at + aside, values[1], "o", ms=3, color=colour, label=f"{name}, 95 % of one set"
                )
            axis.axhline(1, color="black", lw=0.8)
            axis.set(
                xlabel="set of four traces", ylim=(0.15, 4.5), yscale="log", xlim=(0, len(sets) + 1)
            )
            axis.set_xticks(range(0, len(sets) + 1, 5))
            axis.set_yticks((0.25, 0.5, 1, 2))
            axis.set_yticklabels(("0.25", "0.5", "1", "2"))
            axis.minorticks_off()
            axis.legend(loc="upper center", ncols=2, fontsize=8)
        axes[2, 0].set_ylabel("waves, after over before")
        axes[2, 1].set_ylabel("waves, x over y")
    return path


def main(
    strokes=STROKES, count: int = SETS, path: Path | None = FOLDER / "figures_30_31.svg"
) -> dict:
    """Print, draw and return {stroke: ([Set], Row of the whole areas)}."""
    lines = [k * bands.POINTS // count for k in range(count)]
    found = {}
    for stroke in strokes:
        before, after, row = rub_surface(stroke)
        sets = found.setdefault(stroke, ([cut(before, after, line) for line in lines], row))[0]
        x, y, less, earlier = counts(sets)
        low, high = (
            (heights(sets, when).min() / UM, heights(sets, when).max() / UM) for when in (0, 1)
        )
        print(
            f"stroke {row.stroke / UM:.1f} um: waves of the areas {row.after[0]:.2f} along x and {row.after[1]:.2f} "
            f"along y; wave heights of traces {low[0]:.1f} to {low[1]:.1f} um before, {high[0]:.1f} to {high[1]:.1f} "
            f"um after; of {count} sets reduced along x {x}, along y {y}, lower along x than along y after {less}, "
            f"before {earlier}; the interval holds the ratio of the areas in {count_held(sets, row)} of {2 * count}; "
            f"with a worn depth {sum(part.verdict.code == 'worn' for one in sets for part in one.parts)}"
        )
        for way, (first, last) in zip((0, 1), zip(*PRINTED_HEIGHTS)):
            high = totals(sets, way)
            print(
                f"  along {'xy'[way]}: Pt {spread(high[0] / UM, 1)} um before, {spread(high[1] / UM, 1)} um after, "
                f"ratio {spread(high[1] / high[0], 2)}; print {first / UM:.1f} and {last / UM:.1f} um, "
                f"{last / first:.2f}"
            )
    sets = found[strokes[0]][0]
    parts = middle(sets).parts
    print("the drawn set: " + ", ".join(part.verdict.code for part in parts))
    if path is not None:
        picture(sets, path)
    print(ANSWER)
    return found


if __name__ == "__main__":
    run_study(main)
