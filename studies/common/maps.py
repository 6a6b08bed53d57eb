"""Maps of the patch over loads, tilts and load lines: one condensed pair, pressed point after point.

Each point starts from the contact set of its neighbour. Loads run forth and back for every tilt, so that each point
differs from the one before in one step of one quantity. The factor of the last contact set is carried along and only
changed where nodes come or go.
"""

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from patchfem.contact.active_set import Ask, Operator
from patchfem.contact.unilateral import checked, refuse, solve
from patchfem.core import Compliance, Outcome, PatchfemError, frozen_array
from patchfem.elasticity.lapack import one_thread


@dataclass(frozen=True, eq=False, slots=True)
class PressMap:
    """Contact at all combinations of loads (n,) [N], angles (a,) [rad] and load lines (l,) [m]; arrays (n, a, l).

    fraction: share of the area with pressure; peak: largest nodal pressure [Pa]; centre: pressure centre from the
    middle [m]; approach [m] and rotation [rad] of the upper holder; normal_stiffness: dN/d(approach) at held rotation
    [N/m]; shear_stiffness: dT/d(slide) in stick [N/m]; sigma_n: (n, a, l, m) [Pa]; the last two are None where not
    asked for. outcome: Outcome of each point. Numbers of a point that is not solved are NaN, and `reasons` says why by
    its index. residual: largest relative residual of the independent check; iterations: contact sets tried.
    """

    loads: np.ndarray
    angles: np.ndarray
    lines: np.ndarray
    fraction: np.ndarray
    peak: np.ndarray
    centre: np.ndarray
    approach: np.ndarray
    rotation: np.ndarray
    normal_stiffness: np.ndarray
    shear_stiffness: np.ndarray | None
    sigma_n: np.ndarray | None
    outcome: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray
    reasons: MappingProxyType


NUMBERS = ("fraction", "peak", "centre", "approach", "rotation", "normal_stiffness", "residual")


def press_map(pieces: Compliance, gap: np.ndarray, loads, angles=(0.0,), lines=None, spring: float = 0.0,
              shear: bool = False, keep: bool = False) -> PressMap:
    """Static pressure on the gap (m,) [m] for all combinations of loads (n,) [N], angles (a,) [rad] and load lines (l,)
    [m].

    An angle adds angle * x to the gap. Without `lines` the angles are held. With them the load acts `lines` [m] right
    of the middle and the piece is free to rotate, or held by the `spring` [N m/rad] of its holder from the angle on.
    shear: the shear stiffness as well; keep: the pressures as well.

    A point without an answer (load line outside the patch, not converged) is marked and the others go on. Zero load is
    no_contact, with the approach at first touch. PatchfemError for inputs that are no map.
    """
    loads, angles, lines, held = _axes(pieces, gap, loads, angles, lines)
    shape, m = (loads.size, angles.size, lines.size), pieces.interface.x.size
    out = {name: np.full(shape, np.nan) for name in NUMBERS}
    out["shear_stiffness"] = np.full(shape, np.nan) if shear else None
    out["sigma_n"] = np.full((*shape, m), np.nan) if keep else None
    out["iterations"] = np.zeros(shape, np.int64)
    out["outcome"] = np.full(shape, Outcome.NOT_CONVERGED, dtype=object)
    reasons, start = {}, None
    normal, tangential = Operator(pieces.normal), Operator(pieces.tangential) if shear else None
    with one_thread():
        for point in _order(loads, angles, lines):
            load, angle, line = float(loads[point[0]]), float(angles[point[1]]), float(lines[point[2]])
            tilted = gap + angle * pieces.interface.x
            try:
                refuse(pieces.interface.x, tilted, load, None if held else load * line, spring)
                if load == 0:
                    _touch(out, point, tilted, angle)
                    continue
                ask = Ask(pieces.interface.x, tilted, load, None if held else load * line, spring)
                found = solve(normal, ask, start)
                _, checks = checked(pieces.normal, ask, found)
            except (PatchfemError, np.linalg.LinAlgError) as error:
                reasons[point], start = str(error), None
                continue
            start = found.active
            _record(out, point, pieces, ask, found, checks, angle, tangential)
    fixed = {name: value if value is None else frozen_array(value, value.dtype) for name, value in out.items()}
    return PressMap(frozen_array(loads), frozen_array(angles), frozen_array(lines), reasons=MappingProxyType(reasons),
                    **fixed)


def _axes(pieces, gap, loads, angles, lines) -> tuple:
    held = lines is None
    axes = [np.atleast_1d(np.asarray(values, float)) for values in (loads, angles, (0.0,) if held else lines)]
    for name, values in zip(("loads", "angles", "lines"), axes):
        if values.ndim != 1 or values.size == 0 or not np.isfinite(values).all():
            raise PatchfemError(f"map: {name} must be a list of finite numbers")
    if np.shape(gap) != pieces.interface.x.shape or not np.isfinite(gap).all():
        raise PatchfemError("map: the gap must be finite and have a value for each interface node")
    return *axes, held


def _order(loads, angles, lines):
    """Indices of all points, neighbours one after the other: loads run fastest, then load lines, then angles."""
    steps = [np.argsort(values, kind="stable") for values in (loads, lines, angles)]
    up_load, up_line = True, True
    for a in steps[2]:
        for k in steps[1] if up_line else steps[1][::-1]:
            for n in steps[0] if up_load else steps[0][::-1]:
                yield int(n), int(a), int(k)
            up_load = not up_load
        up_line = not up_line


def _touch(out, point, gap, angle) -> None:
    for name, value in (("fraction", 0.0), ("peak", 0.0), ("centre", 0.0), ("approach", gap.min()), ("rotation", angle),
                        ("normal_stiffness", 0.0), ("residual", 0.0)):
        out[name][point] = value
    if out["shear_stiffness"] is not None:
        out["shear_stiffness"][point] = 0.0
    if out["sigma_n"] is not None:
        out["sigma_n"][point] = 0.0
    out["outcome"][point] = Outcome.NO_CONTACT


def _record(out, point, pieces, ask, found, checks, angle, tangential) -> None:
    weight, sigma = pieces.interface.weight, found.force / pieces.interface.weight
    for name, value in (("fraction", weight[found.active].sum() / weight.sum()), ("peak", sigma.max()),
                        ("centre", found.force @ ask.x / found.force.sum()),
                        ("approach", ask.gap.min() + found.closing), ("rotation", angle + found.theta),
                        ("normal_stiffness", found.stiffness), ("residual", max(checks.values()))):
        out[name][point] = value
    if tangential is not None:
        ones = np.ones((np.count_nonzero(found.active), 1))
        out["shear_stiffness"][point] = tangential.solver(found.active)(ones).sum()
    if out["sigma_n"] is not None:
        out["sigma_n"][point] = sigma
    out["iterations"][point] = found.iterations
    out["outcome"][point] = Outcome.DONE
