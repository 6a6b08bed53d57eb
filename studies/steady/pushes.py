"""Multipliers of a motion from small pushes: by the march, and by the event engine of one mode."""

from dataclasses import replace

import numpy as np

from patchfem.core import Start
from patchfem.dynamics.events.elements import coulomb
from patchfem.dynamics.events.histories import simulate
from patchfem.dynamics.march import march as marching
from patchfem.runs.patch.ladder import solve_all
from patchfem.runs.rig.interface import contact_of
from patchfem.runs.rig.numerics import choose


def fitted(states, n: int, size: float, omega: float) -> np.ndarray:
    """Multipliers of motions pushed each way along every coordinate and rate: one map is fitted to their differences.

    states(push (2, n)) -> (cycles, 2, n) at the ends of successive cycles; size [m], omega size of rates: of a push.
    """
    units, spans = np.repeat([size, omega * size], n), []
    for k in range(2 * n):
        push = np.zeros(2 * n)
        push[k] = units[k]
        ends = [np.reshape(states(sign * push.reshape(2, n)), (-1, 2 * n)) / units / 2 for sign in (1, -1)]
        spans.append(ends[0] - ends[1])
    found = np.array(spans)  # (push, cycle, coordinate); the first cycle still holds what the contact remembers
    before, after = np.concatenate(found[:, 1:-1]), np.concatenate(found[:, 2:])
    values = np.linalg.eigvals(np.linalg.lstsq(before, after, rcond=1e-9)[0])
    return values[np.argsort(-np.abs(values))]


def marched(model, start: Start, steps: int, settle: int, cycles: int, size: float) -> np.ndarray:
    """Multipliers by the march of a model from a state near its steady motion."""
    modes, drive = model.rig.modes, model.rig.drive
    model = replace(model, rig=replace(model.rig, start=start))
    patch = solve_all(model.patch, model.accuracy.tolerance, False)[0] if model.patch is not None else None
    run = marching.fresh(modes, drive, contact_of(model, choose(model), patch), steps, np.inf, start)
    for _ in range(settle):
        run.cycle(steps, 0, [])

    def states(push):
        twin, out = run.fork(drive), []
        twin.state += push
        for _ in range(cycles):
            twin.cycle(steps, 0, [])
            out.append(twin.state.copy())
        return np.array(out)

    return fitted(states, modes.omega.size, size, drive.omega)


def exact(model, start: Start, cycles: int, size: float) -> np.ndarray:
    """The same by the event engine of one mode."""
    modes, drive = model.rig.modes, model.rig.drive
    limit = model.friction.static * model.point.load

    def states(push):
        out, now = [], Start(start.z + push[0], start.v + push[1])
        for _ in range(cycles):
            seen = simulate(modes, drive, [coulomb(limit)], 1, 1, start=now).response
            now = Start(seen.modal[-1], seen.modal_rate[-1])
            out.append([now.z, now.v])
        return np.array(out)

    return fitted(states, 1, size, drive.omega)
