"""Motions that a march repeats with its drive: brought there, shown over a cycle, disturbed.

A motion is marched until it settles, and every few cycles the limit of its states is guessed from their differences:
reduced rank extrapolation, which is exact where a disturbance dies out linearly (Sidi, J. Comput. Appl. Math. 36, 305,
1991). What the contact remembers follows by itself in the cycles between. Elements that slip a little further in every
cycle come to rest by themselves and start anew after every guess: one that did not help has the next one wait.
"""

import numpy as np

from ..march.march import ends_of, mark_of

LEAD = 6  # cycles from the start to the first guess
REST = 2  # cycles after a guess that the memory of the contact takes
MOST = 600  # cycles
HELPED = 0.1  # of the change of the state before a guess: where it is more after it, twice the cycles pass to the next
CLOSE = 1e-8  # of the largest state, to which a motion repeats
STILL = 1e-9  # of what the drive moves a free mass by: a smaller motion is none
NUDGE = 1e-6  # of the largest state: a small disturbance
# cycles in which the contact takes up a disturbance, and those that are seen in all
TAKEN_UP = 2
SEEN = 8
FORGOTTEN = 1e-3  # of the largest disturbances, on the root mean square: what is smaller is not told from none
NOTHING = 1e-5  # of a disturbance, which then has died out


def settled(run) -> float:
    """March a Run until it repeats; the change of the state over the last cycle, over the largest state.

    It is more than CLOSE where no motion repeats within MOST cycles; `run.outcome` is set where the march ended.
    """
    size = 2 * run.state.shape[1] + 2
    done = 0
    before = _state(run)
    least = (
        STILL
        * float(np.abs(run.drive.values(np.linspace(0, run.drive.period, 9))).max())
        / _pace(run) ** 2
    )
    least = max(least * _size(run.modes.base), 1e-300)
    change = np.inf
    misses = 0
    still = 0
    while done < MOST and run.outcome is None:
        kept = [before]
        for _ in range((LEAD if done == 0 else REST) + size):
            run.cycle(run.prop.steps, 0, [])
            done += 1
            kept.append(_state(run))
            if run.outcome is not None:
                break
        last = change
        change = _size(kept[-1] - kept[-2]) / max(_size(kept[-1]), least)
        if change <= CLOSE or run.outcome is not None:
            break
        if still == 0:  # the cycles since the last guess
            misses = 0 if change < HELPED * last else misses + 1
            still = 2**misses
        still -= 1
        before = _limit(kept[-size:]) if still == 0 else None
        if before is None:
            before = kept[-1]
        else:
            run.placed(*_apart(run, before))
    return float(change)


def shown(run, frames: int = 0) -> tuple:
    """(Mark of one more cycle of a Run, snapshots of the interface in it); its energies are those of this cycle."""
    run.books_anew()
    snapshots = []
    part = run.cycle(run.prop.steps, frames, snapshots)
    run.check()
    return mark_of(run, [part], ends_of([part], run)), snapshots


def multipliers(run) -> np.ndarray:
    """Floquet multipliers (2 n,), the largest first: what a cycle makes of small disturbances of the modes.

    Every one is disturbed in a march of its own from the state as it stands. In the first TAKEN_UP cycles the contact
    takes up the disturbance; the map of a cycle is that which fits those that follow, SEEN in all, in least squares.
    Memories that fade slowly bend the fit: none counts as larger than 1 that was not seen to grow so.
    """
    here = _state(run)
    found = []
    nudge = NUDGE * max(_size(here), 1e-300)
    for k in range(-1, here.size):
        twin = run.fork(run.drive)
        there = here.copy()
        there[k] += nudge if k >= 0 else 0.0
        twin.placed(*_apart(run, there))
        states = []
        for _ in range(SEEN):
            twin.cycle(twin.prop.steps, 0, [])
            states.append(_state(twin))
        found.append(states)
    # (cycles, 2 n, 2 n)
    after = np.moveaxis(np.array(found[1:]) - np.array(found[0]), 0, 2) / nudge
    sizes = np.abs(after).max(axis=(1, 2))
    last = TAKEN_UP + int(np.argmax(np.append(sizes[TAKEN_UP:] < NOTHING, True)))
    first = min(TAKEN_UP, last) - 1
    if last - first < 2:
        first = 0
        last = 2
    pairs = [
        (after[k] / sizes[k], after[k + 1] / sizes[k])
        for k in range(first, last - 1)
        if sizes[k] > 0
    ]
    if not pairs:
        return np.zeros(here.size)
    now, then = (np.concatenate(part, axis=1) for part in zip(*pairs))
    values = np.linalg.eigvals(then @ np.linalg.pinv(now, rcond=FORGOTTEN))
    grown = (
        (sizes[last - 1] / sizes[first]) ** (1 / max(last - 1 - first, 1))
        if sizes[first] > 0
        else 0.0
    )
    values /= np.maximum(np.abs(values) / max(grown, 1.0), 1.0)
    return values[np.argsort(-np.abs(values))]


def _state(run) -> np.ndarray:
    """Coordinates [m] and rates over the largest pace of modes and drive [m] (2 n,)."""
    return np.concatenate([run.state[0], run.state[1] / _pace(run)])


def _pace(run) -> float:
    return max(float(run.modes.omega.max()), 2 * np.pi / run.drive.period)


def _apart(run, state) -> tuple:
    """(coordinates, rates) (n,) of a state."""
    n = run.state.shape[1]
    return state[:n], state[n:] * _pace(run)


def _size(state) -> float:
    return float(np.abs(state).max(initial=0.0))


def _limit(kept):
    """Limit of states (k, 2 n) that follow each other: their mean of the weights that make its change least; None where
    nothing is gained."""
    states = np.array(kept)
    changes = np.diff(states, axis=0)
    rise = np.diff(changes, axis=0)
    if not _size(rise) > 0:
        return None
    share = np.linalg.lstsq(rise.T, -changes[0], rcond=1e-10)[0]
    if _size(share) > 1e6:
        return None
    return states[0] + share @ changes[:-1]
