"""Shared by the export tests: a small series of any cells with random numbers, and the scene of a small run."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from scene_texts import COATED, COULOMB

from patchfem.export.fields.blocks import blocks_of
from patchfem.export.fields.vtkhdf import NAME, write_series

UNITS = {"displacement": "m", "stress": "Pa", "von_mises": "Pa", "stress_error": "1", "material": "1",
         "normal_stress": "Pa", "gap": "m", "status": "1", "normal_bond_lower": "Pa", "normal_bond_upper": "Pa"}
CROWNED = COATED + """\
[contact.crown]
radius = "80 m"
[contact.shear]
""" + COULOMB + """\
[slide]
kind = "triangle"
amplitude = "0.4 um"
speed = "0.2 mm/s"
[accuracy]
steps_per_cycle = 40
"""


def body(sign: float, frames: int, rng) -> dict:
    """Three columns of two quads, one of them cut in two; node 3 * column + row."""
    x, depth = np.meshgrid([-1e-3, -0.2e-3, 0.3e-3, 1e-3], [0.0, 1e-4, 1e-3], indexing="ij")
    node = np.arange(12).reshape(4, 3)
    quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(-1, 4)
    triangles = np.stack([quads[2, [0, 1, 2]], quads[2, [0, 2, 3]]])
    return {"points": np.stack([x.ravel(), sign * depth.ravel()], axis=1),
            "blocks": [triangles, np.delete(quads, 2, 0)], "interface": node[:, 0],
            "material": np.array([1, 1, 1, 0, 0, 1, 0]) > 0,
            "displacement": rng.normal(size=(frames, 12, 2)) * 1e-6, "stress": rng.normal(size=(frames, 7, 4)) * 1e7,
            "mises": rng.random((frames, 7)) * 1e7, "stress_error": rng.random((frames, 7)),
            "bond": {"normal_bond": rng.normal(size=(frames, 4)) * 1e6}}


def write_small(folder, frames: int = 3, seed: int = 0, times=None):
    """A results folder with only fields.vtkhdf; what was given to the writer."""
    rng = np.random.default_rng(seed)
    gap = rng.random((frames, 4)) * 1e-6
    interface = {"normal_stress": rng.random((frames, 4)) * 1e7, "gap": gap,
                 "status": rng.integers(0, 3, (frames, 4))}
    pair = body(-1.0, frames, rng), body(1.0, frames, rng)
    blocks = blocks_of(*pair, np.array([-1e-3, -0.2e-3, 0.3e-3, 1e-3]), interface)
    times = np.cumsum(rng.random(frames)) if times is None else np.array(times)
    folder.mkdir(exist_ok=True)
    write_series(folder / NAME, blocks, times, UNITS)
    return SimpleNamespace(blocks=blocks, times=times, pair=pair, interface=interface)


def at(values, frame: int):
    """One frame of an array that may be constant."""
    return values[frame if len(values) > 1 else 0]
