"""Local search of a least-squares fit in the unit cube of its parameters (descent)."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from .space import UnitCubeResidual

COST_TOL = 1e-10  # relative change of the sum of squares per step at convergence
QUICK_COST_TOL = 1e-4  # COST_TOL of a residual that is expensive to evaluate
MAX_EVALUATIONS = 100  # largest number of evaluations in one descent, without Jacobians


class Descent(NamedTuple):
    """Result of a local least-squares search (descent).

    - u: final point (n,) in the unit cube, to which the ranges of the parameters are mapped.
    - cost: final sum of squares; infinite if the evaluation at the start failed.
    - is_converged: whether the descent converged.
    - rows: number of rows of the residual.
    """

    u: np.ndarray
    cost: float
    is_converged: bool
    rows: int


def descend(model: UnitCubeResidual, u, free) -> Descent:
    """Minimize a residual locally from a point of the unit cube (trust-region reflective method).

    The final sum of squares is never larger than that at the start.

    Parameters
    ----------
    model : UnitCubeResidual
        Residual as a function on the unit cube.
    u : (n,) array_like
        Starting point.
    free : sequence of int
        Indices of the free coordinates.

    Returns
    -------
    Descent
    """
    u = np.array(u, float)
    free = list(free)
    cost = model.sum_of_squares(u)
    start = Descent(u, cost, bool(np.isfinite(cost)), model.rows)
    if not (free and start.is_converged):
        return start

    # the point with the free coordinates v is fixed + select v
    select = np.eye(u.size)[:, free]
    fixed = u - select @ u[free]

    # the trust-region method needs a start inside the bounds
    for margin in (1e-3, 1e-9):
        inner = np.clip(u[free], margin, 1 - margin)
        residual = model(fixed + select @ inner)
        if residual is not None:
            break
    else:
        return start._replace(is_converged=False)
    scale = max(np.abs(residual).max(), 1e-300)

    # the residual is scaled because the method stops at an absolute gradient
    ftol = QUICK_COST_TOL if model.is_expensive else COST_TOL
    result = least_squares(
        lambda part: model.evaluate_or_penalize(fixed + select @ part) / scale,
        inner,
        jac=lambda part: model.jacobian(fixed + select @ part, free) / scale,
        bounds=(0, 1),
        ftol=ftol,
        xtol=10 * ftol,
        gtol=1e-15,
        max_nfev=MAX_EVALUATIONS,
    )
    end = fixed + select @ result.x
    cost = model.sum_of_squares(end)
    best = start if cost > start.cost else Descent(end, cost, True, model.rows)
    return best._replace(is_converged=result.status > 0)
