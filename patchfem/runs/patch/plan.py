"""Mesh size, stiffness and dimensionless groups of a patch before it is solved.

In: a `PatchModel` or a Model. Out: numbers of unknowns, stiffnesses in series, and sentences for
the plan.
"""

from collections.abc import Sequence
from math import sqrt

from ...formatting import format_length
from ...mesh import pieces as piece_meshes
from ...model.model import Model
from ...model.pieces import make_piece_meshes
from ..results.patch_rows import Values
from . import area, skin, store
from .grids import MIN_NESTED_MESHES, halve_cells, make_base_grids

# Stiffness [N/m] of each element in series, or "rigid", by name.
StiffnessChain = dict[str, float | str]


def _predict_finest_mesh(patch_model, tolerance: float) -> "Sequence[piece_meshes.Mesh | None]":
    """Return the meshes of the pieces on the expected finest level.

    A mesh file is not read. An automatic mesh takes its place. `tolerance` is the relative error that the static
    measures have to meet.
    """
    if not patch_model.mesh.is_automatic:
        return make_piece_meshes(patch_model.with_mesh(file=None))
    bodies, contact = make_base_grids(patch_model)
    has_edges = bool(patch_model.gap.step_edges or (contact is not None and contact.places))
    # Tolerance below which a contact that ends inside the interface or at a step needs another
    # refinement level.
    has_fourth = has_edges and tolerance < 2e-3
    return halve_cells(bodies, MIN_NESTED_MESHES - 1 + has_fourth)


def count_unknowns(model: Model) -> dict[str, int]:
    """Count the unknowns of all patches of a model; equal patches of several interfaces are solved once."""
    patches = {} if model.patch is None else {"contact": model.patch}
    if model.has_interface_patches:
        for interface in model.rig.friction.interfaces:
            if interface.patch is not None:
                patches[store.content_key(interface.patch)] = interface.patch
    points = 0
    nodes = 0
    for patch in patches.values():
        if patch.area is not None:
            points += area.count_cells(patch)
            continue
        bodies = _predict_finest_mesh(patch, model.accuracy.tolerance)
        finest = [body for body in bodies if body is not None]
        points += finest[0].x.size
        nodes += sum(body.n_nodes for body in finest)
    return {"interface_points": points, "elastic_unknowns_about": 2 * nodes}


def stiffness_chain(patch_model) -> StiffnessChain:
    """Return the stiffnesses [N/m] in series between the holder and the interface of a patch, by name.

    The names are "holder", "pieces_shear" and "asperities"; the value of an element that is not in the scene is "rigid".
    """
    stiffnesses = {
        "holder": patch_model.loading.tangential_stiffness or "rigid",
        "pieces_shear": "rigid",
        "asperities": "rigid",
    }
    pieces = patch_model.pieces
    if patch_model.interface.has_shear:
        stiffnesses["pieces_shear"] = pieces.shear_stiffness
    layer = patch_model.interface.skin
    if layer is not None and layer.tangential_ratio is not None:
        area = pieces.length * pieces.width * pieces.pairs
        stiffnesses["asperities"] = (
            layer.tangential_ratio
            * skin.asperity_layer_stiffness(patch_model, patch_model.nominal_load / area)
            * area
        )
    return stiffnesses


def find_solved_links(chain: StiffnessChain, static_measures: Values) -> StiffnessChain:
    """Return the stiffness [N/m] of the pieces in the stiffness chain, from that of the solved patch.

    The stiffness of the patch is that of the pieces and the asperities in series.

    Parameters
    ----------
    chain : dict
        Stiffness chain of a plan by name.
    static_measures : dict
        Values of the static measures by name.
    """
    links = {}
    for name, link in chain.items():
        if not name.startswith("pieces_shear") or link == "rigid":
            continue
        stiffness = static_measures.get(name.replace("pieces_shear", "tangential_stiffness"))
        if not stiffness:
            continue
        compliance = 1 / stiffness
        asperities = chain.get(name.replace("pieces_shear", "asperities"), "rigid")
        if not isinstance(asperities, str):
            compliance -= 1 / asperities
        links[name] = 1 / compliance
    return links


def compute_patch_groups(model: Model) -> Values:
    """Compute the dimensionless groups of a patch, and with friction its slip length [m].

    tilt_over_first_opening is the tilt divided by the tilt at which flat pieces, modelled as bars,
    start to open at an edge.
    """
    dimensionless_groups = {}
    patch_model = model.patch
    load = patch_model.nominal_load
    if model.friction is not None:
        dimensionless_groups["slip_length"] = (
            model.friction.static * load / patch_model.pieces.shear_stiffness
        )
    if patch_model.gap.tilt is not None and load > 0:
        approach = load * patch_model.pieces.series_compliance(
            lambda m: (1 - m.poisson**2) / m.young
        )
        dimensionless_groups["tilt_over_first_opening"] = (
            patch_model.gap.tilt * patch_model.pieces.length / (2 * approach)
        )
    return dimensionless_groups


def describe_shear(patch_model, slip_length: float, name: str = "") -> str:
    """Describe how the pieces of an interface shear before they slip.

    Parameters
    ----------
    patch_model : PatchModel
        Patch of the interface.
    slip_length : float
        Elastic slide of the pieces under their friction limit [m].
    name : str
        Nodes of the interface; "" for the table [contact].
    """
    place = f"interface {name}: " if name else ""
    shear = f"by {format_length(slip_length, 3)} or more before the whole patch slips"
    if patch_model.interface.has_shear:
        return f"{place}the pieces shear elastically {shear}"
    table = "structure.interface.contact.shear" if name else "contact.shear"
    return (
        f"{place}the pieces are rigid in shear in this scene; elastic pieces would shear {shear}; add "
        f"[{table}] to include this shear"
    )


def describe_tilt(dimensionless_groups: Values, patch_model) -> list[str]:
    """Return a list with a sentence on the tilt relative to the tilt at which the contact of flat pieces opens."""
    tilt = dimensionless_groups.get("tilt_over_first_opening")
    gap = patch_model.gap
    if tilt is None or patch_model.area is not None:
        return []
    if gap.profile is not None or len(gap.shapes) > 1:
        return [
            f"the tilt is {tilt:.3g} times the tilt at which an edge of flat pieces would start to open, but these "
            "pieces are not flat"
        ]
    if tilt <= 1:
        # Largest ratio of tilt to the opening tilt of bars at which full contact is certain.
        # Elastic pieces with height/length 0.08 to 4 open at 0.77 and above.
        part = "the pieces touch everywhere" + ", except perhaps near an edge" * (tilt > 0.7)
    else:
        part = f"the pieces touch along about {100 / sqrt(tilt):.0f} % of the length or less"
    return [f"the tilt is {tilt:.3g} times the tilt at which an edge starts to open: {part}"]
