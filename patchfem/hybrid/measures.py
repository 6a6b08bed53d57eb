"""Measures of the window of a case, and energies of its run, from what the engine records.

Names and definitions are those of `response.rows`. A value without a meaning is NaN.
"""

import numpy as np

from ..friction import path_work
from .cases import Case
from .records import (
    N_FACE_INTEGRALS,
    N_INTEGRALS,
    WINDOW_START,
    Clock,
    Cycle,
    Extreme,
    Face,
    Integral,
    Mode,
    Probe,
    Record,
    Setting,
    State,
    Tail,
    Window,
)

MIN_ENERGY = (
    1e-6  # imbalance that counts as round-off, relative to the energy of the smallest speed
)
MIN_ACCELERATION = 1e-9  # first harmonic [m s-2] below which there is no distortion
FULL_STICK = 1e-12  # fraction by which a time of stick may miss the whole window


def compute_measures(case: Case, state: State, record: Record) -> dict[str, float]:
    """Return the measures of the window and of the whole run by name.

    Parameters
    ----------
    case : Case
        Case with the state at its start.
    state : State
        State at the end.
    record : Record
        What the run recorded.
    """
    period = case.rig.settings[Setting.PERIOD]
    # Extremes of a window that the run has not reached have no value.
    extremes = np.where(np.isinf(record.extremes), np.nan, record.extremes)
    half_ranges = (extremes[:, Extreme.MAX] - extremes[:, Extreme.MIN]) / 2
    peaks = np.maximum(extremes[:, Extreme.MAX], -extremes[:, Extreme.MIN])
    span = state.clock[Clock.SPAN]
    has_cycle = span > period * (1 - 1e-6)
    harmonic_1 = harmonic_3 = np.nan
    if has_cycle:
        row = record.integrals[Probe.ACCELERATION]
        harmonic_1 = np.hypot(row[Integral.COS_1], row[Integral.SIN_1]) * 2 / span
        harmonic_3 = np.hypot(row[Integral.COS_3], row[Integral.SIN_3]) * 2 / span
    distortion = harmonic_3 / harmonic_1 if harmonic_1 > MIN_ACCELERATION else np.nan
    values = {
        "relative_displacement_amplitude": half_ranges[Probe.GAUGE],
        "absolute_acceleration_peak": peaks[Probe.ACCELERATION],
        "absolute_acceleration_fundamental": harmonic_1,
        "acceleration_distortion": distortion,
    }
    values |= _compute_work(case, state)
    if not case.n_friction:
        return values

    # Measures of every interface; those of further ones carry its number.
    work = (split_integrals(case, state.y) - split_integrals(case, state.rows[WINDOW_START]))[:, 0]
    for i, row in enumerate(record.faces[: case.n_friction]):
        first = Probe.FACES + Probe.COUNT * i
        suffix = f"_{i + 1}" if i else ""
        # A reversal without stick takes a time of the size of round-off.
        stuck = row[Window.STUCK] / span
        if min(abs(stuck), abs(stuck - 1)) <= FULL_STICK:
            stuck = round(stuck)
        values |= {
            f"slip_amplitude{suffix}": half_ranges[first + Probe.SLIP],
            f"stick_fraction{suffix}": stuck,
            f"friction_force_peak{suffix}": peaks[first + Probe.FORCE],
            f"loop_area{suffix}": work[i] * period / span if has_cycle else np.nan,
        }

    # Measures of the first interface alone.
    row = record.faces[0]
    values["slip_start_phase"] = path_work.mean_slip_phase(
        row[Window.STARTS], row[Window.COS_START], row[Window.SIN_START]
    )
    if case.rig.faces[0, Face.SWING] or case.rig.faces[0, Face.STIFFNESS]:
        loads = extremes[Probe.FACES + Probe.LOAD]
        values["normal_load_least"] = loads[Extreme.MIN]
        values["normal_load_peak"] = loads[Extreme.MAX]
        values["open_fraction"] = row[Window.OPEN] / span
    loop = _compute_loop(case, record, values["loop_area"])
    return values | (loop if has_cycle else dict.fromkeys(loop, np.nan))


def split_integrals(case: Case, y) -> np.ndarray:
    """Return friction work [J], path of slip [m] and loss [J] (..., M, 3) of the interfaces in states y (..., n)."""
    count = N_FACE_INTEGRALS * case.rig.faces.shape[0]
    y = y[..., y.shape[-1] - N_INTEGRALS - count : y.shape[-1] - N_INTEGRALS]
    return y.reshape(*y.shape[:-1], -1, N_FACE_INTEGRALS)


def compute_energies(case: Case, state: State) -> dict[str, float]:
    """Return the energies [J] of the whole motion.

    - "work_in", "power": work of the drive and the sum of its magnitudes over the steps
    - "viscous", "friction": energies that dampers and friction dissipate
    - "stored", "peak_stored": change of the stored energy, and the largest energy of the modes
    """
    work, _, loss = split_integrals(case, state.y).T
    change = _find_modal_energy(case, state.y) - _find_modal_energy(case, case.y)
    return {
        "work_in": float(state.y[Tail.WORK]),
        "viscous": float(state.y[Tail.LOSS]),
        "power": float(state.clock[Clock.EXCHANGED]),
        "friction": float(loss.sum()),
        "stored": float(change + (work - loss).sum()),
        "peak_stored": float(state.clock[Clock.STORED]),
    }


def _find_modal_energy(case: Case, y) -> float:
    """Return the energy of the modes [J] in a state."""
    n = case.rig.modes.shape[1]
    squares = y[n : 2 * n] ** 2 + case.rig.modes[Mode.STIFFNESS] * y[:n] ** 2
    return 0.5 * case.rig.settings[Setting.MASS] * float(squares.sum())


def _compute_work(case: Case, state: State) -> dict[str, float]:
    """Return the works of friction [J] in the whole run, and the relative error of the energy balance."""
    settings = case.rig.settings
    work, _, loss = split_integrals(case, state.y)[: case.n_friction].sum(axis=0)
    values = {"friction_work": work, "energy_dissipated": loss, "energy_stored": work - loss}
    if settings[Setting.IS_BENCH]:
        return values
    energies = compute_energies(case, state)
    gap = abs(energies["work_in"] - energies["viscous"] - energies["friction"] - energies["stored"])
    size = energies["power"] + energies["peak_stored"]
    n = case.rig.modes.shape[1]
    if gap <= MIN_ENERGY * settings[Setting.MASS] * case.rig.scales[n] ** 2 or size == 0:
        gap = 0.0
    return values | {"energy_balance": gap / (size or 1.0)}


def _compute_loop(case: Case, record: Record, loop_area: float) -> dict[str, float]:
    """Return stiffness, damping and drift of the first interface, from its cycles in the window.

    Parameters
    ----------
    case : Case
        The case, with the stiffness to which damping refers.
    record : Record
        What the run recorded.
    loop_area : float
        Friction work per cycle [J].
    """
    phasors = record.integrals[:, Integral.COS_1] - 1j * record.integrals[:, Integral.SIN_1]
    slide = phasors[Probe.FACES + Probe.SLIDE]
    force = phasors[Probe.FACES + Probe.FORCE]

    # Ranges and forces at the reversals of every cycle.
    cycles = record.cycles[record.cycles[:, Cycle.WINDOW] >= 0]
    ranges = cycles[:, Cycle.MAX_SLIDE] - cycles[:, Cycle.MIN_SLIDE]
    slopes = (cycles[:, Cycle.FORCE_AT_MAX] - cycles[:, Cycle.FORCE_AT_MIN]) / ranges
    slopes = slopes[np.isfinite(slopes)]
    half_range = ranges.mean() / 2
    damping = np.nan
    if case.first_stiffness > 0:
        damping = loop_area / (2 * np.pi * case.first_stiffness * half_range**2)
    values = {
        "equivalent_stiffness": (force / slide).real,
        "harmonic_force_ratio": abs(force / slide),
        "secant_stiffness": slopes.mean() if slopes.size else np.nan,
        "equivalent_damping": damping,
    }
    if len(cycles) > 1:
        means = cycles[:, Cycle.SLIDE] / case.rig.settings[Setting.PERIOD]
        values["drift_per_cycle"] = (means[-1] - means[0]) / (len(cycles) - 1)
    return values
