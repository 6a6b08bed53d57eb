"""Areal scans before and after wear with known truth: machined surfaces, fifteen kinds of change, two instruments.

Written without knowledge of the method that compares the scans. Both scans sample one surface on a
grid of half the spacing of the scans; the second scan has its own shift, rotation, tilt, offset,
noise, dust and missing heights. No scan is bowed and both have the same spacing. All lengths are in
metres, positions are (x, y), and the frame of the piece is the frame of the scan before. Seeds 1 to
30 were used to check the generator.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scan_finishes import draw_finish, draw_surface
from scipy.ndimage import gaussian_filter, map_coordinates, median_filter, spline_filter

KINDS = (
    "smooth track",
    "rough track",
    "crater",
    "shallow wear",
    "scratches",
    "pile-up",
    "deposits",
    "remounted",
    "uniform",
    "wedge",
    "elsewhere",
    "exchanged",
    "edge",
    "ring",
    "worn tops",
)
TRACKS = ("smooth track", "rough track", "pile-up")
UNKNOWABLE = ("uniform", "wedge", "elsewhere")  # No scan of this region alone can show the wear.
FALSE_CLAIMS = {
    "pile-up": ("no wear",),
    "deposits": ("worn",),
    "remounted": ("worn", "grew"),
    "exchanged": ("worn",),
} | dict.fromkeys(UNKNOWABLE, ("worn", "grew", "no wear"))
OVERSAMPLING = 2  # Points of the surface per spacing of the scans, in each direction.
# Width of the surface beyond each edge relative to the longer side; the shifted scan may cover it.
MARGIN = 0.22
MAX_SHIFT = 0.12  # Largest shift relative to the side of the scan, in each direction.


class Volumes(NamedTuple):
    """Noise-free volumes [m^3] and area [m^2] of the region that both scans cover.

    `worn` and `grown` are sums over the points of the scan after within the scan before, one pixel area each;
    `worn_inner` and `grown_inner` leave out one row of points along each border of this region.
    """

    worn: float
    grown: float
    worn_inner: float
    grown_inner: float
    area: float
    area_inner: float


class Depths(NamedTuple):
    """Noise-free depths [m] in the common region, positive for lost material."""

    mean_worn: float  # Worn volume / area; growth does not count.
    mean_net: float  # Mean of all depths.
    maximum: float  # Largest depth at a point of the scan after.
    maximum_median: float  # Largest median of 3 x 3 depths.


class Pose(NamedTuple):
    """Pose of the scan after: piece = shift + centre + R(rotation) (position - centre)."""

    shift: tuple
    rotation: float  # [rad], counterclockwise
    centre: tuple


class Track(NamedTuple):
    """Straight worn track in the frame of the piece."""

    middle: tuple
    direction: float  # [rad] of its axis from x, in [0, pi)
    width: float  # Distance between the positions at which the wear begins.
    length: float | None  # Distance between the tips; None if the track leaves the common region.
    ends: tuple | None  # Positions of both tips ((x, y), (x, y)).
    # The flanks have zero slope at their ends (cosine), so no scan shows where they begin.
    is_flat_flanked: bool


class Section(NamedTuple):
    """Mean cross-section of a track, with the quantities of the user guide [m], [m^2]."""

    mean_depth: float
    floor_depth: float
    step_depth: float
    gross_area: float


@dataclass(frozen=True)
class Truth:
    """True values of a pair.

    Attributes
    ----------
    is_knowable : bool
        True if the scans can show how much was worn (zero where nothing was).
    sentence : tuple of str
        Claims that would be false: any of "worn", "grew", "no wear".
    volumes : Volumes
    depths : Depths
    pose : Pose
    track : Track or None
    section : Section or None
    depth : ndarray
        Noise-free depth (ny, nx) [m] at the points of the scan after; NaN outside the scan before.
    """

    is_knowable: bool
    sentence: tuple
    volumes: Volumes
    depths: Depths
    pose: Pose
    track: Track | None
    section: Section | None
    depth: np.ndarray = field(repr=False)


@dataclass(frozen=True)
class ScanPair:
    """Heights (ny, nx) [m] of two scans (NaN if missing), their spacing [m] and the truth."""

    kind: str
    seed: int
    finish: str
    before: np.ndarray = field(repr=False)
    after: np.ndarray = field(repr=False)
    spacing: float
    truth: Truth


class SurfaceGrid(NamedTuple):
    """Surface grid: positions x, y (n, m) [m], pitch [m], and a box that lies inside both scans."""

    x: np.ndarray
    y: np.ndarray
    pitch: float
    low: np.ndarray
    high: np.ndarray


def draw_pair(seed: int, kind: str | None = None) -> ScanPair:
    """Draw the pair of scans of a seed; without `kind`, consecutive seeds have consecutive kinds."""
    kind = KINDS[(seed - 1) % len(KINDS)] if kind is None else kind
    random = np.random.default_rng([seed, 311, KINDS.index(kind)])
    # Numbers of points ny, nx.
    shape = np.array([random.integers(120, 301), random.integers(150, 401)])
    spacing = float(np.exp(random.uniform(np.log(0.4e-6), np.log(5e-6))))
    size = (shape[::-1] - 1) * spacing
    pose = draw_pose(random, size)
    grid = make_grid(size, spacing, pose)
    finish = draw_finish(random)
    rms = spacing * np.exp(random.uniform(np.log(0.04), np.log(0.3)))
    new = rms * draw_surface(random, grid.x.shape, finish)
    old, track = apply_wear(kind, random, grid, new, rms)
    second_place = rms * draw_surface(random, new.shape, finish) if kind == "elsewhere" else old
    blur = OVERSAMPLING * random.uniform(0.35, 0.6)  # Resolution of the instrument [points].
    first, second, worn = (gaussian_filter(heights, blur) for heights in (new, second_place, old))
    if kind == "exchanged":
        first, second, new, worn = second, first, old, first
    points = scan_points(shape, spacing, Pose((0.0, 0.0), 0.0, pose.centre))
    moved_points = scan_points(shape, spacing, pose)
    true_before = interpolate_surface(first, grid, points)
    true_after = interpolate_surface(second, grid, moved_points)
    instrument = random.choice(["stylus", "camera"])
    noise = rms * random.uniform(0.01, 0.06)
    scans = [
        make_scan(random, heights, spacing, rms, noise, instrument)
        for heights in (true_before, true_after)
    ]
    depth = interpolate_surface(first - worn, grid, moved_points)
    truth = compute_truth(kind, depth, moved_points, pose, spacing, size, track)
    return ScanPair(kind, seed, finish.name, *scans, spacing, truth)


def draw_pose(random, size) -> Pose:
    """Draw shift and rotation of the second scan, from a fraction of a point to many points.

    The rotation is at most 2 degrees.
    """
    reach = 0.01 if random.random() < 0.2 else MAX_SHIFT
    shift = random.uniform(-reach, reach, 2) * size
    rotation = 0.0 if random.random() < 0.3 else np.radians(random.uniform(-2, 2))
    return Pose(tuple(shift.tolist()), float(rotation), tuple((size / 2).tolist()))


def make_grid(size, spacing: float, pose: Pose) -> SurfaceGrid:
    """Return the grid of the surface over both scans, and the box inside both of them."""
    pitch = spacing / OVERSAMPLING
    margin = MARGIN * size.max()
    x = np.arange(-margin, size[0] + margin, pitch)
    y = np.arange(-margin, size[1] + margin, pitch)
    skew = abs(np.tan(pose.rotation)) * size[::-1] / 2 + 4 * spacing
    low = np.maximum(0, pose.shift) + skew
    high = np.minimum(size, size + pose.shift) - skew
    return SurfaceGrid(*np.meshgrid(x, y), pitch, low, high)


def scan_points(shape, spacing: float, pose: Pose) -> np.ndarray:
    """Return the positions (2, ny, nx) [m] on the piece of the points of a scan."""
    y, x = np.indices(tuple(shape)) * spacing
    x = x - pose.centre[0]
    y = y - pose.centre[1]
    cos = np.cos(pose.rotation)
    sin = np.sin(pose.rotation)
    return np.array(
        [
            pose.centre[0] + pose.shift[0] + cos * x - sin * y,
            pose.centre[1] + pose.shift[1] + sin * x + cos * y,
        ]
    )


def interpolate_surface(heights, grid: SurfaceGrid, points) -> np.ndarray:
    """Interpolate the surface at positions (2, ny, nx) [m] by cubic splines."""
    index = [(points[1] - grid.y[0, 0]) / grid.pitch, (points[0] - grid.x[0, 0]) / grid.pitch]
    return map_coordinates(spline_filter(heights), index, prefilter=False, mode="nearest")


def make_scan(
    random, heights, spacing: float, rms: float, noise: float, instrument: str
) -> np.ndarray:
    """Return a scan: heights with noise, tilt, offset, digitization, dust and missing points."""
    ny, nx = heights.shape
    z = heights + noise * draw_noise(random, heights.shape, instrument)
    along = np.linspace(-0.5, 0.5, nx)
    across = np.linspace(-0.5, 0.5, ny)[:, None]
    tilt = random.uniform(-8, 8, 2) * rms
    z += tilt[0] * along + tilt[1] * across + random.uniform(-5e-6, 5e-6)
    step = random.choice([0.0, 0.3, 1.0]) * noise
    if step > 0:
        z = np.round(z / step) * step
    if random.random() < 0.5:
        for _ in range(random.integers(1, 6)):
            i = random.integers(0, ny - 4)
            j = random.integers(0, nx - 4)
            height, width = random.integers(1, 4, 2)
            sign = -1 if instrument == "camera" and random.random() < 0.4 else 1
            z[i : i + height, j : j + width] += sign * random.uniform(6, 25) * rms
    if random.random() < 0.6:
        slope = np.hypot(*np.gradient(heights, spacing))
        limit = np.quantile(slope, random.uniform(0.97, 0.999))
        z[(slope > limit) & (random.random(z.shape) < random.uniform(0.4, 1.0))] = np.nan
    if random.random() < 0.3:
        for _ in range(random.integers(1, 4)):
            i = random.integers(0, ny)
            j = random.integers(0, nx)
            radius = random.uniform(1, 5)
            rows, columns = np.ogrid[:ny, :nx]
            z[(rows - i) ** 2 + (columns - j) ** 2 < radius**2] = np.nan
    return z


def draw_noise(random, shape, instrument: str) -> np.ndarray:
    """Draw noise with a fast part of unit deviation: lines of a stylus, or pixels of a camera."""
    ny, nx = shape
    white = random.normal(size=shape)
    if instrument == "camera":
        fast = gaussian_filter(white, random.uniform(0.4, 1.2))
        waves = random.uniform(1, 6, 2)
        y, x = np.ogrid[: 1 : ny * 1j, : 1 : nx * 1j]
        ripple = np.sin(2 * np.pi * (waves[0] * x + waves[1] * y + random.random()))
        return fast / fast.std() + random.uniform(0, 0.5) * ripple
    memory = random.uniform(0.2, 0.85)
    fast = np.empty(shape)
    fast[:, 0] = white[:, 0]
    for j in range(1, nx):
        fast[:, j] = memory * fast[:, j - 1] + np.sqrt(1 - memory**2) * white[:, j]
    drift = gaussian_filter(np.cumsum(random.normal(size=ny)), 3.0)
    drift = (drift - drift.mean()) / drift.std()
    lines = random.uniform(0, 1.5) * random.normal(size=ny) + random.uniform(0, 1.5) * drift
    return fast + lines[:, None]


def apply_wear(kind: str, random, grid: SurfaceGrid, new, rms: float) -> tuple:
    """Return the worn surface (n, m) [m], and the track or None."""
    if kind == "exchanged":
        kind = random.choice(["smooth track", "crater", "shallow wear"])
    if kind in TRACKS:
        return wear_track(kind, random, grid, new, rms)
    span = grid.high - grid.low
    middle = grid.low + random.uniform(0.4, 0.6, 2) * span
    dx = grid.x - middle[0]
    dy = grid.y - middle[1]
    if kind == "crater":
        radius = random.uniform(0.15, 0.32) * span.min()
        depth = random.uniform(2, 12) * rms
        return cut_surface(random, grid, new, depth * (1 - (dx**2 + dy**2) / radius**2)), None
    if kind == "shallow wear":
        half = random.uniform(0.27, 0.4, 2) * span
        r = (np.abs(dx) / half[0]) ** 4 + (np.abs(dy) / half[1]) ** 4
        shape = np.clip((1 - r) / random.uniform(0.1, 0.9), 0, 1)
        return new - random.uniform(0.3, 1.5) * rms * shape, None
    if kind == "scratches":
        return new - draw_scratches(random, grid, rms), None
    if kind == "deposits":
        return new + draw_lumps(random, grid, rms), None
    if kind == "uniform":
        return new - random.uniform(0.3, 4) * rms, None
    if kind == "wedge":
        angle = random.uniform(0, 2 * np.pi)
        ramp = np.cos(angle) * dx + np.sin(angle) * dy
        return new - random.uniform(0.5, 5) * rms * (ramp - ramp.min()) / np.ptp(ramp), None
    if kind == "edge":
        angle = 0.5 * np.pi * random.integers(4) + random.uniform(-0.2, 0.2)
        reach = (
            np.cos(angle) * dx / span[0] + np.sin(angle) * dy / span[1] - random.uniform(-0.1, 0.25)
        )
        return cut_surface(random, grid, new, random.uniform(4, 25) * rms * reach), None
    if kind == "ring":
        outer = random.uniform(0.28, 0.42) * span.min()
        r = np.hypot(dx, dy) / outer
        inner = random.uniform(0.3, 0.6)
        shape = np.maximum((1 - r) * (r - inner), 0) * 4 / (1 - inner) ** 2
        return new - random.uniform(1, 5) * rms * np.sqrt(shape), None
    if kind == "worn tops":
        half = random.uniform(0.25, 0.38, 2) * span
        level = np.quantile(new, random.uniform(0.3, 0.7))
        tops = np.maximum(new - level, 0) * random.uniform(0.8, 1.0)
        return np.where((np.abs(dx) < half[0]) & (np.abs(dy) < half[1]), new - tops, new), None
    return new.copy(), None  # The kinds "remounted" and "elsewhere" have no wear here.


def cut_surface(random, grid: SurfaceGrid, new, depth) -> np.ndarray:
    """Cut to `depth` [m] below the smoothed surface where depth > 0.

    The floor is smooth or keeps the roughness.
    """
    if random.random() < 0.4:
        return new - np.maximum(depth, 0)
    smooth = gaussian_filter(new, random.uniform(20, 40) * OVERSAMPLING)
    floor = smooth - depth + random.uniform(0.02, 0.2) * (new - smooth)
    return np.where(depth > 0, np.minimum(new, floor), new)


def wear_track(kind: str, random, grid: SurfaceGrid, new, rms: float) -> tuple:
    """Wear a straight track: through both scans, or with round ends inside them."""
    span = grid.high - grid.low
    middle = grid.low + random.uniform(0.45, 0.55, 2) * span
    direction = random.uniform(0, np.pi)
    half = random.uniform(0.08, 0.17) * span.min()
    depth = random.uniform(2, 10) * rms
    axis = np.array([np.cos(direction), np.sin(direction)])
    across = -(grid.x - middle[0]) * axis[1] + (grid.y - middle[1]) * axis[0]
    along_axis = (grid.x - middle[0]) * axis[0] + (grid.y - middle[1]) * axis[1]
    length = None
    ends = None
    distance = np.abs(across)
    if random.random() < 0.5:
        # Half the distance between the centres of the round ends.
        straight = random.uniform(0.15, 0.22) * span.min()
        distance = np.hypot(across, np.maximum(np.abs(along_axis) - straight, 0))
        length = float(2 * (straight + half))
        ends = tuple(tuple((middle + sign * axis * length / 2).tolist()) for sign in (-1, 1))
    r = distance / half
    profile = random.choice(["parabola", "vee", "cosine", "flat"])
    worn = depth * evaluate_profile(random, profile, r)
    if kind == "smooth track":
        smooth = gaussian_filter(new, random.uniform(20, 40) * OVERSAMPLING)
        grooves = np.interp(across, *draw_grooves(random, half, grid.pitch))
        floor = smooth - worn + random.uniform(0.02, 0.15) * rms * grooves
        old = np.where(r < 1, np.minimum(new, floor), new)
    else:
        old = new - worn
    if kind == "pile-up":
        # Width of the ridge relative to the half-width of the track.
        ridge = random.uniform(0.3, 0.9)
        heights = random.uniform(0.05, 0.4, 2) * depth
        shape = np.sin(np.pi * np.clip((r - 1) / ridge, 0, 1)) ** 2
        old = old + np.where(across > 0, heights[0], heights[1]) * shape
    is_flat_flanked = profile == "cosine" and kind != "smooth track"
    return old, Track(tuple(middle.tolist()), direction, 2 * half, length, ends, is_flat_flanked)


def evaluate_profile(random, profile: str, r) -> np.ndarray:
    """Return the depth relative to the largest depth at r = distance from the axis / half-width."""
    if profile == "parabola":
        return np.maximum(1 - r**2, 0)
    if profile == "vee":
        return np.maximum(1 - r, 0)
    if profile == "cosine":
        return 0.5 + 0.5 * np.cos(np.pi * np.minimum(r, 1))
    return np.clip((1 - r) / random.uniform(0.1, 0.5), 0, 1)


def draw_grooves(random, half: float, pitch: float) -> tuple:
    """Draw the fine grooves of a worn floor: positions across the track [m] and heights of unit deviation."""
    positions = np.arange(-half - 2 * pitch, half + 2 * pitch, pitch)
    heights = gaussian_filter(random.normal(size=positions.size), random.uniform(2, 6))
    return positions, heights / heights.std()


def draw_scratches(random, grid: SurfaceGrid, rms: float) -> np.ndarray:
    """Return the depth [m] of three to eight straight scratches of limited length with round ends."""
    span = grid.high - grid.low
    depth = np.zeros(grid.x.shape)
    for _ in range(random.integers(3, 9)):
        middle = grid.low + random.uniform(0.1, 0.9, 2) * span
        angle = random.uniform(0, np.pi)
        dx = grid.x - middle[0]
        dy = grid.y - middle[1]
        along = np.cos(angle) * dx + np.sin(angle) * dy
        across = np.cos(angle) * dy - np.sin(angle) * dx
        half = random.uniform(2, 6) * OVERSAMPLING * grid.pitch
        beyond = np.maximum(np.abs(along) - random.uniform(0.1, 0.6) * span.max(), 0)
        shape = np.maximum(1 - np.hypot(across, beyond) / half, 0)
        depth = np.maximum(depth, random.uniform(2, 7) * rms * shape ** random.choice([0.5, 1.0]))
    return depth


def draw_lumps(random, grid: SurfaceGrid, rms: float) -> np.ndarray:
    """Return the height [m] of deposits: one to six lumps of elliptic outline."""
    span = grid.high - grid.low
    height = np.zeros(grid.x.shape)
    for _ in range(random.integers(1, 7)):
        middle = grid.low + random.uniform(0.15, 0.85, 2) * span
        half = random.uniform(0.04, 0.13, 2) * span.min()
        r = ((grid.x - middle[0]) / half[0]) ** 2 + ((grid.y - middle[1]) / half[1]) ** 2
        height = np.maximum(
            height, random.uniform(1.5, 7) * rms * np.maximum(1 - r, 0) ** random.choice([0.5, 1.0])
        )
    return height


def compute_truth(
    kind: str, depth, points, pose: Pose, spacing: float, size, track: Track | None
) -> Truth:
    """Integrate the noise-free depth (ny, nx) [m] over the region that both scans cover."""
    beyond = np.stack([points[0], points[1], size[0] - points[0], size[1] - points[1]]).min(axis=0)
    common = beyond >= 0
    inner = beyond >= spacing
    inner[[0, -1], :] = inner[:, [0, -1]] = False
    if kind == "elsewhere":
        depth = np.zeros(depth.shape)
    worn = np.maximum(depth, 0)
    grown = np.maximum(-depth, 0)
    volumes_of_parts = [
        spacing**2 * part[mask].sum() for mask in (common, inner) for part in (worn, grown)
    ]
    volumes = Volumes(*volumes_of_parts, common.sum() * spacing**2, inner.sum() * spacing**2)
    medians = median_filter(depth, 3)
    depths = Depths(
        worn[common].mean(), depth[common].mean(), depth[common].max(), medians[common].max()
    )
    if kind == "exchanged":
        track = None
    section = None if track is None else measure_section(track, depth, points, common, spacing)
    return Truth(
        is_knowable=kind not in UNKNOWABLE,
        sentence=FALSE_CLAIMS.get(kind, ("grew", "no wear")),
        volumes=volumes,
        depths=depths,
        pose=pose,
        track=track,
        section=section,
        depth=np.where(common, depth, np.nan),
    )


def measure_section(track: Track, depth, points, common, spacing: float) -> Section:
    """Average the depth along the track and measure the mean cross-section.

    The average is over nine tenths of the straight part.
    """
    axis = np.array([np.cos(track.direction), np.sin(track.direction)])
    dx = points[0] - track.middle[0]
    dy = points[1] - track.middle[1]
    across = axis[0] * dy - axis[1] * dx
    along = axis[0] * dx + axis[1] * dy
    reach = np.inf if track.length is None else 0.45 * (track.length - track.width)
    used = common & (np.abs(along) <= reach) & (np.abs(across) < track.width / 2)
    n_bins = max(round(track.width / spacing), 5)
    edges = np.linspace(-track.width / 2, track.width / 2, n_bins + 1)
    count = np.histogram(across[used], edges)[0]
    section = np.histogram(across[used], edges, weights=depth[used])[0] / np.maximum(count, 1)
    centres = (edges[1:] + edges[:-1]) / 2
    deepest = np.argsort(section)[-max(n_bins // 5, 3) :]
    curve = np.polynomial.Polynomial.fit(centres[deepest], section[deepest], 2)
    bend = curve.convert().coef[2]
    vertex = -curve.convert().coef[1] / (2 * bend) if bend < 0 else np.nan
    inside = np.isfinite(vertex) and abs(vertex) < track.width / 2
    floor = curve(vertex) if inside else section[deepest].mean()
    third = np.linspace(-track.width / 6, track.width / 6, 401)
    step = np.interp(third, centres, section).mean()
    area = np.maximum(section, 0).mean() * track.width
    return Section(area / track.width, float(floor), float(step), float(area))
