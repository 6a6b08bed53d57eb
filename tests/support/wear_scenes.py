"""Random benches with wear, and an independent integration of Archard's law for comparison.

This is the campaign "wear" of `campaigns.py`.

Truth: dh/ds = coefficient * pressure for the depth h and the sliding distance s, on the compliance
of the elements of order 4 of `patch_of_order_four`. Nothing of the package is used. Each step is an
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
import static_scenes
from patch_of_order_four import (
    Level,
    Pressed,
    Scene,
    condense_pieces,
    find_intervals,
    find_measures,
    read_scene,
)
from wear_forms import worn_volume

import patchfem as pf

# Cells along the part in contact before or after wear; the second mesh gives the truth.
CELLS = (30, 75)
STEPS = (30, 60, 120)  # Numbers of implicit Euler steps; each halves the previous steps.
# First of the coarsest steps relative to the path; pressure at a corner wears off immediately.
FIRST_STEP = 1e-4


class WearScene(NamedTuple):
    """Patch that slides back and forth without partial slip, in SI units."""

    patch: static_scenes.PatchScene
    coefficient: float  # [m^2/N]
    amplitude: float  # [m]
    cycles: float

    @property
    def path(self) -> float:
        """Sliding distance [m]."""
        return 4 * self.amplitude * self.cycles


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


def format_scene(scene: WearScene, **wear) -> str:
    """Return the scene as text, with keys of [wear] that differ."""
    return static_scenes.format_scene(
        scene.patch,
        friction={"law": "coulomb", "static": 0.3},
        slide={"kind": "sine", "frequency": 10.0, "cycles": 2, "amplitude": scene.amplitude},
        wear={"coefficient": scene.coefficient, "cycles": scene.cycles} | wear,
    )


def discretize(scene: Scene, span: tuple, cells: int) -> Pressed:
    """Return the unloaded patch on columns of at most 1/cells of `span` there and larger ones outside."""
    level = Level(1 / (8 * cells), 1 / 60, 0.5, cells, 5)
    x, weight, compliances = condense_pieces(scene, [span], level)
    area = weight * scene.width
    empty = np.zeros(x.size)
    return Pressed(x, area, *compliances, 1 / (scene.layer * area), empty, 0.0, empty, [])


def solve_contact(compliance, gap, load: float, active=None) -> tuple:
    """Solve the contact by an active-set method that starts from `active`.

    Parameters
    ----------
    compliance : (m, m) array
        Normal compliance [m/N].
    gap : (m,) array
        Of the unloaded faces [m].
    load : float
        Sum of the nodal forces [N].
    active : (m,) array of bool, optional
        By default the smallest three tenths of the gaps.

    Returns
    -------
    tuple
        Nodal forces (m,) >= 0, the approach, and the nodes in contact. The gaps under load are >= 0, and zero where
        the force is not.
    """
    if active is None:
        active = gap <= np.quantile(gap, 0.3)
    for _ in range(400):
        index = np.flatnonzero(active)
        columns = np.stack([np.ones(index.size), gap[index]], axis=1)
        rows = np.linalg.solve(compliance[np.ix_(index, index)], columns)
        approach = (load + rows[:, 1].sum()) / rows[:, 0].sum()
        force = np.zeros(gap.size)
        force[index] = approach * rows[:, 0] - rows[:, 1]
        displacement = compliance @ force
        leaves = active & (force < 0)
        enters = ~active & (displacement + gap - approach < -1e-13 * np.abs(displacement).max())
        if not leaves.any() and not enters.any():
            return force, approach, active
        active = active & ~leaves if leaves.any() else active | enters
    raise RuntimeError("no contact found")


class WornPatch(NamedTuple):
    """State after wear: depth of both bodies together (m,) [m], nodal forces [N], approach, nodes in contact."""

    depth: np.ndarray
    force: np.ndarray
    approach: float
    active: np.ndarray


def get_compliance(model: Pressed) -> np.ndarray:
    """Return the normal compliance (m, m) [m/N] of both pieces and the linear layer."""
    return model.nn + np.diag(model.soft)


def integrate_depth(patch: Scene, model: Pressed, scene: WearScene, steps: int) -> WornPatch:
    """Integrate the depth along the sliding distance in `steps` steps that grow geometrically."""
    edges = (
        np.expm1(np.linspace(0, 1, steps + 1) * np.log1p(1 / FIRST_STEP)) * FIRST_STEP * scene.path
    )
    compliance, gap = get_compliance(model), patch.gap(model.x)
    active = None
    depth = np.zeros(gap.size)
    for begin, end in pairwise(edges):
        rate = scene.coefficient * (end - begin) / model.area
        force, approach, active = solve_contact(
            compliance + np.diag(rate), gap + depth, patch.load, active
        )
        depth = depth + rate * force
    return WornPatch(depth, force, approach, active)


def compute_measures(patch: Scene, model: Pressed, scene: WearScene, steps: int) -> dict:
    """Return the measures after wear that is integrated in `steps` steps."""
    depth, force, approach, active = integrate_depth(patch, model, scene, steps)
    intervals = find_intervals(patch, model.x, force / model.area, active)
    worn = model._replace(force=force, approach=approach, active=active, intervals=intervals)
    return find_measures(patch, worn) | {"worn_depth_max": float(depth.max())}


def find_contact_span(patch: Scene, model: Pressed, scene: WearScene) -> tuple:
    """Return the smallest and largest position in contact before and after wear."""
    compliance, gap = get_compliance(model), patch.gap(model.x)
    rate = scene.coefficient * scene.path / model.area
    new = solve_contact(compliance, gap, patch.load)[2]
    worn = solve_contact(compliance + np.diag(rate), gap, patch.load)[2]
    positions = model.x[new | worn]
    return float(positions.min()), float(positions.max())


def solve_scene(scene: WearScene) -> dict:
    """Return the measures after wear: name -> (value, uncertainty)."""
    patch = read_scene(static_scenes.make_contact(scene.patch))
    half = patch.half
    span = (-half, half)
    for _ in range(3):
        low, high = find_contact_span(patch, discretize(patch, span, CELLS[0]), scene)
        margin = 0.05 * (high - low) + 1e-6 * half
        span = (max(low - margin, -half), min(high + margin, half))
    extrapolated = []
    for cells in CELLS:
        model = discretize(patch, span, cells)
        coarse, middle, fine = (compute_measures(patch, model, scene, steps) for steps in STEPS)
        extrapolated.append(
            {
                name: (
                    2 * fine[name] - middle[name],
                    abs(2 * fine[name] - 3 * middle[name] + coarse[name]),
                )
                for name in fine
            }
        )
    truth = {
        name: (value, error + abs(value - extrapolated[0][name][0]))
        for name, (value, error) in extrapolated[1].items()
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
