"""Amplitude above which friction does not limit a mode with negative damping.

In: a `rig.CoupledRun` with such a mode. Out: `flutter_amplitude`, the amplitude of the
largest unstable limit cycle (`event_driven.free_motions`), and notes.
"""

from math import tau
from typing import NamedTuple

import numpy as np

from ...core import Measure, NotConverged, Outcome, PatchfemError
from ...effects import law_has_trait
from ...event_driven import free_motions
from ...formatting import format_length
from ...measures.measures import Measures
from ...measures.rows import MOTION_TABLE
from ...model.rig import MAX_COMPUTED_DISPLACEMENT
from .engines import find_obstacle_of_map
from .evaluation import first_interface_load
from .joints import make_undriven_rig

FLUTTER_MEASURE = "flutter_amplitude"
NO_MOVING_INTERFACE_NOTE = (
    "no mode with negative damping moves an interface, so friction cannot dissipate the energy "
    "of such a mode"
)
NO_CYCLE_NOTE = (
    f"no unstable limit cycle was found at amplitudes between {free_motions.MIN_CYCLE_RATIO:g} and "
    f"{free_motions.MAX_CYCLE_RATIO:g} times 4 F/(pi |c| omega), where F is the friction force and c is the "
    "damping coefficient"
)
NO_SMALLER_CYCLE_NOTE = (
    "no unstable limit cycle was found at amplitudes up to "
    f"{free_motions.MAX_CYCLE_RATIO:g} times 4 F/(pi |c| omega), and motions below {{}} could not be followed"
)
UNSUPPORTED_BOND_LAW_REASON = (
    'with bonds limit cycles can be computed only for friction.reading = "stretch", order = 1, a constant '
    "bond length and pieces that are rigid in shear"
)
NO_SLIDING_NOTE = (
    "no motion was found in which the interface always slides and friction dissipates the energy that the mode "
    "gains"
)
RIGID_FRICTION_REASON = (
    "with rigid friction limit cycles cannot be computed if the rig has a mode of 0 Hz"
)


def compute_flutter_amplitude(run) -> tuple[Measures, list[str]]:
    """Compute the amplitude above which friction does not limit a mode with negative damping, so that a motion grows.

    It is the amplitude of the largest unstable limit cycle. `run` is the `rig.CoupledRun` of the rig. Without an unstable
    cycle the measure has a reason instead of a value. The second value is a list of sentences on what was found.
    """
    model = run.model
    unit = MOTION_TABLE[FLUTTER_MEASURE].unit
    floor = MOTION_TABLE[FLUTTER_MEASURE].floor
    # Limit cycles by increasing amplitude, why no unstable one is known, and the smallest amplitude [m] of the search.
    cycles, reason, smallest_amplitude = _find_limit_cycles(model, run.numerics, run.patch)

    end_notes = []
    outcome = run.solution.run.outcome
    if outcome is Outcome.EXCEEDS_TRAVEL and model.rig.springs.travel == MAX_COMPUTED_DISPLACEMENT:
        end_time = run.solution.run.response.time[-1]
        end_notes.append(
            f"the run ended after {end_time:.4g} s, when the motion exceeded {MAX_COMPUTED_DISPLACEMENT:g} m"
        )

    unstable_cycles = [cycle for cycle in cycles if not cycle.is_stable]
    if not unstable_cycles:
        missing = Measure(None, unit, None, floor, reason=reason)
        return {FLUTTER_MEASURE: missing}, end_notes
    limit = unstable_cycles[-1]

    # Motions below the unstable cycle approach the largest stable one inside it, or decay.
    inner = [cycle for cycle in cycles if cycle.is_stable and cycle.amplitude < limit.amplitude]
    decay_text = "smaller amplitude"
    if inner:
        attractor = inner[-1].amplitude
        barriers = [cycle.amplitude for cycle in unstable_cycles if cycle.amplitude < attractor]
        if barriers:
            decay_text = f"amplitude between {format_length(barriers[-1], 3)} and this"
        decay_text += f" ends in the limit cycle of {format_length(attractor, 3)}, which is stable"
    elif law_has_trait(model.friction.law, "set-valued") and model.rig.modes.omega.size == 1:
        # A rigid interface with a single mode does not vibrate during stick.
        decay_text += " decays to rest"
    elif smallest_amplitude:
        lowest = format_length(smallest_amplitude, 2)
        decay_text += f" decays, at least to {lowest} (smaller motions could not be followed)"
    else:
        decay_text += " decays"

    measure = Measure(limit.amplitude, unit, limit.error, floor)
    notes = [
        "a mode of negative damping gains energy: without a drive this mode has an unstable steady oscillation of "
        f"{format_length(limit.amplitude, 4)} at the output, at {limit.omega / tau:.4g} "
        "Hz; a free oscillation of "
        f"{decay_text}, and a free oscillation of larger amplitude grows",
        *end_notes,
    ]
    return {FLUTTER_MEASURE: measure}, notes


class LimitCycles(NamedTuple):
    """Limit cycles of a self-excited rig, and the reason if no unstable one is known.

    - cycles: limit cycles by increasing amplitude.
    - reason: reason why no unstable one is known.
    - smallest_amplitude: smallest output amplitude of the search [m], or 0 if it covered all amplitudes.
    """

    cycles: list[free_motions.LimitCycle]
    reason: str
    smallest_amplitude: float = 0.0


def _find_limit_cycles(model, numerics, patch) -> LimitCycles:
    """Compute the limit cycles of a self-excited rig with one interface.

    If none can be computed, `LimitCycles.reason` says why. `numerics` are the settings of the run, and `patch` is the
    pressed patch of the interface, or None for an interface without one.
    """
    rig = model.rig
    law = model.friction
    if len(rig.friction.interfaces) != 1 or law is None:
        return LimitCycles([], "limit cycles can be computed for one interface only")

    modes = rig.modes
    if not modes.interfaces[0][free_motions.find_unstable_modes(modes)].any():
        return LimitCycles([], NO_MOVING_INTERFACE_NOTE)

    if reason := find_obstacle_of_map("harmonic", model):
        return LimitCycles([], f"limit cycles cannot be computed {reason}")

    # The laws must follow from a few numbers, and rigid ones need modes that oscillate by themselves.
    try:
        undriven = make_undriven_rig(model, numerics, patch)
    except PatchfemError:
        return LimitCycles([], UNSUPPORTED_BOND_LAW_REASON)
    is_rigid = not np.isfinite(undriven.stiffness).all()
    if is_rigid and not modes.omega.all():
        return LimitCycles([], RIGID_FRICTION_REASON)

    try:
        cycles, smallest = free_motions.find_limit_cycles(
            undriven, law.static * first_interface_load(model, patch)
        )
    except NotConverged as missing:
        return LimitCycles([], NO_SLIDING_NOTE if is_rigid else str(missing))

    # Amplitudes below the smallest examined one may have further cycles.
    reason = NO_CYCLE_NOTE
    if smallest:
        reason = NO_SMALLER_CYCLE_NOTE.format(format_length(smallest, 2))
    return LimitCycles(cycles, NO_SLIDING_NOTE if is_rigid else reason, smallest)
