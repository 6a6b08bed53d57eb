"""The rig's pieces under any misalignment: condensed once on three graded meshes, pressed as often as wanted.

What the studies beside this file share. Columns grow from 0.3 um at the edge that stays closed by 1.5 % each on the
finest mesh, so a contact edge is as sharp at 1e-2 rad as at 1e-6; the errors are those of `runs.patch.measures` from
cells two and four times as long.
"""

from functools import cache
from pathlib import Path

import numpy as np

from patchfem.mesh import Layout, RowHeights, TensorGrid, divide_into_columns, divide_into_rows
from patchfem.model import build
from patchfem.model.patch import PatchModel
from patchfem.runs.patch.condensed import CondensedPair, condense
from patchfem.runs.patch.measures import with_static_measures
from patchfem.runs.patch.press import Patch, solve_patch_contact
from patchfem.scene import scene

RIG = Path(__file__).parents[1] / "rig" / "rig.toml"
# text of the scene up to [contact], for the patch at rest
TEXT = RIG.read_text(encoding="utf-8").partition("[friction]")[0]
TILTS = tuple(10.0 ** np.arange(-6, -1.5, 0.5))
RUBBED_FRACTION = 0.1  # fraction of the mean pressure above which a point counts as rubbed
# surface layers; "peaks" are those of `rough_skin`, 80 um apart, with heights scattered by 0.2 um
SKINS = {
    "bare": (),
    "linear": ('law="linear"', "normal_stiffness=1e13 Pa/m", "tangential_ratio=0.8"),
    "exponential": ('law="exponential"', "decay_length=2.5 um", "tangential_ratio=0.8"),
    "peaks": (
        'law="hertz"',
        "radius=10.5 um",
        "density=156 1/mm^2",
        "height_deviation=0.2 um",
        "tangential_ratio=0.8",
    ),
}


def case(angle: float | None = None, skin: str = "bare", *more: str) -> PatchModel:
    """Return the model of the pieces with a layer of SKINS at an angle [rad]; with None the piece rotates freely.

    `more` are further key=value of contact.
    """
    sets = [f"asperities.{text}" for text in SKINS[skin]] + list(more)
    if angle is not None:
        sets.append(f"tilt.angle={angle!r} rad")
    text = TEXT if angle is not None else TEXT.partition("[contact.tilt]")[0]
    return build(scene.loads(text, RIG, [f"contact.{one}" for one in sets])).patch


@cache
def pair(halvings: int = 2) -> CondensedPair:
    """Return the condensed pieces on the coarsest mesh (110 columns), whose cells are halved `halvings` times."""
    asked = case(0.0)
    half = asked.pieces.length / 2
    x = divide_into_columns(Layout(-half, half, ((-half, -half, 1.2e-6),), half / 30, 0.06))
    height = asked.pieces.height
    rows = RowHeights(
        first=x[1] - x[0], last=height / 3, coating=height / 3, largest=height / 3, growth=0.25
    )
    grid = TensorGrid(x, *divide_into_rows(height, asked.pieces.lower.thickness, rows))
    for _ in range(halvings):
        grid = grid.refine()
    return condense(asked, grid)


def patches(asked: PatchModel) -> tuple:
    """Return the Patch of a model of `case` on the finest mesh, and on meshes with cells twice and four times as long."""
    return tuple(solve_patch_contact(asked, pair(k)) for k in (2, 1, 0))


def compute_measures(asked: PatchModel) -> dict:
    """Return {name: Measure} of a model of `case`, with `rubbed`, the portion that rubs, as a value."""
    fine = with_static_measures(patches(asked), None)[0]
    return fine.measures | {"rubbed": rubbed_portion(fine)}


def rubbed_portion(patch: Patch) -> float:
    """Return the portion of the length that carries at least RUBBED_FRACTION of the mean pressure.

    Its ends are interpolated between nodes.
    """
    x = patch.x
    mean = patch.pressure.load / patch.pieces.interface.weight.sum()
    sigma = patch.pressure.sigma_n - RUBBED_FRACTION * mean
    low = np.minimum(sigma[:-1], sigma[1:])
    high = np.maximum(sigma[:-1], sigma[1:])
    part = np.clip(high / np.maximum(high - low, 1e-300), 0.0, 1.0)
    return float(np.diff(x) @ part / np.ptp(x))
