"""Measures of the window of a case, and energies of its run, from what the engine records.

Names and definitions are those of `measures.rows`. A value without a meaning is NaN.
"""

import numpy as np

from ..motion_measures import Observations, energy_balance, measure_acceleration, measure_interface
from .cases import Case
from .laws import LAWS
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

# Measures of every interface; those of further ones carry its number. Other measures are those of the first one alone.
INTERFACE_MEASURES = ("slip_amplitude", "stick_fraction", "friction_force_peak", "loop_area")


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
    span = state.clock[Clock.SPAN]
    # Extremes of a window that the run has not reached have no value, nor have sums over less than a cycle.
    extremes = np.where(np.isinf(record.extremes), np.nan, record.extremes)
    whole = 1.0 if span > period * (1 - 1e-6) else np.nan
    cosines = record.integrals[:, [Integral.COS_1, Integral.COS_3]]
    sines = record.integrals[:, [Integral.SIN_1, Integral.SIN_3]]
    harmonics = whole * (cosines - 1j * sines)
    values = {
        "relative_displacement_amplitude": np.ptp(extremes[Probe.GAUGE]) / 2,
        "absolute_acceleration_peak": np.abs(extremes[Probe.ACCELERATION]).max(),
        **measure_acceleration(*harmonics[Probe.ACCELERATION], span),
        **_compute_work(case, state),
    }
    count = case.n_friction
    if not count:
        return values

    # A row for each interface, with an entry for each of its quantities.
    faces = extremes[Probe.FACES :].reshape(-1, Probe.COUNT, 2)[:count]
    phasors = harmonics[Probe.FACES :, 0].reshape(-1, Probe.COUNT)[:count]
    work = split_integrals(case, state.y) - split_integrals(case, state.rows[WINDOW_START])
    windows = record.faces[:count].T
    cycles = record.cycles[record.cycles[:, Cycle.WINDOW] >= 0]
    loads = faces[:, Probe.LOAD, Extreme.MAX]
    limits = find_force_limits(case.rig.faces[:count], loads)[:, None]
    observations = Observations(
        span=span,
        period=period,
        force=np.clip(faces[:, Probe.FORCE], -limits, limits),
        slip=faces[:, Probe.SLIP],
        stick=windows[[Window.STUCK, Window.STARTS, Window.COS_START, Window.SIN_START]],
        work=whole * work[:count, 0],
        harmonics=phasors[:, [Probe.SLIDE, Probe.FORCE]].T,
        cycles=whole * cycles[None, :, Cycle.SLIDE : Cycle.FORCE_AT_MAX + 1],
    )
    for name, column in measure_interface(observations, case.first_stiffness).items():
        for i, value in enumerate(column if name in INTERFACE_MEASURES else column[:1]):
            values[f"{name}_{i + 1}" if i else name] = value

    if case.rig.faces[0, Face.SWING] or case.rig.faces[0, Face.STIFFNESS]:
        values["normal_load_least"] = faces[0, Probe.LOAD, Extreme.MIN]
        values["normal_load_peak"] = faces[0, Probe.LOAD, Extreme.MAX]
        values["open_fraction"] = windows[Window.OPEN, 0] / span
    return values


def find_force_limits(faces, loads) -> np.ndarray:
    """Return the largest friction forces (i,) [N] of interfaces whose state approaches its limit; inf of other laws.

    The force of bonds that all break approaches its limit faster than a step takes, so that the steps of the state, which
    are stable only just, pass the limit by more than their tolerance.

    Parameters
    ----------
    faces : (i, k) ndarray
        Rows `records.Face` of the interfaces.
    loads : (i,) ndarray
        Largest normal loads [N].
    """
    limits = np.full(len(faces), np.inf)
    is_bonded = faces[:, Face.LAW] == LAWS.index("bonds")
    if is_bonded.any():
        static, length, last_length = faces[is_bonded, Face.NUMBERS : Face.NUMBERS + 3].T
        limits[is_bonded] = static * np.maximum(last_length / length, 1.0) * loads[is_bonded]
    return limits


def split_integrals(case: Case, y) -> np.ndarray:
    """Return friction work [J], irreversible slide [m] and loss [J] (..., M, 3) of the interfaces in states y (..., n)."""
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
    values = {"friction_work": work, "energy_dissipated": loss}
    if settings[Setting.IS_BENCH]:
        # A bench starts without a stretch.
        return values | {"energy_stored": work - loss}
    n = case.rig.modes.shape[1]
    # Imbalance that counts as round-off, relative to the energy of the smallest speed
    round_off = 1e-6 * settings[Setting.MASS] * case.rig.scales[n] ** 2
    return values | {"energy_balance": energy_balance(compute_energies(case, state), round_off)}
