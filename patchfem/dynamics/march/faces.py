"""The arrays of what rubs in a march: of one contact, or of the elements beside it or in its place."""

import numpy as np

from ..contacts import arrays
from ..contacts.dispatch import COULOMB, number_of

GOAL = 1e-11  # residual of the step solve over the friction limit


def faces_of(model, prop, plant, mass: float):
    """Fresh `arrays.Faces` of a march, from the Propagator and the Plant of its modes [kg]; `arrays.Alone` of a model
    without joints."""
    if not model.joints:
        return arrays.Alone(np.array([GOAL * model.limit]))
    elements, (p, n), numbers = [one.element for one in model.joints], prop.rows.shape, number_of(model.laws)
    e = len(elements)
    num, mem = (np.zeros((e, max(1, *(len(part) for part in parts)))) for parts in (
        [one.numbers for one in elements], [one.memory for one in elements]))
    for k, one in enumerate(elements):
        num[k, :one.numbers.size], mem[k, :one.memory.size] = one.numbers, one.memory
        num[k, 0] = numbers[one.kernels or COULOMB]
    there, scale = getattr(model, "patch", None) is not None, getattr(model, "scale", 0.0)
    goal = [model.patch.limit if there else model.limit, *(one.limit or max(scale, 1e-300) for one in elements)]
    ports = np.array([one.port for one in model.joints], np.int64)
    holds = np.array([k for k, one in enumerate(elements) if (one.kernels or COULOMB) == COULOMB], np.int64)
    quick = prop.rows * prop.push[1] if not prop.dense.size else prop.rows @ prop.dense[n:, 2 * n:]
    gamma, m, at = quick @ prop.rows.T / mass, holds.size, ports[holds]
    gives = [give[np.ix_(at, at)] for give in (prop.beta, gamma, prop.rows @ prop.rows.T / mass)]
    stops = arrays.Stops(holds, np.zeros(m, np.int64), np.tile(num[holds, 1:3].T, (2, 1)), np.array(gives),
                         np.ascontiguousarray(prop.rows[at]), np.zeros((m, m)), np.zeros((18, m)))
    return arrays.Faces(
        np.array([there], np.int64), np.array(prop.beta, float), np.ascontiguousarray(prop.rows, float), ports,
        np.array([one.potential is None for one in model.joints], np.int64), num, mem,
        np.array([one.limit if one.bounded else np.inf for one in elements]), GOAL * np.array(goal),
        plant.push[0] / mass, np.zeros(n), np.zeros((e, 2)), np.zeros(e), np.zeros(2), np.zeros(1), np.zeros(p),
        *np.zeros((5, e)), np.zeros((e, e)), np.zeros((3, n)), np.zeros((n, n)), gamma, np.zeros(p), stops)
