"""Data of the export tests: a small series of mixed cells with random values, and the scene of a small run."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from scene_texts import COATED, COULOMB

from patchfem.export.fields import vtkhdf
from patchfem.export.fields.blocks import build_blocks

UNITS = {
    "displacement": "m",
    "stress": "Pa",
    "von_mises": "Pa",
    "stress_error": "1",
    "material": "1",
    "normal_stress": "Pa",
    "gap": "m",
    "status": "1",
    "normal_bond_lower": "Pa",
    "normal_bond_upper": "Pa",
}
CROWNED = (
    COATED
    + """\
[contact.crown]
radius = "80 m"
[contact.shear]
"""
    + COULOMB
    + """\
[slide]
kind = "triangle"
amplitude = "0.4 um"
speed = "0.2 mm/s"
[accuracy]
steps_per_cycle = 40
"""
)


def make_body(sign: float, frames: int, rng) -> dict:
    """Return the data of a body of three columns of two quadrilaterals, one of them split.

    The number of a node is 3 * column + row.
    """
    x, depth = np.meshgrid([-1e-3, -0.2e-3, 0.3e-3, 1e-3], [0.0, 1e-4, 1e-3], indexing="ij")
    node = np.arange(12).reshape(4, 3)
    quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(
        -1, 4
    )
    triangles = np.stack([quads[2, [0, 1, 2]], quads[2, [0, 2, 3]]])
    return {
        "points": np.stack([x.ravel(), sign * depth.ravel()], axis=1),
        "blocks": [triangles, np.delete(quads, 2, 0)],
        "interface": node[:, 0],
        "material": np.array([1, 1, 1, 0, 0, 1, 0]) > 0,
        "displacement": rng.normal(size=(frames, 12, 2)) * 1e-6,
        "stress": rng.normal(size=(frames, 7, 4)) * 1e7,
        "mises": rng.random((frames, 7)) * 1e7,
        "stress_error": rng.random((frames, 7)),
        "bond": {"normal_bond": rng.normal(size=(frames, 4)) * 1e6},
    }


def write_small_series(folder, frames: int = 3, seed: int = 0, times=None):
    """Write a results folder that contains only fields.vtkhdf, and return the data passed to the writer."""
    rng = np.random.default_rng(seed)
    gap = rng.random((frames, 4)) * 1e-6
    interface = {
        "normal_stress": rng.random((frames, 4)) * 1e7,
        "gap": gap,
        "status": rng.integers(0, 3, (frames, 4)),
    }
    pair = make_body(-1.0, frames, rng), make_body(1.0, frames, rng)
    blocks = build_blocks(*pair, np.array([-1e-3, -0.2e-3, 0.3e-3, 1e-3]), interface)
    times = np.cumsum(rng.random(frames)) if times is None else np.array(times)
    folder.mkdir(exist_ok=True)
    vtkhdf.write_series(folder / vtkhdf.NAME, blocks, times, UNITS)
    return SimpleNamespace(blocks=blocks, times=times, pair=pair, interface=interface)


def frame_values(values, frame: int):
    """Return one frame of an array that may be constant in time."""
    return values[frame if len(values) > 1 else 0]
