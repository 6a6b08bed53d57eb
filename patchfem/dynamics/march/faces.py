"""Arrays of the friction elements of a march, which act with a contact or in its place."""

import numpy as np

from ..interfaces import arrays
from ..interfaces.dispatch import COULOMB_LAW, number_laws

STEP_TOL = 1e-11  # residual of the step solve over the friction limit


def make_faces(model, prop, modal_system, mass: float):
    """Return the arrays of the elements of a march at its start; `arrays.SingleContact` for a model without elements.

    Parameters
    ----------
    model : ContactModel, joints.JointsModel or varying_load.VaryingLoadModel
    prop : propagator.Propagator
    modal_system : ModalArrays
    mass : float
        [kg]

    Returns
    -------
    interfaces.arrays.PortElements or SingleContact
    """
    if not model.joints:
        return arrays.SingleContact(np.array([STEP_TOL * model.limit]))
    elements = [joint.element for joint in model.joints]
    p, n = prop.rows.shape
    law_numbers = number_laws(model.laws)
    e = len(elements)
    num = np.zeros((e, max(element.numbers.size for element in elements)))
    mem = np.zeros((e, max(1, *(element.memory.size for element in elements))))
    for k, element in enumerate(elements):
        num[k, : element.numbers.size] = element.numbers
        mem[k, : element.memory.size] = element.memory
        num[k, 0] = law_numbers[element.kernels or COULOMB_LAW]
    there = getattr(model, "patch", None) is not None
    scale = getattr(model, "scale", 0.0)
    ports = np.array([one.port for one in model.joints], np.int64)
    mates = [k + one.mate for k, one in enumerate(model.joints)]
    holds = np.array(
        [k for k, one in enumerate(elements) if (one.kernels or COULOMB_LAW) == COULOMB_LAW],
        np.int64,
    )
    quick = prop.rows * prop.push[1] if not prop.dense.size else prop.rows @ prop.dense[n:, 2 * n :]
    gamma = quick @ prop.rows.T / mass
    m = holds.size
    at = ports[holds]
    gives = [give[np.ix_(at, at)] for give in (prop.beta, gamma, prop.rows @ prop.rows.T / mass)]
    stops = arrays.SetValuedElements(
        holds,
        np.zeros(m, np.int64),
        np.tile(num[holds, 1:3].T, (2, 1)),
        np.array(gives),
        np.ascontiguousarray(prop.rows[at]),
        np.zeros((m, m)),
        np.zeros((18, m)),
    )
    each = np.zeros((10, e))
    each[6] = [one.limit if one.is_bounded else np.inf for one in elements]
    each[7] = [STEP_TOL * (one.limit or max(scale, 1e-300)) for one in elements]
    modal = np.zeros((5, n))
    modal[0] = modal_system.push[0] / mass
    return arrays.PortElements(
        np.ascontiguousarray(prop.rows, float),
        np.array([prop.beta, gamma]),
        np.array([ports, [one.potential is None for one in model.joints], mates], np.int64),
        num,
        mem,
        each,
        np.array([0.0, 0.0, 0.0, STEP_TOL * (model.patch.limit if there else model.limit), 0.0]),
        np.zeros((2, p)),
        modal,
        np.zeros((e, e)),
        np.zeros((n, n)),
        stops,
    )
