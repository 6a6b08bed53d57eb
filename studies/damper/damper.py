"""Which law of friction describes a measured loop of a banded rotary damper, and what does none of them describe?

Every law that gives way before it slips describes the plateaus and the work of a cycle, and one length is enough: the
stretch reading with a bond length of 2.0 mm leaves 271 N on the plateaus (6 % of 4.2 kN) and gives 384.1 J of the
382.9 J measured; two or three numbers more (iwan, bouc-wen, lugre) gain at most 4 % in the rms of all
rows, and the rows do not determine them. Coulomb (330 J) and tanh, whose reference speed of 86 mm/s is half the
largest speed, do not describe it. No law describes the 25 mm after a reversal: there the force stays near zero while
the backlash closes, then rings up to 9.6 kN, twice the limit of any of them. That leaves 1.0 kN in all rows, eight
times what the cycles scatter, so that 538 rows count as some 60 in the intervals.

The record (1 Hz, strokes of 51 mm, +-4.2 kN on the plateaus, peaks of 9.6 kN; two cycles that repeat to 0.12 kN) comes
from the set of measurements named in `SOURCE`, which is not part of this project.

Run: python studies/damper/damper.py --record FILE.csv
"""

import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from steady_loops import HOLD, write_with_run_in
from study_run import Option, run_study

from patchfem.campaigns.fits.problem import FittedKeys
from patchfem.campaigns.fits.request import FitOptions, fit_measurement
from patchfem.campaigns.free_keys import parse_ranges
from patchfem.inputs import read_loop
from patchfem.inputs.loops import Loop
from patchfem.scene import loads

SOURCE = "ARTS-Laboratory, Dataset-Friction-Damper-with-Backlash, dataset-1, 1 Hz, 20 lb tension; CC BY-SA 4.0"
LOAD = 10e3  # [N] assumed; only the product of load and friction coefficient is known
SCENE = (
    '[normal]\nload = "10 kN"\n[friction]\n{}[slide]\nkind = "sine"\namplitude = "25.6 mm"\nfrequency = "1 Hz"\n'
    "cycles = 2\n"
)
STATIC = "friction.static=0.1..1.5"
BOND = "friction.bond_length=0.1 mm..30 mm"
STIFFNESS = "friction.stiffness=1e5 N/m..1e8 N/m"
LAWS = {
    "coulomb": ('law = "coulomb"\nstatic = 0.4\n', (STATIC,)),
    "tanh": (
        'law = "tanh"\nstatic = 0.4\nreference_speed = "10 mm/s"\n',
        (STATIC, "friction.reference_speed=0.1 mm/s..200 mm/s"),
    ),
    "elastic-plastic": (
        'law = "elastic-plastic"\nstatic = 0.4\nbond_length = "3 mm"\n',
        (STATIC, BOND),
    ),
    "stretch": ('law = "nonlocal"\nstatic = 0.4\nbond_length = "3 mm"\n', (STATIC, BOND)),
    "iwan": (
        'law = "iwan"\nstatic = 0.4\nstiffness = "2e6 N/m"\nchi = -0.5\nbeta = 1.0\n',
        (STATIC, STIFFNESS, "friction.chi=-0.95..0", "friction.beta=0.01..10"),
    ),
    "bouc-wen": (
        'law = "bouc-wen"\nstatic = 0.4\nstiffness = "2e6 N/m"\nexponent = 1.0\nshape = 0.5\n',
        (STATIC, STIFFNESS, "friction.exponent=1..10", "friction.shape=0.05..1"),
    ),
    "lugre": (
        'law = "lugre"\nstatic = 0.45\nkinetic = 0.4\nstiffness = "2e6 N/m"\nstribeck_speed = "20 mm/s"\n',
        (
            "friction.static=0.42..1.5",
            "friction.kinetic=0.2..0.42",
            STIFFNESS,
            "friction.stribeck_speed=1 mm/s..300 mm/s",
        ),
    ),
}


class Row(NamedTuple):
    """Law fitted to the record.

    Contains rms difference [N] over all rows and over the rows beyond half a stroke after a
    reversal, work per cycle [J] of law and record, the record without its offset, the fitted force (k,) [N], and the
    fitted keys.
    """

    law: str
    values: int
    rms: float
    plateau: float
    work: float
    measured: float
    loop: Loop
    model: np.ndarray
    fitted: FittedKeys


def plateau(slide) -> np.ndarray:
    """Return a mask (k,) of the rows that have slid half a stroke or more since the last reversal."""
    way = np.sign(np.diff(slide, prepend=slide[0]))
    out = np.zeros(slide.size, bool)
    turn = slide[0]
    stroke = np.ptp(slide)
    for k in range(1, slide.size):
        if way[k] * way[k - 1] < 0:
            turn = slide[k - 1]
        out[k] = abs(slide[k] - turn) >= stroke / 2
    return out


def repeat(loop) -> tuple:
    """Return the rows of a cycle, and the rms difference [N] of two successive cycles as their scatter."""
    half = loop.displacement.size // 2
    misses = [
        np.mean((loop.displacement[k:] - loop.displacement[:-k]) ** 2)
        for k in range(half // 2, half)
    ]
    period = half // 2 + int(np.argmin(misses))
    gap = loop.reading[period:] - loop.reading[:-period]
    return period, float(np.sqrt(np.mean(gap**2) / 2))


def main(file, names=tuple(LAWS)) -> list:
    """Return a Row for each law, fitted to a record in steady motion.

    The offset of the load cell is the mean difference from a first fit, which is subtracted for a second one.
    """
    loop = read_loop(file)
    period, _ = repeat(loop)
    flat = plateau(loop.displacement)
    cycle = slice(0, period + 1)
    rows = []

    def work(force):
        return float(np.trapezoid(force[cycle], loop.displacement[cycle]))

    for name in names:
        text, free = LAWS[name]
        offset = 0.0
        for _ in range(2):
            record = loop._replace(reading=loop.reading - offset)
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "loop.csv"
                count = write_with_run_in(path, loop.time, loop.displacement, record.reading)
                found = fit_measurement(
                    loads(SCENE.format(text)), path, parse_ranges(free), FitOptions(hold=(HOLD,))
                )
            model = found.computed[count:]
            miss = model - record.reading
            offset -= miss.mean()
        rows.append(
            Row(
                name,
                len(free),
                found.fit.rms,
                float(np.sqrt(np.mean(miss[flat] ** 2))),
                work(model),
                work(loop.reading),
                record,
                model,
                found,
            )
        )
    return rows


def draw(rows: list, path: Path) -> None:
    """Plot the record and the laws against the slide, and their differences against time."""
    from drawing import drawing

    loop = rows[0].loop
    with drawing(path, (9.6, 4.2), 1, 2) as (_, (left, right)):
        left.plot(
            loop.displacement * 1e3, loop.reading / 1e3, ".", ms=3, color="0.6", label="measured"
        )
        for row in rows:
            left.plot(loop.displacement * 1e3, row.model / 1e3, lw=1, label=row.law)
            right.plot(loop.time, (row.model - loop.reading) / 1e3, lw=0.8)
        left.set(xlabel="slide [mm]", ylabel="force [kN]", title="Measured and fitted")
        right.set(xlabel="time [s]", ylabel="fitted - measured [kN]", title="Residual")
        left.legend(frameon=False)


def print_all(record: str = "", path: Path = Path("damper.svg")) -> None:
    """Print the fits of every law to a record, and draw three of them."""
    if not Path(record).is_file():
        sys.exit(
            f"the record is not part of this project: get it as a CSV file ({SOURCE}) for --record"
        )
    table = main(record)
    print(f"cycles repeat to {repeat(table[0].loop)[1]:.0f} N")
    for row in table:
        fitted = row.fitted
        pairs = zip(fitted.keys.ranges, fitted.fit.values)
        values = [f"{one.key.partition('.')[2]} {value:.4g} {one.unit}" for one, value in pairs]
        print(
            f"{row.law:20s} rms {row.rms:6.0f} N, plateau {row.plateau:5.0f} N, work {row.work:5.1f} J of "
            f"{row.measured:5.1f} J, counted rows {fitted.fit.intervals.rows:.0f}, {fitted.seconds:.0f} s:",
            ", ".join(values),
        )
    draw([row for row in table if row.law in ("coulomb", "stretch", "iwan")], path)


if __name__ == "__main__":
    run_study(print_all, record=Option("", "CSV file of the record"))
