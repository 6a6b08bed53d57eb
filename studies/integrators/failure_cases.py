"""Ways to integrate Fig 16 by Duhamel's integral, and a block at resonance by Newmark: each run judged in numbers."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from problems import SDOF, SDOF_DRIVE, SDOF_LIMIT, TWO, TWO_LIMIT, exact
from report_methods import Law, coulomb, elastic_plastic, solve_duhamel, solve_newmark

from patchfem.core import DriveSegment
from patchfem.structure.drives import PiecewiseDrive

SLIDES = 8.079711463905416  # exact time at which mass 2 first moves
END = 40.0  # end of a run in the unit of time of the report
MOVED_DISTANCE = 0.05  # displacement above which the mass counts as moved


COULOMB_LAW = coulomb(TWO_LIMIT)
BRANCH = coulomb(TWO_LIMIT, 0.01)
ELASTIC = elastic_plastic(TWO_LIMIT, 0.01)
PRINTED_LAW = elastic_plastic(TWO_LIMIT, 0.03, as_printed=True)
CASES = (  # (name, law, step, quantity of the criterion, its tolerance, relaxation)
    ("Fig 17, 18: displacement 1e-2", COULOMB_LAW, 0.05, "displacement", 1e-2, 0.1),
    ("displacement 1e-3", COULOMB_LAW, 0.05, "displacement", 1e-3, 0.5),
    ("displacement 1e-6", COULOMB_LAW, 0.05, "displacement", 1e-6, 0.1),
    ("Fig 19, 20: velocity 1e-4", COULOMB_LAW, 0.05, "velocity", 1e-4, 0.1),
    ("velocity 1e-6", COULOMB_LAW, 0.02, "velocity", 1e-6, 0.5),
    ("force 1e-3", COULOMB_LAW, 0.02, "force", 1e-3, 0.5),
    ("static branch, force 1e-6", BRANCH, 0.02, "force", 1e-6, 0.5),
    ("Fig 21, 22: elastic 0.01, velocity 1e-6", ELASTIC, 0.01, "velocity", 1e-6, 0.5),
    ("elastic 0.01, force 1e-6", ELASTIC, 0.01, "force", 1e-6, 0.5),
    ("3.12 as printed, eps 0.03", PRINTED_LAW, 0.01, "velocity", 1e-6, 0.5),
)
STEPS = (50, 100, 200, 500, 1000, 2000, 5000, 10000)
CYCLES = 200


@dataclass(frozen=True, eq=False, slots=True)
class Row:
    """Result of one way to integrate the problem of Fig. 16.

    `early` is the largest |x2| before the mass can move; `moves` is the time and the force at which
    |x2| exceeds 0.05; `jumps` is the fraction of steps in which the force changes by more than 1;
    `worst` and `mean` are the differences between the force of the law at the accepted state and
    the force that was used; `failed` is the fraction of steps without convergence; `error` is that
    of x2 at t = 20 (exact value -0.305217).
    """

    name: str
    early: float
    moves: float
    force: float
    jumps: float
    worst: float
    mean: float
    failed: float
    error: float
    run: object


def solve(name, law: Law, step, criterion, tolerance, relax) -> Row:
    """Integrate one case and return its row."""
    drive = PiecewiseDrive((DriveSegment(0.0, 0.0, 1.0, 1.14),), 1000 * step, False)
    found = solve_duhamel(
        TWO,
        drive,
        law,
        (END, 1000),
        criterion=criterion,
        tolerance=tolerance,
        relaxation=relax,
    )
    x = found.z @ TWO.slide
    force = found.force
    t = found.time
    first = int(np.argmax(np.abs(x) > MOVED_DISTANCE))
    early = np.abs(x[t < SLIDES]).max()
    miss = np.abs(found.residual[1:])
    return Row(
        name,
        float(early),
        float(t[first]),
        float(abs(force[first])),
        float(np.mean(np.abs(np.diff(force)) > 1)),
        float(miss.max()),
        float(miss.mean()),
        found.n_failed / (t.size - 1),
        float(np.interp(20, t, x) - exact("two", [20.0]).slide[0]),
        found,
    )


def peak_errors(speed: float, by_force: bool) -> list:
    """Return relative errors of the peak of the stick-slip block by Newmark's method with a stick speed.

    There is one error for each number of STEPS per cycle.
    """
    times = np.linspace(CYCLES - 1, CYCLES, 2001) * SDOF_DRIVE.period
    peak = np.abs(exact("sdof", times).slide).max()
    law = coulomb(SDOF_LIMIT, speed)
    runs = (
        solve_newmark(SDOF, SDOF_DRIVE, law, (CYCLES * SDOF_DRIVE.period, n), needs_force=by_force)
        for n in STEPS
    )
    return [float(np.abs(found.z[-n:]).max() / peak - 1) for n, found in zip(STEPS, runs)]
