"""Steps and CPU times of the engines of a rig, for the choice of an engine.

In: a Model. Out: numbers of steps, CPU times, and whether a time integration with constant steps is
chosen instead of steps from event to event.

The steps of the engine `hybrid` follow from the fastest vibration of the modes, also with stuck interfaces, from the lengths
over which a law forgets, and from the events of friction elements.
"""

from functools import lru_cache
from math import inf, pi, sqrt
from typing import NamedTuple

import numpy as np

from ... import cost_model
from ...effects import law_has_trait
from ...model import patch as patch_model
from ...model.model import Model
from ...structure.drive_sizes import find_max_frequency_ratio

# Largest CPU time [s] of a motion from event to event if a time integration, which has larger errors, takes less.
MAX_HYBRID_SECONDS = 5.0
MAX_HYBRID_SECONDS_UNRESOLVED = 60.0  # The same if time steps cannot resolve the modes.
# Steps of a run and its comparison run, relative to those of the run.
HYBRID_COST_FACTOR = 1.7
MARCH_COST_FACTOR = 1.75  # The same of a time integration, which has several coarse runs.
# Smallest number of steps of `hybrid` per shortest period of the drive.
MIN_STEPS_PER_SHORTEST_PERIOD = 12
HYBRID_STEPS_PER_RADIAN = 0.8  # Steps of `hybrid` per radian of the fastest vibration.
HYBRID_STEPS_PER_EVENT = 3.0
# Largest stable step of `hybrid` in relaxation times of a law.
MAX_HYBRID_STEP_RELAXATION_TIMES = 4.0
MAX_MARCH_STEPS_PER_CYCLE = 6400  # Largest automatically chosen number of time steps per cycle.
MAX_REFINED_RUN_STEPS = 1e7  # Largest number of time steps of a run after its steps were doubled.
# Keys of [accuracy] that select constant time steps.
MARCH_ACCURACY_KEYS = ("steps_per_cycle", "tail", "merge", "shear_modes")


def required_steps_per_cycle(model: Model) -> int:
    """Return the number of steps per cycle that meets the tolerance, without an upper bound."""
    accuracy = model.accuracy
    rig = model.rig
    max_frequency_ratio = max(
        find_max_frequency_ratio(rig.drive.signal),
        float(rig.structure.frequencies.max()) * rig.drive.signal.period,
    )
    if model.load_varies:
        max_frequency_ratio = max(
            max_frequency_ratio, model.point.frequency * rig.drive.signal.period
        )
    # The error is proportional to the square of the step; 400 steps per cycle of the fastest motion
    # give 1e-3.
    return 2 * round(200 * sqrt(1e-3 / accuracy.tolerance) * max_frequency_ratio)


def steps_per_cycle(model: Model) -> int:
    """Return the steps per cycle of a time integration, from the scene or else from the tolerance.

    The tolerance selects between 100 and MAX_MARCH_STEPS_PER_CYCLE steps.
    """
    return model.accuracy.steps_per_cycle or min(
        max(required_steps_per_cycle(model), 100), MAX_MARCH_STEPS_PER_CYCLE
    )


def find_interface_load(model: Model, interface) -> float:
    """Return the normal load [N] on an interface (default: on the whole model)."""
    return model.nominal_load if interface.load is None else interface.load


class ElementSizes(NamedTuple):
    """Friction elements of a rig.

    - count: number of elements of all interfaces
    - max_stiffness: largest stiffness of one in stick [N/m]. Rigid elements count as 0
    """

    count: int
    max_stiffness: float


@lru_cache(8)
def estimate_elements(model: Model) -> ElementSizes:
    """Estimate the number of friction elements and the largest stiffness in stick."""
    count = 0
    max_stiffness = 0.0
    # One element per interface, or one per node of a patch that slips part by part, in series with its pieces
    for interface in model.rig.friction.interfaces:
        load = find_interface_load(model, interface)
        keys = interface.numbers
        n_elements = 1
        stiffness = keys.stiffness or 0.0
        if law_has_trait(keys.law, "set-valued"):
            stiffness = inf
        elif keys.bond_length:
            stiffness = keys.static * load / keys.bond_length
        if model.partial_slip or interface.partial_slip:
            patch = interface.patch or model.patch
            stiffness = 1 / (1 / max(stiffness, 1e-300) + 1 / patch.pieces.shear_stiffness)
            n_elements = patch_model.TYPICAL_N_NODES
            if not patch.mesh.is_automatic:
                n_elements = round(patch.pieces.length / patch.uniform_element_size) + 1
        count += n_elements
        max_stiffness = max(max_stiffness, stiffness if stiffness < inf else 0.0)
    return ElementSizes(count, max_stiffness)


def estimate_hybrid_steps(model: Model) -> float:
    """Estimate the number of steps per cycle of the engine `hybrid`, which integrates from event to event.

    An event is a stop, a release or a reversal of an interface. Each interval between events takes steps that resolve the
    fastest vibration of the modes and the fastest change of a law.
    """
    rig = model.rig
    modes = rig.modes
    drive = rig.drive.signal
    period = drive.period
    mobility = float((modes.interfaces**2).sum(axis=1).max(initial=0.0)) / modes.mass

    # The fastest vibration of the modes, also with stuck interfaces, and the tones of the drive.
    count, stiffness = estimate_elements(model)
    damping = float(np.linalg.norm(modes.damping_matrix, 2))
    stuck_square = float(modes.omega.max()) ** 2 + stiffness * mobility
    fastest = damping / 2 + sqrt(damping**2 / 4 + stuck_square)
    max_tone = find_max_frequency_ratio(drive)
    phase = max(fastest * period, 2 * pi * max_tone)

    # Each element slips twice per oscillation; the rows of a record set the steps without tones.
    events = 0.0
    if rig.friction.interfaces:
        events = 2 * max(count, len(modes.interfaces)) * max_tone + 2
    n_rows = 0.0 if drive.segments else len(drive.breaks) / rig.drive.cycles
    n_tones = max_tone
    if model.load_varies:
        n_tones = max(n_tones, model.point.frequency * period)

    # The explicit method follows the fastest decay of a law.
    rate = max(
        [_estimate_decay_rate(model, interface, mobility) for interface in rig.friction.interfaces]
        or [0.0]
    )
    rate += float(np.abs(modes.damping_matrix).sum(axis=1).max())
    return (
        max(n_rows or MIN_STEPS_PER_SHORTEST_PERIOD * n_tones, HYBRID_STEPS_PER_RADIAN * phase)
        + rate * period / MAX_HYBRID_STEP_RELAXATION_TIMES
        + HYBRID_STEPS_PER_EVENT * events
    )


def _estimate_decay_rate(model: Model, interface, mobility: float) -> float:
    """Estimate the fastest rate [1/s] at which a law forgets its state.

    `interface` is one of the rig, with the numbers of its law, and `mobility` [1/kg] the inverse of the mass on which
    the law acts.
    """
    rig = model.rig
    keys = interface.numbers
    limit = keys.static * find_interface_load(model, interface)
    rate = ((keys.micro_damping or 0.0) + (keys.viscous or 0.0)) * mobility
    if keys.reference_speed:
        rate = max(rate, limit / keys.reference_speed * mobility)
    elif law_has_trait(keys.law, "bonds") or keys.law in ("bouc-wen", "lugre"):
        length = keys.bond_length or limit / keys.stiffness
        speed = 2 / pi * rig.slide_speed_scale
        rate = max(rate, speed / min(length, keys.slip_growth or inf))
    return rate


def estimate_hybrid_seconds(model: Model) -> float:
    """Estimate the CPU time [s] of a run of the engine `hybrid` and its comparison run."""
    n_modes = model.rig.modes.omega.size
    n_interfaces = len(model.rig.modes.interfaces) if model.rig.friction.interfaces else 0
    each = (
        cost_model.HYBRID_STEP_SECONDS
        + cost_model.HYBRID_MODE_PAIR_SECONDS * n_modes**2
        + cost_model.HYBRID_INTERFACE_PAIR_SECONDS * n_interfaces**2
    )
    return HYBRID_COST_FACTOR * each * estimate_hybrid_steps(model) * model.rig.drive.cycles


def estimate_march_seconds(model: Model) -> float:
    """Estimate the CPU time [s] of a time integration and of the coarse runs for its error."""
    count = estimate_elements(model).count
    n_interfaces = len(model.rig.friction.interfaces)
    step = cost_model.MARCH_STEP_SECONDS + cost_model.MARCH_ELEMENT_STEP_SECONDS * count
    return (
        MARCH_COST_FACTOR
        * model.rig.drive.cycles
        * (cost_model.MARCH_CYCLE_SECONDS + steps_per_cycle(model) * n_interfaces * step)
    )


def prefers_time_steps(model: Model) -> bool:
    """Return whether a time integration is chosen over the engine `hybrid`.

    The scene has a setting of the time integration, or the steps of `hybrid` cost more CPU time than those of the time
    integration and than its smaller errors are worth.
    """
    accuracy = model.accuracy
    is_rigid = not model.partial_slip and all(
        law_has_trait(law.numbers.law, "set-valued") and not law.partial_slip
        for law in model.rig.friction.interfaces
    )
    has_setting = any(getattr(accuracy, key) is not None for key in MARCH_ACCURACY_KEYS)
    if not is_rigid and (has_setting or accuracy.quadrature not in ("auto", "recursion")):
        return True
    is_resolved = required_steps_per_cycle(model) <= MAX_MARCH_STEPS_PER_CYCLE
    seconds = MAX_HYBRID_SECONDS if is_resolved else MAX_HYBRID_SECONDS_UNRESOLVED
    return estimate_hybrid_seconds(model) > max(seconds, estimate_march_seconds(model))
