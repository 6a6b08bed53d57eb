"""Arrays of the friction elements of a march, which act with a contact or in its place."""

import numpy as np

from ..interfaces.dispatch import COULOMB_LAW, number_laws
from .element_arrays import (
    ContactPlace,
    ElementRow,
    FaceRow,
    LinkRow,
    ModalRow,
    PortElements,
    PortRow,
    SetValuedElements,
    SingleContact,
)

STEP_TOL = 1e-11  # residual of the step solve over the friction limit
TINY_FORCE = 1e-300  # [N]; keeps the tolerance of a spring above 0 if the scale of the model is 0


def make_faces(model, prop, modal_system, mass: float):
    """Return the arrays of the elements of a march at its start; `SingleContact` for a model without elements.

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
    links = np.zeros((3, e), np.int64)
    links[LinkRow.PORT] = [joint.port for joint in model.joints]
    links[LinkRow.IS_FRICTION] = [joint.potential is None for joint in model.joints]
    links[LinkRow.MATE] = [k + joint.mate for k, joint in enumerate(model.joints)]
    state = np.zeros((len(ElementRow), e))
    scale = max(getattr(model, "scale", 0.0), TINY_FORCE)
    for k, element in enumerate(elements):
        state[ElementRow.MAX_FORCE, k] = element.limit if element.is_bounded else np.inf
        state[ElementRow.FORCE_TOL, k] = STEP_TOL * (element.limit or scale)
    contact = np.zeros(len(ContactPlace))
    has_contact = getattr(model, "patch", None) is not None
    contact[ContactPlace.FORCE_TOL] = STEP_TOL * (model.patch.limit if has_contact else model.limit)
    modal = np.zeros((ModalRow.SCRATCH + 3, n))
    modal[ModalRow.COMPLIANCE] = modal_system.push[0] / mass
    # rows of the rates under a constant force
    rate_rows = prop.rows * prop.push[1]
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
    """Return the arrays of the set-valued elements.

    Parameters
    ----------
    elements : list of Element
    ports : (e,) array
        Their ports.
    num : (e, k) array
        Numbers of their laws.
    compliances : tuple of (p, p) arrays
        What port forces take from the displacements [m/N] and velocities [m/(s N)] of the ports.
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
