"""Data of the export tests: a small series of mixed cells with random values, and the scene of a small run."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from scene_texts import COATED, COULOMB

from patchfem.export.fields import vtkhdf
from patchfem.export.fields.blocks import Block, build_blocks

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


def make_wave_block(frames: int, across: int, deep: int) -> Block:
    """Return a block of quadrilaterals with smooth fields that move along x, as in a sliding body."""
    x, y = np.meshgrid(
        np.linspace(0, 12.7e-3, across + 1), np.linspace(0, 6.35e-3, deep + 1), indexing="ij"
    )
    node = np.arange(x.size).reshape(x.shape)
    quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(
        -1, 4
    )
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    centroids = points[quads].mean(axis=1)
    phase_sine = np.sin(2 * np.pi * np.arange(frames) / frames)[:, None]
    mises = 8e6 * np.exp(
        -(((centroids[:, 0] - 2e-3 * (2 + phase_sine)) / 3e-3) ** 2) - centroids[:, 1] / 2e-3
    )
    displacement = np.zeros((frames, x.size, 3), np.float32)
    displacement[..., 0] = 1e-5 * phase_sine + 1e-7 * np.cos(300 * points[:, 0]) * np.exp(
        -points[:, 1] / 3e-3
    )
    displacement[..., 1] = (
        -1e-6
        * np.exp(-(((points[:, 0] - 2e-3 * (2 + phase_sine)) / 4e-3) ** 2))
        * (1 - points[:, 1] / 7e-3)
    )
    stress = np.zeros((frames, len(quads), 6), np.float32)
    for number, factor in enumerate((-0.7, -1.1, -0.5, 0.3)):
        stress[..., number] = factor * mises * np.cos(number + 200 * centroids[:, 0])
    return Block(
        points,
        quads.ravel(),
        np.arange(len(quads) + 1) * 4,
        np.full(len(quads), 9, np.uint8),
        {"displacement": displacement},
        {
            "stress": stress,
            "von_mises": mises.astype(np.float32),
            "stress_error": (0.03 + 1e-9 * mises).astype(np.float32),
        },
    )


def write_wave_series(path, frames: int, across: int, deep: int) -> Block:
    """Write a series with the single block of `make_wave_block`, and return the block."""
    block = make_wave_block(frames, across, deep)
    vtkhdf.write_series(
        path,
        {"lower": block},
        np.arange(frames) * 1e-4,
        {"displacement": "m", "von_mises": "Pa"},
        {"lower": {"stress": 4096.0, "von_mises": 5000.0, "displacement": 2e-10}},
    )
    return block


def frame_values(values, frame: int):
    """Return one frame of an array that may be constant in time."""
    return values[frame if len(values) > 1 else 0]
