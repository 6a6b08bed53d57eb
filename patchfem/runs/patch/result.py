"""What a pressed patch hands back by itself, and the warnings that it deserves."""

from dataclasses import replace

from ...core import Outcome
from ...model.pieces import bodies_of
from ...model.source import placed
from ..results.result import Result, still
from . import kept
from .ladder import solve_all
from .measures import strip_error
from .notes import left_out
from .rounding import beyond_gentle
from .values import values

LOCKS = 0.499  # Poisson's ratio; up to it the bars of locking cells hold
SMALL = 0.02  # strain that is taken as small: what is of its second order is left out

__all__ = ["bodies", "left_out", "measured", "probed", "solve_all", "static", "strained"]


def probed(model) -> dict:
    """Static measures of the patch of a model, solved alone and without errors."""
    with placed(model.source):
        return values(solve_all(model.patch, model.accuracy.tolerance, False)[0])


def bodies(model) -> tuple:
    """Meshes of the pieces of a model, (lower, upper or None where it is alike); a mesh that the tolerance chooses is
    the one that a run takes."""
    with placed(model.source):
        if not model.patch.chosen:
            return bodies_of(model.patch)
        pair = solve_all(model.patch, model.accuracy.tolerance)[0].pair
        return pair.grid, None if pair.upper is pair.piece else pair.upper_grid


def measured(model, patch, coarse) -> dict:
    """Static measures of the patch of a model; those that miss a tolerance that chose the mesh are extrapolated.

    A measure that is a difference of larger terms has the tolerance times those as floor: of the approach the rotation
    times half the length, of the centre of pressure half the length, of the moment the load times that.
    """
    tolerance = model.patch.mesh_tolerance or model.accuracy.tolerance
    return floored(model, kept.measured(model.patch, patch, coarse, tolerance if model.patch.chosen else None))


def floored(model, found: dict) -> dict:
    """Measures with the floors of `measured`."""
    arm = model.patch.length / 2
    terms = {"approach": abs(found["rotation"].value) * arm, "pressure_centre": arm,
             "moment": found["normal_load"].value * arm}
    return found | {name: replace(found[name], floor=max(found[name].floor, model.accuracy.tolerance * size))
                    for name, size in terms.items()}


def static(what, patch, coarse, seconds, warnings, *_) -> Result:
    """Run a plan whose patch does not move, or a patch without contact; arguments as `run.run` has them."""
    p, extra = patch.pressure, {"residuals": dict(patch.pressure.residuals), "iterations": patch.pressure.iterations}
    if p.outcome is Outcome.NO_CONTACT:
        warnings = [*warnings, Outcome.NO_CONTACT.sentence]
    found = measured(what.model, patch, coarse)
    if patch.strips is not None and coarse[0] is not None:
        found = strip_error(what.model.patch, coarse[0], found)
    return Result(what, p.outcome, found, None, None, patch, still(patch), seconds, warnings, extra)


def strained(asked, patch) -> list:
    """Warnings where the answer leaves small strains, or where cells of a given size lock."""
    beyond = ["the contact reaches the place where a rounded end is 0.097 steep, beyond which nothing touches here; "
              "lower the tilt or the load"] if beyond_gentle(patch) else []
    return strained_by(asked, patch.pressure.sigma_n.max(initial=0.0), patch.pressure.approach, beyond)


def strained_by(asked, top: float, approach: float, beyond=()) -> list:
    """The warnings of `strained` from the largest nodal pressure [Pa] and the approach [m]; beyond: one in between."""
    out, pieces = [], (asked.lower, asked.upper)
    stuff = [m for piece in pieces for m in (piece.substrate, piece.coating and piece.coating.material) if m]
    deep = top / min(m.young for m in stuff)
    closed = approach / sum(piece.height for piece in pieces)
    for share, what in ((deep, "the peak pressure is {:.3g} of the lowest Young's modulus"),
                        (closed, "the approach is {:.3g} of the pieces' height")):
        if share > SMALL:
            out.append(what.format(share) + f", beyond the small strains that are assumed ({SMALL:g})")
    out += beyond
    stiff = max(m.poisson for m in stuff)
    if asked.plane == "strain" and stiff > LOCKS and not asked.chosen:
        cure = "split the elements of contact.mesh" if asked.mesh is not None else "leave out contact.element_size"
        out.append(f"Poisson's ratio {stiff:g} in plane strain (limit {LOCKS:g}): on cells of a given size, which lock "
                   f"towards 0.5, values are off by up to twice their bars; {cure}")
    return out
