"""Numbers behind a picture of the pieces: positions, magnification, window, colour scale."""

from dataclasses import dataclass

import numpy as np

from ...formatting import choose_axis_unit
from ..fields.series import Frame

# Fraction of the area of a panel that the colour scale covers if it omits stress peaks.
COLOURED_AREA = 0.995
# Ratio of the stress at COLOURED_AREA to the largest one; at or above it, the scale is not cut.
MIN_PEAK_RATIO = 0.8
# Round-off error of a slide, relative to the largest motion: a slide is a difference of values that
# are stored in single precision.
ROUND_OFF = 1e-5
DRAWN_MOTION_FRACTION = 0.05  # largest motion or gap as drawn, relative to the height of a panel


@dataclass(frozen=True, eq=False, slots=True)
class Panel:
    """View of both pieces in a window, with magnified motion and a colour scale for the stress.

    Attributes
    ----------
    places : (N, 2) array
        Positions as drawn [mm].
    cells : (cells,) array of bool
        Cells that are drawn.
    factor : float
        Factor of the motion.
    slide : float
        Slide of the upper piece as a whole [mm].
    window : tuple
        (left, right, bottom, top) [mm].
    top : float
        Stress at the upper end of the colours [Pa].
    is_cut : bool
        Whether the stress of some cell exceeds this value.
    slide_factor : float
        Factor of the slide.
    """

    places: np.ndarray
    cells: np.ndarray
    factor: float
    slide: float
    window: tuple
    top: float
    is_cut: bool
    slide_factor: float = 1.0

    def title(self, scaled: bool = True) -> str:
        """Return the title of the panel, which states the magnification of the motion and of the slip.

        scaled: whether it contains the stress of the upper end of the colours.
        """
        text = (
            "drawn to scale"
            if self.factor == 0
            else f"motion and gap magnified {self.factor:g} times"
        )
        unit, scale = choose_axis_unit([self.top], "Pa")
        text += (
            f", top colour: {self.top * scale:.3g} {unit} or more" if self.is_cut and scaled else ""
        )
        if self.slide_factor != 1:
            return (
                text
                + f"\nthe slide of {self.slide * 1e3:.3g} um magnified {self.slide_factor:g} times"
            )
        return text + (
            f"\nthe slide of {self.slide * 1e3:.3g} um, drawn to scale"
            if self.slide and self.factor > 1
            else ""
        )


def make_panels(
    frame: Frame,
    magnify: float | tuple | None = None,
    close: tuple | None = None,
    slide_factor: float = 1.0,
) -> tuple:
    """Return the panels of both pieces, whole and around their contact, with one colour scale.

    The upper piece is drawn with the shape of its surface, which is part of the gap and not of the
    mesh.

    Parameters
    ----------
    frame : Frame
    magnify : float or tuple, optional
        Factor of the motion, for both panels or for each; by default one that makes it visible, for
        each.
    close : tuple, optional
        Window of the second panel [mm]; by default that of `find_contact_window`.
    slide_factor : float
        Factor of the slide of the upper piece as a whole.

    Returns
    -------
    tuple of Panel
    """
    motion = drawn_displacement(frame), upper_piece_slide(frame), slide_factor
    used_points = np.unique(
        np.concatenate([block.ravel() for part in (0, 1) for block in frame.cells(part)])
    )
    x, y = frame.points[used_points, :2].T * 1e3
    whole_window = (x.min(), x.max(), y.min(), y.max())
    factors = magnify if isinstance(magnify, tuple) else (magnify, magnify)
    windows = (whole_window, find_contact_window(frame) if close is None else close)
    inside = [_stressed_cells(frame, window) for window in windows]
    mises = frame.cell_data["von_mises"]
    area = cell_areas(frame)
    # Panels side by side have the same colour scale.
    colour_limit = max(_colour_limit(mises[cells], area[cells]) for cells in inside)
    return tuple(
        _make_panel(frame, motion, *panel_settings, colour_limit)
        for panel_settings in zip(windows, inside, factors)
    )


def _stressed_cells(frame: Frame, window: tuple) -> np.ndarray:
    """Return a mask of the cells in a window for which a stress is defined."""
    left, right, bottom, top = window
    x, y = cell_centres(frame).T
    return (
        (x >= left)
        & (x <= right)
        & (y >= bottom)
        & (y <= top)
        & np.isfinite(frame.cell_data["von_mises"])
    )


def _colour_limit(mises, area) -> float:
    """Return the stress [Pa] at the upper end of the colour scale for some cells.

    It is the largest stress, unless this is a peak in a corner.
    """
    largest = float(mises.max(initial=0.0))
    bulk_limit = float(_weighted_quantile(mises, area, COLOURED_AREA))
    return bulk_limit if bulk_limit < MIN_PEAK_RATIO * largest else largest


def _make_panel(
    frame: Frame, motion: tuple, window: tuple, is_drawn, magnify: float | None, limit: float
) -> Panel:
    """Return the view of both pieces in a window.

    Parameters
    ----------
    frame : Frame
    motion : tuple
        Displacement (N, 2) [m], slide [m] and factor of the slide.
    window : tuple
        (left, right, bottom, top) [mm].
    is_drawn : (cells,) array of bool
        Cells that are drawn.
    magnify : float or None
        Factor of the motion.
    limit : float
        Stress at the upper end of the colours [Pa].
    """
    move, slide, slide_factor = motion
    left, right, bottom, top = window
    x, y = frame.points[:, :2].T * 1e3
    is_inside = (x >= left) & (x <= right) & (y >= bottom) & (y <= top)
    if magnify is None:
        largest = np.abs(move[is_inside, 1]).max(initial=0.0) * 1e3
        magnify = (
            round_down_factor(DRAWN_MOTION_FRACTION * (top - bottom) / largest)
            if largest > 0
            else 0.0
        )
    largest = float(frame.cell_data["von_mises"][is_drawn].max(initial=0.0))
    rigid_slide = np.zeros_like(move)
    rigid_slide[upper_points(frame), 0] = slide
    places = (
        frame.points[:, :2]
        + min(magnify, 1.0) * slide_factor * rigid_slide
        + magnify * (move - rigid_slide)
    ) * 1e3
    drawn_points = places[
        np.unique(frame.connectivity[np.repeat(is_drawn, np.diff(frame.offsets))])
    ]
    low, high = (
        (drawn_points.min(axis=0), drawn_points.max(axis=0))
        if len(drawn_points)
        else ((left, bottom), (right, top))
    )
    return Panel(
        places,
        is_drawn,
        float(magnify),
        slide * 1e3,
        (low[0], high[0], low[1], high[1]),
        limit,
        largest > limit * (1 + 1e-6),
        slide_factor,
    )


def _weighted_quantile(values, weight, fraction: float) -> float:
    """Return the weighted quantile of values at a fraction of the total weight."""
    if not values.size:
        return 0.0
    order = np.argsort(values)
    cumulative_weight = np.cumsum(weight[order])
    return values[order][
        min(np.searchsorted(cumulative_weight, fraction * cumulative_weight[-1]), values.size - 1)
    ]


def upper_points(frame: Frame) -> np.ndarray:
    """Return the indices of the points that belong to the upper piece."""
    return np.unique(np.concatenate([block.ravel() for block in frame.cells(1)]))


def upper_piece_slide(frame: Frame) -> float:
    """Return the displacement [m] along x of the upper piece as a rigid body.

    It is the motion of its rigid far face, extrapolated to y = 0.
    """
    upper = upper_points(frame)
    return float(
        upper_piece_slides(
            frame.points[upper], frame.point_data["displacement"][None, upper].astype(float)
        )[0]
    )


def upper_piece_slides(points, displacements) -> np.ndarray:
    """Return the displacements (f,) [m] along x of the upper piece as a rigid body in f frames.

    Parameters
    ----------
    points : (n, 2) array
        [m]
    displacements : (f, n, 2) array
        Displacements [m].
    """
    height = points[:, 1].max()
    is_far_face = points[:, 1] >= height * (1 - 1e-9)
    x_from_centre = points[is_far_face, 0] - points[is_far_face, 0].mean()
    # The far face is rigid, so that its slope is the rotation of the piece.
    rotation = displacements[:, is_far_face, 1] @ x_from_centre / (x_from_centre @ x_from_centre)
    slide = displacements[:, is_far_face, 0].mean(axis=1) + rotation * height
    return np.where(np.abs(slide) > ROUND_OFF * np.abs(displacements).max(axis=(1, 2)), slide, 0.0)


def drawn_displacement(frame: Frame) -> np.ndarray:
    """Return the magnified displacement (N, 2) [m] that is added to the points of a drawing.

    For the upper piece it includes the shape of its surface, decreasing towards its far face, so
    that the drawn gap is the computed one.
    """
    move = frame.points[:, :2] * 0 + frame.point_data["displacement"][:, :2]
    line = frame.interface()
    upper = upper_points(frame)
    surface = move[line, 1] + frame.point_data["gap"][line]
    move[upper, 1] += surface_shape_motion(
        frame.points[upper], move[None, upper, 1], frame.points[line, 0], surface[None]
    )[0]
    return move


def surface_shape_motion(points, normal_motion, x, surface) -> np.ndarray:
    """Return the displacement (f, n) [m] that moves the face of the upper piece to its surface shape.

    Parameters
    ----------
    points : (n, 2) array
        [m]
    normal_motion : (f, n) array
        Motion across the interface [m].
    x : (m,) array
        [m]
    surface : (f, m) array
        Position of the surface at x [m].
    """
    height = points[:, 1].max()
    face = np.flatnonzero(points[:, 1] <= 1e-9 * height)
    face = face[np.argsort(points[face, 0], kind="stable")]
    added = [
        np.interp(points[:, 0], x, surface_row - np.interp(x, points[face, 0], move[face]))
        for surface_row, move in zip(surface, normal_motion)
    ]
    return np.array(added) * (1 - points[:, 1] / height)


def round_down_factor(factor: float, minimum: float = 1.0) -> float:
    """Round a magnification factor down to 1, 2 or 5 times a power of ten."""
    if factor < minimum:
        return minimum
    power = 10.0 ** np.floor(np.log10(factor))
    return float(power * max(step for step in (1, 2, 5) if step * power <= factor * (1 + 1e-9)))


def find_contact_window(frame: Frame) -> tuple:
    """Return a window [mm] around the contact; for a long contact, around its largest pressure."""
    line = frame.interface()
    x = frame.points[line, 0] * 1e3
    sigma = frame.point_data["normal_stress"][line]
    length = np.ptp(x)
    touching = x[sigma > 0]
    cell = np.diff(x).max()
    if not touching.size:
        centre = x.mean()
        half = length / 8
    elif np.ptp(touching) > length / 4:
        centre = x[np.argmax(sigma)]
        half = length / 8
    else:
        centre = (touching[0] + touching[-1]) / 2
        half = max(np.ptp(touching), 4 * cell)
    left = max(x[0], min(centre - half, x[-1] - 2 * half))
    right = min(x[-1], left + 2 * half)
    return (left, right, -0.3 * (right - left), 0.3 * (right - left))


def cell_centres(frame: Frame) -> np.ndarray:
    """Return the centres (cells, 2) [mm] of the cells of a frame, and of the interface segments."""
    sums = np.add.reduceat(frame.points[frame.connectivity, :2], frame.offsets[:-1])
    return sums / np.diff(frame.offsets)[:, None] * 1e3


def cell_areas(frame: Frame) -> np.ndarray:
    """Return the areas (cells,) [m2] of the cells in a frame, which are 0 for interface segments."""
    return quadrilateral_areas(frame.points[:, :2], cell_corners(frame.connectivity, frame.offsets))


def cell_corners(connectivity, offsets) -> np.ndarray:
    """Return the corners (m, 4) of cells in VTK form; a cell with fewer corners repeats its last one."""
    last = np.diff(offsets)[:, None] - 1
    return connectivity[offsets[:-1, None] + np.minimum(np.arange(4), last)]


def quadrilateral_areas(points, cells) -> np.ndarray:
    """Return the areas (m,) of cells with four corners (m, 4) among points (n, 2)."""
    corner = points[cells]
    after = np.roll(corner, -1, axis=1)
    return np.abs((corner[..., 0] * after[..., 1] - corner[..., 1] * after[..., 0]).sum(axis=1)) / 2


def interface_curves(frame: Frame, stress_range: tuple | None = None) -> tuple:
    """Return the stresses along the interface of a frame: x [mm], curves, and their unit.

    Parameters
    ----------
    frame : Frame
    stress_range : tuple, optional
        Minimum and maximum stress [Pa] that determine the unit; by default those of the frame.

    Returns
    -------
    tuple
        x (m,) [mm], ((label, values (m,)), ...) and the unit.
    """
    line = frame.interface()
    curves = [("normal stress", frame.point_data["normal_stress"][line])]
    if "shear_stress" in frame.point_data:
        curves.append(("shear stress", frame.point_data["shear_stress"][line]))
    unit, scale = choose_axis_unit(
        np.concatenate([values for _, values in curves]) if stress_range is None else stress_range,
        "Pa",
    )
    return (
        frame.points[line, 0] * 1e3,
        tuple((label, values * scale) for label, values in curves),
        unit,
    )


def outer_edges(frame: Frame, cells) -> tuple:
    """Return the outer edges (e, 2) of some cells, and the edges below a coating.

    cells: (cells,) bool.
    """
    outer = []
    inner = []
    size = np.diff(frame.offsets)
    material = frame.cell_data["material"]
    for part in (0, 1):
        ends = []
        edge_material = []
        is_drawn = []
        for count in (3, 4):
            is_selected = (frame.cell_data["part"] == part) & (size == count)
            block = frame.connectivity[frame.offsets[:-1][is_selected][:, None] + np.arange(count)]
            ends.append(np.stack([block, np.roll(block, -1, axis=1)], axis=2).reshape(-1, 2))
            edge_material.append(np.repeat(material[is_selected], count))
            is_drawn.append(np.repeat(cells[is_selected], count))
        ends = np.sort(np.concatenate(ends), axis=1)
        edge_material = np.concatenate(edge_material)
        pairs, number = np.unique(ends, axis=0, return_inverse=True)
        n_cells = np.bincount(number.ravel())
        n_coated_cells = np.bincount(number.ravel(), edge_material > 0)
        is_visible = np.bincount(number.ravel(), np.concatenate(is_drawn)) > 0
        outer.append(pairs[(n_cells == 1) & is_visible])
        inner.append(pairs[(n_cells == 2) & (n_coated_cells == 1) & is_visible])
    return np.concatenate(outer), np.concatenate(inner)
