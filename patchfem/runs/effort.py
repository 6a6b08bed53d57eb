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
PYTHON_CYCLE, COMPILED_CYCLE, COMPILED_FROM = 1.2e-4, 3e-6, 5000  # one mode under sines [s]; `one_mode.sdof`


def steps_per_cycle(model: Model) -> int:
    """Steps per cycle that the tolerance asks of a march, unless the scene pins them."""
    accuracy, rig = model.accuracy, model.rig
    quickest = max(fastest(rig.drive), float(rig.frequencies.max()) * rig.drive.period)
    if model.load_varies:
        quickest = max(quickest, model.point.frequency * rig.drive.period)
    # errors fall with the square of the step; 400 steps per cycle of the fastest motion give about 1e-3
    return accuracy.steps_per_cycle or int(np.clip(
        2 * round(200 * sqrt(1e-3 / accuracy.tolerance) * quickest), 100, MOST_STEPS))


def exact_effort(model: Model) -> tuple:
    """Pieces of motion of a run by the exact engine, and its seconds."""
    rig, modes = model.rig, model.rig.modes
    drive, n, faces = rig.drive, modes.omega.size, len(modes.interfaces)
    if n == 1 and faces == 1 and drive.segments:
        each = PYTHON_CYCLE if rig.cycles <= COMPILED_FROM else COMPILED_CYCLE
        return int(4 * rig.cycles), each * rig.cycles
    damper = float(np.max(2 * modes.zeta * modes.omega) if modes.damping is None else np.linalg.norm(modes.damping, 2))
    rate = (damper + sqrt(damper**2 + 4 * float(modes.omega.max())**2)) / 2
    rows = 0 if drive.segments else len(drive.breaks)
    rate = max(rate, 2 * np.pi / drive.period * fastest(drive))
    pieces = rig.cycles * (rate * drive.period / 2 + 4) + rows
    return ceil(pieces), pieces * (5e-5 + 1.5e-8 * (n + faces) * (2 * n + 27))


def too_long(model: Model) -> str:
    """Why the exact engine is not worth its seconds to a model that names no engine; empty where it is."""
    pieces, seconds = exact_effort(model)
    march = 4e-7 * model.rig.cycles * steps_per_cycle(model)
    return f"in {pieces} pieces" if seconds > max(BRIEF, SHARE * march) else ""


def refuse_endless(model: Model) -> None:
    """Raise Missing when the exact engine would take longer than LONGEST seconds."""
    pieces, seconds = exact_effort(model)
    if seconds > LONGEST:
        raise Missing(f"the exact motion (about {pieces:.2g} pieces between events, rows of the drive and cycles of "
                      f"the fastest mode) would take about {seconds:.0f} s, more than {LONGEST:.0f} s; lower "
                      "drive.cycles or the frequency of the fastest mode, or use accuracy.method = \"march\"", "")
