"""Self-checks of a static patch: area, load, stiffness and pressure.

In: `Evidence`. Out: Findings.
"""

from collections.abc import Iterator

from patchfem.core import Outcome
from patchfem.runs.patch import values
from patchfem.runs.results.patch_rows import HALF_SPACE_SOURCE

from .evidence import Evidence
from .finding import (
    CONTACT_RESIDUAL_TOL,
    EVALUATION_TOL,
    ROUND_OFF_TOL,
    ROUTE_OF_LOWER_BOUND,
    ROUTE_OF_UPPER_BOUND,
    STATED_ERROR_FACTOR,
    Finding,
)


def check_interface_area(run: Evidence) -> Iterator[Finding]:
    """Compare the sum of the nodal areas with length × width × number of pairs.

    The nodal areas integrate a constant exactly, so that the two numbers differ only by round-off;
    coordinates of a mesh file have about seven digits.
    """
    if run.result.patch is None:
        return
    total_area = float(run.result.patch.pieces.interface.weight.sum())
    tolerance = CONTACT_RESIDUAL_TOL if run.model.patch.mesh.file is not None else ROUND_OFF_TOL
    yield Finding("the sum of the nodal areas", total_area, run.area, tolerance * run.area, "m2")


def check_normal_load(run: Evidence) -> Iterator[Finding]:
    """Compare the prescribed load with the integral of the pressure and with `normal_load`.

    This is the equilibrium of the upper piece, which the contact solver satisfies up to its
    residual.
    """
    if (
        run.result.patch is None
        or run.scene.get("contact", {}).get("load") is None
        or run.model.load_varies
    ):
        return
    pressure = run.result.patch.pressure
    if pressure.outcome is Outcome.NO_CONTACT or run.result.outcome is Outcome.NO_CONTACT:
        return
    total = float(pressure.sigma_n @ run.result.patch.pieces.interface.weight)
    for quantity_name, found in (
        ("the integral of the normal stress", total),
        ("the measure normal_load", run.value("normal_load")),
    ):
        if found is not None:
            yield Finding(quantity_name, found, run.load, CONTACT_RESIDUAL_TOL * run.load, "N")


def check_stiffness_bounds(run: Evidence) -> Iterator[Finding]:
    """Compare normal and tangential stiffness with the bounds of a layered column.

    Two pieces of equal length are clamped over their whole far faces. Uniform strain is admissible
    (minimum potential energy), so that the stiffness is at most that of columns M A/H in series,
    with M = E (1 - nu)/((1 + nu)(1 - 2 nu)) in plane strain and E/(1 - nu^2) in plane stress; in
    shear G A/H. If the whole interface is in contact without an asperity layer, uniform stress is
    admissible (minimum complementary energy), so that the stiffness is at least E' A/H, with E' =
    E/(1 - nu^2) or E. Partial contact and asperities only reduce the stiffness. Bilinear elements
    contain the uniform strain and are stiffer than the continuum, so that the bounds hold for them
    as well. The error estimates of the measures are added to the thresholds.
    """
    patch = run.result.patch
    patch_model = run.model.patch
    if (
        patch is None
        or patch_model.mesh.file is not None
        or run.value("normal_stiffness") is None
        or patch_model.pieces.has_overhang
    ):
        return
    length = patch_model.pieces.length
    for piece in patch_model.pieces.both:
        is_longer = piece.length > length * (1 + ROUND_OFF_TOL)
        if is_longer or piece.corner_kind(length / 2) != "sharp":
            return
    flexibility = {"column": 0.0, "stress": 0.0, "shear": 0.0}
    for piece in patch_model.pieces.both:
        for material, thickness in (
            (piece.substrate, piece.height - piece.thickness),
            (piece.coating and piece.coating.material, piece.thickness),
        ):
            if not thickness:
                continue
            young = material.young
            nu = material.poisson
            if patch_model.pieces.plane == "strain":
                column = young * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
                stress = young / (1 - nu**2)
            else:
                column = young / (1 - nu**2)
                stress = young
            for name, modulus in (
                ("column", column),
                ("stress", stress),
                ("shear", young / (2 * (1 + nu))),
            ):
                flexibility[name] += thickness / (modulus * run.area)
    normal = run.value("normal_stiffness")
    shear = run.value("tangential_stiffness")
    slack = {}
    for name in ("normal_stiffness", "tangential_stiffness"):
        slack[name] = EVALUATION_TOL * run.value(name) + STATED_ERROR_FACTOR * run.error(name)
    upper = 1 / flexibility["column"]
    yield Finding(
        "normal_stiffness",
        normal,
        min(normal, upper),
        slack["normal_stiffness"],
        "N/m",
        ROUTE_OF_UPPER_BOUND,
    )
    yield Finding(
        "tangential_stiffness",
        shear,
        min(shear, 1 / flexibility["shear"]),
        slack["tangential_stiffness"],
        "N/m",
        ROUTE_OF_UPPER_BOUND,
    )
    if patch.active.all() and not patch.has_skin and patch.strips is None:
        yield Finding(
            "normal_stiffness",
            normal,
            max(normal, 1 / flexibility["stress"]),
            slack["normal_stiffness"],
            "N/m",
            ROUTE_OF_LOWER_BOUND,
        )


def check_pressure_measures(run: Evidence) -> Iterator[Finding]:
    """Compare the measures of the pressure with the nodal pressures.

    By definition, loaded_fraction × pressure_peak is the mean pressure, load/(length × width); the
    moment is the sum of force × x; each contact edge lies within one cell of its last node. The
    error estimates of the measures are added to the thresholds, because the measures may come from
    another mesh than the nodal pressures.
    """
    patch = run.result.patch
    names = ("loaded_fraction", "pressure_peak", "moment", "contact_fraction", "normal_load")
    if patch is None or patch.strips is not None or any(run.value(name) is None for name in names):
        return
    if patch.pressure.outcome is Outcome.NO_CONTACT or "wear" in run.scene:
        return
    loaded_fraction, peak, moment, contact_fraction, load = (run.value(name) for name in names)
    mean = load / run.area
    weight = patch.pieces.interface.weight
    relative_errors = (
        run.error("loaded_fraction") / loaded_fraction + run.error("pressure_peak") / peak
    )
    relative = STATED_ERROR_FACTOR * relative_errors
    yield Finding(
        "the mean pressure, loaded_fraction × pressure_peak,",
        loaded_fraction * peak,
        mean,
        (EVALUATION_TOL + relative) * mean,
        "Pa",
    )
    if run.result.measures["moment"].engine == HALF_SPACE_SOURCE:
        surface = patch.points.surface
        moment_of_pressure = float(surface.x @ (surface.sigma_n * surface.weight))
    else:
        moment_of_pressure = float(patch.x @ (patch.pressure.sigma_n * weight))
    yield Finding(
        "the moment of the pressure",
        moment,
        moment_of_pressure,
        EVALUATION_TOL * load * run.model.patch.pieces.length / 2
        + STATED_ERROR_FACTOR * run.error("moment"),
        "N m",
    )
    cells = float(values.edge_cell_lengths(patch.x, patch.active).sum())
    nodal_fraction = float(weight[patch.active].sum()) / run.area
    yield Finding(
        "contact_fraction",
        contact_fraction,
        nodal_fraction,
        EVALUATION_TOL
        + 2 * cells / run.model.patch.pieces.length
        + STATED_ERROR_FACTOR * run.error("contact_fraction"),
    )
