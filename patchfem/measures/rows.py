"""Rows of the measures of a motion, for the solutions of all engines.

In: a `LastCycles`, i.e. the last cycles of a run with the values that its engine integrated. Out:
values by name, and the definition, floor and larger term of each measure. measures.toml has name, unit, floor and
definition of each measure; a measure of your own is a row of SINGLE_RUN_ROWS.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from .. import structure
from ..core import (
    MeasureDefinition,
    Response,
    add_interface_number,
    read_measure_rows,
    remove_interface_number,
)
from ..motion_measures import MAX_RESTING_SLIDE_RANGE, energy_balance, ratio_or_zero
from . import stationary
from .decay_curve import measure_last_cycle_amplitude
from .loops import (
    compute_mean_drift,
    find_reversals,
    measure_sampled_loop,
)
from .measures import (
    Measures,
    Values,
    compute_ledger_measures,
    compute_peak,
    compute_slip_measures,
)
from .spectrum import find_acceleration_harmonics, make_acceleration_measures


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
    - release: histories of the whole run of a release, whose last whole cycle may begin before the window; None for other
      drives.
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
    release: Response | None = None

    @cached_property
    def span(self) -> float:
        """Duration of the window [s]."""
        return self.window.span

    @cached_property
    def slip_measures(self) -> Values:
        """Slip amplitude [m], stick fraction [1] and phase of slip onset [rad] as a dict."""
        if self.load is None:
            return {}
        return compute_slip_measures(self.window, self.drive, self.slide_round_off)

    @cached_property
    def reversals(self) -> np.ndarray:
        """Smallest and largest slide [m], each with the force there [N], in each complete cycle (c, 4)."""
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
        reversals = self.reversals if is_moving else np.empty((0, 4))
        return measure_sampled_loop(reversals, self.loop, self.stiffness)

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
    """Return the amplitude [m] with which the drift of an interface is compared: that of the slip, or else of the motion.

    `values` are the measures by name of one run, or (n,) of n runs.
    """
    slip = np.abs(np.nan_to_num(np.asarray(values.get("slip_amplitude", 0.0), float)))
    return np.where(slip > 0, slip, np.abs(values.get(AMPLITUDE, 0.0)))


def measure_amplitude(
    extremes: np.ndarray, release: Response | None = None, period: float = np.inf
) -> float:
    """Return the measure AMPLITUDE [m]: half the peak-to-peak displacement at the output.

    Of a release it is that of the last whole cycle, if there is one.

    Parameters
    ----------
    extremes : (c, 2) array
        Smallest and largest output in the last cycles [m].
    release : Response or None
        Histories of the whole run of a release; None for other drives.
    period : float
        Period of the drive, or of the first mode of a release [s].
    """
    amplitude = None
    if release is not None:
        motion = (release.time, release.output, release.output_rate)
        amplitude = measure_last_cycle_amplitude(*motion, period)
    return float(np.ptp(extremes)) / 2 if amplitude is None else amplitude


AMPLITUDE = "relative_displacement_amplitude"  # measure on which a run is refined
STICK_FRACTION = "stick_fraction"
SLIP_START_PHASE = "slip_start_phase"
STEADY_AMPLITUDE = "relative_displacement_amplitude_steady"  # the same, extrapolated
# Functions of a LastCycles that return the measures which are not in one of its groups of values
FUNCTIONS = {
    AMPLITUDE: lambda s: measure_amplitude(s.extremes, s.release, s.drive.period),
    "absolute_acceleration_peak": lambda s: compute_peak(s.window.acceleration),
    "friction_force_peak": lambda s: None if s.load is None else compute_peak(s.window.force),
    "energy_balance": lambda s: energy_balance(s.run_energies),
    "drift_per_cycle": lambda s: compute_mean_drift(
        s.window.time, s.window.slide, s.window.slide_rate, s.drive.period
    ),
    "normal_load": lambda s: s.load,
    "normal_load_least": lambda s: s.evaluate_load(np.min),
    "normal_load_peak": lambda s: s.evaluate_load(np.max),
    "open_fraction": lambda s: s.evaluate_load(lambda load: np.mean(load <= 0)),
}
# Functions of the measures of an interface that return larger terms, by measure
LARGER_TERM_FUNCTIONS = {
    "drift_per_cycle": _find_drift_scale,
    "equivalent_stiffness": lambda values: np.nan_to_num(values.get("harmonic_force_ratio", 0.0)),
}
# Measures that only single runs compute. If there are any, a sweep computes the cases of a rig one by one,
# because batches compute only the measures of this package.
SINGLE_RUN_ROWS: tuple[MeasureDefinition, ...] = ()


def _read_motion_rows() -> Iterator[MeasureDefinition]:
    """Yield the rows of the measures of a motion, that of a scatter after its measure."""
    for name, row in read_measure_rows("motion").items():
        yield row._replace(function=FUNCTIONS.get(name, row.function))
        if row.has("scatter"):
            # The tolerance of a scatter refers to its measure, because the scatter itself may be near 0.
            yield row._replace(
                name=f"{name}_scatter",
                text=f"half-width of the 95 % interval of {name}: the scatter between random drives of the same length "
                "with different seeds",
                larger_term=name,
            )


# Rows of all measures of a motion
MOTION_MEASURE_ROWS = (*_read_motion_rows(), *SINGLE_RUN_ROWS)
# Values that only set the floors of measures (`find_larger_term`); results do not contain them.
INTERNAL_VALUES = tuple(read_measure_rows("internal"))
MOTION_TABLE = {row.name: row for row in MOTION_MEASURE_ROWS} | read_measure_rows("internal")


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
    if last_cycles.release is not None:
        # The amplitude that an engine integrates is that of the window.
        known = {name: value for name, value in known.items() if name != AMPLITUDE}
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
    term = find_definition(name).larger_term
    own = _find_own_values(name, values)
    first = remove_interface_number(name)
    if first in LARGER_TERM_FUNCTIONS:
        return LARGER_TERM_FUNCTIONS[first](own)
    return {"1": 1.0, "pi": np.pi}.get(term, np.abs(own.get(term, 0.0)))


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
