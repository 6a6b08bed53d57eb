"""Initial arrays of the friction elements and springs in a march."""

import numpy as np

from ..interfaces.dispatch import COULOMB_LAW, number_laws
from .element_arrays import (
    ContactIndex,
    ElementRow,
    FaceRow,
    LinkRow,
    ModalRow,
    PortElements,
    PortRow,
    SetValuedElements,
    SingleContact,
)

# Largest residual of a step relative to the friction limit, far below any time-step error.
STEP_TOL = 1e-11
# Smallest tolerance of a spring force [N], positive even if the force scale of the model is 0.
TINY_FORCE = 1e-300


def make_element_arrays(model, prop, modal_system, mass: float):
    """Return the arrays of the friction elements and springs at the start of a march.

    The result is a `SingleContact` if the model has no elements.

    Parameters
    ----------
    model : ContactModel, joints.JointsModel or varying_load.VaryingLoadModel
    prop : propagator.Propagator
    modal_system : ModalArrays
    mass : float
        [kg]

    Returns
    -------
    PortElements or SingleContact
    """
    if not model.joints:
        return SingleContact(np.array([STEP_TOL * model.limit]))
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
    links = np.zeros((len(LinkRow), e), np.int64)
    links[LinkRow.PORT] = [joint.port for joint in model.joints]
    links[LinkRow.IS_FRICTION] = [joint.potential is None for joint in model.joints]
    state = np.zeros((len(ElementRow), e))
    scale = max(getattr(model, "scale", 0.0), TINY_FORCE)
    for k, element in enumerate(elements):
        state[ElementRow.MAX_FORCE, k] = element.limit if element.is_bounded else np.inf
        state[ElementRow.FORCE_TOL, k] = STEP_TOL * (element.limit or scale)
    contact = np.zeros(len(ContactIndex))
    has_contact = getattr(model, "patch", None) is not None
    contact[ContactIndex.FORCE_TOL] = STEP_TOL * (model.patch.limit if has_contact else model.limit)
    modal = np.zeros((ModalRow.SCRATCH + 3, n))
    modal[ModalRow.COMPLIANCE] = modal_system.force_response[0] / mass
    # These are the rates of the modes per constant force.
    rate_rows = prop.rows * prop.force_response[1]
    if prop.dense.size:
        rate_rows = prop.rows @ prop.dense[n:, 2 * n :]
    gamma = rate_rows @ prop.rows.T / mass
    stops = _make_set_valued(
        elements, links[LinkRow.PORT], num, (prop.beta, gamma), prop.rows, mass
    )
    return PortElements(
        rows=np.ascontiguousarray(prop.rows, float),
        compliances=np.array([prop.beta, gamma]),
        links=links,
        num=num,
        mem=mem,
        state=state,
        contact=contact,
        port=np.zeros((len(PortRow), p)),
        modal=modal,
        system=np.zeros((e, e)),
        hess=np.zeros((n, n)),
        stops=stops,
    )


def _make_set_valued(elements, ports, num, compliances, rows, mass: float) -> SetValuedElements:
    """Return the arrays of the set-valued friction elements at the start of a march.

    Parameters
    ----------
    elements : list of Element
    ports : (e,) array
        Ports of the elements.
    num : (e, k) array
        Numbers of the laws of the elements.
    compliances : tuple of (p, p) arrays
        Reduction of the displacements [m/N] and velocities [m/(s N)] of the ports per constant port force.
    rows : (p, n) array
        Displacement of every port per coordinate.
    mass : float
        [kg]
    """
    laws = [element.kernels or COULOMB_LAW for element in elements]
    numbers = np.array([k for k, law in enumerate(laws) if law == COULOMB_LAW], np.int64)
    at = ports[numbers]
    m = numbers.size
    return SetValuedElements(
        element=numbers,
        names=np.zeros(m, np.int64),
        limit=np.tile(num[numbers, 1:3].T, (2, 1)),
        compliances=np.array(
            [matrix[np.ix_(at, at)] for matrix in (*compliances, rows @ rows.T / mass)]
        ),
        rows=np.ascontiguousarray(rows[at]),
        system=np.zeros((m, m)),
        field=np.zeros((len(FaceRow), m)),
    )
