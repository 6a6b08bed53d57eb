"""The four problems of the work-precision study with their truths: free decay, a block, two masses, a patch."""

import sys
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import problems

from patchfem.core import InitialState, ModalBasis
from patchfem.event_driven.cases import EXACT_RTOL
from patchfem.event_driven.laws import masing
from patchfem.friction.laws.coulomb import Coulomb
from patchfem.model import build
from patchfem.runs import choose_numerics, solve_with_coarser
from patchfem.runs.interfaces.joints import list_joints
from patchfem.scene import scene
from patchfem.structure import make_release
from patchfem.time_steps import contacts, laws, time_march

FOLDER = Path(__file__).parent
POINTS = 20  # points per cycle at which relative displacements are compared
TRUTH = 204800  # steps per cycle of the reference solution of the patch, a time march
POINT = ("decay", "block", "two")  # problems with point contacts
ALL = ("decay", "block", "two", "patch")  # all problems


@dataclass(frozen=True, eq=False, slots=True)
class Problem:
    """Problem of the study.

    `limit` is the friction limit [N] of one Coulomb interface, `elements` are (stiffness [N/m],
    yield displacement [m]) of elastic-plastic elements. `numbers` describes the same problem for
    the rates of `switched`. `size` is the size of a state for absolute tolerances,
    `longest` the largest step in cycles that does not pass over an event. The error is taken over
    the `last` cycles, against the slide `truth` (k,) [m] at `times`.
    """

    name: str
    modes: ModalBasis
    drive: object
    limit: float
    cycles: int
    numbers: dict
    elements: tuple | None = None
    size: float = 1.0
    longest: float = 1 / 8
    last: int = 5
    start: InitialState | None = None
    truth: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def times(self) -> np.ndarray:
        """Return the sample times in the last cycles."""
        return (
            self.cycles - self.last + np.arange(1, self.last * POINTS + 1) / POINTS
        ) * self.drive.period

    def error(self, slide) -> float:
        """Return the largest error of the slide relative to its largest value."""
        return float(np.abs(slide - self.truth).max() / np.abs(self.truth).max())


@cache
def problem(name: str) -> Problem:
    """Return the problem of this name: "decay", "block", "two" or "patch"."""
    if name == "decay":
        rest = InitialState(np.array([11.5]), np.zeros(1))
        half = np.pi
        made = Problem(
            name,
            problems.UNDAMPED_MASS,
            make_release(2 * half),
            1.0,
            16,
            {"limit": 1.0, "xi": 0.0, "size": 0.0, "place": 11.5},
            last=16,
            start=rest,
        )
        done = np.minimum(np.floor(made.times / half), 6)  # equation 3.11 with N0 rounded up
        return replace(
            made,
            truth=np.where(done < 6, (10.5 - 2 * done) * np.cos(made.times) + (-1) ** done, -0.5),
        )
    if name == "block":
        made = Problem(
            name,
            problems.SDOF,
            problems.SDOF_DRIVE,
            problems.SDOF_LIMIT,
            60,
            {"limit": problems.SDOF_LIMIT, "xi": 0.003},
        )
        return replace(made, truth=event_driven(made, EXACT_RTOL))
    if name == "two":
        made = Problem(
            name,
            problems.TWO,
            problems.TWO_DRIVE,
            problems.TWO_LIMIT,
            20,
            {"limit": problems.TWO_LIMIT, "omega": 1.14},
        )
        return replace(made, truth=event_driven(made, EXACT_RTOL))
    model = build(
        scene.load(
            FOLDER / "patch.toml", ["contact.element_size=0.2 mm", "accuracy.tolerance=1e-3"]
        )
    )
    modes = model.rig.modes
    drive = model.rig.drive.signal
    patch = solve_with_coarser(model.patch, model.accuracy.tolerance, False)[0]
    k, y = list_joints(model, patch, choose_numerics(model).space.meshed)[0].list_elements()
    numbers = {
        "omega": modes.omega,
        "zeta": modes.zeta,
        "slide": modes.slide,
        "base": modes.base,
        "mass": modes.mass,
        "drive": drive.acceleration,
        "drive_omega": drive.omega,
        "stiffness": k,
        "yields": y,
    }
    made = Problem(
        name,
        modes,
        drive,
        float(k @ y),
        20,
        {
            key: value.tolist() if isinstance(value, np.ndarray) else value
            for key, value in numbers.items()
        },
        (np.array(k), np.array(y)),
        1e-5,
        1 / 100,
    )
    return replace(made, truth=march(made, TRUTH))


def event_driven(one: Problem, rtol: float) -> np.ndarray:
    """Integrate from event to event by steps of order 8 with the step tolerance `rtol`."""
    if one.elements is None:
        law = problems.make_coulomb(one.limit)
    else:
        law = masing.from_elements(*one.elements)
    return problems.sample_motion(
        one.modes, one.drive, law, one.cycles, one.times, one.start, window=one.last, rtol=rtol
    ).slide


def march(one: Problem, steps: int) -> np.ndarray:
    """Integrate by time stepping with `steps` per cycle."""
    if one.elements is None:
        law = laws.make_coulomb(Coulomb(one.limit, one.limit), np.ones(1))
    else:
        law = laws.make_elements(*one.elements)
    points = contacts.PointSet(law, one.modes.slide)
    contact = contacts.Contact([points], one.limit)
    found = time_march.march(
        one.modes, one.drive, contact, one.cycles, steps, window=one.last, start=one.start
    )
    return found.window.slide[:: steps // POINTS][1:]
