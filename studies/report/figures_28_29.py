"""Does a rig whose surfaces ride up the flanks of grooves move as in Figures 28 and 29: distorted at 5 g, and stable or
unstable at 8 g?

Partly. At 143 Hz and 7.9 g the amplitude of the block stays at 0.83 mil; at 8.0 g the block runs away after 9 cycles.
With 2 % more friction the amplitude stays at 0.82 mil at 8 g. The real rig was unstable at 8 g in one series and stable
in a later series. Computed peaks of acceleration and displacement (readings in brackets): 6.9 g and 0.39 mil (8.4 g and
0.44 mil) at 135 Hz and 5 g; 8.4 g and 0.49 mil (9.5 g and 0.30 mil) at 135 Hz and 6 g; 7.2 g and 0.29 mil (6.0 g and
0.23 mil) at 143 Hz and 5 g.

The scene is grooved.toml: 80 um grooves, 13 um from peak to valley, that lift the block; two numbers were fitted at 143
Hz, none to a runaway. The onset read at 143 Hz was 3.9 g in one series and 4.0 g in the other, 2.6 % apart, so the two
records of 8 g need nothing but that. To raise the level by 0.1 g every 50 cycles hardly matters: at 143 Hz the block
leaves at 8.0 g either way, at 135 Hz at 8.2 g instead of 8.1 g from rest; there the rig was unstable from 6 g on, for
which friction would have to act far off the axis (runaways.py). A knock matters: let go 30 um off its valley it leaves
at 7.5 g, from 40 um at 7.0 g. A rigid block runs away from 5.30 g on; beside the second path of studies/table_1 it has
a steady motion of 0.61 mil at 8 g. The third harmonic of the acceleration is 0.23 of the first at 5 g and 0.35 at 8 g.
The text says 135 Hz at 6 g of Fig. 28, its caption 5 g, so both are drawn. Of the prints only captions could be read.

Run: python studies/report/figures_28_29.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from study_run import run_study
from study_text import read_answer

import patchfem as pf
from patchfem.core import Response

FOLDER = Path(__file__).parent
ANSWER = read_answer(__doc__)
VERDICT = (
    "in part: both records of 8 g at 143 Hz are reproduced, with friction coefficients that differ by 2 %. "
    "The unstable motion at 135 Hz from 6 g on is not reproduced"
)
G = 9.80665  # [m/s^2] standard gravity
MIL = 25.4e-6  # [m] one thousandth of an inch
MORE_FRICTION = {"friction.static": "0.408"}  # 2 % more friction
CASES = (
    ("Fig. 28: 135 Hz, 5 g", 135, 5.0, {}),
    ("Fig. 28 (text): 135 Hz, 6 g", 135, 6.0, {}),
    ("Fig. 29: 143 Hz, 5 g", 143, 5.0, {}),
    ("143 Hz, 8 g, 2 % more friction", 143, 8.0, MORE_FRICTION),
    ("143 Hz, 8 g", 143, 8.0, {}),
)


class Run(NamedTuple):
    """Run from rest.

    Contains title, whether it stayed within 2 mil, number of cycles, peaks of the last cycles [g],
    [mil], third over first harmonic of the acceleration, frequency [Hz], and its Response.
    """

    title: str
    stays: bool
    cycles: float
    acceleration: float
    displacement: float
    distortion: float
    frequency: float
    seen: Response


def run_block(title: str, frequency: float, level: float, sets: dict) -> Run:
    """Run grooved.toml at a frequency [Hz] and a level [g] for 200 cycles, or until the motion diverges.

    Gone is a block beyond 2 mil, or thrown out of its grooves on the way there.
    """
    found = pf.run(
        FOLDER / "grooved.toml",
        **sets,
        **{"drive.frequency": frequency, "drive.acceleration": level * G},
    )
    value = {name: one.value for name, one in found.measures.items()}
    seen = found.window if found.outcome in ("steady", "transient") else found.response
    return Run(
        title,
        seen is found.window,
        found.response.time[-1] * frequency,
        value["absolute_acceleration_peak"] / G,
        value["relative_displacement_amplitude"] / MIL,
        value["acceleration_distortion"],
        frequency,
        seen,
    )


def let_go(place: float, level: float) -> bool:
    """Return whether the block stays in its valley at 143 Hz and a level [g].

    It is released at rest at a distance `place` [um] from the valley.
    """
    text = (FOLDER / "grooved.toml").read_text("utf-8")
    start = f'[structure.start]\ndisplacement = ["{place} um", "0 m"]\nvelocity = ["0 m/s", "0 m/s"]\n\n[drive]'
    found = pf.run(text.replace("[drive]", start), **{"drive.acceleration": level * G})
    return found.outcome in ("steady", "transient")


def last_level(frequency: float, levels) -> float:
    """Return the level [g] at which the block leaves its valley if the level is raised through `levels` every 50 cycles."""
    text = (FOLDER / "grooved.toml").read_text("utf-8")
    listed = ", ".join(f'"{level:g} g"' for level in levels)
    text = text.replace("cycles = 200", "cycles = 50").replace(
        'acceleration = "8 g"', f"levels = [{listed}]"
    )
    text = text.replace('kind = "base"', 'kind = "base"\nwaveform = "levels"')
    found = pf.run(text, **{"drive.frequency": frequency})
    return float(levels[int(found.response.time[-1] * frequency // 50)])


def picture(runs: list, path: Path) -> Path:
    """Plot input, absolute acceleration and displacement of every run, one above the other as the recorder drew them."""
    with drawing(path, (10.4, 6.2), 3, len(runs), sharey="row", sharex="col") as (_, axes):
        for column, run in enumerate(runs):
            r = run.seen
            time = (r.time - r.time[-1]) * run.frequency + (3 if run.stays else run.cycles)
            colour = BLUE if run.stays else ORANGE
            for axis, value in zip(
                axes[:, column], (r.base_acceleration / G, r.acceleration / G, r.output / MIL)
            ):
                axis.plot(time, value, color=colour, lw=1)
            axes[0, column].set_title(
                run.title.replace(": ", "\n").replace(", 2 %", "\n2 %"), fontsize=9
            )
            axes[0, column].set_xlim((0, 3) if run.stays else (0, run.cycles))
            axes[2, column].set_xlabel("cycles" if run.stays else "cycles from rest")
            axes[2, column].axhline(0, color=GREY, lw=0.5)
        for axis, text, top in zip(
            axes[:, 0],
            ("input [g]", "acceleration of\nthe block [g]", "displacement of\nthe block [mil]"),
            (9, 16, 2.1),
        ):
            axis.set(ylabel=text, ylim=(-top, top))
        axes[0, -1].set_xticks(range(0, 9, 4))
        axes[1, -1].text(0.04, 0.05, "runs away", color=ORANGE, transform=axes[1, -1].transAxes)
    return path


def main(path: Path | None = FOLDER / "figures_28_29.svg", cases=CASES) -> list:
    """Print, draw and return the runs."""
    runs = [run_block(*case) for case in cases]
    for run in runs:
        print(
            f"{run.title:32} {'stays' if run.stays else 'leaves':6} {run.cycles:5.1f} cycles, "
            f"{run.acceleration:.1f} g, {run.displacement:.2f} mil, third over first harmonic {run.distortion:.2f}"
        )
    if path is not None:
        picture(runs, path)
    print(ANSWER)
    return runs


if __name__ == "__main__":
    run_study(main)
