"""Registration of a scan on another of the same place: rotation, shift, tilt and offset from what no wear has moved.

The second scan at R(angle) p + shift is z_before(p) - w(p) + a plane + noise, with a worn depth w that is zero where
nothing rubbed. Rotation and shift come from the heights between the noise of single ones and the waves that a smooth
wear and a slow error of the scan have, by robust least squares (Tukey's biweight) on images that get finer; then the
plane from blocks that agree (`plane`), and from the heights within the noise of it.
"""

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from ...core import PatchfemError
from ..areal import Areal, filled
from .plane import unworn_planes
from .search import SIZE, Guess, guesses, image, middle, rotation, step_of, variant, without_waves

REACH = 2.5  # standard deviations of the noise within which a height counts as unworn
BIWEIGHT = 4.685  # standard deviations beyond which a height has no weight: 95 % efficient for normal noise
CORE, GAIN = 1.5, 0.551  # the same for the plane, which shallow wear would tilt; how far their mean moves with it
POINTS, FINEST = 40_000, 60_000  # heights of a fit, on images and on the scans
WAVES = 8.0  # pixels of an image: standard deviation of the Gauss filter whose mean is taken off
DEPTH = 3  # former moves that the next one learns from
ORDER = 4  # of the cosines over a scan that stand for its slow errors while shift and rotation are fitted
LARGEST = 1000  # pixels along a side of the finest image
ROUNDS = 20
AGAIN, NOISY = 2, 1.6  # planes that are sought at most, while heights scatter more than so many times a height's noise
NARROW = 1.35  # the same of heights that only noise moves, which is alike in neighbours
EXACT = 1e-9  # of the scatter of the heights, below which noise is rounding
FEWEST = 400  # unworn heights
CHUNK = 1 << 20  # heights of a map at a time
FREE = 1e-5  # least singular value of normal equations over the largest: a shift along a straight lay is not known
FEW = (2.131 / 1.96)**2  # of a variance from 16 parts: Student's quantile over that of a normal number
RIM = 2  # heights at the rim of a scan that a cubic spline reads less well
PARTS = 4  # along a side, of which each is left out once to tell how well a fit is known


@dataclass(frozen=True, eq=False)
class Laid:
    """How a second scan lies on a first one.

    guess: the search; angle [rad], shift (2,) [m] as there; depth (m, n) [m]: of the second scan below the first at the
    places of the first, less the plane, NaN where one is missing; covariance (6, 6): of angle, shift, and level [m] and
    slopes along x and y of the plane about the middle of the first; noise [m] of a depth; used (m, n): the unworn
    heights; region (m, n): what lies in both scans, missing heights too; like: correlation of the unworn heights of
    both; other: the registration on another plane, where a second part of the scans may be the unworn one.
    """

    guess: Guess
    angle: float
    shift: np.ndarray
    depth: np.ndarray
    covariance: np.ndarray
    noise: float
    used: np.ndarray
    region: np.ndarray
    like: float
    other: "Laid | None" = None


def laid(before: Areal, after: Areal) -> Laid:
    """Lay a scan on another one; PatchfemError with the reason where no common place is found."""
    step, tried = step_of(before, after), []
    for guess in guesses(before, after):
        other = variant(after, guess.mirrored, guess.turned)
        tried.append((*_by_images(before, other, np.array([guess.angle, *guess.shift]), step), guess, other))
    _, state, guess, other = min(tried, key=lambda one: one[0])
    finest = max(_step(before.x), _step(before.y), _step(other.x), _step(other.y), step * SIZE / LARGEST)
    for finer in _finer(step, finest):
        _, state = _by_images(before, other, state, finer)
    fit = _Fit(before, other, state)
    state = fit.placed(state)
    for _ in range(AGAIN):
        planes = unworn_planes(fit.map(state, np.zeros(3)), fit.x, fit.y, fit.least)
        if not planes:
            raise PatchfemError("no part of the two scans agrees up to a plane")
        settled = [fit.settled(state, np.array(plane[:3]), plane.noise) for plane in planes]
        state = settled[0][0]
        if settled[0][2] < NOISY * planes[0].noise:
            break  # otherwise the plane was that of scans that were not yet in place, or a fit to a wedge and its edge
    else:
        with suppress(PatchfemError):
            settled.insert(1, fit.settled(state, np.array(planes[0][:3]), planes[0].noise, NARROW))
    out = None
    for one in reversed(settled):
        out = replace(_record(fit, guess, *one), other=out)
    return out


def _finer(step: float, finest: float) -> list:
    """Steps [m] below the one of the search down to the finest, each half of the one before at least."""
    return [step / 2**k for k in range(1, int(np.ceil(np.log2(step / finest) - 1e-9)))] + [finest] * int(finest < step)


def _record(fit, guess: Guess, state, plane, noise: float, covariance) -> Laid:
    """The registration on a plane as a record."""
    depth = fit.map(state, plane)
    if np.isfinite(depth).sum() < FEWEST:
        raise PatchfemError("hardly any heights of the two scans coincide")
    return Laid(guess, float(state[0]), state[1:], depth, covariance, noise, _unworn(depth, noise), fit.region(state),
                fit.like(state, plane, noise))


def _step(axis) -> float:
    return float(np.ptp(axis) / (axis.size - 1))


def _unworn(depth, noise: float) -> np.ndarray:
    """Heights within the noise of the plane, of which no neighbour is deep."""
    from scipy.ndimage import binary_dilation

    with np.errstate(invalid="ignore"):
        deep = np.abs(depth) > 2 * REACH * noise
        return (np.abs(depth) <= REACH * noise) & ~binary_dilation(deep)


def _by_images(before: Areal, after: Areal, state, step: float) -> tuple:
    """Median difference of heights without long waves over their median size, and angle and shift, from images of a
    step [m]."""
    pair = [image(scan, step) for scan in (before, after)]
    fit = _Pixels(*((without_waves(*one, WAVES), one[1]) for one in pair), step, middle(before), middle(after))
    off, faster = np.inf, _Faster()
    for _ in range(ROUNDS):
        rest, slopes, wanted, _ = fit.rest(state)
        if rest.size < FEWEST:
            return np.inf, state
        rest = rest - np.median(rest)
        off = float(np.median(np.abs(rest)))
        weight = np.clip(1 - (rest / max(BIWEIGHT * 1.4826 * off, 1e-300))**2, 0.0, None)**2
        move = _moved(slopes, wanted * weight[:, None], -rest)
        state = faster(state, move)
        if np.abs(move[1:]).max() < 1e-3 * step and abs(move[0]) < 1e-3 / SIZE:
            break
    return off / max(float(np.median(np.abs(fit.z))), 1e-300), state


class _Faster:
    """The next state (j,) of a fit whose moves shrink slowly, as robust ones do (Anderson 1965), from its last ones."""

    def __init__(self):
        self.states, self.moves = [], []

    def __call__(self, state, move) -> np.ndarray:
        self.states, self.moves = [*self.states[-DEPTH:], state], [*self.moves[-DEPTH:], move]
        if len(self.moves) < 3:
            return state + move
        scale = np.abs(self.moves).max(axis=0).clip(1e-300)
        less, back = (np.diff(np.array(one) / scale, axis=0) for one in (self.moves, self.states))
        share = np.linalg.lstsq(less.T, move / scale, rcond=1e-3)[0]
        ahead = move - scale * (share @ (less + back))
        return state + ahead


def _moved(slopes, wanted, rest) -> np.ndarray:
    """Move (j,) with wanted^T slopes move = wanted^T rest; a direction in which the heights do not change stays.

    wanted (k, j) has the slopes of the other image, whose noise is another one: noisy slopes on both sides would make
    moves too short and their scatter too small (instrumental variables).
    """
    scale = np.sqrt((slopes**2).sum(axis=0)).clip(1e-300)
    return np.linalg.lstsq((wanted / scale).T @ slopes / scale, (wanted / scale).T @ rest, rcond=FREE)[0] / scale


def _spread(slopes, wanted, rest, at) -> np.ndarray:
    """Covariance (j, j) of a move whose errors are alike in neighbouring heights: each of 16 parts of the scan is left
    out once (jackknife); along a direction in which the heights do not change it may be half the scan."""
    scale = np.sqrt((slopes**2).sum(axis=0)).clip(1e-300)
    low, high = at.min(axis=0), at.max(axis=0)
    part = np.minimum((PARTS * (at - low) / (high - low).clip(1e-300)).astype(int), PARTS - 1) @ (PARTS, 1)
    kept = [part == k for k in range(PARTS**2)]
    normal = np.array([(wanted[one] / scale).T @ (slopes[one] / scale) for one in kept])
    right = np.array([(wanted[one] / scale).T @ rest[one] for one in kept])
    moves = np.array([np.linalg.lstsq(normal.sum(axis=0) - n, right.sum(axis=0) - r, rcond=FREE)[0]
                      for n, r in zip(normal, right) if n.any()])
    covariance = FEW * (len(moves) - 1) * np.cov(moves.T, bias=True) / np.outer(scale, scale)
    _, sizes, ways = np.linalg.svd(normal.sum(axis=0))
    for way in ways[sizes < FREE * sizes[0]] / scale:
        covariance = covariance + np.outer(way, way) * (np.ptp(at) / 2 / max(np.abs(way[1:3]).max(), 1e-300))**2
    return covariance


class _Pixels:
    """Two images and the difference of their heights at a random share of the places of the first."""

    def __init__(self, one: tuple, two: tuple, step: float, *middles):
        from scipy.ndimage import binary_erosion, spline_filter

        rows, columns = np.nonzero(binary_erosion(one[1]))
        if rows.size > POINTS:
            take = np.random.default_rng(1).choice(rows.size, POINTS, replace=False)
            rows, columns = rows[take], columns[take]
        self.z = one[0][rows, columns]
        self.slopes = np.column_stack([axis[rows, columns] for axis in np.gradient(one[0], step)[::-1]])
        self.at = step * np.column_stack([columns - (one[0].shape[1] - 1) / 2, rows - (one[0].shape[0] - 1) / 2])
        whole = filled(np.where(two[1], two[0], np.nan), ~two[1])
        self.spline, self.known = spline_filter(whole, 3), binary_erosion(two[1]).astype(np.float32)
        self.step, self.middles, self.shape = step, middles, two[0].shape

    def rest(self, state) -> tuple:
        """What `rest_at` gives of both images."""
        place = self.at @ rotation(state[0]).T + state[1:] + self.middles[0] - self.middles[1]
        grid = np.array([place[:, 1] / self.step + (self.shape[0] - 1) / 2,
                         place[:, 0] / self.step + (self.shape[1] - 1) / 2])
        return rest_at((self.z, self.at, self.slopes), (self.spline, self.known), grid, state[0], (self.step,) * 2)


def rest_at(first: tuple, second: tuple, grid, angle: float, steps: tuple) -> tuple:
    """First less second heights (k,) where the second is known, their change with angle and shift (k, 3) by the slopes
    of the second scan, the same by those of the first, and their places (k, 2).

    first: heights (k,), places (k, 2) about the middle, slopes along x and y (k, 2); second: its spline and whether
    each height is known; grid (2, k): its rows and columns there; steps: of its columns and rows [m].
    """
    from scipy.ndimage import map_coordinates

    inside = _inside(second[1], grid)
    grid, (z, at, own) = grid[:, inside], (one[inside] for one in first)

    def read(move):
        return map_coordinates(second[0], grid + np.array(move)[:, None], order=3, prefilter=False, mode="mirror")

    turned = at @ rotation(angle + np.pi / 2).T  # d(R p)/d(angle)
    other = np.column_stack([read((0, 0.5)) - read((0, -0.5)), read((0.5, 0)) - read((-0.5, 0))]) / steps
    both = [-np.column_stack([(one * turned).sum(axis=1), one]) for one in (other, own @ rotation(angle).T)]
    return z - read((0, 0)), *both, at


def _inside(known, grid) -> np.ndarray:
    """Whether all four neighbours of a place are known."""
    from scipy.ndimage import map_coordinates

    return map_coordinates(known, grid, order=1, mode="constant", cval=0.0) > 0.999


class _Fit:
    """Both scans, and the depth of the second below the first at places of the first."""

    def __init__(self, before: Areal, after: Areal, state):
        from scipy.ndimage import binary_erosion, spline_filter

        self.centre = middle(before)
        self.x, self.y = before.x - self.centre[0], before.y - self.centre[1]
        self.z = before.z - np.nanmean(before.z)
        self.least = EXACT * float(np.nanstd(self.z))
        self.after = after
        z = after.z - np.nanmean(after.z)
        missing = np.isnan(z)
        self.known = (~missing).astype(np.float32)
        self.known[:RIM], self.known[-RIM:], self.known[:, :RIM], self.known[:, -RIM:] = 0.0, 0.0, 0.0, 0.0
        self.spline = spline_filter(filled(z, missing), 3)
        self.steps = _step(after.x), _step(after.y)
        rows, columns = np.nonzero(binary_erosion(~np.isnan(self.z)))
        take = np.random.default_rng(2).permutation(rows.size)[:FINEST]
        rows, columns = rows[take], columns[take]
        slopes = [(self.z[rows + way[0], columns + way[1]] - self.z[rows - way[0], columns - way[1]]) / (2 * step)
                  for way, step in (((0, 1), _step(self.x)), ((1, 0), _step(self.y)))]
        self.some = self.z[rows, columns], np.column_stack([self.x[columns], self.y[rows]]), np.column_stack(slopes)

    def rest(self, state, most: int = FINEST) -> tuple:
        """What `rest_at` gives of both scans at some places."""
        some = [one[:most] for one in self.some]
        grid = np.nan_to_num(self.grid(some[1], state), posinf=1e9)
        return rest_at(some, (self.spline, self.known), grid, state[0], self.steps)

    def placed(self, state) -> np.ndarray:
        """Angle and shift from heights about cosines of the place, which take smooth wear and slow errors."""
        faster, smooth = _Faster(), 0.0
        for _ in range(ROUNDS):
            rest, slopes, wanted, at = self.rest(state, POINTS)
            if rest.size < FEWEST:
                raise PatchfemError("hardly any heights of the two scans coincide")
            base = _cosines(at, 2 * ORDER)
            off = rest - base @ smooth if np.ndim(smooth) else rest - np.median(rest)
            weight = np.clip(1 - (off / max(BIWEIGHT * 1.4826 * np.median(np.abs(off)), 1e-300))**2, 0.0, None)**2
            move = _moved(np.hstack([slopes, -base]), np.hstack([wanted, -base]) * weight[:, None], -rest)
            state, smooth = faster(state, move[:3]), move[3:]
            if np.abs(move[1:3]).max() < 1e-3 * min(self.steps):
                break
        return state

    def grid(self, at, state) -> np.ndarray:
        """Rows and columns (2, k) of the second scan of places (k, 2) [m] about the middle of the first."""
        place = at @ rotation(state[0]).T + state[1:] + self.centre
        return np.array([np.interp(place[:, 1], self.after.y, np.arange(self.after.y.size), np.inf, np.inf),
                         np.interp(place[:, 0], self.after.x, np.arange(self.after.x.size), np.inf, np.inf)])

    def _parts(self):
        """(rows as a slice, places (k, 2)) of the first scan, some at a time."""
        rows = max(CHUNK // self.x.size, 1)
        for first in range(0, self.y.size, rows):
            part = slice(first, first + rows)
            yield part, np.stack(np.broadcast_arrays(self.x, self.y[part, None]), axis=-1).reshape(-1, 2)

    def map(self, state, plane) -> np.ndarray:
        """Depths (m, n) [m] less a plane."""
        from scipy.ndimage import map_coordinates

        out = np.empty(self.z.shape)
        for part, at in self._parts():
            grid = np.nan_to_num(self.grid(at, state), posinf=1e9)
            there, read = _inside(self.known, grid), np.full(len(at), np.nan)
            read[there] = map_coordinates(self.spline, grid[:, there], order=3, prefilter=False, mode="mirror")
            out[part] = (self.z[part].ravel() - read - (plane[0] + at @ plane[1:])).reshape(out[part].shape)
        return out

    def region(self, state) -> np.ndarray:
        """Whether each place (m, n) of the first scan lies in the second one."""
        out = np.empty(self.z.shape, bool)
        for part, at in self._parts():
            out[part] = np.isfinite(self.grid(at, state)).all(axis=0).reshape(out[part].shape)
        return out

    def settled(self, state, plane, noise: float, widest: float = np.inf) -> tuple:
        """(state, plane, noise [m], covariance (6, 6)) of the fit to the unworn heights, once these stay the same; of
        those within `widest` times the noise that is given, where the scatter is larger.

        The slow errors of both scans, cosines of the place, are fitted with the state, as they move it otherwise.
        """
        faster, most = _Faster(), widest * noise
        for turn in range(ROUNDS):
            rest, slopes, wanted, at = self.rest(state)
            flat = np.column_stack([np.ones(rest.size), at])
            rest = rest - flat @ plane
            noise = max(min(_noise(rest, noise if turn == 0 else 0.0), most), self.least)
            on = np.abs(rest) <= REACH * noise
            if on.sum() < FEWEST:
                raise PatchfemError("hardly any heights of the two scans agree up to a plane")
            slow = _cosines(at[on], ORDER)
            both = [np.hstack([one[on], slow]) for one in (slopes, wanted)]
            move = _moved(*both, -rest[on])
            near = np.abs(rest) <= CORE * noise
            tilt = _moved(flat[near], flat[near], rest[near] + slopes[near] @ move[:3]) / GAIN
            state, plane = faster(state, move[:3]), plane + tilt
            if turn > 2 and np.abs(move[1:3]).max() < 1e-3 * min(self.steps) and abs(tilt[0]) < 1e-2 * noise:
                break
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = _spread(*both, -rest[on], at[on])[:3, :3]
        covariance[3:, 3:] = _spread(flat[near], flat[near], rest[near], at[near]) / GAIN**2
        return state, plane, noise, covariance

    def like(self, state, plane, noise: float) -> float:
        """Correlation of the unworn heights of both scans, those of the first about their own plane."""
        grid = np.nan_to_num(self.grid(self.some[1], state), posinf=1e9)
        rest, *_, at = self.rest(state)
        z, flat = self.some[0][_inside(self.known, grid)], np.column_stack([np.ones(rest.size), at])
        rest = rest - flat @ plane
        on = np.abs(rest) <= REACH * noise
        height = z[on] - flat[on] @ np.linalg.lstsq(flat[on], z[on], rcond=None)[0]
        return float(np.corrcoef(height, height - rest[on])[0, 1])


def _cosines(at, order: int) -> np.ndarray:
    """Products of cosines over the range of places (k, 2), of as many half waves as `order` in all (k, j)."""
    low, high = at.min(axis=0), at.max(axis=0)
    x, y = (np.pi * (at - low) / (high - low).clip(1e-300)).T
    along, across = ([np.cos(k * one) for k in range(order + 1)] for one in (x, y))
    return np.column_stack([along[i] * across[j] for i in range(order + 1) for j in range(order + 1 - i)])


def _noise(rest, least: float) -> float:
    """Standard deviation [m] of noise, from the depths of that sign which less wear or growth makes."""
    sides = [one[one > 0] for one in (rest, -rest)]
    return max(1.4826 * min((float(np.median(one)) for one in sides if one.size > 3), default=0.0), least, 1e-300)
