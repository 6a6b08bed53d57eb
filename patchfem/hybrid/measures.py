"""Measures of the windows of many cases, from what the engine records.

Names and definitions are those of `response.rows`. All arrays have a leading axis of cases; a value without a meaning is
NaN.
"""

import numpy as np

from ..friction import path_work
from .records import (
    N_FACE_INTEGRALS,
    N_INTEGRALS,
    Clock,
    Cycle,
    Face,
    Mode,
    Record,
    Rig,
    Setting,
    State,
    Whole,
    Window,
)

MIN_ENERGY = (
    1e-6  # imbalance that counts as round-off, relative to the energy of the smallest speed
)
MIN_ACCELERATION = 1e-9  # first harmonic [m s-2] below which there is no distortion
FULL_STICK = 1e-12  # fraction by which a time of stick may miss the whole window
FACE_MEASURES = ("slip_amplitude", "stick_fraction", "friction_force_peak", "loop_area")


def compute_measures(
    rigs: Rig, states: State, records: Record, window: int, first, **model
) -> dict[str, np.ndarray]:
    """Return the measures of a window as arrays (c,) by name.

    Parameters
    ----------
    rigs, states, records
        Arrays of a batch after a run.
    window : int
        Number of the window.
    first : (c, n) array
        States at the start.
    **model
        `n_friction`: number of friction interfaces; `stiffness` (c,): of the first mode at the contact [N/m], 0 if
        unknown.
    """
    settings = rigs.settings
    period = settings[:, Setting.PERIOD]
    whole = records.whole[:, window]
    span = whole[:, Whole.SPAN]
    has_cycle = span > period * (1 - 1e-6)
    harmonic_1 = np.hypot(whole[:, Whole.COS_1], whole[:, Whole.SIN_1]) * 2 / span
    harmonic_3 = np.hypot(whole[:, Whole.COS_3], whole[:, Whole.SIN_3]) * 2 / span
    values = {
        "relative_displacement_amplitude": (whole[:, Whole.MAX] - whole[:, Whole.MIN]) / 2,
        "absolute_acceleration_peak": np.maximum(
            whole[:, Whole.MAX_ACCELERATION], -whole[:, Whole.MIN_ACCELERATION]
        ),
        "absolute_acceleration_fundamental": np.where(has_cycle, harmonic_1, np.nan),
        "acceleration_distortion": np.where(
            has_cycle & (harmonic_1 > MIN_ACCELERATION), harmonic_3 / harmonic_1, np.nan
        ),
    }
    values |= _compute_energies(rigs, states, first, model["n_friction"])
    if not model["n_friction"]:
        return values

    # Measures of every interface; those of further ones carry its number.
    for i in range(model["n_friction"]):
        row = records.faces[:, window, i]
        suffix = f"_{i + 1}" if i else ""
        stuck = row[:, Window.STUCK]
        # A reversal without stick takes a time of the size of round-off.
        stuck = np.where(stuck <= span * FULL_STICK, 0.0, stuck)
        found = (
            (row[:, Window.MAX_SLIP] - row[:, Window.MIN_SLIP]) / 2,
            np.where(stuck >= span * (1 - FULL_STICK), 1.0, stuck / span),
            np.maximum(row[:, Window.MAX_FORCE], -row[:, Window.MIN_FORCE]),
            np.where(has_cycle, row[:, Window.WORK] * period / span, np.nan),
        )
        values |= {name + suffix: value for name, value in zip(FACE_MEASURES, found)}

    # Measures of the first interface alone.
    row = records.faces[:, window, 0]
    values["slip_start_phase"] = path_work.mean_slip_phase(
        row[:, Window.STARTS], row[:, Window.COS_START], row[:, Window.SIN_START]
    )
    if (rigs.faces[:, 0, Face.SWING] != 0).any() or (rigs.faces[:, 0, Face.STIFFNESS] != 0).any():
        values["normal_load_least"] = row[:, Window.MIN_LOAD]
        values["normal_load_peak"] = row[:, Window.MAX_LOAD]
        values["open_fraction"] = row[:, Window.OPEN] / span
    loop = _compute_loop(rigs, records, window, span, values, model["stiffness"])
    return values | {name: np.where(has_cycle, value, np.nan) for name, value in loop.items()}


def _compute_energies(rigs, states, first, n_friction: int) -> dict[str, np.ndarray]:
    """Return the energies [J] of the whole run and the relative error of their balance."""
    n_faces = rigs.faces.shape[1]
    n = rigs.modes.shape[2]
    y = states.y
    integrals = y.shape[1] - N_INTEGRALS - N_FACE_INTEGRALS * n_faces
    faces = y[:, integrals : y.shape[1] - N_INTEGRALS].reshape(len(y), n_faces, N_FACE_INTEGRALS)

    def find_stored(state):
        """Return the energy (c,) of the modes [J]."""
        squares = state[:, n : 2 * n] ** 2 + rigs.modes[:, Mode.STIFFNESS] * state[:, :n] ** 2
        return 0.5 * rigs.settings[:, Setting.MASS] * squares.sum(axis=1)

    work = faces[:, :n_friction, 0].sum(axis=1)
    loss = faces[:, :n_friction, 2].sum(axis=1)
    values = {"friction_work": work, "energy_dissipated": loss, "energy_stored": work - loss}
    is_bench = rigs.settings[:, Setting.IS_BENCH] > 0
    if is_bench.any():
        return values
    gap = y[:, -4] + find_stored(first) - find_stored(y) - y[:, -3] - faces[..., 0].sum(axis=1)
    size = states.clock[:, Clock.EXCHANGED] + states.clock[:, Clock.STORED]
    min_gap = MIN_ENERGY * rigs.settings[:, Setting.MASS] * rigs.scales[:, n] ** 2
    gap = np.where(np.abs(gap) > min_gap, np.abs(gap), 0.0)
    return values | {"energy_balance": np.divide(gap, size, out=np.zeros_like(gap), where=size > 0)}


def _compute_loop(
    rigs, records, window: int, span, values: dict[str, np.ndarray], stiffness
) -> dict[str, np.ndarray]:
    """Return stiffness, damping and drift of the first interface, from its cycles in a window."""
    row = records.faces[:, window, 0]
    slide = row[:, Window.SLIDE_COS] - 1j * row[:, Window.SLIDE_SIN]
    force = row[:, Window.FORCE_COS] - 1j * row[:, Window.FORCE_SIN]

    # Ranges and forces at the reversals of every cycle.
    numbers = np.flatnonzero(records.cycles[0, :, Cycle.WINDOW] == window)
    cycles = records.cycles[:, numbers]
    ranges = cycles[..., Cycle.MAX_SLIDE] - cycles[..., Cycle.MIN_SLIDE]
    jumps = cycles[..., Cycle.FORCE_AT_MAX] - cycles[..., Cycle.FORCE_AT_MIN]
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = jumps / ranges
        count = np.isfinite(slopes).sum(axis=1)
        secant = np.where(np.isfinite(slopes), slopes, 0.0).sum(axis=1) / count
        half_range = ranges.mean(axis=1) / 2
        damping = values["loop_area"] / (2 * np.pi * stiffness * half_range**2)
        found = {
            "equivalent_stiffness": (force / slide).real,
            "harmonic_force_ratio": np.abs(force / slide),
            "secant_stiffness": secant,
            "equivalent_damping": np.where(stiffness > 0, damping, np.nan),
        }
    if numbers.size > 1:
        means = cycles[..., Cycle.SLIDE] / rigs.settings[:, Setting.PERIOD, None]
        found["drift_per_cycle"] = (means[:, -1] - means[:, 0]) / (numbers.size - 1)
    return found
