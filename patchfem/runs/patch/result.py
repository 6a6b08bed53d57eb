"""Result of a static patch, its warnings, and notes on neglected effects.

In: a model with a patch, and the solved `Patch`es. Out: measures with their floors, the `Result` of
a run without motion, warnings, and notes on plane state, lever arms, couplings and incomplete
clamping.
"""

from ... import surface
from ...core import Outcome
from ...formatting import format_length, format_quantity
from ...mesh import pieces as piece_meshes
from ...model.pieces import make_piece_meshes
from ...model.source import locate_errors
from ...scene.keys.contact import Material
from ..results.result import ContactData, Result, RunInputs, Statements, collect_rest_frame
from . import skin, store
from .case_meshes import solve_with_coarser
from .measures import note_on_plane_state
from .values import contact_reaches_steep_end

# Largest Poisson's ratio at which the error estimates are reliable despite volumetric locking.
MAX_POISSON_RATIO = 0.499
# Largest strain at which second-order effects may be neglected.
MAX_SMALL_STRAIN = 0.02

STEEP_END_WARNING = (
    "on a rounded end the contact reaches the point where the slope is 0.097, and beyond this point no "
    "contact is computed; lower the tilt or the load"
)

# Smallest ratio of normal to tangential displacement under a shear force that a note reports.
MIN_REPORTED_NORMAL_COUPLING_RATIO = 0.02


def make_piece_meshes_of_run(model) -> "tuple[piece_meshes.Mesh, piece_meshes.Mesh | None]":
    """Return the meshes of the lower and the upper piece of a model, as in a run.

    The upper one is None if the pieces are identical.
    """
    with locate_errors(model.source):
        if not model.patch.mesh.is_automatic:
            return make_piece_meshes(model.patch)
        return solve_with_coarser(model.patch, model.accuracy.tolerance)[0].pair.meshes


def make_static_result(inputs: RunInputs) -> Result:
    """Return the Result of a static patch, which may be without contact."""
    patch = inputs.patch
    pressure = patch.pressure
    warnings = inputs.warnings
    if pressure.outcome is Outcome.NO_CONTACT:
        warnings = [*warnings, Outcome.NO_CONTACT.sentence]
    return Result(
        plan=inputs.plan,
        outcome=pressure.outcome,
        measures=dict(patch.measures),
        seconds=inputs.seconds,
        statements=Statements(warnings, inputs.notes),
        contact=ContactData(patch, collect_rest_frame(patch)),
    )


def patch_warnings(patch_model, patch, *, has_error_mesh: bool = True) -> list[str]:
    """Return warnings on large strains, locking elements, the gap, the ends of the pieces and a missing coarser mesh.

    Parameters
    ----------
    patch_model : PatchModel
        Model of the patch.
    patch : Patch
        The patch on its finest mesh.
    has_error_mesh : bool
        Whether the patch is solved on another mesh too, from which its errors follow.
    """
    warnings = warn_of_strains(
        patch_model, patch.pressure.sigma_n.max(initial=0.0), patch.pressure.approach
    )
    if patch_model.area is None and contact_reaches_steep_end(patch.pressed).any():
        warnings.append(STEEP_END_WARNING)

    warnings += warn_of_locking(patch_model)

    # Warnings on the profile, and on a mesh without a coarser one for an error estimate.
    warnings += [text for text in patch.notes if not surface.nodes.is_note(text)]
    if not has_error_mesh:
        warnings.append(
            f"the {patch.x.size - 1} elements along the interface are too few for an estimate of the "
            f"error; {_advise_shorter_elements(patch_model)}"
        )
    return warnings


def warn_of_strains(patch_model, pressure: float, approach: float) -> list[str]:
    """Return warnings if strains are too large for linear elasticity (`MAX_SMALL_STRAIN`).

    Parameters
    ----------
    patch_model : PatchModel
        Patch with the materials and heights of the pieces.
    pressure : float
        Largest pressure [Pa] at a node.
    approach : float
        Distance [m] by which the holders approach each other.
    """
    lowest_young = min(material.young for material in _list_materials(patch_model))
    height = sum(piece.height for piece in patch_model.pieces.both)
    strains = {
        "the peak pressure is {:.3g} of the lowest Young's modulus": pressure / lowest_young,
        "the approach is {:.3g} of the total height of the two pieces": approach / height,
    }
    limit = f", beyond the small strains that are assumed ({MAX_SMALL_STRAIN:g})"
    warnings = []
    for words, strain in strains.items():
        if strain > MAX_SMALL_STRAIN:
            warnings.append(words.format(strain) + limit)
    return warnings


def warn_of_locking(patch_model) -> list[str]:
    """Return a list with a warning on elements that are too stiff at a Poisson's ratio near 0.5.

    A mesh that the run chose is refined until locking is part of its error; a given mesh is not.
    """
    poisson = max(material.poisson for material in _list_materials(patch_model))
    is_fixed = not patch_model.mesh.is_automatic
    if patch_model.pieces.plane == "strain" and poisson > MAX_POISSON_RATIO and is_fixed:
        return [
            "in plane strain the elements become too stiff (lock) as Poisson's ratio nears 0.5; here "
            f"Poisson's ratio is {poisson:g} (limit {MAX_POISSON_RATIO:g}), so the true errors may be "
            f"twice the estimates; {_advise_shorter_elements(patch_model)}"
        ]
    return []


def _list_materials(patch_model) -> list[Material]:
    """Return the materials of the substrates and coatings of both pieces."""
    materials = []
    for piece in patch_model.pieces.both:
        materials += [piece.substrate, *([piece.coating.material] if piece.coating else [])]
    return materials


def _advise_shorter_elements(patch_model) -> str:
    """Return the advice for a mesh that the scene prescribes."""
    if patch_model.mesh.file is not None:
        return "split the elements of contact.mesh"
    return "leave out contact.element_size"


def notes_on_neglected_effects(face) -> list[str]:
    """Return notes on the effects that the model of a pressed interface neglects in any motion.

    Without a patch on coarser meshes there is no note on the plane state.

    Parameters
    ----------
    face : Face
        The interface with its patch on all meshes, from fine to coarse.
    """
    model = face.model
    patch_model = model.patch
    patch, *coarse = face.patches
    out = [text for text in patch.notes if surface.nodes.is_note(text)]

    # How the results treat the waves of a profile.
    if patch.points is not None:
        out.append(
            f"each static measure is computed on the mesh and on points {format_length(patch.averaging, 3)} apart, and "
            "the more accurate value is given; on these points short waves are treated as in infinite "
            f"layers; {_describe_results_on_mesh(model, patch)}"
        )
    elif patch.averaging is not None and not patch_model.gap.is_rough:
        out.append(
            "where the profile is in contact, its heights are averaged over a length of "
            f"{format_length(patch.averaging, 3)}; the errors include the effect of the choice of this length"
        )

    if patch.has_skin and patch.pressure.load > 0:
        loaded_area = patch.pieces.interface.weight @ patch.active
        out += skin.note_on_asperity_stiffness(
            patch_model, float(patch.pressure.load / loaded_area)
        )

    # A face has no plane state, and its unequal pieces do not slip.
    if patch_model.area is not None:
        return out

    out += note_on_coupling(patch.pair.coupling)
    if coarse[0] is not None and patch.pressure.outcome is not Outcome.NO_CONTACT:
        # An unstructured mesh has no coarser one: its second mesh is finer than its first. The coarsest
        # mesh of a fine series, and the next one of another, have 20 cells along the contact, which are
        # enough for the change.
        other = patch
        if coarse[-1] is not None:
            mesh = patch_model.mesh
            other = coarse[-1] if mesh.is_automatic and mesh.is_fine else coarse[-2:][0]
        out += store.get_or_compute(
            ("plane band", other), lambda: note_on_plane_state(patch_model, other)
        )
    return out


def note_on_coupling(coupling: float) -> list[str]:
    """Return a list with a note on the coupling of shear and normal motion, which acts only between dissimilar pieces.

    `coupling` is the largest ratio of normal to tangential displacement under a shear force [1].
    """
    if coupling <= MIN_REPORTED_NORMAL_COUPLING_RATIO:
        return []
    return [
        "the pieces have different elasticity, which couples shear and normal motion; this coupling is "
        f"neglected; under a shear force the largest normal displacement is {coupling:.2g} times the largest slide"
    ]


def _describe_results_on_mesh(model, patch) -> str:
    """Return a clause on which results come from the mesh and not from the points of a profile."""
    largest = format_quantity(float(patch.pressure.sigma_n.max()), "Pa", 3)
    where = f"the mesh of {patch.x.size} interface points, whose largest pressure is {largest}"
    if model.kind == "patch":
        return (
            f"pressure and gap of the interface are given on these points, but the stress inside the pieces is "
            f"computed on {where}"
        )
    return f"fields and motion are computed on {where}"
