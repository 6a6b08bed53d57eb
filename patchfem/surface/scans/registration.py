"""Registration of a scan on another of the same place: rotation, shift, tilt and offset from what no wear has moved.

The second scan at R(angle) p + shift is z_before(p) - w(p) + a plane + noise, with a worn depth w that is zero where
nothing rubbed. Rotation and shift come from the heights without long waves, which a smooth wear does not have, by
robust least squares (Tukey's biweight) on images that get finer; then the plane from blocks that agree (`plane`); then
all six numbers from the heights within the noise of it.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...core import PatchfemError
from ..areal import Areal, filled
from .plane import unworn_planes
from .search import SIZE, Guess, guesses, image, middle, rotation, step_of, variant, without_waves

REACH = 2.5  # standard deviations of the noise within which a height counts as unworn
BIWEIGHT = 4.685  # standard deviations beyond which a height has no weight: 95 % efficient for normal noise
POINTS, FINEST = 40_000, 150_000  # heights of a fit, on images and on the scans
WAVES = 8.0  # pixels of an image: standard deviation of the Gauss filter whose mean is taken off
ROUNDS = 12
FEWEST = 400  # unworn heights
CHUNK = 1 << 20  # heights of a map at a time
FREE = 1e-4  # least singular value of a fit over the largest: a shift along a straight lay is not known
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
        tried.append((*_by_images(before, other, np.array([guess.angle, *guess.shift]), step, 3 * WAVES), guess, other))
    _, state, guess, other = min(tried, key=lambda one: one[0])
    finest = max(_step(before.x), _step(before.y), _step(other.x), _step(other.y))
    for finer in _finer(step, finest):
        _, state = _by_images(before, other, state, finer, WAVES)
    fit = _Fit(before, other, state)
    planes = unworn_planes(fit.map(state, np.zeros(3)), fit.x, fit.y)
    if not planes:
        raise PatchfemError("no part of both scans agrees up to a plane")
    settled = [_settled(fit, guess, state, plane) for plane in planes]
    return replace(settled[0], other=settled[1] if len(settled) > 1 else None)


def _finer(step: float, finest: float) -> list:
    """Steps [m] from the one of the search down to the finest, each half of the one before at least."""
    return [step / 2**k for k in range(int(np.ceil(np.log2(step / finest) - 1e-9)))] + [finest]


def _settled(fit, guess: Guess, state, plane) -> Laid:
    """The registration that starts from one plane."""
    state, numbers, noise, covariance = fit.settled(state, np.array(plane[:3]), plane.noise)
    depth = fit.map(state, numbers)
    return Laid(guess, float(state[0]), state[1:], depth, covariance, noise,
                _unworn(depth, noise), fit.region(state), fit.like(state, numbers, noise))


def _step(axis) -> float:
    return float(np.ptp(axis) / (axis.size - 1))


def _unworn(depth, noise: float) -> np.ndarray:
    """Heights within the noise of the plane, of which no neighbour is deep."""
    from scipy.ndimage import binary_dilation

    with np.errstate(invalid="ignore"):
        deep = np.abs(depth) > 2 * REACH * noise
        return (np.abs(depth) <= REACH * noise) & ~binary_dilation(deep)


def _by_images(before: Areal, after: Areal, state, step: float, waves: float) -> tuple:
    """Median difference of heights without long waves over their median size, and angle and shift, from images of a
    step [m] without the waves longer than some pixels."""
    pair = [image(scan, step) for scan in (before, after)]
    fit = _Pixels(*(without_waves(*one, waves) for one in pair), [one[1] for one in pair], step,
                  middle(before), middle(after))
    off = np.inf
    for _ in range(ROUNDS):
        rest, slopes = fit.rest(state)
        if rest.size < FEWEST:
            return np.inf, state
        rest = rest - np.median(rest)
        off = float(np.median(np.abs(rest)))
        weight = np.clip(1 - (rest / max(BIWEIGHT * 1.4826 * off, 1e-300))**2, 0.0, None)
        move = _least(slopes * weight[:, None], -rest * weight)
        state = state + move
        if np.abs(move[1:]).max() < 1e-3 * step and abs(move[0]) < 1e-3 / SIZE:
            break
    return off / max(float(np.median(np.abs(fit.z))), 1e-300), state


def _least(slopes, rest) -> np.ndarray:
    """Least-squares move; a direction in which the heights do not change stays."""
    scale = np.sqrt((slopes**2).sum(axis=0)).clip(1e-300)
    return np.linalg.lstsq(slopes / scale, rest, rcond=FREE)[0] / scale


class _Pixels:
    """Two images and the difference of their heights at a random share of the places of the first."""

    def __init__(self, one, two, there, step: float, *middles):
        from scipy.ndimage import binary_erosion, spline_filter

        rows, columns = np.nonzero(there[0])
        if rows.size > POINTS:
            take = np.random.default_rng(1).choice(rows.size, POINTS, replace=False)
            rows, columns = rows[take], columns[take]
        self.z = one[rows, columns]
        self.at = step * np.column_stack([columns - (one.shape[1] - 1) / 2, rows - (one.shape[0] - 1) / 2])
        self.spline, self.known = spline_filter(two, 3), binary_erosion(there[1]).astype(np.float32)
        self.step, self.middles, self.shape = step, middles, two.shape

    def rest(self, state) -> tuple:
        """First less second heights (k,) and their change with angle and shift (k, 3)."""
        place = self.at @ rotation(state[0]).T + state[1:] + self.middles[0] - self.middles[1]
        grid = np.array([place[:, 1] / self.step + (self.shape[0] - 1) / 2,
                         place[:, 0] / self.step + (self.shape[1] - 1) / 2])
        return rest_at(self.z, self.at, self.spline, self.known, grid, state[0], (self.step, self.step))


def rest_at(z, at, spline, known, grid, angle: float, steps: tuple) -> tuple:
    """First less second heights where the second is known, and their change with angle and shift.

    z (k,), at (k, 2): heights and places about the middle of the first; grid (2, k): rows and columns of the second;
    steps: of its columns and rows [m].
    """
    from scipy.ndimage import map_coordinates

    inside = _inside(known, grid)
    grid, at = grid[:, inside], at[inside]

    def read(move):
        return map_coordinates(spline, grid + np.array(move)[:, None], order=3, prefilter=False, mode="mirror")

    along = (read((0, 0.5)) - read((0, -0.5))) / steps[0]
    across = (read((0.5, 0)) - read((-0.5, 0))) / steps[1]
    turned = at @ rotation(angle + np.pi / 2).T  # d(R p)/d(angle)
    slopes = -np.column_stack([along * turned[:, 0] + across * turned[:, 1], along, across])
    return z[inside] - read((0, 0)), slopes


def _inside(known, grid) -> np.ndarray:
    """Whether all four neighbours of a place are known."""
    from scipy.ndimage import map_coordinates

    return map_coordinates(known, grid, order=1, mode="constant", cval=0.0) > 0.999


class _Fit:
    """Both scans, and the depth of the second below the first at places of the first."""

    def __init__(self, before: Areal, after: Areal, state):
        from scipy.ndimage import spline_filter

        self.centre = middle(before)
        self.x, self.y = before.x - self.centre[0], before.y - self.centre[1]
        self.z = before.z - np.nanmean(before.z)
        self.after = after
        z = after.z - np.nanmean(after.z)
        missing = np.isnan(z)
        self.known = (~missing).astype(np.float32)
        self.known[:RIM], self.known[-RIM:], self.known[:, :RIM], self.known[:, -RIM:] = 0.0, 0.0, 0.0, 0.0
        self.spline = spline_filter(filled(z, missing), 3)
        self.steps = _step(after.x), _step(after.y)
        rows, columns = np.nonzero(~np.isnan(self.z))
        if rows.size > FINEST:
            take = np.random.default_rng(2).choice(rows.size, FINEST, replace=False)
            rows, columns = rows[take], columns[take]
        self.some = self.z[rows, columns], np.column_stack([self.x[columns], self.y[rows]])

    def grid(self, at, state) -> np.ndarray:
        """Rows and columns (2, k) of the second scan of places (k, 2) [m] about the middle of the first."""
        place = at @ rotation(state[0]).T + state[1:] + self.centre
        return np.array([np.interp(place[:, 1], self.after.y, np.arange(self.after.y.size), np.inf, np.inf),
                         np.interp(place[:, 0], self.after.x, np.arange(self.after.x.size), np.inf, np.inf)])

    def map(self, state, plane) -> np.ndarray:
        """Depths (m, n) [m] less a plane."""
        from scipy.ndimage import map_coordinates

        out, rows = np.empty(self.z.shape), max(CHUNK // self.x.size, 1)
        for first in range(0, self.y.size, rows):
            part = slice(first, first + rows)
            at = np.stack(np.broadcast_arrays(self.x, self.y[part, None]), axis=-1).reshape(-1, 2)
            grid = np.nan_to_num(self.grid(at, state), posinf=1e9)
            there = _inside(self.known, grid)
            read = np.full(there.size, np.nan)
            read[there] = map_coordinates(self.spline, grid[:, there], order=3, prefilter=False, mode="mirror")
            depth = self.z[part].ravel() - read - (plane[0] + at @ plane[1:])
            out[part] = depth.reshape(self.z[part].shape)
        return out

    def region(self, state) -> np.ndarray:
        """Whether each place (m, n) of the first scan lies in the second one."""
        at = np.stack(np.broadcast_arrays(self.x, self.y[:, None]), axis=-1).reshape(-1, 2)
        return np.isfinite(self.grid(at, state)).all(axis=0).reshape(self.z.shape)

    def settled(self, state, plane, noise: float) -> tuple:
        """(state, plane, noise [m], covariance (6, 6)) of the fit to the unworn heights, once these stay the same."""
        z, at = self.some
        for turn in range(ROUNDS):
            grid = np.nan_to_num(self.grid(at, state), posinf=1e9)
            there = _inside(self.known, grid)
            rest, slopes = rest_at(z, at, self.spline, self.known, grid, state[0], self.steps)
            flat = np.column_stack([np.ones(rest.size), at[there]])
            rest = rest - flat @ plane
            noise = _noise(rest, noise if turn == 0 else 0.0)
            on = np.abs(rest) <= REACH * noise
            if on.sum() < FEWEST:
                raise PatchfemError("hardly any heights of both scans agree up to a plane")
            pull = np.column_stack([slopes, -flat])[on]
            move = _least(pull, -rest[on])
            state, plane = state + move[:3], plane + move[3:]
            if turn > 2 and np.abs(move[1:3]).max() < 1e-3 * min(self.steps) and abs(move[3]) < 1e-2 * noise:
                break
        return state, plane, noise, self._covariance(pull, rest[on], at[there][on])

    def _covariance(self, pull, rest, at) -> np.ndarray:
        """Covariance (6, 6) of a fit whose errors are alike in neighbouring heights: each of 16 parts of the scan is
        left out once (jackknife)."""
        scale = np.sqrt((pull**2).sum(axis=0)).clip(1e-300)
        pull = pull / scale
        low, high = at.min(axis=0), at.max(axis=0)
        part = np.minimum((PARTS * (at - low) / (high - low).clip(1e-300)).astype(int), PARTS - 1) @ (PARTS, 1)
        normal = np.array([pull[part == k].T @ pull[part == k] for k in range(PARTS**2)])
        right = np.array([pull[part == k].T @ rest[part == k] for k in range(PARTS**2)])
        moves = np.array([np.linalg.lstsq(normal.sum(axis=0) - normal[k], right.sum(axis=0) - right[k], rcond=FREE)[0]
                          for k in range(PARTS**2) if normal[k].any()])
        return (len(moves) - 1) * np.cov(moves.T, bias=True) / np.outer(scale, scale)

    def like(self, state, plane, noise: float) -> float:
        """Correlation of the unworn heights of both scans, those of the first about their own plane."""
        z, at = self.some
        grid = np.nan_to_num(self.grid(at, state), posinf=1e9)
        there = _inside(self.known, grid)
        rest, _ = rest_at(z, at, self.spline, self.known, grid, state[0], self.steps)
        z, at = z[there], at[there]
        rest = rest - plane[0] - at @ plane[1:]
        on = np.abs(rest) <= REACH * noise
        flat = np.column_stack([np.ones(on.sum()), at[on]])
        height = z[on] - flat @ np.linalg.lstsq(flat, z[on], rcond=None)[0]
        return float(np.corrcoef(height, height - rest[on])[0, 1])


def _noise(rest, least: float) -> float:
    """Standard deviation [m] of noise, from the depths of that sign which less wear or growth makes."""
    sides = [one[one > 0] for one in (rest, -rest)]
    return max(1.4826 * min((float(np.median(one)) for one in sides if one.size > 3), default=0.0), least, 1e-300)
