"""Alignment of a second scan on a first one: rotation, shift and plane from the heights that did not wear.

The search (`search`) knows the place to a pixel of its images. The model of the second scan (`model`) is
fitted by Tukey's biweight to images that get finer, whose long waves are filtered off, as smooth wear and
slow errors have long waves. The plane of the unworn heights then comes from least trimmed squares of the
modes of tiles (`compare.robust`, as for traces), and all six parameters from a biweight fit without the
parts that changed (`wear`).
"""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core import PatchfemError, frozen_array
from ..areal import Areal
from ..compare.robust import MIN_UNWORN, REACH, Floor, find_floors, fit_biweight
from .errors import ScanErrors, placement_covariance, scan_errors
from .model import ALL, PLACE, PLANE, Parameter, Raster, ScanModel, raster_of
from .search import SIZE, Guess, guesses, image, step_of, variant, without_waves
from .wear import find_change, widen

N_IMAGE_POINTS = 20_000  # heights of a fit to images
N_THINNED = 8_000  # heights of the subsample with which starting planes are refined
LONG_WAVES = (
    8.0  # pixels: standard deviation of the Gauss filter that takes the long waves off an image
)
MAX_SIDE = 1000  # pixels along a side of the finest image
MAX_LOUDER = 1.5  # scale of a floor over that of the quietest one, beyond which it is no floor
MIN_RIVAL = (
    0.5  # score of a second floor over the fraction on the first, above which either may be unworn
)
MIN_APART = 3.0  # smallest median distance of two floors, in standard deviations of their noise
MARGIN = 0.1  # of the shorter side, excluded beside changed parts to estimate how far slight wear moves the plane
MAX_ROUNDS = 4  # iterations of fit and search for changed parts


@dataclass(frozen=True, eq=False)
class ScanAlignment:
    """How a second scan lies on a first one.

    Attributes
    ----------
    guess : Guess
        Result of the search.
    state : (6,) array
        See `model.Parameter`.
    depth : (m, n) array [m]
        Of the second scan below the first one at the places of the first, NaN where one is missing.
    noise : float
        Standard deviation [m] of an unworn depth.
    used : (m, n) bool array
        Unworn heights.
    worn, grown : (m, n) bool array
        Places that are deeper, or higher, than noise, by their own depth or the mean around them.
    region : (m, n) bool array
        Places that lie in both scans, measured or not.
    covariance : (3, 3) array
        Of angle [rad] and shift [m].
    errors : ScanErrors
        Drawn errors of the depth in tiles of the map.
    likeness : float
        Correlation of the unworn heights of both scans.
    other : ScanAlignment or None
        Alignment on another plane, where a second part of the scans may be the unworn one.
    """

    guess: Guess
    state: np.ndarray
    depth: np.ndarray
    noise: float
    used: np.ndarray
    worn: np.ndarray
    grown: np.ndarray
    region: np.ndarray
    covariance: np.ndarray
    errors: ScanErrors
    likeness: float
    other: "ScanAlignment | None" = field(default=None, repr=False)

    @property
    def angle(self) -> float:
        """Rotation [rad] of the second scan, from -pi to pi."""
        return float((self.state[Parameter.ANGLE] + np.pi) % (2 * np.pi) - np.pi)

    @property
    def shift(self) -> np.ndarray:
        """Shift (2,) [m] of the second scan."""
        return self.state[[Parameter.SHIFT_X, Parameter.SHIFT_Y]]


def align_scans(before: Areal, after: Areal) -> ScanAlignment:
    """Align the second scan on the unworn heights of the first one.

    Raises
    ------
    PatchfemError
        If no common place, or no plane that heights of both scans lie on, is found.
    """
    guess, other, state = _place(before, after)
    model = ScanModel(raster_of(before), raster_of(other)).cut(state)
    floors = _unworn_floors(model, state)
    if not floors:
        raise PatchfemError("no part of the two scans agrees up to a plane")
    out = None
    for floor in reversed(floors):
        out = replace(_complete(model, guess, floor), other=out)
    return out


def _place(before: Areal, after: Areal) -> tuple:
    """Find the place on images: the guess that fits best, the scan after as it says, and the state."""
    step = step_of(before, after)
    tried = []
    for guess in guesses(before, after):
        other = variant(after, guess.mirrored, guess.turned)
        state = np.array([0.0, 0.0, 0.0, guess.angle, *guess.shift])
        loudness, state = _fit_images(before, other, state, step)
        tried.append((loudness, len(tried), state, guess, other))
    _, _, state, guess, other = min(tried)
    finest = max(*raster_of(before).steps, *raster_of(other).steps, step * SIZE / MAX_SIDE)
    while step > 1.5 * finest:
        step = max(step / 2, finest)
        _, state = _fit_images(before, other, state, step)
    return guess, other, state


def _fit_images(before: Areal, after: Areal, state, step: float) -> tuple:
    """Fit the place to images of a step [m]; return the noise over the height of the image, and the state."""
    rasters = []
    for scan in (before, after):
        z, known = image(scan, step)
        z = np.where(known, without_waves(z, known, LONG_WAVES), np.nan)
        middle = raster_of(scan).middle
        axes = (at + step * (np.arange(n) - (n - 1) / 2) for at, n in zip(middle, z.shape[::-1]))
        rasters.append(Raster(*axes, z))
    model = ScanModel(*rasters, N_IMAGE_POINTS)
    state = np.concatenate([np.zeros(3), state[3:]])
    try:
        state, scale = fit_biweight(model.cut(state), state, [Parameter.OFFSET, *PLACE], rounds=30)
    except PatchfemError:
        return np.inf, state
    return scale / max(float(np.nanstd(rasters[0].z)), 1e-300), state


def _unworn_floors(model: ScanModel, state) -> list:
    """Find the floors that may be the unworn one, the likeliest first; at most two.

    A floor scores by the fraction of the heights on it, less the fraction above it, as wear leaves
    nothing above the first scan: the flat floor of a groove is quiet, and most heights lie above it.
    """
    thin = model.thinned(N_THINNED)
    state = fit_biweight(thin, state, list(PLANE)).state  # a tilt within a tile would blur its mode
    floors = find_floors(thin, state, list(PLANE), list(PLANE))
    floors = [floor for floor in floors if floor.unworn >= max(MIN_UNWORN, floor.grown)]
    if not floors:
        return []
    quietest = min(floor.scale for floor in floors)
    floors = [floor for floor in floors if floor.scale <= MAX_LOUDER * quietest]
    floors.sort(key=lambda floor: floor.grown - floor.unworn)
    first = floors[0]
    for floor in floors[1:]:
        is_likely = (
            floor.unworn - floor.grown >= MIN_RIVAL * first.unworn or floor.unworn >= first.unworn
        )
        if is_likely and _are_apart(thin, first, floor):
            return [first, floor]
    return [first]


def _are_apart(model: ScanModel, one: Floor, other: Floor) -> bool:
    """Return whether the planes of two floors lie apart by more than their noise."""
    apart = (model.at / model.before.half) @ (one.state - other.state)[1:3] + (
        one.state - other.state
    )[0]
    return float(np.median(np.abs(apart))) > MIN_APART * max(one.scale, other.scale)


def _complete(model: ScanModel, guess: Guess, floor: Floor) -> ScanAlignment:
    """Fit a floor to all heights but those that changed, and map the depth below it."""
    model = model.cut(floor.state)
    model.smooth_slope(floor.scale)
    changed = None
    fit = fit_biweight(model, floor.state, list(ALL), max_scale=floor.scale)
    depth = model.map_depth(fit.state)
    for _ in range(MAX_ROUNDS):
        used = np.abs(depth) <= REACH * fit.scale
        worn, grown = find_change(depth, used, fit.scale)
        new = (worn | grown)[model.rows, model.columns]
        if changed is not None and (new == changed).mean() > 0.999:
            break
        changed = new
        if (~changed).sum() < MIN_UNWORN * changed.size:
            break
        before = fit
        fit = fit_biweight(model, fit.state, list(ALL), changed, max_scale=fit.scale)
        depth = depth + model.plane_map(fit.state - before.state)
    depth = model.map_depth(fit.state)
    used = (np.abs(depth) <= REACH * fit.scale) & ~worn & ~grown
    wide = widen(worn | grown, int(MARGIN * min(depth.shape)))
    doubt = np.zeros(3)
    if wide.any() and (used & ~wide).sum() > used.sum() / 2:
        other = fit_biweight(
            model, fit.state, list(ALL), wide[model.rows, model.columns], rounds=10
        )
        doubt = (other.state - fit.state)[:3]
    return ScanAlignment(
        guess=guess,
        state=frozen_array(fit.state),
        depth=frozen_array(depth),
        noise=fit.scale,
        used=used,
        worn=worn,
        grown=grown,
        region=model.map_overlap(fit.state),
        covariance=placement_covariance(model, fit.state, fit.scale, changed),
        errors=scan_errors(depth, used, doubt),
        likeness=_likeness(model, fit),
    )


def _likeness(model: ScanModel, fit) -> float:
    """Return the correlation of the unworn heights of both scans, those of the first about their own plane."""
    depth, jacobian = model.linearize(fit.state)
    on = np.abs(depth) <= REACH * fit.scale
    height = model.before.z[model.rows, model.columns][on]
    plane = jacobian[on][:, :3]
    height = height - plane @ np.linalg.lstsq(plane, height, rcond=None)[0]
    return float(np.corrcoef(height, height - depth[on])[0, 1])
