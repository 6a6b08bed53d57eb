"""Table of the measures of a motion, applied to the solutions of all engines alike.

In: a `LastCycles`, i.e. the last cycles of a run with the values that its engine integrated. Out:
values by name, and for any name its definition, floor and larger term. A row has a name, a
unit, the absolute floor of its error, a definition in one sentence, and the function that
computes it from a `LastCycles`. A new measure is a new row of SINGLE_RUN_ROWS.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..core import IntegratedMeasures, MeasureDefinition, Response
from ..structure import drive_sizes
from . import stationary
from .loops import (
    Reversal,
    find_reversals,
    interface_loop,
    mean_drift,
    mean_half_range,
    secant_stiffness,
)
from .measures import (
    MIN_SLIDE_RANGE,
    compute_acceleration_peak,
    compute_ledger_measures,
    compute_slip_measures,
    energy_balance,
    lateral_history,
    slip_start_measure,
)
from .spectrum import MIN_HARMONIC, harmonic_measures, odd_harmonics


@dataclass(frozen=True, eq=False)
class LastCycles:
    """Last cycles of a run, from which the measures are evaluated.

    - window: histories.
    - drive: drive of the run.
    - extremes (c, 2): smallest and largest output in every cycle of the window [m].
    - book: energies of the whole run by name [J].
    - load: normal load [N]; None without friction.
    - stiffness: K of the first mode as seen by the contact [N/m]; 0 if no damping ratio refers to
      it.
    - sine: whether the drive is sinusoidal at the end of the run.
    - integrated: measures that the engine integrated itself.
    - loop: first harmonics of slide [m] and force [N] and work per cycle [J], if they do not come
      from `integrated`; None if the window contains no whole cycle.
    - ledger (4, k): friction work and energies [J], or None.
    - by: how the force at a reversal of the slide is evaluated (see `loops.find_reversals`).
    - still: half range of the slide [m] up to which it is round-off.
    - even: equally spaced samples of the window; None if its own samples are.
    - inside: function (window, number) that returns the window of an interface with samples inside
      the steps; None if those at the ends of the steps suffice.
    - together: whether the interfaces are parts of a single one, so that there are no others.
    - number: index of the interface.
    - run: histories of the whole run from t = 0, at equally spaced samples and every reversal; None
      if they are not kept.
    """

    window: Response
    drive: object
    extremes: np.ndarray
    book: dict
    load: float | None
    stiffness: float
    sine: bool
    integrated: IntegratedMeasures = field(default_factory=IntegratedMeasures)
    loop: tuple | None = None
    ledger: np.ndarray | None = None
    by: str = "rate"
    still: float = 0.0
    even: Response | None = None
    inside: Callable | None = None
    together: bool = False
    number: int = 0
    run: Response | None = None

    @cached_property
    def span(self) -> float:
        """Duration of the window [s]."""
        return self.window.time[-1] - self.window.time[0]

    @cached_property
    def samples(self) -> Response:
        """Samples of the window, with samples inside the time steps if the engine has them."""
        return self.window if self.inside is None else self.inside(self.window, self.number)

    @cached_property
    def has_full_cycle(self) -> bool:
        """Whether the window contains complete cycles of the drive."""
        return drive_sizes.has_full_cycle(self.span, self.drive)

    @cached_property
    def slip(self) -> dict:
        """Slip amplitude [m], stick fraction [1] and phase of the slip start [rad] as a dict."""
        if self.load is None:
            return {}
        first = self.integrated.loops[0] if self.integrated.loops else None
        if first is None or first.stuck_time is None:
            window = self.even or self.samples
            steps = max(1, round((window.time.size - 1) * self.drive.period / self.span))
            found = compute_slip_measures(
                window,
                self.drive,
                steps,
                [lateral_history(window, one, self.number) for one in ("slides", "slips")],
            )
        else:
            starts = self.integrated.slip_start_phases
            found = {"stick_fraction": stick_fraction(first.stuck_time, self.span)} | (
                {} if starts is None else slip_start_measure(np.asarray(starts))
            )
        found |= {} if first is None else {"slip_amplitude": first.slip_range / 2}
        return found if self.sine else {k: v for k, v in found.items() if k != "slip_start_phase"}

    @cached_property
    def turns(self) -> list:
        """Smallest and largest `Reversal` of the displacement in every complete cycle."""
        if self.integrated.reversals:
            return [tuple(Reversal(*one) for one in pair) for pair in self.integrated.reversals]
        w = self.samples
        return find_reversals(w.time, w.slide, w.slide_rate, w.force, self.drive.period, self.by)

    @cached_property
    def harmonics(self) -> tuple | None:
        """First harmonics of displacement and force, and work per cycle [J].

        It is None without a complete cycle.
        """
        if self.loop is not None or not self.integrated.loops or not self.has_full_cycle:
            return self.loop
        first = self.integrated.loops[0]
        return (
            first.displacement_harmonic,
            first.force_harmonic,
            first.work * self.drive.period / self.span,
        )

    @cached_property
    def cycle(self) -> dict:
        """Measures of the friction loop as a dict, empty without friction or a complete cycle.

        loop_area [J]; under sinusoidal drive also equivalent_stiffness and secant_stiffness [N/m]
        and equivalent_damping [1].
        """
        if self.harmonics is None or self.load is None:
            return {}
        moves = (
            self.sine
            and self.lateral("slides") is None
            and np.ptp(self.window.slide) > max(2 * self.still, MIN_SLIDE_RANGE)
        )
        if not moves:
            return interface_loop(0.0, *self.harmonics, self.stiffness)
        found = interface_loop(mean_half_range(self.turns), *self.harmonics, self.stiffness)
        return found | {"secant_stiffness": secant_stiffness(self.turns)}

    @cached_property
    def waves(self) -> dict:
        """Harmonics of the acceleration as a dict, empty unless the drive ends as a sinusoid.

        absolute_acceleration_fundamental [m s-2] and, if there is an acceleration,
        acceleration_distortion [1].
        """
        if not (self.sine and self.has_full_cycle):
            return {}
        if self.integrated.acceleration_harmonics is None:
            return harmonic_measures(*odd_harmonics(self.window, self.drive))
        return harmonic_measures(
            *self.integrated.acceleration_harmonics, drive_sizes.find_max_acceleration(self.drive)
        )

    @cached_property
    def energies(self) -> dict:
        """Work and energies [J] at the end of the run as a dict, empty if they are not recorded."""
        return {} if self.ledger is None else compute_ledger_measures(self.ledger)

    @cached_property
    def random_response_measures(self) -> dict:
        """Measures of the response to a stationary random drive as a dict."""
        if not hasattr(self.drive, "band"):
            return {}
        found = stationary.random_response_measures(self.window, self.drive)
        if self.load is None:
            names = [name for name in found if name.startswith("friction_power")]
            for name in names:
                del found[name]
        return found

    def further_interfaces(self) -> list:
        """Return the LastCycles of each interface after the first one.

        The work of an interface comes from `integrated.loops` or, without them, from the samples.
        """
        extra = self.window.extra
        if self.load is None or self.together or "slides" not in extra:
            return []
        slips = extra.get("slips", extra["slides"])
        count = extra["slides"].shape[1]
        out = []
        for k in range(1, count):
            window = replace(
                self.window,
                slide=extra["slides"][:, k],
                slide_rate=extra["slide_rates"][:, k],
                force=extra["forces"][:, k],
                slip=slips[:, k],
            )
            loops = self.integrated.loops[k : k + 1]
            work = loops[0].work if loops else float(np.trapezoid(window.force, window.slide))
            if not loops:
                work += lateral_work(self.window, k)
            out.append(
                replace(
                    self,
                    window=window,
                    integrated=IntegratedMeasures(loops=loops),
                    sine=False,
                    number=k,
                    loop=(0j, 0j, work * self.drive.period / max(self.span, 1e-300)),
                )
            )
        return out

    def lateral(self, name: str):
        """Return a history of the interface in the direction perpendicular to sliding."""
        return lateral_history(self.window, name, self.number)

    def evaluate_load(self, value: Callable) -> float | None:
        """Apply a function to the history of the normal load (k,) [N]; None if it is constant.

        value: function of the load history in the window.
        """
        load = self.window.extra.get("normal_load")
        return None if load is None or self.load is None else float(value(load))


def lateral_work(window, number: int) -> float:
    """Return the friction work [J] in a window due to motion perpendicular to the drive.

    The trapezoidal rule is used; the work is 0 if the interface slides along a line.
    """
    force, slide = (lateral_history(window, name, number) for name in ("forces", "slides"))
    return 0.0 if force is None or slide is None else float(np.trapezoid(force, slide))


def resultant_peak(force, across) -> float:
    """Return the largest magnitude [N] of a force or of its resultant with a lateral force."""
    return float((np.abs(force) if across is None else np.hypot(force, across)).max())


def compute_drift(s: LastCycles) -> float:
    """Return the drift of the relative displacement per cycle [m] of an interface.

    If the interface slides in a plane, it is the magnitude of the drift vector.
    """
    w = s.window
    across = s.lateral("slides")
    drift_along = mean_drift(w.time, w.slide, w.slide_rate, s.drive.period)
    if across is None:
        return drift_along
    return float(
        np.hypot(
            drift_along,
            mean_drift(w.time, across, w.extra["lateral_slide_rates"][:, s.number], s.drive.period),
        )
    )


def first_harmonic(values: dict):
    """Return the ratio [N/m] of the first harmonics of friction force and displacement.

    The part in phase is the equivalent stiffness; the other part is W/(pi A^2), often many times as
    large. values: measures of one run, or (n,) of many.
    """
    in_phase = np.abs(values["equivalent_stiffness"])
    slip_amplitude = np.asarray(values.get("slip_amplitude", 0.0), float)
    with np.errstate(all="ignore"):
        quadrature = np.where(
            slip_amplitude > 0, values.get("loop_area", 0.0) / (np.pi * slip_amplitude**2), 0.0
        )
    return np.hypot(in_phase, np.nan_to_num(quadrature))


def _drift_scale(values: dict):
    """Return the amplitude [m] with which the drift of an interface is compared.

    It is the amplitude of the slip; without slip, that of the motion. values: as in
    `first_harmonic`.
    """
    slip = np.abs(np.nan_to_num(np.asarray(values.get("slip_amplitude", 0.0), float)))
    return np.where(slip > 0, slip, np.abs(values.get("relative_displacement_amplitude", 0.0)))


def _random_rows(name: str, unit: str, floor: float, words: str, group: str = "motion") -> tuple:
    """Return the definitions of a measure under random drive and of its statistical scatter."""
    scatter = f"{name}_scatter"
    return (
        MeasureDefinition(
            name, unit, floor, words, lambda s: s.random_response_measures.get(name), group=group
        ),
        MeasureDefinition(
            scatter,
            unit,
            floor,
            f"half-width of the 95 % interval of {name}: the scatter between "
            "random drives of the same length with different seeds",
            lambda s: s.random_response_measures.get(scatter),
            group=group,
            larger_term=(name, lambda values: np.abs(values.get(name, 0.0))),
        ),
    )


# This table has measures that only single runs compute. If there are any, a sweep runs each case of
# a rig by itself, because its batches compute only the shipped measures.
SINGLE_RUN_ROWS: tuple[MeasureDefinition, ...] = ()
CUBIC_CONVERGENCE_ORDER = 4.0  # Convergence order of a value on cubics between samples.
ROWS = (
    MeasureDefinition(
        "relative_displacement_amplitude",
        "m",
        1e-10,
        "half the peak-to-peak displacement at the output, relative to "
        "the base; of a release, that of the last whole cycle of the "
        "motion, from a reversal to the second reversal after it",
        lambda s: float(s.extremes[:, 1].max() - s.extremes[:, 0].min()) / 2,
    ),
    MeasureDefinition(
        "absolute_acceleration_peak",
        "m s-2",
        1e-4,
        "largest acceleration at the output, base motion included",
        lambda s: compute_acceleration_peak(s.window),
    ),
    MeasureDefinition(
        "friction_force_peak",
        "N",
        1e-6,
        "largest friction force on the whole interface, of a bench during the whole "
        "run; if the interface slides in a plane, the largest resultant of both directions",
        lambda s: (
            None
            if s.load is None
            else s.integrated.loops[0].max_force
            if s.integrated.loops
            else resultant_peak(s.samples.force, s.lateral("forces"))
        ),
        group="friction",
    ),
    MeasureDefinition(
        "energy_balance",
        "1",
        1e-8,
        "error of the energy balance over the run: work minus stored energy minus dissipated energy, divided by the "
        "sum of the exchanged energy and the largest stored energy",
        lambda s: energy_balance(s.book),
        group="energy",
        larger_term=("1", lambda _: 1.0),
    ),
    MeasureDefinition(
        "absolute_acceleration_fundamental",
        "m s-2",
        MIN_HARMONIC,
        "first harmonic of the acceleration at the output, base motion included",
        lambda s: s.waves.get("absolute_acceleration_fundamental"),
    ),
    MeasureDefinition(
        "acceleration_distortion",
        "1",
        1e-6,
        "third harmonic of the acceleration at the output, base motion included, divided by the first harmonic; null "
        "if the output does not move",
        lambda s: s.waves.get("acceleration_distortion"),
    ),
    MeasureDefinition(
        "drift_per_cycle",
        "m",
        1e-11,
        "drift of the slide per cycle: (mean slide over the last cycle of the window - mean slide over the "
        "first cycle of the window)/(number of cycles between these two cycles); if the interface slides in a plane, "
        "the length of this vector; null if the drive is not periodic at the end of the run",
        compute_drift,
        larger_term=("slip amplitude (without slip: amplitude of the motion)", _drift_scale),
        order=CUBIC_CONVERGENCE_ORDER,
    ),
    MeasureDefinition(
        "slip_amplitude",
        "m",
        1e-10,
        "half the peak-to-peak value of the irreversible part of the slide; for a patch, the mean over its points, "
        "weighted by the pressure; for law 'iwan', the mean over the sliders, weighted by their slip forces; if the "
        "interface slides in a plane, half the largest distance between two points of the path of irreversible slide",
        lambda s: s.slip.get("slip_amplitude"),
        group="friction",
    ),
    MeasureDefinition(
        "stick_fraction",
        "1",
        1e-3,
        "fraction of the time of the last cycles during which the interface as a whole sticks; the interface sticks "
        "as a "
        "whole while more than half of the change of the slide (weighted as in `slip_amplitude`) is elastic; part of a "
        "patch, or some sliders of law 'iwan', may slip during this time",
        lambda s: s.slip.get("stick_fraction"),
        0.35,
        group="friction",
        larger_term=("1", lambda _: 1.0),
    ),
    MeasureDefinition(
        "slip_start_phase",
        "rad",
        1e-3,
        "phase of the drive (of the base displacement, or of the force) at which slip starts after stick, modulo pi; "
        "slip is the weighted mean defined under `slip_amplitude`; the phase is printed in degrees; null if slip "
        "starts at different phases of a half cycle",
        lambda s: s.slip.get("slip_start_phase"),
        1.0,
        group="friction",
        larger_term=("pi", lambda _: np.pi),
    ),
    MeasureDefinition(
        "normal_load",
        "N",
        0.0,
        "normal load on the interface, summed over all equal patches (key `pairs`)",
        lambda s: s.load,
        group="friction",
    ),
    MeasureDefinition(
        "loop_area",
        "J",
        1e-10,
        "friction work per cycle in this interface alone (the energy dissipated, if the loop closes), in both "
        "directions if the interface slides in a plane; null if the drive is not periodic and the friction loop does "
        "not close, because the interface then stores or returns more energy than it dissipates",
        lambda s: s.cycle.get("loop_area"),
        group="energy",
    ),
    MeasureDefinition(
        "equivalent_stiffness",
        "N m-1",
        1.0,
        "part of the first harmonic of the friction force that is in phase with the slide, divided by the first "
        "harmonic of the slide; negative if friction keeps the spring of the structure deflected during stick",
        lambda s: s.cycle.get("equivalent_stiffness"),
        group="friction",
        larger_term=("magnitude of the complex ratio of the two first harmonics", first_harmonic),
    ),
    MeasureDefinition(
        "secant_stiffness",
        "N m-1",
        1.0,
        "friction force at the largest slide of a cycle minus friction force at the smallest slide, divided by the "
        "range of the slide; if the force jumps at the largest or the smallest slide, the mean of the forces "
        "before and after the jump is used; null if rigid friction sticks there, where the force takes many values",
        lambda s: s.cycle.get("secant_stiffness"),
        group="friction",
        order=CUBIC_CONVERGENCE_ORDER,
    ),
    MeasureDefinition(
        "equivalent_damping",
        "1",
        1e-8,
        "equivalent damping ratio of friction in the first mode that is not rigid, averaged over the last cycles: "
        "loop_area/(2 pi K A^2), where K = moving_mass omega_1^2 and A = (half the range of the slide in a "
        "cycle)/(value of the key `slide` of this mode); null if other modes contribute more than 5 % of the slide",
        lambda s: s.cycle.get("equivalent_damping"),
        group="friction",
        order=CUBIC_CONVERGENCE_ORDER,
    ),
    MeasureDefinition(
        "friction_work",
        "J",
        1e-10,
        "work done on all interfaces together over the whole run; with method `harmonic`, "
        "over two cycles",
        lambda s: s.energies.get("friction_work"),
        group="energy",
    ),
    MeasureDefinition(
        "energy_stored",
        "J",
        1e-10,
        "energy stored in all interfaces at the end of the run: elastic energy and, with "
        "grooves, the potential energy of the load",
        group="energy",
    ),
    MeasureDefinition(
        "energy_dissipated",
        "J",
        1e-10,
        "energy dissipated by friction in all interfaces over the whole run; with "
        "method `harmonic`, over two cycles",
        lambda s: s.energies.get("energy_dissipated"),
        group="energy",
    ),
    MeasureDefinition(
        "energy_created",
        "J",
        1e-10,
        "energy created over the whole run by a law that is not passive, such as equation 2.17 as printed in the "
        "report; with method `harmonic`, over two cycles",
        lambda s: s.energies.get("energy_created"),
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
        larger_term=("1", lambda _: 1.0),
    ),
    MeasureDefinition(
        "relative_displacement_amplitude_steady",
        "m",
        1e-10,
        "steady amplitude under a periodic drive, extrapolated if the motion has not settled or may still change by "
        "more than 0.02 tolerance × amplitude; absent if it has settled and cannot change by more; null if the motion "
        "has not settled and its limit cannot be extrapolated",
    ),
    MeasureDefinition(
        "peak_frequency",
        "Hz",
        0.0,
        "drive frequency, within the swept range, at which the curve of steady amplitudes "
        "is largest; a resonance unless it is an end of that range",
    ),
    MeasureDefinition(
        "friction_ratio_end",
        "1",
        1e-9,
        "friction force divided by normal load, both at the end of the slide",
        group="friction",
    ),
    MeasureDefinition(
        "friction_ratio_peak",
        "1",
        1e-9,
        "largest value of friction force divided by normal load during the whole run",
        group="friction",
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
    ),
    *_random_rows(
        "relative_displacement_rms",
        "m",
        1e-10,
        "root mean square displacement at the output about its mean, under a random drive",
    ),
    *_random_rows(
        "absolute_acceleration_rms",
        "m s-2",
        1e-4,
        "root mean square acceleration at the output, base motion included, under a random drive",
    ),
    *_random_rows(
        "response_frequency",
        "Hz",
        1e-3,
        "frequency of the largest peak of the frequency response (H1 estimate) "
        "under a random drive",
    ),
    *_random_rows(
        "response_damping",
        "1",
        1e-5,
        "damping ratio of the largest peak of the frequency response (H1 "
        "estimate), structure and friction together",
    ),
    *_random_rows(
        "friction_power",
        "W",
        1e-9,
        "mean power of friction under a random drive: friction work per second in "
        "all interfaces together",
        "energy",
    ),
    MeasureDefinition(
        "ring_frequency", "Hz", 1e-3, "frequency of the free vibration (ringing) during stick"
    ),
    MeasureDefinition(
        "ring_damping", "1", 1e-6, "damping ratio of the free vibration (ringing) during stick"
    ),
    MeasureDefinition(
        "onset_level",
        "m s-2",
        0.0,
        "drive level at the onset of slip, found by bisection between two levels; the key `drive.onset` defines what "
        "counts as the onset; for a force drive the level is in N",
        group="friction",
    ),
    MeasureDefinition(
        "jump_level",
        "m s-2",
        0.0,
        "drive level just after the largest jump of the amplitude; a step from one level to the next counts as a jump "
        "if the amplitude changes by at least 1.5 times the factor of the level; for a force drive the level is in N",
    ),
    MeasureDefinition(
        "level_hysteresis",
        "m",
        0.0,
        "hysteresis: largest difference between the amplitudes reached at the same level while the levels "
        "increase and while they decrease",
    ),
    *SINGLE_RUN_ROWS,
)
ROWS_NEEDING_RUN = tuple(row for row in ROWS if row.needs_run)
TABLE = {row.name: row for row in ROWS}
# These measures exist for every interface.
INTERFACE_MEASURES = (
    "slip_amplitude",
    "stick_fraction",
    "friction_force_peak",
    "loop_area",
)
DISPLACEMENT_MEASURES = (
    "relative_displacement_amplitude",
    "relative_displacement_amplitude_steady",
    "slip_amplitude",
    "drift_per_cycle",
)
# Largest floor of a displacement error relative to the displacement of the drive.
MAX_DISPLACEMENT_FLOOR = 1e-5


def compute_measures(last_cycles: LastCycles) -> dict:
    """Compute the measures of a run from its last cycles as a dict, in SI units.

    Measures without a value are left out. The INTERFACE_MEASURES are repeated for every further
    interface, with its number after the name. A value of the engine replaces the one computed from
    samples.
    """
    known = last_cycles.integrated.values
    out = {}
    for row in ROWS:
        if row.name in known:
            out[row.name] = known[row.name]
        elif row.function is not None and (last_cycles.run is not None or not row.needs_run):
            out[row.name] = row.function(last_cycles)
    for number, interface in enumerate(last_cycles.further_interfaces(), 1):
        for name in INTERFACE_MEASURES:
            out[add_interface_number(name, number)] = TABLE[name].function(interface)
    return {name: value for name, value in (out | known).items() if value is not None}


def stick_fraction(stuck, span):
    """Return the ratio of the stick time to a time span.

    A fraction that differs from 1 only by the round-off of the sum of its parts is set to 1.
    """
    return np.where(stuck >= span * (1 - 1e-12), 1.0, stuck / span)[()]


def remove_interface_number(name: str) -> str:
    """Remove the interface number from a measure name, such as "_2" of slip_amplitude_2."""
    head, _, number = name.rpartition("_")
    return head if number.isdigit() else name


def add_interface_number(name: str, number: int) -> str:
    """Append an interface number to the name of a measure, except for the first interface."""
    return f"{name}_{number + 1}" if number else name


def error_floor(name: str, size=np.inf):
    """Return the floor of the error of a measure of any interface, in its unit.

    The floor of a displacement is at most the fraction MAX_DISPLACEMENT_FLOOR of `size`.

    Parameters
    ----------
    name : str
    size : float or (n,)
        Displacement that the drive alone causes [m]; 0 or inf if no drive moves anything.
    """
    floor = find_definition(name).floor
    if remove_interface_number(name) not in DISPLACEMENT_MEASURES:
        return floor
    return np.where(
        np.greater(size, 0), np.minimum(floor, MAX_DISPLACEMENT_FLOOR * np.asarray(size)), floor
    )


def larger_term(name: str, values: dict):
    """Return the size of the terms whose difference a measure is, in its unit.

    Parameters
    ----------
    name : str
    values : dict
        Values by name of one run, or (n,) of many; those of the same interface are used.

    Returns
    -------
    float or (n,)
        0 if the measure is not a difference.
    """
    row = find_definition(name)
    number = name[len(remove_interface_number(name)) :]
    if row.larger_term is None:
        return 0.0
    own_values = {}
    for other_name, value in values.items():
        base_name = remove_interface_number(other_name)
        own_values[base_name] = values.get(base_name + number, value)
    return row.larger_term[1](own_values)


def set_final_floors(measures: dict, tolerance: float) -> dict:
    """Raise the error floors of measures that are differences of much larger terms."""
    values = {
        name: measure.value for name, measure in measures.items() if measure.value is not None
    }
    out = dict(measures)
    for name in values:
        if remove_interface_number(name) in TABLE:
            floor = tolerance * float(larger_term(name, values))
            if floor > measures[name].floor:
                out[name] = replace(measures[name], floor=floor)
    return out


def find_definition(name: str) -> MeasureDefinition:
    """Return the definition of a measure of any interface; KeyError for an unknown name."""
    return TABLE[remove_interface_number(name)]
