"""What a run of a rig costs: pieces between the events of the exact engine, steps of the march, and the seconds of
both."""

from math import ceil, inf, sqrt

import numpy as np

from ..core import Missing
from ..friction.bonds.parameters import LONGEST
from ..model.model import Model
from ..structure.drive_sizes import fastest, largest

MOST_STEPS = 6400  # finest automatic march, steps per cycle
BRIEF = 5.0  # seconds of the exact engine that are worth its digits, however quick the march is
SHARE = 5.0  # and how many times the seconds of the march
PATIENCE = 60.0  # seconds that they are worth where the finest march does not resolve the modes
DYING = 33.0  # decay times until free motion is round-off, `dynamics.events.following`
MANY = 60  # modes up to which that time is looked for
COMPILED_FROM = 2000  # cycles, `dynamics.one_mode.sdof`
PYTHON_CYCLE, PYTHON_STEP = 1.2e-4, 4e-6  # seconds of one mode under sines, and of each step in its slips
COMPILED_CYCLE, COMPILED_STEP = 3e-6, 1.5e-7
POINT = 8e-6  # seconds per radian of its last cycles, for loop and peaks


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


def _decay(modes, inside) -> float:
    """Slowest decay [1/s] of the free motion within the span of `inside` (n, r); 0: some of it stays, inf: r = 0."""
    r, scale = inside.shape[1], max(float(modes.omega.max()), 1e-300)
    if r == 0:
        return inf
    stiff, damp = inside.T @ np.diag((modes.omega / scale)**2) @ inside, inside.T @ modes.dampers @ inside / scale
    values = np.linalg.eigvals(np.block([[np.zeros((r, r)), np.eye(r)], [-stiff, -damp]]))
    slowest = -float(values.real.max())
    return slowest * scale if slowest > 1e-9 else 0.0


def _dying(modes, rubs: bool) -> float:
    """Seconds that free motion takes to die out after an event, the mean of slip and stick; inf where it stays."""
    n = modes.omega.size
    if n > MANY:
        return inf
    out = DYING / max(_decay(modes, np.eye(n)), 1e-300)
    if not rubs:
        return out
    _, sizes, right = np.linalg.svd(modes.interfaces)
    stuck = right[int(np.count_nonzero(sizes > 1e-9 * max(sizes.max(), 1e-300))):].T
    return (out + DYING / max(_decay(modes, stuck), 1e-300)) / 2


def _events(model: Model, turns: float) -> float:
    """Events of all interfaces in a cycle: two stops and releases each, and of a slow drive the jumps that static and
    kinetic friction allow. turns [rad]: of the fastest mode in a cycle, which bound them."""
    jumps, drive = 0.0, model.rig.drive
    for one in model.rig.interfaces:
        load = model.nominal_load if one.load is None else one.load
        kinetic = one.numbers.kinetic
        drop = 0.0 if kinetic is None else (one.numbers.static - kinetic) * load
        if drop > 0 and turns > 20:
            jumps += 2 * model.rig.modes.mass * largest(drive) / drop
    return min(4 * len(model.rig.interfaces) + jumps, turns + 4)


def exact_effort(model: Model) -> tuple:
    """Pieces of motion of a run by the exact engine, and its seconds.

    Modes far above the drive ring after every event until they have died out and follow it from there on; those that
    are not damped ring all the time.
    """
    rig, modes = model.rig, model.rig.modes
    drive, n, faces = rig.drive, modes.omega.size, len(modes.interfaces)
    damper = float(np.max(2 * modes.zeta * modes.omega) if modes.damping is None else
                   np.linalg.norm(modes.damping, 2 if n <= MANY else inf))
    rate = (damper + sqrt(damper**2 + 4 * float(modes.omega.max())**2)) / 2
    ringing, events = rate * drive.period, _events(model, rate * drive.period)
    slow = ringing > 20
    dying = rate * _dying(modes, bool(rig.interfaces)) if slow else inf
    if n == 1 and faces == 1 and drive.segments:
        fast = rig.cycles > COMPILED_FROM
        each, step = (COMPILED_CYCLE, COMPILED_STEP) if fast else (PYTHON_CYCLE, PYTHON_STEP)
        steps = 0.0 if not slow else 10 * events if dying < 1e300 else 6 * ringing
        last = min(rig.cycles, 10.0) * min(ringing, events * dying)
        return ceil(events * rig.cycles), rig.cycles * (each + steps * step) + POINT * last
    rate = max(rate, 2 * np.pi / drive.period * fastest(drive))
    pieces = rig.cycles * (rate * drive.period / 2 + 4)
    if drive.segments and slow:
        pieces = min(pieces, (rig.cycles * events + 1) * dying / 2 + 4 * rig.cycles)
    pieces += 0 if drive.segments else len(drive.breaks)
    return ceil(pieces), pieces * (5e-5 + 1.5e-8 * (n + faces) * (2 * n + 27))


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
