"""Periodic motions by marching with extrapolation, and their Floquet multipliers.

A motion is marched, and every few cycles the limit of its states is extrapolated from their differences: reduced rank
extrapolation, which is exact if a perturbation decays linearly (Sidi, J. Comput. Appl. Math. 36, 305, 1991). The memory
of the contact adapts in the cycles between. Elements that slip a little further in every cycle come to rest by
themselves; after an extrapolation that did not reduce the change per cycle, the next one is postponed.
"""

import numpy as np

from .time_march import March, Motion, Record, advance_with_frames

N_FIRST_CYCLES = 6  # cycles before the first extrapolation
N_MEMORY_CYCLES = 2  # cycles after an extrapolation in which the memory adapts to the new state
MAX_CYCLES = 600  # largest number of cycles
# Largest ratio of the changes per cycle after and before a successful extrapolation; after a failure the waiting time
# doubles.
MAX_CHANGE_RATIO = 0.1
PERIODIC_TOL = 1e-8  # largest relative change of the state per cycle of a periodic motion
REST_RATIO = (
    1e-9  # largest motion that counts as rest, relative to that of a free mass under the drive
)
PERTURBATION_RATIO = 1e-6  # perturbation for the multipliers, relative to the largest state
N_SETTLING_CYCLES = 2  # cycles in which the memory adapts to a perturbation
N_PERTURBED_CYCLES = 8  # cycles after a perturbation
MIN_SINGULAR_RATIO = 1e-3  # smallest singular value of the perturbations above round-off, relative to the largest one
MIN_PERTURBATION_RATIO = 1e-5  # perturbation, relative to its start, below which it has decayed


def march_to_periodic(run: March) -> float:
    """March until the motion is periodic; return the relative change over the last cycle.

    The change exceeds PERIODIC_TOL if no periodic motion is reached within MAX_CYCLES; `run.outcome` is set if the march
    ended early.
    """
    before = _scale_state(run)
    size = before.size + 2
    push = np.abs(run.drive.values(np.linspace(0, run.drive.period, 9))).max()
    rest = REST_RATIO * float(push) * np.abs(run.modes.base).max() / _fastest_rate(run) ** 2
    rest = max(rest, 1e-300)
    n_cycles = 0
    n_failures = 0
    n_waiting = 0
    change = np.inf
    while n_cycles < MAX_CYCLES and run.outcome is None:
        states = [before]
        for _ in range((N_FIRST_CYCLES if n_cycles == 0 else N_MEMORY_CYCLES) + size):
            run.advance(run.steps)
            n_cycles += 1
            states.append(_scale_state(run))
            if run.outcome is not None:
                break
        last = change
        change = np.abs(states[-1] - states[-2]).max() / max(np.abs(states[-1]).max(), rest)
        if change <= PERIODIC_TOL or run.outcome is not None:
            break

        # The last extrapolation is judged by the cycles since then.
        if n_waiting == 0:
            n_failures = 0 if change < MAX_CHANGE_RATIO * last else n_failures + 1
            n_waiting = 2**n_failures
        n_waiting -= 1
        before = _extrapolate(states[-size:]) if n_waiting == 0 else None
        if before is None:
            before = states[-1]
        else:
            run.move_to(*_split_state(run, before))
    return float(change)


def march_cycle(run: March, frames: int = 0) -> Motion:
    """March over one more cycle, and return its motion; its energies are those of this cycle."""
    run.reset_balance()
    record = Record(run, run.steps, run.steps, keeps_samples=True)
    record.add(*advance_with_frames(run, run.steps, frames))
    run.check_steps()
    return record.make_motion()


def estimate_multipliers(run: March) -> np.ndarray:
    """Estimate the Floquet multipliers (2 n,) of a periodic motion by perturbed marches, in decreasing magnitude.

    Each march perturbs one number of the present state. In the first N_SETTLING_CYCLES the memory of the contact adapts;
    the map of a cycle is a least-squares fit to the following cycles. Memories that fade slowly bias the fit: no
    multiplier counts as larger than 1 unless the perturbation grew as much.
    """
    state = _scale_state(run)
    perturbation = PERTURBATION_RATIO * max(np.abs(state).max(), 1e-300)
    runs = []
    for k in range(-1, state.size):
        other = run.fork()
        moved = state.copy()
        moved[k] += perturbation if k >= 0 else 0.0
        other.move_to(*_split_state(run, moved))
        states = []
        for _ in range(N_PERTURBED_CYCLES):
            other.advance(other.steps)
            states.append(_scale_state(other))
        runs.append(states)

    # The perturbations after each cycle have the shape (cycles, 2 n, 2 n).
    changes = np.moveaxis(np.array(runs[1:]) - np.array(runs[0]), 0, 2) / perturbation
    sizes = np.abs(changes).max(axis=(1, 2))
    has_decayed = np.append(sizes[N_SETTLING_CYCLES:] < MIN_PERTURBATION_RATIO, True)
    last = N_SETTLING_CYCLES + int(np.argmax(has_decayed))
    first = min(N_SETTLING_CYCLES, last) - 1
    if last - first < 2:
        first = 0
        last = 2
    cycles = [k for k in range(first, last - 1) if sizes[k] > 0]
    if not cycles:
        return np.zeros(state.size)
    starts = np.concatenate([changes[k] / sizes[k] for k in cycles], axis=1)
    ends = np.concatenate([changes[k + 1] / sizes[k] for k in cycles], axis=1)
    values = np.linalg.eigvals(ends @ np.linalg.pinv(starts, rcond=MIN_SINGULAR_RATIO))
    growth = 0.0
    if sizes[first] > 0:
        growth = (sizes[last - 1] / sizes[first]) ** (1 / max(last - 1 - first, 1))
    values /= np.maximum(np.abs(values) / max(growth, 1.0), 1.0)
    return values[np.argsort(-np.abs(values))]


def _scale_state(run: March) -> np.ndarray:
    """Return the state (2 n,) [m] of a run: coordinates, and velocities divided by the fastest modal rate."""
    return np.concatenate([run.state[0], run.state[1] / _fastest_rate(run)])


def _fastest_rate(run: March) -> float:
    """Return the largest circular frequency of modes and drive [rad/s]."""
    return max(float(run.modes.omega.max()), 2 * np.pi / run.drive.period)


def _split_state(run: March, state) -> tuple[np.ndarray, np.ndarray]:
    """Split a state vector into modal coordinates [m] and velocities [m/s], (n,) each."""
    n = state.size // 2
    return state[:n], state[n:] * _fastest_rate(run)


def _extrapolate(successive_states) -> np.ndarray | None:
    """Extrapolate successive states (k, 2 n) to their limit by reduced rank extrapolation.

    The limit is the weighted mean of the states with the smallest change. The result is None if the extrapolation is
    ill-conditioned.
    """
    states = np.array(successive_states)
    changes = np.diff(states, axis=0)
    second = np.diff(changes, axis=0)
    if not np.abs(second).max(initial=0.0) > 0:
        return None
    weights = np.linalg.lstsq(second.T, -changes[0], rcond=1e-10)[0]
    if np.abs(weights).max() > 1e6:
        return None
    return states[0] + weights @ changes[:-1]
