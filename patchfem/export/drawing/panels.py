"""What a picture of the pressed pieces shows, as numbers: places drawn, how much magnified, which part, which scale."""

from dataclasses import dataclass

import numpy as np

from ...formatting import axis_unit
from ..fields.series import Frame

SHOWN = 0.995  # share of the area of a panel whose stress the colours tell apart
CLIPPED = 0.8  # share of the largest stress above which the colours reach all the way
ROUND_OFF = 1e-5  # of the largest motion: what is kept is in single precision, a slide is a difference of two
VISIBLE = 0.05  # share of the height of a panel that the largest motion or gap in it takes


@dataclass(frozen=True, eq=False, slots=True)
class Panel:
    """One view of both pieces.

    places: (N, 2) [mm] as drawn; cells: (cells,) bool, those drawn; factor of the motion; slide [mm] of the upper piece
    as a whole, drawn `aside` times as long as it is; window: (left, right, bottom, top) [mm] of what is drawn; top:
    stress [Pa] at the upper end of the colours; over: whether some cell exceeds it.
    """

    places: np.ndarray
    cells: np.ndarray
    factor: float
    slide: float
    window: tuple
    top: float
    over: bool
    aside: float = 1.0

    def title(self, scaled: bool = True) -> str:
        """Head of the panel: how much its motion is magnified, and where `scaled` which stress the top colour stands
        for."""
        text = (
            "drawn to scale"
            if self.factor == 0
            else f"motion and gap magnified {self.factor:g} times"
        )
        unit, scale = axis_unit([self.top], "Pa")
        text += (
            f", top colour: {self.top * scale:.3g} {unit} or more" if self.over and scaled else ""
        )
        if self.aside != 1:
            return text + f"\nthe slide of {self.slide * 1e3:.3g} um magnified {self.aside:g} times"
        return text + (
            f"\nthe slide of {self.slide * 1e3:.3g} um, drawn to scale"
            if self.slide and self.factor > 1
            else ""
        )


def panels(
    frame: Frame,
    magnify: float | tuple | None = None,
    close: tuple | None = None,
    aside: float = 1.0,
) -> tuple:
    """Panels of both pieces whole and of the place where they touch, with one scale of colours, each with a factor of
    its own unless `magnify` is given, one for both or one for each.

    close: second window [mm], that of `near` unless given; aside: factor of the slide of the upper piece as a whole.
    The upper piece is drawn with the shape of its surface, which lives in the gap and not in the mesh.
    """
    motion = moved(frame), slide_of(frame), aside
    used = np.unique(
        np.concatenate([block.ravel() for part in (0, 1) for block in frame.cells(part)])
    )
    x, y = frame.points[used, :2].T * 1e3
    whole = (x.min(), x.max(), y.min(), y.max())
    factors = magnify if isinstance(magnify, tuple) else (magnify, magnify)
    windows = (whole, near(frame) if close is None else close)
    inside = [_inside(frame, window) for window in windows]
    mises, area = frame.cell_data["von_mises"], areas(frame)
    # one scale for what stands side by side
    top = max(_limit(mises[cells], area[cells]) for cells in inside)
    return tuple(_panel(frame, motion, *each, top) for each in zip(windows, inside, factors))


def _inside(frame: Frame, window: tuple) -> np.ndarray:
    """Cells (cells,) bool of a window that have a stress."""
    left, right, bottom, top = window
    x, y = middles(frame).T
    return (
        (x >= left)
        & (x <= right)
        & (y >= bottom)
        & (y <= top)
        & np.isfinite(frame.cell_data["von_mises"])
    )


def _limit(mises, area) -> float:
    """Stress [Pa] at the upper end of the colours of some cells: the largest, unless that stands out in a corner."""
    largest, most = float(mises.max(initial=0.0)), float(_exceeded(mises, area, SHOWN))
    return most if most < CLIPPED * largest else largest


def _panel(
    frame: Frame, motion: tuple, window: tuple, here, magnify: float | None, limit: float
) -> Panel:
    move, slide, aside = motion
    left, right, bottom, top = window
    x, y = frame.points[:, :2].T * 1e3
    mine = (x >= left) & (x <= right) & (y >= bottom) & (y <= top)
    if magnify is None:
        largest = np.abs(move[mine, 1]).max(initial=0.0) * 1e3
        magnify = rounded(VISIBLE * (top - bottom) / largest) if largest > 0 else 0.0
    largest = float(frame.cell_data["von_mises"][here].max(initial=0.0))
    whole = np.zeros_like(move)
    whole[upper_points(frame), 0] = slide
    places = (
        frame.points[:, :2] + min(magnify, 1.0) * aside * whole + magnify * (move - whole)
    ) * 1e3
    drawn = places[np.unique(frame.connectivity[np.repeat(here, np.diff(frame.offsets))])]
    low, high = (
        (drawn.min(axis=0), drawn.max(axis=0)) if len(drawn) else ((left, bottom), (right, top))
    )
    return Panel(
        places,
        here,
        float(magnify),
        slide * 1e3,
        (low[0], high[0], low[1], high[1]),
        limit,
        largest > limit * (1 + 1e-6),
        aside,
    )


def _exceeded(values, weight, share: float) -> float:
    """The value below which `share` of the weight lies."""
    if not values.size:
        return 0.0
    order = np.argsort(values)
    heap = np.cumsum(weight[order])
    return values[order][min(np.searchsorted(heap, share * heap[-1]), values.size - 1)]


def upper_points(frame: Frame) -> np.ndarray:
    """Numbers of the points of the upper piece."""
    return np.unique(np.concatenate([block.ravel() for block in frame.cells(1)]))


def slide_of(frame: Frame) -> float:
    """Slide [m] of the upper piece as a whole: of its far face, which is held rigid, carried down to y = 0."""
    upper = upper_points(frame)
    return float(
        slides(frame.points[upper], frame.point_data["displacement"][None, upper].astype(float))[0]
    )


def slides(points, moves) -> np.ndarray:
    """Slides (f,) [m], as `slide_of`, of an upper piece whose points (n, 2) [m] move by (f, n, 2) [m]."""
    height = points[:, 1].max()
    far = points[:, 1] >= height * (1 - 1e-9)
    apart = points[far, 0] - points[far, 0].mean()
    # the far face is held rigid: a slope is its rotation
    turn = moves[:, far, 1] @ apart / (apart @ apart)
    slide = moves[:, far, 0].mean(axis=1) + turn * height
    return np.where(np.abs(slide) > ROUND_OFF * np.abs(moves).max(axis=(1, 2)), slide, 0.0)


def moved(frame: Frame) -> np.ndarray:
    """Displacement (N, 2) [m] as drawn.

    That of the upper piece includes the shape of its surface, fading towards its far face, so that the drawn gap is the
    gap.
    """
    move = frame.points[:, :2] * 0 + frame.point_data["displacement"][:, :2]
    line, upper = frame.interface(), upper_points(frame)
    surface = move[line, 1] + frame.point_data["gap"][line]
    move[upper, 1] += shape(
        frame.points[upper], move[None, upper, 1], frame.points[line, 0], surface[None]
    )[0]
    return move


def shape(points, up, x, surface) -> np.ndarray:
    """What the shape of its surface adds to the motion (f, n) [m] across the interface of an upper piece, as `moved`.

    points: (n, 2) [m]; up: (f, n) [m]; surface: (f, m) [m], where it is at the places x (m,) [m].
    """
    height = points[:, 1].max()
    face = np.flatnonzero(points[:, 1] <= 1e-9 * height)
    face = face[np.argsort(points[face, 0], kind="stable")]
    added = [
        np.interp(points[:, 0], x, there - np.interp(x, points[face, 0], move[face]))
        for there, move in zip(surface, up)
    ]
    return np.array(added) * (1 - points[:, 1] / height)


def rounded(factor: float, least: float = 1.0) -> float:
    """A factor > 0 rounded down to 1, 2 or 5 times a power of ten; `least` where it is smaller than that."""
    if factor < least:
        return least
    power = 10.0 ** np.floor(np.log10(factor))
    return float(power * max(step for step in (1, 2, 5) if step * power <= factor * (1 + 1e-9)))


def near(frame: Frame) -> tuple:
    """Window [mm] around the contact, or around its most stressed quarter where it is longer than that."""
    line = frame.interface()
    x, sigma = frame.points[line, 0] * 1e3, frame.point_data["normal_stress"][line]
    length, touching = np.ptp(x), x[sigma > 0]
    cell = np.diff(x).max()
    if not touching.size:
        middle, half = x.mean(), length / 8
    elif np.ptp(touching) > length / 4:
        middle, half = x[np.argmax(sigma)], length / 8
    else:
        middle, half = (touching[0] + touching[-1]) / 2, max(np.ptp(touching), 4 * cell)
    left = max(x[0], min(middle - half, x[-1] - 2 * half))
    right = min(x[-1], left + 2 * half)
    return (left, right, -0.3 * (right - left), 0.3 * (right - left))


def middles(frame: Frame) -> np.ndarray:
    """Middles of the cells (cells, 2) [mm] of a frame, lines of the interface included."""
    sums = np.add.reduceat(frame.points[frame.connectivity, :2], frame.offsets[:-1])
    return sums / np.diff(frame.offsets)[:, None] * 1e3


def areas(frame: Frame) -> np.ndarray:
    """Areas of the cells (cells,) [m2] of a frame, 0 of lines."""
    return sizes(frame.points[:, :2], corners(frame.connectivity, frame.offsets))


def corners(connectivity, offsets) -> np.ndarray:
    """Corners (m, 4) of lines, triangles and quadrilaterals as VTK lists them, the last one more often in the first."""
    last = np.diff(offsets)[:, None] - 1
    return connectivity[offsets[:-1, None] + np.minimum(np.arange(4), last)]


def sizes(points, cells) -> np.ndarray:
    """Areas (m,) of cells of four corners (m, 4) among points (n, 2)."""
    corner = points[cells]
    after = np.roll(corner, -1, axis=1)
    return np.abs((corner[..., 0] * after[..., 1] - corner[..., 1] * after[..., 0]).sum(axis=1)) / 2


def curves(frame: Frame, reach: tuple | None = None) -> tuple:
    """Stresses along the interface of a frame: (x (m,) [mm], ((label, values (m,) in the unit), ...), unit).

    reach: (lowest, highest) stress [Pa] that the unit suits, that of the frame unless given.
    """
    line = frame.interface()
    shown = [("normal stress", frame.point_data["normal_stress"][line])]
    if "shear_stress" in frame.point_data:
        shown.append(("shear stress", frame.point_data["shear_stress"][line]))
    unit, scale = axis_unit(
        np.concatenate([values for _, values in shown]) if reach is None else reach, "Pa"
    )
    return (
        frame.points[line, 0] * 1e3,
        tuple((label, values * scale) for label, values in shown),
        unit,
    )


def borders(frame: Frame, cells) -> tuple:
    """Edges (e, 2) of the `cells` (bool), as point numbers: outer ones of both pieces, and those under a coating."""
    outer, inner = [], []
    size, material = np.diff(frame.offsets), frame.cell_data["material"]
    for part in (0, 1):
        ends, coat, shown = [], [], []
        for count in (3, 4):
            mine = (frame.cell_data["part"] == part) & (size == count)
            block = frame.connectivity[frame.offsets[:-1][mine][:, None] + np.arange(count)]
            ends.append(np.stack([block, np.roll(block, -1, axis=1)], axis=2).reshape(-1, 2))
            coat.append(np.repeat(material[mine], count))
            shown.append(np.repeat(cells[mine], count))
        ends, coat = np.sort(np.concatenate(ends), axis=1), np.concatenate(coat)
        pairs, number = np.unique(ends, axis=0, return_inverse=True)
        times = np.bincount(number.ravel())
        coats = np.bincount(number.ravel(), coat > 0)
        seen = np.bincount(number.ravel(), np.concatenate(shown)) > 0
        outer.append(pairs[(times == 1) & seen])
        inner.append(pairs[(times == 2) & (coats == 1) & seen])
    return np.concatenate(outer), np.concatenate(inner)
