"""Stress around the contact on a regular grid, frame by frame, for the film of a page."""

from pathlib import Path

import numpy as np

from ...formatting import format_number
from ..charts.panel import Curve, Panel, make_axis
from .vtkhdf import Frames, read_frames

FILM_GRID_POINTS = (61, 60)  # columns and rows of the grid
MAX_FILM_FRAMES = 30  # largest number of frames, chosen evenly in the last cycle
WINDOW_HEIGHT_OVER_WIDTH = 0.6  # height of the window around the contact over its width
# Largest contact, over the length of the pieces, that the window shows as a whole.
MAX_SHOWN_CONTACT_FRACTION = 0.25
# Ratio to the median interval between frames above which an interval separates the pressed state
# from the last cycle.
MIN_FRAME_GAP_RATIO = 3.0


def select_last_frames(times) -> np.ndarray:
    """Return the numbers of the last frames whose times (f,) [s] follow each other closely.

    For a rig they are the frames of its last cycle, without the pressed state long before it; for a
    bench all frames of its slide.
    """
    steps = np.diff(times)
    if not steps.size:
        return np.arange(len(times))
    breaks = np.flatnonzero(steps > MIN_FRAME_GAP_RATIO * np.median(steps))
    return np.arange(breaks[-1] + 1 if breaks.size else 0, len(times))


def find_contact_window(frames: Frames) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top [m] of a window around the contact in all frames.

    It is twice as wide as the contact, but at least eight elements there; around the largest pressure of a long contact it
    is a quarter of the length of the pieces.
    """
    line = frames.blocks["interface"]
    x = line.points[:, 0]
    pressure = line.point_data["normal_stress"].max(axis=0)
    length = np.ptp(x)
    loaded = np.flatnonzero(pressure > 0)
    first, last = loaded[[0, -1]] if loaded.size else (0, x.size - 1)
    touching = x[[first, last]]
    width = np.ptp(touching)
    is_long = width > MAX_SHOWN_CONTACT_FRACTION * length
    centre = x[np.argmax(pressure)] if is_long else touching.mean()
    half = length / 8 if is_long else max(width, 4 * np.diff(x[max(first - 1, 0) : last + 2]).max())
    left = max(x[0], min(centre - half, x[-1] - 2 * half))
    right = min(x[-1], left + 2 * half)
    reach = WINDOW_HEIGHT_OVER_WIDTH / 2 * (right - left)
    return float(left), float(right), float(-reach), float(reach)


def make_stress_panels(path: Path) -> list[Panel]:
    """Return the film of the von Mises stress around the contact in the last cycle; [] if the pieces do not touch.

    The stress is drawn on a regular grid, and a static patch has one frame.

    Parameters
    ----------
    path : Path
        A file of fields.

    Raises
    ------
    PatchfemError
        If the file is damaged.
    """
    frames = read_frames(path, {"normal_stress", "von_mises"})
    cycle = select_last_frames(frames.times)
    count = min(MAX_FILM_FRAMES, cycle.size)
    numbers = cycle[np.linspace(0, cycle.size - 1, count).round().astype(int)]
    left, right, bottom, top = find_contact_window(frames)
    columns, rows = FILM_GRID_POINTS
    x = np.linspace(left, right, columns)
    y = bottom + (top - bottom) * (np.arange(rows) + 0.5) / rows  # no row is on the interface
    stress = _sample_stress(frames, numbers, x, y)
    if not np.nanmax(stress, initial=0.0) > 0:
        return []

    # all frames have the same scales
    title = "von Mises stress in both pieces"
    x_axis, y_axis = (make_axis(name, "m", np.concatenate([x, y])) for name in "xy")
    colours = make_axis(title, "Pa", stress)
    # after many cycles of wear the times of a cycle are equal in their first digits
    elapsed = frames.times[numbers] - frames.times[numbers[0]]
    times = make_axis("time", "s", elapsed)
    curves = [
        Curve(
            name=f"{format_number(float(time) * times.scale, 3)} {times.unit}",
            x=x * x_axis.scale,
            y=values * colours.scale,
            rows=y * y_axis.scale,
        )
        for time, values in zip(elapsed, stress, strict=True)
    ]
    caption = (
        "Stress around the contact, or around the largest pressure of a long contact; the interface is at y = 0. The "
        "colours are the same in all frames; t begins at the first one."
    )
    return [Panel(title, "film", x_axis, y_axis, curves, caption, colour_label=colours.unit)]


def _sample_stress(frames: Frames, numbers: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the von Mises stress (f, j, k) [Pa] of the cell at each point of a grid, NaN outside the pieces.

    `numbers` (f,) are those of the frames, and `x` (k,) and `y` (j,) [m] the ascending coordinates of the grid.
    """
    values = np.full((numbers.size, y.size, x.size), np.nan)
    for side in ("lower", "upper"):
        block = frames.blocks[side]
        stress = block.cell_data["von_mises"][numbers]
        corners = block.points[block.cells, :2]
        # A cell gives its stress to the points of the grid in the rectangle around it.
        first, last = (
            np.stack([np.searchsorted(x, ends[:, 0], how), np.searchsorted(y, ends[:, 1], how)], 1)
            for ends, how in ((corners.min(axis=1), "left"), (corners.max(axis=1), "right"))
        )
        for cell in np.flatnonzero((last > first).all(axis=1)):
            across, down = map(slice, first[cell], last[cell])
            values[:, down, across] = stress[:, cell, None, None]
    return values
