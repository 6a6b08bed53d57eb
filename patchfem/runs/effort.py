"""What a run of a rig costs: pieces between the events of the exact engine, steps of the march, and the seconds of
both."""

from math import ceil, sqrt

import numpy as np

from ..core import Missing
from ..friction.bonds.parameters import LONGEST
from ..model.model import Model
from ..structure.drive_sizes import fastest

MOST_STEPS = 6400  # finest automatic march, steps per cycle
BRIEF = 5.0  # seconds of the exact engine that are worth its digits, however quick the march is
SHARE = 5.0  # and how many times the seconds of the march
PATIENCE = 60.0  # seconds that they are worth where the finest march does not resolve the modes
PIECE, MODE, FACE = 1e-6, 1.2e-7, 3e-7  # seconds of a piece of the motion, of each further mode and interface in it
READ = 1.5e-5  # and of one of the last cycles, which is kept, for loops and peaks


def steps_wanted(model: Model) -> int:
    """Steps per cycle that the tolerance asks of a march, however many."""
    accuracy, rig = model.accuracy, model.rig
    quickest = max(fastest(rig.drive), float(rig.frequencies.max()) * rig.drive.period)
    if model.load_varies:
        quickest = max(quickest, model.point.frequency * rig.drive.period)
    # errors fall with the square of the step; 400 steps per cycle of the fastest motion give about 1e-3
    return 2 * round(200 * sqrt(1e-3 / accuracy.tolerance) * quickest)


def steps_per_cycle(model: Model) -> int:
    """Steps per cycle of a march: those of the scene, else what the tolerance asks for, within its bounds."""
    return model.accuracy.steps_per_cycle or min(max(steps_wanted(model), 100), MOST_STEPS)


def exact_effort(model: Model) -> tuple:
    """Pieces of motion of a run from event to event, and its seconds.

    A piece is at most two radians of the fastest mode long, however slow the drive is.
    """
    rig, modes = model.rig, model.rig.modes
    drive, n, faces = rig.drive, modes.omega.size, len(modes.interfaces)
    damper = float(np.max(2 * modes.zeta * modes.omega) if modes.damping is None else np.linalg.norm(modes.damping, 2))
    rate = (damper + sqrt(damper**2 + 4 * float(modes.omega.max())**2)) / 2
    rate = max(rate, 2 * np.pi / drive.period * fastest(drive))
    each = rate * drive.period / 2 + 4 * faces
    pieces = rig.cycles * each + (0 if drive.segments else len(drive.breaks))
    return ceil(pieces), pieces * (PIECE + MODE * (n - 1) + FACE * (faces - 1)) + READ * min(rig.cycles, 10.0) * each


def too_long(model: Model) -> str:
    """Why the exact engine is not worth its seconds to a model that names no engine; empty where it is."""
    pieces, seconds = exact_effort(model)
    march = 4e-7 * model.rig.cycles * steps_per_cycle(model)
    worth = PATIENCE if steps_wanted(model) > MOST_STEPS else max(BRIEF, SHARE * march)
    return f"in {pieces} pieces" if seconds > worth else ""


def refuse_endless(model: Model) -> None:
    """Raise Missing when the exact engine would take longer than LONGEST seconds."""
    pieces, seconds = exact_effort(model)
    if seconds > LONGEST:
        raise Missing(f"the exact motion (about {pieces:.2g} pieces between events, rows of the drive and cycles of "
                      f"the fastest mode) would take about {seconds:.0f} s, more than {LONGEST:.0f} s; lower "
                      "drive.cycles or the frequency of the fastest mode, or use accuracy.method = \"march\"", "")
