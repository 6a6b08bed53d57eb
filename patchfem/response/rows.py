"""Table of the measures of a motion, for the solutions of all engines.

In: a `LastCycles`, i.e. the last cycles of a run with the values that its engine integrated. Out:
values by name, and the definition, floor and larger term of each measure. A row has a name, a unit,
the absolute floor of the error, a definition in one sentence, and a function of a `LastCycles`. A new
measure is a new row of SINGLE_RUN_ROWS.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from .. import structure
from ..core import MeasureDefinition, Response, add_interface_number, remove_interface_number
from ..motion_measures import MAX_RESTING_SLIDE_RANGE, energy_balance, ratio_or_zero
from . import stationary
from .loops import (
    Reversal,
    compute_interface_loop,
    compute_mean_drift,
    compute_mean_half_range,
    compute_secant_stiffness,
    find_reversals,
)
from .measures import (
    Measures,
    Values,
    compute_ledger_measures,
    compute_peak,
    compute_slip_measures,
)
from .spectrum import MIN_MOVING_HARMONIC, find_acceleration_harmonics, make_acceleration_measures


@dataclass(frozen=True, eq=False)
class LastCycles:
    """Last cycles of a run, from which the measures are computed.

    - window: histories of the last cycles.
    - drive: drive of the run.
    - extremes (c, 2): smallest and largest output in each cycle of the window [m].
    - run_energies: energies of the whole run by name [J].
    - load: normal load [N]; None without friction.
    - stiffness: stiffness of the first mode at the contact [N/m]; 0 if the damping ratio is not
      computed.
    - is_sine: whether the drive is sinusoidal at the end of the run.
    - integrated: measures that the engine integrated by name, None without a value. If the motion of an engine is in closed
      form or piecewise polynomial, they are more accurate than those from samples.
    - loop: first harmonics of relative displacement [m] and friction force [N], and work per cycle
      [J]; None if the window contains no complete cycle.
    - ledger (4, k): friction work, and stored, dissipated and created energy [J] of the whole run, or None.
    - reversal_rule: rule for the friction force at a reversal of the displacement (see
      `loops.find_reversals`).
    - slide_round_off: largest half range of the relative displacement that is round-off [m].
    - is_single_interface: whether the columns `slides` of the window are bands of a single interface.
    - release: amplitude of the last whole cycle of a release [m]; None for other drives and without such a cycle.
    """

    window: Response
    drive: object
    extremes: np.ndarray
    run_energies: Values
    load: float | None
    stiffness: float
    is_sine: bool
    integrated: dict[str, float | None] = field(default_factory=dict)
    loop: tuple | None = None
    ledger: np.ndarray | None = None
    reversal_rule: str = "rate"
    slide_round_off: float = 0.0
    is_single_interface: bool = False
    release: float | None = None

    @cached_property
    def span(self) -> float:
        """Duration of the window [s]."""
        return self.window.time[-1] - self.window.time[0]

    @cached_property
    def slip_measures(self) -> Values:
        """Slip amplitude [m], stick fraction [1] and phase of slip onset [rad] as a dict."""
        if self.load is None:
            return {}
        window = self.window
        steps = max(1, round((window.time.size - 1) * self.drive.period / self.span))
        return compute_slip_measures(window, self.drive, steps)

    @cached_property
    def reversals(self) -> list[tuple[Reversal, ...]]:
        """Reversal at the smallest and at the largest displacement in each complete cycle."""
        w = self.window
        return find_reversals(
            w.time, w.slide, w.slide_rate, w.force, self.drive.period, self.reversal_rule
        )

    @cached_property
    def loop_measures(self) -> Values:
        """Measures of the friction loop as a dict; empty without friction or a complete cycle.

        loop_area [J]; under sinusoidal drive also equivalent_stiffness and secant_stiffness [N/m]
        and equivalent_damping [1].
        """
        if self.loop is None or self.load is None:
            return {}
        is_moving = self.is_sine and np.ptp(self.window.slide) > max(
            2 * self.slide_round_off, MAX_RESTING_SLIDE_RANGE
        )
        if not is_moving:
            return compute_interface_loop(0.0, *self.loop, self.stiffness)
        measures = compute_interface_loop(
            compute_mean_half_range(self.reversals), *self.loop, self.stiffness
        )
        return measures | {"secant_stiffness": compute_secant_stiffness(self.reversals)}

    @cached_property
    def acceleration_measures(self) -> Values:
        """Harmonic measures of the acceleration as a dict, which is empty without a complete cycle.

        absolute_acceleration_fundamental [m s-2] and, if there is an acceleration,
        acceleration_distortion [1].
        """
        if not structure.drive_sizes.has_full_cycle(self.span, self.drive):
            return {}
        return make_acceleration_measures(*find_acceleration_harmonics(self.window, self.drive))

    @cached_property
    def final_energies(self) -> Values:
        """Friction work and energies [J] at the end of the run by name; empty if not recorded."""
        return {} if self.ledger is None else compute_ledger_measures(self.ledger)

    @cached_property
    def random_response_measures(self) -> Values:
        """Measures of the response to a stationary random drive as a dict."""
        if not hasattr(self.drive, "band"):
            return {}
        return stationary.random_response_measures(
            self.window, self.drive, has_friction=self.load is not None
        )

    def evaluate(self, row: MeasureDefinition) -> float | None:
        """Return the value of the measure that a row of the table defines, in the unit of the row.

        None if it has no value: measures with the flag "sine" have none under a drive that is no sine.
        """
        if row.has("sine") and not self.is_sine:
            return None
        if isinstance(row.function, str):
            return getattr(self, row.function).get(row.name)
        return row.function(self)

    def further_interfaces(self) -> "list[LastCycles]":
        """Return the last cycles of each interface after the first one, as if it were the only interface."""
        whole = self.window
        if self.load is None or self.is_single_interface:
            return []
        interfaces = []
        for k in range(1, whole.slides.shape[1]):
            window = replace(
                whole,
                slide=whole.slides[:, k],
                slide_rate=whole.extra["slide_rates"][:, k],
                force=whole.forces[:, k],
                slip=whole.slips[:, k],
            )

            # The area is the only measure of the loops of further interfaces, so that they need no harmonics.
            work = float(np.trapezoid(window.force, window.slide))
            interfaces.append(
                replace(
                    self,
                    window=window,
                    integrated={},
                    is_sine=False,
                    loop=(0j, 0j, work * self.drive.period / max(self.span, 1e-300)),
                )
            )

        return interfaces

    def evaluate_load(self, function: Callable[[np.ndarray], float]) -> float | None:
        """Return the value of a function of the normal load (k,) [N] in the window, or None for a constant load."""
        load = self.window.extra.get("normal_load")
        return None if load is None or self.load is None else float(function(load))


def _find_drift_scale(values: Values):
    """Return the amplitude [m] with which the drift of an interface is compared.

    The scale is the slip amplitude, or without slip the amplitude of the motion.

    Parameters
    ----------
    values : dict
        Measures of one run, or (n,) of n runs.
    """
    slip = np.abs(np.nan_to_num(np.asarray(values.get("slip_amplitude", 0.0), float)))
    return np.where(slip > 0, slip, np.abs(values.get(AMPLITUDE, 0.0)))


def _make_random_rows(
    name: str, unit: str, floor: float, definition: str, group: str = "motion"
) -> tuple[MeasureDefinition, MeasureDefinition]:
    """Return the definitions of a measure under a random drive and of its statistical scatter.

    Parameters
    ----------
    name : str
        Name of the measure. The scatter is named NAME_scatter.
    unit : str
        SI unit of both.
    floor : float
        Absolute error that is allowed in addition to a tolerance times the value.
    definition : str
        What the measure is.
    group : str
        Group of measures in which both are printed.
    """
    scatter = f"{name}_scatter"
    value_row = MeasureDefinition(
        name, unit, floor, definition, "random_response_measures", group=group
    )

    # The tolerance of a scatter refers to its measure, because the scatter itself may be near 0.
    scatter_row = MeasureDefinition(
        scatter,
        unit,
        floor,
        f"half-width of the 95 % interval of {name}: the scatter between "
        "random drives of the same length with different seeds",
        "random_response_measures",
        group=group,
        larger_term=(name, lambda values: np.abs(values.get(name, 0.0))),
    )
    return value_row, scatter_row


AMPLITUDE = "relative_displacement_amplitude"  # measure on which a run is refined
STICK_FRACTION = "stick_fraction"
SLIP_START_PHASE = "slip_start_phase"
STEADY_AMPLITUDE = "relative_displacement_amplitude_steady"  # the same, extrapolated
# Measures that only single runs compute. If there are any, a sweep computes the cases of a rig one by one,
# because batches compute only the measures of this package.
SINGLE_RUN_ROWS: tuple[MeasureDefinition, ...] = ()
UNIT_LARGER_TERM = ("1", lambda _: 1.0)  # larger term of a fraction and of a relative difference
# Order of convergence of values that are interpolated by cubics between samples.
CUBIC_CONVERGENCE_ORDER = 4.0
MOTION_MEASURE_ROWS = (
    MeasureDefinition(
        AMPLITUDE,
        "m",
        1e-10,
        "half the peak-to-peak displacement at the output, relative to "
        "the base; of a release, that of the last whole cycle of the "
        "motion, from a reversal to the second reversal after it, without "
        "ripples below a quarter of the range in the last period",
        lambda s: np.ptp(s.extremes) / 2 if s.release is None else s.release,
        flags="main level curve displacement",
    ),
    MeasureDefinition(
        "absolute_acceleration_peak",
        "m s-2",
        1e-4,
        "largest acceleration at the output, base motion included",
        lambda s: compute_peak(s.window.acceleration),
        flags="main level curve",
    ),
    MeasureDefinition(
        "friction_force_peak",
        "N",
        1e-6,
        "largest friction force on the whole interface, of a bench during the whole run",
        lambda s: None if s.load is None else compute_peak(s.window.force),
        group="friction",
        flags="interface level loop force",
        friction_scale=lambda scale: scale.limit,
    ),
    MeasureDefinition(
        "energy_balance",
        "1",
        1e-8,
        "error of the energy balance over the run: work minus stored energy minus dissipated energy, divided by the "
        "sum of the exchanged energy and the largest stored energy",
        lambda s: energy_balance(s.run_energies),
        group="energy",
        larger_term=UNIT_LARGER_TERM,
        flags="error",
        friction_scale=lambda _: 0.0,
    ),
    MeasureDefinition(
        "absolute_acceleration_fundamental",
        "m s-2",
        MIN_MOVING_HARMONIC,
        "first harmonic of the acceleration at the output, base motion included",
        "acceleration_measures",
        flags="level curve sine",
    ),
    MeasureDefinition(
        "acceleration_distortion",
        "1",
        1e-6,
        "third harmonic of the acceleration at the output, base motion included, divided by the first harmonic; null "
        "if the output does not move",
        "acceleration_measures",
        flags="level curve sine",
    ),
    MeasureDefinition(
        "drift_per_cycle",
        "m",
        1e-11,
        "drift of the slide per cycle: (mean slide over the last cycle of the window - mean slide over the "
        "first cycle of the window)/(number of cycles between these two cycles); null unless drive and load repeat in "
        "every cycle at the end of the run",
        lambda s: compute_mean_drift(
            s.window.time, s.window.slide, s.window.slide_rate, s.drive.period
        ),
        larger_term=("slip amplitude (without slip: amplitude of the motion)", _find_drift_scale),
        order=CUBIC_CONVERGENCE_ORDER,
        flags="displacement",
    ),
    MeasureDefinition(
        "slip_amplitude",
        "m",
        1e-10,
        "half the peak-to-peak value of the irreversible part of the slide; for a patch, the mean over its points, "
        "weighted by the pressure; for law 'iwan', the mean over the sliders, weighted by their slip forces",
        "slip_measures",
        group="friction",
        flags="interface level displacement loop",
        friction_scale=lambda scale: scale.bond_length,
    ),
    MeasureDefinition(
        STICK_FRACTION,
        "1",
        1e-3,
        "fraction of the time of the last cycles during which the interface as a whole sticks; the interface sticks "
        "as a "
        "whole while more than half of the change of the slide (weighted as in `slip_amplitude`) is elastic; part of a "
        "patch, or some sliders of law 'iwan', may slip during this time",
        "slip_measures",
        0.35,
        group="friction",
        larger_term=UNIT_LARGER_TERM,
        flags="interface level",
    ),
    MeasureDefinition(
        SLIP_START_PHASE,
        "rad",
        1e-3,
        "phase of the drive (of the base displacement, or of the force) at which slip starts after stick, modulo pi; "
        "slip is the weighted mean defined under `slip_amplitude`; the phase is printed in degrees; null if slip "
        "starts at different phases of a half cycle",
        "slip_measures",
        1.0,
        group="friction",
        larger_term=("pi", lambda _: np.pi),
        flags="sine phase",
    ),
    MeasureDefinition(
        "normal_load",
        "N",
        0.0,
        "normal load on the interface, summed over all equal patches (key `pairs`)",
        lambda s: s.load,
        group="friction",
        friction_scale=lambda _: 0.0,
    ),
    MeasureDefinition(
        "loop_area",
        "J",
        1e-10,
        "friction work per cycle in this interface alone (the energy dissipated, if the loop closes); null if the drive "
        "is not periodic and the friction loop does not close, because the interface then stores or returns more energy "
        "than it dissipates",
        "loop_measures",
        group="energy",
        flags="main interface level loop",
        friction_scale=lambda scale: scale.cycle_work,
    ),
    MeasureDefinition(
        "equivalent_stiffness",
        "N m-1",
        1.0,
        "part of the first harmonic of the friction force that is in phase with the slide, divided by the first "
        "harmonic of the slide; negative if friction keeps the spring of the structure deflected during stick",
        "loop_measures",
        group="friction",
        larger_term=(
            "magnitude of the complex ratio of the two first harmonics",
            lambda values: np.nan_to_num(values.get("harmonic_force_ratio", 0.0)),
        ),
        flags="level sine loop",
    ),
    MeasureDefinition(
        "secant_stiffness",
        "N m-1",
        1.0,
        "friction force at the largest slide of a cycle minus friction force at the smallest slide, divided by the "
        "range of the slide; if the force jumps at the largest or the smallest slide, the mean of the forces "
        "before and after the jump is used; a cycle whose largest or smallest slide lies at its end is left out; null if "
        "rigid friction sticks there, where the force takes many values",
        "loop_measures",
        group="friction",
        order=CUBIC_CONVERGENCE_ORDER,
        flags="level sine",
    ),
    MeasureDefinition(
        "equivalent_damping",
        "1",
        1e-8,
        "equivalent damping ratio of friction in the first mode that is not rigid, averaged over the last cycles: "
        "loop_area/(2 pi K A^2), where K = moving_mass omega_1^2 and A = (half the range of the slide in a "
        "cycle)/(value of the key `slide` of this mode); the frequency is that without contact and bonded spring; "
        "null if other modes contribute more than 5 % of the slide",
        "loop_measures",
        group="friction",
        order=CUBIC_CONVERGENCE_ORDER,
        flags="level sine loop",
    ),
    MeasureDefinition(
        "friction_work",
        "J",
        1e-10,
        "work done on all interfaces together over the whole run; with method `harmonic`, "
        "over two cycles",
        "final_energies",
        group="energy",
        flags="run",
        friction_scale=lambda scale: scale.work,
    ),
    MeasureDefinition(
        "energy_stored",
        "J",
        1e-10,
        "energy stored in the interface at the end of a run on a bench: elastic energy and, with "
        "grooves, the energy that the load has taken up",
        group="energy",
        friction_scale=lambda scale: scale.limit * scale.bond_length,
    ),
    MeasureDefinition(
        "energy_dissipated",
        "J",
        1e-10,
        "energy dissipated by friction in all interfaces over the whole run; with "
        "method `harmonic`, over two cycles",
        "final_energies",
        group="energy",
        flags="run",
        friction_scale=lambda scale: scale.work,
    ),
    MeasureDefinition(
        "energy_created",
        "J",
        1e-10,
        "energy created over the whole run by a law that is not passive, such as equation 2.17 as printed in the "
        "report; with method `harmonic`, over two cycles",
        "final_energies",
        group="energy",
    ),
    MeasureDefinition(
        "normal_load_least",
        "N",
        1e-6,
        "smallest normal load in the last cycles",
        lambda s: s.evaluate_load(np.min),
        group="friction",
    ),
    MeasureDefinition(
        "normal_load_peak",
        "N",
        1e-6,
        "largest normal load in the last cycles",
        lambda s: s.evaluate_load(np.max),
        group="friction",
    ),
    MeasureDefinition(
        "open_fraction",
        "1",
        1e-3,
        "fraction of the time of the last cycles in which the surfaces are not in contact",
        lambda s: s.evaluate_load(lambda load: np.mean(load <= 0)),
        4.0,
        group="friction",
        larger_term=UNIT_LARGER_TERM,
    ),
    MeasureDefinition(
        STEADY_AMPLITUDE,
        "m",
        1e-10,
        "steady amplitude under a periodic drive, extrapolated if the motion has not settled or may still change by "
        "more than 0.02 tolerance × amplitude; absent if it has settled and cannot change by more; null if the motion "
        "has not settled and its limit cannot be extrapolated, or if no common period of load and drive fits into the run",
        flags="displacement",
    ),
    MeasureDefinition(
        "peak_frequency",
        "Hz",
        0.0,
        "drive frequency, within the swept range, at which the curve of steady amplitudes "
        "is largest; a resonance unless it is an end of that range",
    ),
    MeasureDefinition(
        "peak_width",
        "Hz",
        0.0,
        "width of the highest peak of a drawn response curve between the frequencies at which the amplitude is the peak "
        "divided by the square root of 2",
    ),
    MeasureDefinition(
        "friction_ratio_end",
        "1",
        1e-9,
        "friction force divided by normal load, both at the end of the slide",
        group="friction",
        friction_scale=lambda scale: scale.static,
    ),
    MeasureDefinition(
        "friction_ratio_peak",
        "1",
        1e-9,
        "largest value of friction force divided by normal load during the whole run",
        group="friction",
        flags="main",
        friction_scale=lambda scale: scale.static,
    ),
    MeasureDefinition(
        "flutter_amplitude",
        "m",
        1e-10,
        "amplitude (half peak-to-peak at the output) of the unstable limit cycle without a drive, in which friction "
        "dissipates exactly what a mode of negative damping supplies; smaller motions decay, larger motions grow",
    ),
    MeasureDefinition(
        "work_check",
        "1",
        1e-2,
        "relative difference between two values of the friction work of the run: the value from the trapezoidal rule "
        "on the samples, and the value in the energy balance",
        group="energy",
        flags="error",
        friction_scale=lambda _: 1.0,
    ),
    *_make_random_rows(
        "relative_displacement_rms",
        "m",
        1e-10,
        "root mean square displacement at the output about its mean, under a random drive",
    ),
    *_make_random_rows(
        "absolute_acceleration_rms",
        "m s-2",
        1e-4,
        "root mean square acceleration at the output, base motion included, under a random drive",
    ),
    *_make_random_rows(
        "response_frequency",
        "Hz",
        1e-3,
        "frequency of the largest peak of the frequency response (H1 estimate) "
        "under a random drive",
    ),
    *_make_random_rows(
        "response_damping",
        "1",
        1e-5,
        "damping ratio of the largest peak of the frequency response (H1 "
        "estimate), structure and friction together",
    ),
    *_make_random_rows(
        "friction_power",
        "W",
        1e-9,
        "mean power of friction under a random drive: friction work per second in "
        "all interfaces together",
        "energy",
    ),
    MeasureDefinition(
        "onset_level",
        "m s-2",
        0.0,
        "drive level at the onset of slip, found by bisection between two levels; the key `drive.onset` defines what "
        "counts as the onset; for a force drive the level is in N",
        group="friction",
    ),
    *SINGLE_RUN_ROWS,
)
# Values that only set the floors of measures (`larger_term`); results do not contain them.
INTERNAL_ROWS = (
    MeasureDefinition(
        "harmonic_force_ratio",
        "N m-1",
        0.0,
        "magnitude of the complex ratio of the first harmonics of friction force and slide",
        "loop_measures",
        flags="sine",
    ),
)
INTERNAL_VALUES = tuple(row.name for row in INTERNAL_ROWS)
MOTION_TABLE = {row.name: row for row in (*MOTION_MEASURE_ROWS, *INTERNAL_ROWS)}


def select_names(flag: str) -> tuple[str, ...]:
    """Return the names of the measures whose row of the table has a flag, such as "main" or "loop"."""
    return tuple(row.name for row in MOTION_TABLE.values() if row.has(flag))


INTERFACE_MEASURES = select_names("interface")
# Upper limit of the floor of the error of a displacement, relative to the displacement caused by the drive alone, and of
# that of a friction force, relative to the normal load.
MAX_RELATIVE_FLOOR = 1e-5


def compute_measures(last_cycles: LastCycles) -> Values:
    """Compute the measures of a run from its last cycles as a dict, in SI units.

    Measures without a value are omitted. The INTERFACE_MEASURES of further interfaces have the number of the
    interface after the name. A value that the engine integrated replaces the value from samples.
    """
    known = last_cycles.integrated
    values = {}
    for row in MOTION_TABLE.values():
        if row.name in known:
            values[row.name] = known[row.name]
        elif row.function is not None:
            values[row.name] = last_cycles.evaluate(row)
    for number, interface in enumerate(last_cycles.further_interfaces(), 1):
        for name in INTERFACE_MEASURES:
            values[add_interface_number(name, number)] = interface.evaluate(MOTION_TABLE[name])
    return {name: value for name, value in (values | known).items() if value is not None}


def find_error_floor(name: str, values: Values, displacement=np.inf):
    """Return the floor of the error of a measure: the magnitude below which it is round-off, in the unit of the measure.

    The floor of a displacement is at most MAX_RELATIVE_FLOOR times that of the drive, and that of a friction force at most
    MAX_RELATIVE_FLOOR times the normal load of its interface.

    Parameters
    ----------
    name : str
        Name of the measure, which may end in the number of an interface, such as "slip_amplitude_2".
    values : dict
        Values by name of one run, or (n,) of n runs. Without a normal load the floor of a force is that of the table.
    displacement : float or (n,)
        Displacement caused by the drive alone [m]. With 0 or inf the floor of a displacement is that of the table.
    """
    definition = find_definition(name)
    floor = definition.floor
    if definition.has("displacement"):
        size = displacement
    elif definition.has("force"):
        size = _find_own_values(name, values).get("normal_load", np.inf)
    else:
        return floor
    return np.where(
        np.greater(size, 0), np.minimum(floor, MAX_RELATIVE_FLOOR * np.asarray(size)), floor
    )


def find_larger_term(name: str, values: Values):
    """Return the size of the terms if a measure is a difference, in the unit of the measure.

    Parameters
    ----------
    name : str
        Name of the measure, with the number of an interface.
    values : dict
        Values by name of one run, or (n,) of n runs; those of the same interface are used.

    Returns
    -------
    float or (n,)
        Size of the terms; 0 if the measure is not a difference.
    """
    row = find_definition(name)
    if row.larger_term is None:
        return 0.0
    return row.larger_term[1](_find_own_values(name, values))


def find_subtracted_terms(name: str, values: Values):
    """Return the size of the terms whose round-off a difference has, in the unit of the measure; 0 of other measures.

    The drift is a difference of positions, and the secant stiffness one of friction forces over the range of the slide.

    Parameters
    ----------
    name : str
        Name of the measure.
    values : dict
        Values by name of one run, or (n,) of n runs.
    """
    amplitude = np.abs(values.get(AMPLITUDE, 0.0))
    if name == "drift_per_cycle":
        return amplitude
    if name == "secant_stiffness":
        force = np.abs(values.get("friction_force_peak", 0.0))
        return ratio_or_zero(force, amplitude)
    return 0.0


def _find_own_values(name: str, values: Values) -> Values:
    """Return values by name, in which a name without a number is that of the interface of the measure `name`."""
    number = name[len(remove_interface_number(name)) :]
    if not number:
        return values
    numbered = {other: value for other, value in values.items() if other.endswith(number)}
    return values | {remove_interface_number(other): value for other, value in numbered.items()}


def set_final_floors(measures: Measures, tolerance: float) -> Measures:
    """Return measures whose error floors are large enough for differences of large numbers.

    The floor of a measure that is a difference, such as a drift, is at least `tolerance` times the larger of its terms.
    The INTERNAL_VALUES among the measures are used and left out.
    """
    values = {name: measure.value for name, measure in measures.items()}
    values = {name: value for name, value in values.items() if value is not None}
    updated = {name: one for name, one in measures.items() if name not in INTERNAL_VALUES}
    for name in values.keys() & updated.keys():
        if remove_interface_number(name) in MOTION_TABLE:
            floor = tolerance * float(find_larger_term(name, values))
            if floor > measures[name].floor:
                updated[name] = replace(measures[name], floor=floor)
    return updated


def find_definition(name: str) -> MeasureDefinition:
    """Return the definition of a measure of any interface.

    KeyError is raised for an unknown name.
    """
    return MOTION_TABLE[remove_interface_number(name)]
