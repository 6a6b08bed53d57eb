"""Data of the export tests: a small series of mixed cells with random values, and the scene of a small run."""

from types import SimpleNamespace

import numpy as np

from patchfem.export.fields import vtkhdf
from patchfem.export.fields.vtkhdf import make_blocks
from patchfem.runs import PieceFields, PieceFrames

X = np.array([-1e-3, -0.2e-3, 0.3e-3, 1e-3])  # columns of nodes [m]


def make_piece(sign: float, order: np.ndarray, rng) -> PieceFields:
    """Return a piece of three columns of two quadrilaterals, one of them split into triangles.

    The number of a node is 3 * column + row. Frames of the same number in `order` (f,) are equal.
    """
    frames = len(order)
    x, depth = np.meshgrid(X, [0.0, 1e-4, 1e-3], indexing="ij")
    node = np.arange(12).reshape(4, 3)
    corners = (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:])
    quads = np.stack([corner.ravel() for corner in corners], axis=1)
    triangles = np.stack([quads[2, [0, 1, 2]], quads[2, [0, 2, 3]]])
    return PieceFields(
        points=np.stack([x.ravel(), sign * depth.ravel()], axis=1),
        blocks=(triangles, np.delete(quads, 2, 0)),
        is_coating=np.arange(7) < 3,
        displacement=rng.normal(size=(frames, 12, 2))[order] * 1e-6,
        stress=rng.normal(size=(frames, 7, 4))[order] * 1e7,
        von_mises=rng.random((frames, 7))[order] * 1e7,
        stress_error=rng.random((frames, 7))[order],
    )


def write_small_series(folder, frames: int = 3, times=None, order=None):
    """Write a results folder with fields.vtkhdf alone; return the pieces and blocks that were written.

    Inside the pieces, frames of the same number in `order` (f,) are equal; by default all frames differ.
    """
    order = np.arange(frames) if order is None else np.array(order)
    rng = np.random.default_rng(0)
    times = np.cumsum(rng.random(frames)) if times is None else np.array(times)
    lower, upper = (make_piece(sign, order, rng) for sign in (-1.0, 1.0))
    interface = {
        "displacement": lower.displacement[:, ::3],
        "normal_stress": rng.random((frames, 4)) * 1e7,
        "gap": rng.random((frames, 4)) * 1e-6,
        "status": rng.integers(3, size=(frames, 4)),
        "holder_slide": np.repeat(rng.normal(size=(frames, 1)) * 1e-5, 4, axis=1),
        "normal_bond_lower": rng.normal(size=(frames, 4)) * 1e6,
        "worn_depth": rng.random((frames, 4)) * 1e-7,
    }
    pieces = PieceFrames(times, lower, upper, X, np.ones(4), interface, width=5e-3)
    blocks = make_blocks(pieces)
    folder.mkdir(exist_ok=True)
    vtkhdf.write_blocks(folder / vtkhdf.VTKHDF_FILE, blocks, times)
    return SimpleNamespace(pieces=pieces, blocks=blocks, times=times)


def frame_values(values, frame: int):
    """Return one frame of a field that may be constant in time."""
    return values[frame % len(values)]
