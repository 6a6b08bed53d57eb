"""Stress around the contact on a regular grid, frame by frame, for the film of a page."""

from pathlib import Path

import numpy as np

from .vtkhdf import Frames, read_frames

GRID_POINTS = (61, 60)  # columns and rows of the grid
MAX_FRAMES = 30
WINDOW_HEIGHT = 0.6  # height of the window around the contact over its width
# Largest contact, over the length of the pieces, that the window shows as a whole.
MAX_CONTACT_FRACTION = 0.25
# Ratio to the median interval between frames above which an interval separates the pressed state
# from the last cycle.
MIN_BREAK_RATIO = 3.0


def last_frames(times) -> np.ndarray:
    """Return the numbers of the last frames whose times (f,) [s] follow each other closely.

    For a rig they are the frames of its last cycle, without the pressed state long before it; for a
    bench all frames of its slide.
    """
    steps = np.diff(times)
    if not steps.size:
        return np.arange(len(times))
    breaks = np.flatnonzero(steps > MIN_BREAK_RATIO * np.median(steps))
    return np.arange(breaks[-1] + 1 if breaks.size else 0, len(times))


def contact_window(frames: Frames) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top [m] of a window around the contact in all frames.

    It is twice as wide as the contact; around the largest pressure of a long contact it is a
    quarter of the length of the pieces.
    """
    line = frames.blocks["interface"]
    x = line.points[:, 0]
    pressure = line.point_data["normal_stress"].max(axis=0)
    length = np.ptp(x)
    touching = x[pressure > 0] if pressure.any() else x[[0, -1]]
    width = np.ptp(touching)
    is_long = width > MAX_CONTACT_FRACTION * length
    centre = x[np.argmax(pressure)] if is_long else (touching[0] + touching[-1]) / 2
    half = length / 8 if is_long else max(width, 4 * np.diff(x).max())
    left = max(x[0], min(centre - half, x[-1] - 2 * half))
    right = min(x[-1], left + 2 * half)
    reach = WINDOW_HEIGHT / 2 * (right - left)
    return float(left), float(right), float(-reach), float(reach)


def stress_frames(path: Path) -> dict[str, np.ndarray]:
    """Return the von Mises stress around the contact in the last cycle, on a regular grid.

    Parameters
    ----------
    path : Path
        A file of fields. A static patch has one frame.

    Returns
    -------
    dict
        `x` (61,) and `y` (60,) [m], y > 0 in the upper piece; `times` (f,) [s] of at most 30 frames;
        `values` (f, 60, 61) [Pa], constant in each cell of a piece, and NaN outside.

    Raises
    ------
    PatchfemError
        If the file is damaged.
    """
    frames = read_frames(path, ("von_mises", "normal_stress"))
    cycle = last_frames(frames.times)
    numbers = cycle[np.linspace(0, cycle.size - 1, min(MAX_FRAMES, cycle.size)).round().astype(int)]
    left, right, bottom, top = contact_window(frames)
    columns, rows = GRID_POINTS
    x = np.linspace(left, right, columns)
    row_height = (top - bottom) / rows
    y = bottom + row_height * (np.arange(rows) + 0.5)  # no row lies on the interface

    values = np.full((numbers.size, rows, columns), np.nan)
    for side, is_inside in (("lower", y < 0), ("upper", y > 0)):
        block = frames.blocks[side]
        corners = block.points[block.cells, :2]
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        is_inside &= (y >= low[1]) & (y <= high[1])
        cells = find_cells(corners, x, y[is_inside])
        values[:, is_inside] = block.cell_data["von_mises"][numbers][:, cells]
    return {"x": x, "y": y, "times": frames.times[numbers], "values": values}


def find_cells(corners: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the numbers of the cells (j, k) that contain the points of a grid.

    A point belongs to the cell whose sides it is closest to, measured in the half-widths of the cell; within a cell of a
    rectangular mesh this distance is at most 1.

    Parameters
    ----------
    corners : (c, n, 2) ndarray
        Corners of the cells [m].
    x, y : (k,), (j,) ndarray
        Positions of the columns and rows of the grid [m].
    """
    low = corners.min(axis=1)
    high = corners.max(axis=1)
    centres = (low + high) / 2
    half_widths = (high - low) / 2
    in_x = np.abs(x[:, None] - centres[:, 0]) / half_widths[:, 0]
    cells = np.empty((y.size, x.size), int)
    for row, place in enumerate(y):
        in_y = np.abs(place - centres[:, 1]) / half_widths[:, 1]
        cells[row] = np.argmin(np.maximum(in_x, in_y), axis=1)
    return cells
