"""Result of a static patch, its warnings, and notes on what its model neglects.

In: a model with a patch, and the pressed `Patch`es. Out: measures with their floors, the
`Result` of a run without motion, warnings, and notes (plane state, lever arms, couplings,
incomplete clamping).
"""

from dataclasses import replace

import numpy as np

from ...core import Outcome
from ...formatting import format_length, format_quantity
from ...mesh import recognise
from ...mesh.tensor import TensorGrid
from ...model.pieces import make_piece_meshes
from ...model.source import locate_errors
from ...surface import nodes
from ..results.patch_rows import TABLE
from ..results.result import Result, at_rest
from . import derived, skin
from .ladder import solve_all, solve_static_ladder
from .measures import strip_error
from .values import reaches_steep_end, values

LOCKS = 0.499  # Poisson's ratio up to which the errors of cells that lock are reliable
MAX_SMALL_STRAIN = 0.02  # largest small strain; effects of its second order are neglected

__all__ = [
    "bodies",
    "notes_on_neglected_effects",
    "solve_all",
    "solve_static_ladder",
    "static",
    "static_measures",
    "static_measures_without_errors",
    "warn_of_strains",
]
MIN_COUPLING_RATIO = (
    0.02  # closing by shear over the tangential compliance, above which a note states it
)
# load over the buckling load of a tall piece; its sideways motion lacks about this fraction
MIN_BUCKLING_RATIO = 0.02
# fraction of a far face that counts as complete, because a mesh file has few digits
MIN_COMPLETE_FRACTION = 1 - 1e-6


def static_measures_without_errors(model) -> dict:
    """Return the static measures of the patch of a model, without errors."""
    with locate_errors(model.source):
        return values(solve_all(model.patch, model.accuracy.tolerance, False)[0])


def bodies(model) -> tuple:
    """Return the meshes of the pieces of a model, (lower, upper or None if they are alike).

    If the tolerance chooses the mesh, it is the one of a run.
    """
    with locate_errors(model.source):
        if not model.patch.mesh.is_automatic:
            return make_piece_meshes(model.patch)
        pair = solve_all(model.patch, model.accuracy.tolerance)[0].pair
        return pair.grid, None if pair.upper is pair.piece else pair.upper_grid


def static_measures(model, patch, coarse) -> dict:
    """Return the static measures of the patch of a model.

    If the tolerance chose the mesh, measures that miss it are extrapolated. The floor of a measure
    that is a difference of larger terms is the tolerance times these: for the approach the rotation
    times half the length, for the centre of pressure half the length, for the moment the load times
    half the length.

    Parameters
    ----------
    model : Model
    patch : Patch
    coarse : sequence of Patch or None
        The patch on coarser meshes, fine to coarse.
    """
    patch_model = model.patch
    tolerance = (
        (patch_model.mesh.tolerance or model.accuracy.tolerance)
        if patch_model.mesh.is_automatic
        else None
    )
    found = set_floors(model, derived.static_measures(patch_model, patch, coarse, tolerance))
    # for worn strips, `wear.measures` adds the error due to their number
    if patch.strips is None or coarse[0] is None or model.wear is not None:
        return found
    return strip_error(model.patch, coarse[0], found)


def set_floors(model, found: dict) -> dict:
    """Return measures with the floors described in `static_measures`."""
    least = floors(
        model.patch, model.accuracy.tolerance, {name: one.value for name, one in found.items()}
    )
    return {name: replace(one, floor=max(one.floor, least[name])) for name, one in found.items()}


def floors(patch_model, tolerance: float, values: dict) -> dict:
    """Return the floor of each static measure by name, for values that are numbers or (q,).

    Parameters
    ----------
    patch_model : PatchModel
    tolerance : float
    values : dict
        Values by name.
    """
    arm = patch_model.pieces.length / 2
    terms = {
        "approach": abs(values["rotation"]) * arm,
        "pressure_centre": arm,
        "moment": values["normal_load"] * arm,
    }
    return {
        name: np.maximum(TABLE[name].floor, tolerance * terms.get(name, 0.0)) for name in values
    }


def static(what, patch, coarse, seconds, warnings, *_) -> Result:
    """Return the Result of a plan whose patch does not move, or of a patch without contact.

    The parameters are those of `run.run`.
    """
    p = patch.pressure
    extra = {"residuals": dict(patch.pressure.residuals), "iterations": patch.pressure.iterations}
    if p.outcome is Outcome.NO_CONTACT:
        warnings = [*warnings, Outcome.NO_CONTACT.sentence]
    found = static_measures(what.model, patch, coarse)
    return Result(
        what, p.outcome, found, None, None, patch, at_rest(patch), seconds, warnings, extra
    )


def warn_of_strains(patch_model, patch) -> list:
    """Return warnings on large strains, on cells of a given size that lock, and on the gap."""
    beyond = (
        [
            "on a rounded end the contact reaches the point where the slope is 0.097, and beyond this point no "
            "contact is computed; lower the tilt or the load"
        ]
        if reaches_steep_end(patch)
        else []
    )
    return [
        *strain_warnings(
            patch_model, patch.pressure.sigma_n.max(initial=0.0), patch.pressure.approach, beyond
        ),
        *(text for text in patch.notes if not nodes.is_note(text)),
    ]


def strain_warnings(patch_model, top: float, approach: float, beyond=()) -> list:
    """Return the warnings of `warn_of_strains` on strains and locking.

    Parameters
    ----------
    patch_model : PatchModel
    top : float
        Largest nodal pressure [Pa].
    approach : float
        Approach [m].
    beyond : sequence of str
        Warnings that are inserted before the one on locking.
    """
    out = []
    stuff = _materials(patch_model)
    words = (
        "the peak pressure is {:.3g} of the lowest Young's modulus",
        "the approach is {:.3g} of the total height of the two pieces",
    )
    for share, what in zip(_strains(patch_model, top, approach), words):
        if share > MAX_SMALL_STRAIN:
            out.append(
                what.format(share)
                + f", beyond the small strains that are assumed ({MAX_SMALL_STRAIN:g})"
            )
    out += beyond
    stiff = max(m.poisson for m in stuff)
    if patch_model.pieces.plane == "strain" and stiff > LOCKS and not patch_model.mesh.is_automatic:
        cure = (
            "split the elements of contact.mesh"
            if patch_model.mesh.file is not None
            else "leave out contact.element_size"
        )
        out.append(
            "in plane strain the elements become too stiff (lock) as Poisson's ratio nears 0.5; here "
            f"Poisson's ratio is {stiff:g} (limit {LOCKS:g}), so the true errors may be "
            f"twice the estimates; {cure}"
        )
    return out


def exceeds_small_strains(patch_model, top, approach):
    """Return whether `strain_warnings` may have a warning, for one patch or arrays of many."""
    return (
        np.maximum(*_strains(patch_model, top, approach)) > MAX_SMALL_STRAIN
        if patch_model.mesh.is_automatic
        else np.ones(np.shape(top), bool)
    )


def _strains(patch_model, top, approach) -> tuple:
    """Return peak pressure over lowest Young's modulus, and approach over height of the pieces."""
    return top / min(m.young for m in _materials(patch_model)), approach / (
        patch_model.pieces.lower.height + patch_model.pieces.upper.height
    )


def _materials(patch_model) -> list:
    """Return the materials of the pieces and their coatings."""
    return [
        material
        for piece in (patch_model.pieces.lower, patch_model.pieces.upper)
        for material in (piece.substrate, piece.coating and piece.coating.material)
        if material
    ]


def notes_on_neglected_effects(model, patch, coarse) -> list:
    """Return notes on a pressed patch that hold for any motion.

    Parameters
    ----------
    model : Model
    patch : Patch
    coarse : sequence of Patch or None
        Patches of the error estimate; if the first one is None, the plane state is not discussed.
    """
    patch_model = model.patch
    by_forms = [
        side
        for side, body in (("lower", patch.pair.grid), ("upper", patch.pair.upper_grid))
        if not isinstance(body, TensorGrid)
    ]
    out = [text for text in patch.notes if nodes.is_note(text)]
    out += (
        [
            f"scikit-fem assembles the stiffness of the {' and the '.join(by_forms)} piece cell by cell"
        ]
        if by_forms
        else []
    )
    out += [
        *notes_on_mesh_file(patch.pair),
        *notes_on_tall_pieces(
            patch_model, patch.pressure.load / patch.pieces.interface.weight.sum()
        ),
    ]
    if patch.sharper:
        out.append(
            f"each static measure is computed on the mesh and on points {format_length(patch.averaging, 3)} apart, and "
            "the value with the smaller error is given; on these points short waves are treated as in infinite "
            f"layers; {_mesh_clause(model, patch)}"
        )
    elif patch.averaging is not None and not patch_model.gap.is_rough:
        out.append(
            "where the profile is in contact, its heights are averaged over a length of "
            f"{format_length(patch.averaging, 3)}; the errors include the effect of the choice of this length"
        )
    if patch_model.interface.skin is not None and patch.pressure.load > 0:
        bears = patch.pieces.interface.weight @ (patch.pressure.sigma_n > 0)
        out += skin.note_on_peak_stiffness(patch_model, float(patch.pressure.load / bears))
    if patch.strips is not None:
        out.append(patch.strips.note)
    if patch.pair.coupling > MIN_COUPLING_RATIO and model.kind != "patch":
        out.append(
            "the pieces have different elasticity, which couples shear and normal motion; this coupling is "
            f"neglected; under a shear force the largest normal displacement is {patch.pair.coupling:.2g} times "
            "the largest slide"
        )
    if model.kind == "patch":
        out += frictionless(patch_model, patch)
    if coarse[0] is not None and patch.pressure.outcome is not Outcome.NO_CONTACT:
        # an unstructured mesh has no coarser one: its second patch is finer than its first
        out += derived.plane_notes(patch_model, patch if coarse[-1] is None else coarse[0])
    return out


def _mesh_clause(model, patch) -> str:
    """Return the clause on results that are computed on the mesh, not on points of a profile."""
    peak = (
        f"whose largest pressure is {format_quantity(float(patch.pressure.sigma_n.max()), 'Pa', 3)}"
    )
    where = f"the mesh of {patch.x.size} interface points, {peak}"
    if model.kind == "patch":
        return (
            f"pressure and gap of the interface are given on these points, but the stress inside the pieces is "
            f"computed on {where}"
        )
    return f"fields and motion are computed on {where}"


def frictionless(patch_model, patch) -> list:
    """Return a note, as a list, on unlike pieces: Dundurs' beta and the effect of perfect stick.

    Faces of unlike pieces slide on each other under pressure. Stick prevents this by shear
    stresses, which stiffen the contact.
    """
    pair = patch.pair
    held = np.flatnonzero(patch.active)
    if not pair.closing.any() or not held.size:
        return []
    here = np.ix_(held, held)
    one = np.ones(held.size)
    normal = patch.pieces.normal[here]
    cross = pair.closing[here]
    stuck = normal - cross @ np.linalg.solve(patch.pieces.tangential[here], cross.T)
    more = one @ np.linalg.solve(stuck, one) / (one @ np.linalg.solve(normal, one)) - 1
    beta = abs(_dundurs(patch_model))
    return [
        f"the pieces have different elasticity (Dundurs' beta {beta:.2g} at the interface), and the pressure is "
        f"computed without friction; if the pieces stuck perfectly, normal_stiffness would be {100 * more:.2g} % "
        "larger; with friction the stiffness lies between the two values"
    ]


def _dundurs(patch_model) -> float:
    """Return Dundurs' beta of the two faces."""
    shear = []
    kappa = []
    for piece in (patch_model.pieces.lower, patch_model.pieces.upper):
        face = piece.coating.material if piece.coating else piece.substrate
        shear.append(face.young / (2 + 2 * face.poisson))
        kappa.append(
            3 - 4 * face.poisson
            if patch_model.pieces.plane == "strain"
            else (3 - face.poisson) / (1 + face.poisson)
        )
    (a, b), (k, q) = shear, kappa
    return (a * (q - 1) - b * (k - 1)) / (a * (q + 1) + b * (k + 1))


def notes_on_mesh_file(pair) -> list:
    """Return notes on pieces of a mesh file with holes or a partly clamped far face."""
    out = []
    for side, body in (("lower", pair.grid), ("upper", pair.upper_grid)):
        if body.base_grid is not None:  # a grid has no holes, and its whole last row is clamped
            continue

        count, area = recognise.find_holes(body)
        if count:
            out.append(
                f"contact.mesh: the {side} piece has {count} hole{'s' * (count > 1)} inside, {area:.3g} m2 in "
                "all; if a hole is not intended, close it in the mesh"
            )
        fixed, whole = recognise.measure_fixed_length(body)
        if fixed < MIN_COMPLETE_FRACTION * whole:
            out.append(
                f"contact.mesh: the held nodes `{side}_far` cover {fixed:.6g} m of a face of {whole:.6g} m, "
                f"{fixed / whole:.3g} of the length of this face; the rest of the face is free"
            )
    return out


def notes_on_tall_pieces(patch_model, mean: float) -> list:
    """Return a note for each tall piece whose bending moves the load sideways, as a list.

    The model neglects that the lever arm increases. The measure is the load over the buckling load
    of the piece, clamped at the holder and free at the patch (Euler, pi^2 E' L^2/48 H^2 as a mean
    pressure); the motion lacks about this fraction. A piece that is not taller than long bends too
    little. mean: pressure over the whole interface [Pa].
    """
    out = []
    for side in ("lower", "upper"):
        piece = getattr(patch_model.pieces, side)
        young = piece.substrate.young
        nu = piece.substrate.poisson
        stiff = young / (1 - nu**2) if patch_model.pieces.plane == "strain" else young
        share = mean / (np.pi**2 * stiff * patch_model.pieces.length**2 / (48 * piece.height**2))
        if piece.height > patch_model.pieces.length and share > MIN_BUCKLING_RATIO:
            out.append(
                f"the {side} piece is {piece.height / patch_model.pieces.length:.3g} times as tall as it is long and carries "
                f"{share:.2g} of the load at which it would buckle sideways (limit {MIN_BUCKLING_RATIO:g}); the computation "
                "neglects that bending lengthens the lever arm of the load"
            )
    return out
