"""Random benches with wear, and an independent integration of Archard's law for comparison.

This is the campaign "wear" of `campaigns.py`.

Truth: dh/ds = coefficient * pressure for the depth h and the sliding distance s, on the compliance
of the elements of order 4 of `static_reference`. Nothing of the package is used. Each step is an
implicit Euler step: the contact is solved with C + diag(coefficient * ds / area). Steps halved
twice give Richardson's extrapolation, and a coarser mesh gives the uncertainty. The volume has the
closed form coefficient * load * path (`wear_forms.worn_volume`).
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
import static_reference as reference
import static_scenes
from wear_forms import worn_volume

import patchfem as pf

# Cells along the part in contact before or after wear; the second mesh gives the truth.
CELLS = (30, 75)
STEPS = (30, 60, 120)  # Numbers of implicit Euler steps; each halves the previous steps.
# First of the coarsest steps relative to the path; pressure at a corner wears off immediately.
FIRST_STEP = 1e-4


class WearScene(NamedTuple):
    """Patch that slides back and forth without partial slip, in SI units."""

    patch: reference.PatchScene
    coefficient: float  # [m^2/N]
    amplitude: float  # [m]
    cycles: float

    @property
    def path(self) -> float:
        """Sliding distance [m]."""
        return 4 * self.amplitude * self.cycles


class WearModel(NamedTuple):
    """Discrete patch: compliances (m, m) [m/N] per unit width, positions, weights and gap (m,) [m]."""

    normal: np.ndarray
    tangential: np.ndarray
    place: np.ndarray
    weight: np.ndarray
    gap: np.ndarray


def draw_scene(seed: int) -> WearScene:
    """Draw the patch of `static_scenes` for a seed, and a wear of 0.03 to 10 times its elastic approach."""
    patch = static_scenes.draw_scene(seed)
    random = np.random.default_rng([seed, 52])
    pressure = patch.load / patch.width / patch.length
    elastic = pressure * (patch.lower.height + patch.upper.height) / patch.lower.layers[1][0]
    depth = elastic * 10 ** random.uniform(-1.5, 1)
    coated = [body.thickness for body in (patch.lower, patch.upper) if body.thickness]
    depth = min([depth] + [0.02 * thickness for thickness in coated])
    coefficient = float(f"{10 ** random.uniform(-16, -13):.4g}")
    amplitude = float(f"{10 ** random.uniform(-6, -4):.4g}")
    cycles = float(f"{max(depth / (coefficient * pressure * 4 * amplitude), 1.0):.4g}")
    return WearScene(patch, coefficient, amplitude, cycles)


def format_scene(scene: WearScene) -> str:
    """Return the scene as text."""
    return static_scenes.format_scene(scene.patch) + (
        '[friction]\nlaw = "coulomb"\nstatic = 0.3\n[slide]\nkind = "sine"\nfrequency = "10 Hz"\ncycles = 2\n'
        f'amplitude = "{scene.amplitude!r} m"\n[wear]\ncoefficient = "{scene.coefficient!r} m^2/N"\n'
        f"cycles = {scene.cycles!r}\n"
    )


def discretize(patch: reference.PatchScene, span: tuple, cells: int) -> WearModel:
    """Condense both bodies to an interface with uniform cells over `span` and larger ones outside it."""
    half = patch.length / 2
    size = (span[1] - span[0]) / cells
    corner = min(patch.lower.height, patch.length) / 60
    points = [-half, half]
    sizes = [min(corner, size)] * 2
    if patch.lower.length != patch.upper.length:
        sizes = [size / 8] * 2
    for place in np.linspace(*span, cells + 1):
        points = [*points, float(place)]
        sizes = [*sizes, size]
    if patch.step:
        points = [*points, patch.step[1]]
        sizes = [*sizes, size / 4]
    x = reference.grade_points(points, sizes, -half, half, 0.5, patch.length / 10)
    place, weight = reference.order_four.face_nodes(x, reference.ORDER)
    bodies = [patch.lower] + [patch.upper] * (patch.upper != patch.lower)
    parts = [reference.condense_face(body, patch.plane, x, 0.5, corner) for body in bodies]
    low = parts[0]
    high = parts[-1]
    normal = low[0] + high[0]
    if patch.skin:
        normal = normal + np.diag(1 / (patch.skin * weight))
    gap = reference.unloaded_gap(patch, place)
    return WearModel(
        normal, low[1] + high[1] if patch.upper == patch.lower else np.empty(0), place, weight, gap
    )


class WornPatch(NamedTuple):
    """State after wear: depth of both bodies together (m,) [m], nodal forces, approach, nodes in contact."""

    depth: np.ndarray
    force: np.ndarray
    approach: float
    active: np.ndarray


def integrate_depth(model: WearModel, scene: WearScene, steps: int) -> WornPatch:
    """Integrate the depth along the sliding distance in `steps` steps that grow geometrically."""
    load = scene.patch.load / scene.patch.width
    edges = (
        np.expm1(np.linspace(0, 1, steps + 1) * np.log1p(1 / FIRST_STEP)) * FIRST_STEP * scene.path
    )
    active = None
    depth = np.zeros(model.gap.size)
    for begin, end in pairwise(edges):
        rate = scene.coefficient * (end - begin) / model.weight
        force, approach, active = reference.solve_contact(
            model.normal + np.diag(rate), model.gap + depth, load, active
        )
        depth = depth + rate * force
    return WornPatch(depth, force, approach, active)


def compute_measures(model: WearModel, scene: WearScene, steps: int) -> dict:
    """Return the measures after wear that is integrated in `steps` steps."""
    depth, force, approach, active = integrate_depth(model, scene, steps)
    pressure = force / model.weight
    index = np.flatnonzero(active)
    patch = scene.patch
    place = model.place
    edges = [
        reference.locate_edge(place, pressure, int(index[0]), -1, patch),
        reference.locate_edge(place, pressure, int(index[-1]), 1, patch),
    ]
    inverse = np.linalg.inv(model.normal[np.ix_(index, index)])
    values = {
        "worn_depth_max": float(depth.max()),
        "contact_half_width": (edges[1] - edges[0]) / 2,
        "pressure_peak": reference.interpolate_peak(place, pressure),
        "approach": approach,
        "normal_stiffness": inverse.sum() * patch.width,
        "rotational_stiffness": place[index] @ inverse @ place[index] * patch.width,
    }
    if index.size == index[-1] - index[0] + 1:  # The contact has no gap inside.
        values["contact_fraction"] = (edges[1] - edges[0]) / patch.length
    if model.tangential.size:
        compliance = model.tangential[np.ix_(index, index)]
        values["tangential_stiffness"] = (
            np.linalg.solve(compliance, np.ones(index.size)).sum() * patch.width
        )
    return values


def find_contact_span(model: WearModel, scene: WearScene) -> tuple:
    """Return the smallest and largest position in contact before and after wear."""
    load = scene.patch.load / scene.patch.width
    rate = scene.coefficient * scene.path / model.weight
    new = reference.solve_contact(model.normal, model.gap, load)[2]
    worn = reference.solve_contact(model.normal + np.diag(rate), model.gap, load)[2]
    positions = model.place[new | worn]
    return float(positions.min()), float(positions.max())


def solve_scene(scene: WearScene) -> dict:
    """Return the measures after wear: name -> (value, uncertainty)."""
    patch = scene.patch
    half = scene.patch.length / 2
    span = (-half, half)
    for _ in range(3):
        low, high = find_contact_span(discretize(patch, span, CELLS[0]), scene)
        margin = 0.05 * (high - low) + 1e-6 * patch.length
        span = (max(low - margin, -half), min(high + margin, half))
    extrapolated = []
    for cells in CELLS:
        model = discretize(patch, span, cells)
        coarse, middle, fine = (compute_measures(model, scene, steps) for steps in STEPS)
        shared = coarse.keys() & middle.keys() & fine.keys()
        extrapolated.append(
            {
                name: (
                    2 * fine[name] - middle[name],
                    abs(2 * fine[name] - 3 * middle[name] + coarse[name]),
                )
                for name in shared
            }
        )
    truth = {
        name: (value, error + abs(value - extrapolated[0][name][0]))
        for name, (value, error) in extrapolated[1].items()
        if name in extrapolated[0]
    }
    truth["worn_volume"] = (worn_volume(scene.coefficient, patch.load, scene.path), 0.0)
    return truth


def compare_bench(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the bench of a seed with its reference; see `campaigns`."""
    scene = draw_scene(seed)
    line = {"group": static_scenes.KINDS[seed % len(static_scenes.KINDS)], "engine": "wear"}
    started = process_time()
    try:
        run = pf.run(format_scene(scene))
    except pf.PatchfemError as error:
        return line | {"rows": [], "refused": str(error)}
    line |= {"seconds": process_time() - started, "warnings": list(run.warnings)}
    if earlier and "true" in earlier:
        line |= {key: earlier[key] for key in ("true", "doubt")}
    else:
        reference_values = solve_scene(scene)
        line["true"] = {name: value for name, (value, _) in reference_values.items()}
        line["doubt"] = {name: doubt for name, (_, doubt) in reference_values.items()}
    return line | {"rows": static_scenes.reliable_rows(run.measures, line["true"], line["doubt"])}
