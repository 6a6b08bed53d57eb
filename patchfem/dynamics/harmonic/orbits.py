"""Periodic motions by time marching with extrapolation, and their Floquet multipliers.

A motion is marched, and every few cycles the limit of its states is extrapolated from their
differences: reduced rank extrapolation, which is exact if a perturbation decays linearly
(Sidi, J. Comput. Appl. Math. 36, 305, 1991). The memory of the contact adapts in the cycles
between. Elements that slip a little further in every cycle come to rest by themselves; after an
extrapolation that did not reduce the change per cycle, the next one is postponed.
"""

import numpy as np

from ..march.recording import make_mark, read_output_extremes

# Number of cycles before the first extrapolation.
N_FIRST_CYCLES = 6
# Number of cycles after an extrapolation in which the memory of the
# contact adapts to the new state.
N_MEMORY_CYCLES = 2
# Largest number of cycles that are integrated.
MAX_CYCLES = 600
# Largest ratio of the changes per cycle after and before a successful extrapolation; after a
# failure the waiting time doubles.
MAX_CHANGE_RATIO = 0.1
# Largest relative change of the state per cycle of a periodic motion.
PERIODIC_TOL = 1e-8
# Largest motion that counts as rest, relative to that of a free mass under the drive.
REST_RATIO = 1e-9
# Perturbation for the estimate of multipliers, relative to the largest state; it is far
# above round-off, yet nearly linear.
PERTURBATION_RATIO = 1e-6
# Number of cycles in which the memory of the contact adapts to a perturbation.
N_SETTLING_CYCLES = 2
# Number of cycles that are integrated after a perturbation.
N_PERTURBED_CYCLES = 8
# Smallest singular value of the perturbations above round-off, relative to the largest one.
MIN_SINGULAR_RATIO = 1e-3
# Perturbation, relative to its initial value, below which it has decayed.
MIN_PERTURBATION_RATIO = 1e-5


def march_to_periodic(run) -> float:
    """March a run until its motion is periodic; return the relative change over the last cycle.

    The change exceeds PERIODIC_TOL if no periodic motion is reached within MAX_CYCLES; `run.outcome` is set
    if the march ended early.
    """
    size = 2 * run.state.shape[1] + 2
    n_cycles = 0
    before = _scaled_state(run)
    min_size = (
        REST_RATIO
        * float(np.abs(run.drive.values(np.linspace(0, run.drive.period, 9))).max())
        / _fastest_rate(run) ** 2
    )
    min_size = max(min_size * _max_magnitude(run.modes.base), 1e-300)
    change = np.inf
    n_failures = 0
    n_waiting = 0
    while n_cycles < MAX_CYCLES and run.outcome is None:
        states = [before]
        for _ in range((N_FIRST_CYCLES if n_cycles == 0 else N_MEMORY_CYCLES) + size):
            run.march_cycle(run.prop.steps, 0, [])
            n_cycles += 1
            states.append(_scaled_state(run))
            if run.outcome is not None:
                break
        last = change
        change = _max_magnitude(states[-1] - states[-2]) / max(_max_magnitude(states[-1]), min_size)
        if change <= PERIODIC_TOL or run.outcome is not None:
            break
        if n_waiting == 0:  # judge the last extrapolation by the cycles since then
            n_failures = 0 if change < MAX_CHANGE_RATIO * last else n_failures + 1
            n_waiting = 2**n_failures
        n_waiting -= 1
        before = _extrapolate(states[-size:]) if n_waiting == 0 else None
        if before is None:
            before = states[-1]
        else:
            run.move_to(*_split_state(run, before))
    return float(change)


def march_cycle(run, frames: int = 0) -> tuple:
    """March a run over one more cycle; return its samples and the snapshots of the interface.

    The samples are a `Mark`, whose energies are those of this cycle.
    """
    run.reset_balance()
    snapshots = []
    cycle = run.march_cycle(run.prop.steps, frames, snapshots)
    run.check_steps()
    return make_mark(run, [cycle], read_output_extremes([cycle], run)), snapshots


def estimate_multipliers(run) -> np.ndarray:
    """Estimate the Floquet multipliers (2 n,) of a periodic motion by perturbed marches.

    They are in decreasing magnitude. Each march perturbs one number of the present state. In the first
    N_SETTLING_CYCLES the memory of the contact adapts; the map of a cycle is a least-squares
    fit to the following cycles. Memories that fade slowly bias the fit: no multiplier counts as larger
    than 1 unless the perturbation grew as much.
    """
    state = _scaled_state(run)
    runs = []
    perturbation = PERTURBATION_RATIO * max(_max_magnitude(state), 1e-300)
    for k in range(-1, state.size):
        perturbed_run = run.fork(run.drive)
        perturbed_state = state.copy()
        perturbed_state[k] += perturbation if k >= 0 else 0.0
        perturbed_run.move_to(*_split_state(run, perturbed_state))
        states = []
        for _ in range(N_PERTURBED_CYCLES):
            perturbed_run.march_cycle(perturbed_run.prop.steps, 0, [])
            states.append(_scaled_state(perturbed_run))
        runs.append(states)
    # The perturbations after each cycle have the shape (cycles, 2 n, 2 n).
    perturbations = np.moveaxis(np.array(runs[1:]) - np.array(runs[0]), 0, 2) / perturbation
    sizes = np.abs(perturbations).max(axis=(1, 2))
    last = N_SETTLING_CYCLES + int(
        np.argmax(np.append(sizes[N_SETTLING_CYCLES:] < MIN_PERTURBATION_RATIO, True))
    )
    first = min(N_SETTLING_CYCLES, last) - 1
    if last - first < 2:
        first = 0
        last = 2
    pairs = [
        (perturbations[k] / sizes[k], perturbations[k + 1] / sizes[k])
        for k in range(first, last - 1)
        if sizes[k] > 0
    ]
    if not pairs:
        return np.zeros(state.size)
    starts, ends = (np.concatenate(part, axis=1) for part in zip(*pairs))
    values = np.linalg.eigvals(ends @ np.linalg.pinv(starts, rcond=MIN_SINGULAR_RATIO))
    growth = 0.0
    if sizes[first] > 0:
        growth = (sizes[last - 1] / sizes[first]) ** (1 / max(last - 1 - first, 1))
    values /= np.maximum(np.abs(values) / max(growth, 1.0), 1.0)
    return values[np.argsort(-np.abs(values))]


def _scaled_state(run) -> np.ndarray:
    """Return the state (2 n,) [m] of a run: coordinates, and rates divided by the fastest modal rate."""
    return np.concatenate([run.state[0], run.state[1] / _fastest_rate(run)])


def _fastest_rate(run) -> float:
    return max(float(run.modes.omega.max()), 2 * np.pi / run.drive.period)


def _split_state(run, state) -> tuple:
    """Split a state vector into modal coordinates and rates, (n,) each."""
    n = run.state.shape[1]
    return state[:n], state[n:] * _fastest_rate(run)


def _max_magnitude(state) -> float:
    return float(np.abs(state).max(initial=0.0))


def _extrapolate(successive_states):
    """Extrapolate successive states (k, 2 n) to their limit by reduced rank extrapolation.

    The limit is the weighted mean of the states with the smallest change. The result is None if the
    extrapolation is ill-conditioned.
    """
    states = np.array(successive_states)
    changes = np.diff(states, axis=0)
    second_differences = np.diff(changes, axis=0)
    if not _max_magnitude(second_differences) > 0:
        return None
    weights = np.linalg.lstsq(second_differences.T, -changes[0], rcond=1e-10)[0]
    if _max_magnitude(weights) > 1e6:
        return None
    return states[0] + weights @ changes[:-1]
