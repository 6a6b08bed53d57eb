"""Amplitude above which friction does not limit a mode that gains energy.

In: a `passes.Coupled` with a mode of negative damping. Out: `flutter_amplitude`, the amplitude of
the largest unstable limit cycle (`dynamics.limit_cycles`), and notes.
"""

from ...core import Measure, NotConverged, Outcome, PatchfemError
from ...dynamics import limit_cycles
from ...effects import law_has_trait
from ...formatting import format_length
from ...model.rig import MAX_TRAVEL
from ...response.rows import TABLE
from .engines import ENGINES
from .interface import contact_model
from .steady.balance import BalanceFinder

NAME = "flutter_amplitude"
NO_INTERFACE_NOTE = (
    "no mode with negative damping moves an interface, so friction cannot dissipate the energy "
    "of such a mode"
)
NONE = (
    f"no unstable limit cycle was found at amplitudes between {limit_cycles.MIN_AMPLITUDE_RATIO:g} and "
    f"{limit_cycles.MAX_AMPLITUDE_RATIO:g} times 4 F/(pi |c| omega), where F is the friction force and c is the "
    "damping coefficient"
)
FEWER = (
    f"no unstable limit cycle was found at amplitudes between {limit_cycles.MIN_SLIDING_RATIO:g} and "
    f"{limit_cycles.MAX_AMPLITUDE_RATIO:g} times 4 F/(pi |c| omega), and smaller free motions could not be followed"
)
UNBALANCED = (
    'with bonds limit cycles can be computed only for friction.reading = "stretch", order = 1, a constant '
    "bond length, breakaway = 0 and pieces that are rigid in shear"
)
NO_SLIDING_NOTE = (
    "no motion was found in which the interface always slides and friction dissipates the energy that the mode "
    "gains"
)


def find_limit_cycles(run) -> tuple:
    """Return the measures by name and the notes on unstable limit cycles of a `passes.Coupled`.

    The measure is the amplitude of the largest unstable limit cycle with its error, or the reason
    why it is not known.
    """
    model = run.model
    unit = TABLE[NAME].unit
    floor = TABLE[NAME].floor
    found, reason, looked = _cycles(model, run.numerics, run.patch)
    far = (
        [
            f"the run ended after {run.solution.response.time[-1]:.4g} s, when the motion exceeded {MAX_TRAVEL:g} m"
        ]
        if run.solution.outcome is Outcome.EXCEEDS_TRAVEL and model.rig.springs.travel == MAX_TRAVEL
        else []
    )
    edges = [one for one in found if not one.is_stable]
    if not edges:
        return {NAME: Measure(None, unit, None, floor, reason=reason)}, far
    edge = edges[-1]
    below = [one for one in found if one.is_stable and one.amplitude < edge.amplitude][-1:]
    least = [
        one for one in found if not one.is_stable and below and one.amplitude < below[0].amplitude
    ][-1:]
    # a rigid interface with a single mode does not vibrate during stick
    alone = law_has_trait(model.friction.law, "set-valued") and model.rig.modes.omega.size == 1
    falls = (
        f"amplitude between {format_length(least[0].amplitude, 3)} and this"
        if least
        else "smaller amplitude"
    )
    falls += (
        f" ends in the limit cycle of {format_length(below[0].amplitude, 3)}, which is stable"
        if below
        else " decays to rest"
        if alone
        else f" decays, at least to {format_length(looked, 2)} (smaller motions could not be followed)"
        if looked
        else " decays"
    )
    return {NAME: Measure(edge.amplitude, unit, edge.error, floor)}, [
        "a mode of negative damping gains energy: without a drive this mode has an unstable steady oscillation of "
        f"{format_length(edge.amplitude, 4)} at the output, at {edge.omega / 6.283185307179586:.4g} "
        "Hz; a free oscillation of "
        f"{falls}, and a free oscillation of larger amplitude grows",
        *far,
    ]


def _cycles(model, numerics, patch) -> tuple:
    """Return limit cycles, the reason if none is unstable, and the smallest amplitude searched.

    The amplitude [m] is that of the output, and 0 if all amplitudes were searched.
    """
    rig = model.rig
    f = model.friction
    if len(rig.friction.interfaces) != 1 or f is None:
        return [], "limit cycles can be computed for one interface only", 0.0
    modes = rig.modes
    row = rig.modes.interfaces[0]
    if not row[limit_cycles.find_unstable_modes(modes)].any():
        return [], NO_INTERFACE_NOTE, 0.0
    load = patch.pressure.load if patch is not None else model.point.load
    if reason := ENGINES["harmonic"].lacks(model, steady=True):
        return [], f"limit cycles cannot be computed {reason}", 0.0
    contact = contact_model(model, numerics, patch)
    try:
        if contact.set_valued:
            if rig.springs.is_nonlinear:
                return (
                    [],
                    "with rigid friction limit cycles cannot be computed if the rig has a nonlinear spring",
                    0.0,
                )
            if not modes.omega.all():
                return (
                    [],
                    "with rigid friction limit cycles cannot be computed if the rig has a mode of 0 Hz",
                    0.0,
                )
            static, kinetic = contact.element.numbers[1:3]
            return limit_cycles.find_relay_cycles(modes, row, kinetic, static), NO_SLIDING_NOTE, 0.0
        finder = BalanceFinder(model, numerics, patch)
        cycles, looked = limit_cycles.find_balance_cycles(modes, finder.group, row, f.static * load)
        return cycles, NONE if not looked else FEWER, looked
    except NotConverged as missing:
        return [], str(missing), 0.0
    except PatchfemError:
        return [], UNBALANCED, 0.0
