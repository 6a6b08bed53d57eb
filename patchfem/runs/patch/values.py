"""Values read off a pressed patch: peak, edge, half-width, stiffnesses."""

import numpy as np

from ...core import Outcome
from ...slip.shear_modes import normal_stiffness, rotational_stiffness, tangential_stiffness
from .press import Patch


def half_width(x, sigma) -> float:
    """Half the contact length [m], soft edges found between nodes.

    sigma^2 is linear towards an edge of smooth contact (and exactly quadratic for Hertz), so an edge is the root of a
    cubic fitted to sigma^2 over the loaded nodes from 10 to 80 % of the contact length behind it; the nodes nearest to
    the edge carry its discretisation error and are left out. A root farther than a cell from the border of the contact
    set is not believed: a coating bends sigma^2 within its own thickness of the edge.
    """
    index = np.flatnonzero(sigma > 0)
    if index.size == 0:
        return 0.0
    ends = []
    for side in (-1, 1):
        outer = index[-1] if side > 0 else index[0]
        if outer in (0, x.size - 1):
            ends.append(float(x[outer]))
            continue
        ordered = index[::-1] if side > 0 else index
        behind = side * (x[outer] - x[ordered]) / max(x[index[-1]] - x[index[0]], 1e-300)
        pick = ordered[(behind >= 0.1) & (behind <= 0.8)] if index.size >= 12 else ordered[2:7]
        ends.append(_edge(x, sigma, pick, outer, side))
    return (ends[1] - ends[0]) / 2


def _edge(x, sigma, pick, outer, side) -> float:
    cell = abs(x[outer + side] - x[outer])
    guess = float(x[outer]) + side * cell / 2
    degree = 3 if pick.size >= 8 else 2
    if pick.size < degree + 1:
        return guess
    s = (x[pick] - x[outer]) / cell
    roots = np.roots(np.polyfit(s, sigma[pick]**2, degree))
    real = roots[np.abs(roots.imag) < 1e-9].real
    real = real[np.abs(real - side / 2) <= 1.0] * cell + x[outer]
    return float(real[np.argmin(np.abs(real - guess))]) if real.size else guess


def peak_pressure(x, sigma) -> float:
    """Largest pressure [Pa]: the vertex of the parabola through the largest inner node and its neighbours."""
    top = int(np.argmax(sigma))
    if top in (0, x.size - 1) or sigma[top - 1] <= 0 or sigma[top + 1] <= 0:
        return float(sigma[top])
    left, right = x[top] - x[top - 1], x[top + 1] - x[top]
    before, after = (sigma[top] - sigma[top - 1]) / left, (sigma[top + 1] - sigma[top]) / right
    bend = (after - before) / (left + right)
    slope = (before * right + after * left) / (left + right)
    return float(sigma[top] - slope**2 / (4 * bend)) if bend < 0 else float(sigma[top])


def values(patch: Patch) -> dict:
    """Value of every static measure of a pressed patch by name, in SI; `rows` has their meanings."""
    x, weight, p = patch.x, patch.pieces.interface.weight, patch.pressure
    area = weight.sum()
    peak = peak_pressure(x, p.sigma_n)
    out = {"normal_load": p.load, "contact_fraction": float(weight[p.sigma_n > 0].sum() / area),
           "pressure_peak": peak, "moment": p.moment, "rotation": p.rotation,
           "approach": p.approach, "contact_half_width": half_width(x, p.sigma_n)}
    out["pressure_centre"] = p.moment / p.load if p.load > 0 else 0.0
    touching = p.outcome is not Outcome.NO_CONTACT
    out["loaded_fraction"] = p.load / (area * peak) if touching else 0.0
    out["normal_stiffness"] = normal_stiffness(patch.pieces.normal, patch.active) if touching else 0.0
    out["tangential_stiffness"] = shear_stiffness(patch) if touching else 0.0
    out["rotational_stiffness"] = rotational_stiffness(patch.pieces.normal, x, patch.active) if touching else 0.0
    if patch.strips is not None:
        from .strips import strip_values

        out |= strip_values(patch, peak_pressure)
    return out


def shear_stiffness(patch: Patch) -> float:
    """Tangential stiffness dT/d(slide) [N/m] in stick at held approach and rotation.

    That of unlike pieces includes the closing that shear causes.
    """
    if not patch.pair.closing.any():
        return tangential_stiffness(patch.pieces.tangential, patch.active)
    from ...slip import tangent

    operators = tangent.operators_of(patch.pieces, patch.pair.closing)
    return tangent.operating_tangent(operators, patch.active).tangential


def edge_cells(x, active) -> np.ndarray:
    """Lengths (e,) [m] of the cells in which the contact set ends; empty for full contact."""
    return np.diff(x)[active[1:] != active[:-1]]
