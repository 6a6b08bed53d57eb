"""Alignment of a second scan on a first: rotation, shift and plane of the unworn heights.

The search (`search`) finds the position to a pixel of its images. The model (`model`) is fitted by
Tukey's biweight to images of increasing resolution without long waves, as smooth wear and slow errors
of an instrument have long waves. The plane of the unworn heights then comes from least trimmed
squares over the modes of tiles (`compare.robust`, as for traces), and all six parameters from a
biweight fit to the heights that did not change (`wear`).
"""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core import PatchfemError, frozen_array
from ..areal import Areal
from ..compare.alignment import MAX_ROUNDS, MAX_SCALE_RATIO
from ..compare.robust import MAX_UNWORN, MIN_UNWORN, Floor, find_floors, fit_biweight
from .errors import ScanErrors, draw_scan_errors, estimate_placement_covariance
from .model import ALL, PLACE_PARAMETERS, PLANE, Parameter, Raster, ScanModel, make_raster
from .search import (
    SIZE,
    Placement,
    find_placements,
    pixel_size,
    resample_image,
    subtract_long_waves,
    transform_scan,
)
from .wear import find_change, widen

N_IMAGE_POINTS = 20_000  # number of heights in a fit to images
N_SUBSAMPLE_HEIGHTS = 8_000  # number of heights in the subsample that refines starting planes
LONG_WAVES = 8.0  # width in pixels of the Gaussian filter whose mean is subtracted from an image
MAX_SIDE = 1000  # largest number of pixels along a side of the finest image, which limits the time
# Smallest score of a second plane relative to the unworn fraction on the first, for
# which either may be the unworn one.
MIN_RIVAL = 0.5
MIN_DISTANCE = 3.0  # smallest distance of two different planes, in standard deviations
# Width of the margin around worn points, as a fraction of the shorter side, in which wear may fade
# out undetected
MARGIN = 0.1


@dataclass(frozen=True, eq=False)
class ScanAlignment:
    """Rotation and shift that align a second scan with a first one.

    - placement: result of the coarse search.
    - state: parameters of the model (`model.Parameter`), (6,).
    - depth: depth of the second scan below the first one at the points of the first, NaN where
      a height is missing, (m, n) [m].
    - noise: standard deviation [m] of an unworn depth.
    - worn, grown: points where material was lost, or gained (`wear.find_change`), (m, n) bool.
    - region: points that lie in both scans, measured or not, (m, n) bool.
    - covariance: covariance of angle [rad] and shift [m], (3, 3).
    - errors: drawn errors of the depth.
    - correlation: correlation of the unworn heights of both scans.
    - alternative: alignment on another plane whose heights may be the unworn ones instead, or
      None.
    """

    placement: Placement
    state: np.ndarray
    depth: np.ndarray
    noise: float
    unworn: np.ndarray
    worn: np.ndarray
    grown: np.ndarray
    region: np.ndarray
    covariance: np.ndarray
    errors: ScanErrors
    correlation: float
    alternative: "ScanAlignment | None" = field(default=None, repr=False)

    @property
    def angle(self) -> float:
        """Rotation [rad] of the second scan, from -pi to pi."""
        return float((self.state[Parameter.ANGLE] + np.pi) % (2 * np.pi) - np.pi)

    @property
    def shift(self) -> np.ndarray:
        """Shift (2,) [m] of the second scan."""
        return self.state[[Parameter.SHIFT_X, Parameter.SHIFT_Y]]


def align_scans(before: Areal, after: Areal) -> ScanAlignment:
    """Align the second scan with the first one on their unworn parts.

    Raises
    ------
    PatchfemError
        If no common place is found, or no plane on which heights of both scans lie.
    """
    placement, other, state = _find_place(before, after)
    model = ScanModel(make_raster(before), make_raster(other)).cut(state)
    planes = _find_unworn_planes(model, state)
    if not planes:
        raise PatchfemError("no part of the two scans agrees up to a plane")
    out = None
    for plane in reversed(planes):
        out = replace(_fit_unworn(model, placement, plane), alternative=out)
    return out


def _find_place(before: Areal, after: Areal) -> tuple:
    """Align coarse images, starting from every candidate placement, then refine the best one.

    Returns the placement, the second scan mirrored or inverted by it, and the state (6,).
    """
    step = pixel_size(before, after)
    candidates = []
    for placement in find_placements(before, after):
        other = transform_scan(after, placement.mirrored, placement.is_inverted)
        state = np.array([0.0, 0.0, 0.0, placement.angle, *placement.shift])
        noise, state = _fit_images(before, other, state, step)
        candidates.append((noise, len(candidates), state, placement, other))
    _, _, state, placement, other = min(candidates)
    finest = max(*make_raster(before).steps, *make_raster(other).steps, step * SIZE / MAX_SIDE)
    while step > 1.5 * finest:
        step = max(step / 2, finest)
        _, state = _fit_images(before, other, state, step)
    return placement, other, state


def _fit_images(before: Areal, after: Areal, state, step: float) -> tuple:
    """Align two images of the scans; return their relative noise and the parameters."""
    rasters = []
    for scan in (before, after):
        z, known = resample_image(scan, step)
        z = np.where(known, subtract_long_waves(z, known, LONG_WAVES), np.nan)
        middle = make_raster(scan).middle
        axes = (at + step * (np.arange(n) - (n - 1) / 2) for at, n in zip(middle, z.shape[::-1]))
        rasters.append(Raster(*axes, z))
    model = ScanModel(*rasters, N_IMAGE_POINTS)
    state = np.concatenate([np.zeros(3), state[3:]])
    try:
        state, scale = fit_biweight(
            model.cut(state), state, [Parameter.OFFSET, *PLACE_PARAMETERS], rounds=30
        )
    except PatchfemError:
        return np.inf, state
    return scale / max(float(np.nanstd(rasters[0].z)), 1e-300), state


def _find_unworn_planes(model: ScanModel, state) -> list:
    """Find at most two planes whose heights may be unworn, the more likely one first.

    The score of a plane is the fraction of the heights on it less the fraction above it, because
    wear leaves nothing above the first scan. The flat bottom of a groove is as quiet as an unworn
    part, but most heights lie above it.
    """
    thin = model.thin(N_SUBSAMPLE_HEIGHTS)
    state = fit_biweight(thin, state, list(PLANE)).state  # a tilt would blur the mode of a tile
    planes = find_floors(thin, state, list(PLANE), list(PLANE))
    planes = [plane for plane in planes if plane.unworn >= max(MIN_UNWORN, plane.grown)]
    if not planes:
        return []
    quietest = min(plane.scale for plane in planes)
    planes = [plane for plane in planes if plane.scale <= MAX_SCALE_RATIO * quietest]
    planes.sort(key=lambda plane: plane.grown - plane.unworn)
    first = planes[0]
    for plane in planes[1:]:
        score = plane.unworn - plane.grown
        is_rival = score >= MIN_RIVAL * first.unworn or plane.unworn >= first.unworn
        if is_rival and _are_apart(thin, first, plane):
            return [first, plane]
    return [first]


def _are_apart(model: ScanModel, first: Floor, second: Floor) -> bool:
    """Return whether two planes differ by more than their noise."""
    difference = (first.state - second.state)[:3]
    distance = difference[0] + (model.at / model.before.half) @ difference[1:]
    return float(np.median(np.abs(distance))) > MIN_DISTANCE * max(first.scale, second.scale)


def _fit_unworn(model: ScanModel, placement: Placement, plane: Floor) -> ScanAlignment:
    """Fit the model to the unworn heights and detect wear, repeatedly, until the worn part no longer changes."""
    model = model.cut(plane.state)
    model.smooth_slope(plane.scale)
    changed = None
    fit = fit_biweight(model, plane.state, list(ALL), max_scale=plane.scale)
    depth = model.map_depth(fit.state)
    for _ in range(MAX_ROUNDS):
        unworn = np.abs(depth) <= MAX_UNWORN * fit.scale
        worn, grown = find_change(depth, unworn, fit.scale)
        new = (worn | grown)[model.rows, model.columns]
        if changed is not None and (new == changed).mean() > 0.999:
            break
        changed = new
        if (~changed).sum() < MIN_UNWORN * changed.size:
            break
        last = fit
        fit = fit_biweight(model, fit.state, list(ALL), changed, max_scale=fit.scale)
        depth = depth + model.plane_map(fit.state - last.state)
    depth = model.map_depth(fit.state)
    unworn = (np.abs(depth) <= MAX_UNWORN * fit.scale) & ~worn & ~grown
    wide = widen(worn | grown, int(MARGIN * min(depth.shape)))
    plane_error = np.zeros(3)
    if wide.any() and (unworn & ~wide).sum() > unworn.sum() / 2:
        excluded = wide[model.rows, model.columns]
        other = fit_biweight(model, fit.state, list(ALL), excluded, rounds=10)
        plane_error = (other.state - fit.state)[:3]
    return ScanAlignment(
        placement=placement,
        state=frozen_array(fit.state),
        depth=frozen_array(depth),
        noise=fit.scale,
        unworn=unworn,
        worn=worn,
        grown=grown,
        region=model.map_overlap(fit.state),
        covariance=estimate_placement_covariance(model, fit.state, fit.scale, changed),
        errors=draw_scan_errors(depth, unworn, plane_error),
        correlation=_correlate_unworn(model, fit),
    )


def _correlate_unworn(model: ScanModel, fit) -> float:
    """Correlate the unworn heights of both scans after subtracting the plane of the first scan."""
    depth, jacobian = model.linearize(fit.state)
    unworn = np.abs(depth) <= MAX_UNWORN * fit.scale
    height = model.before.z[model.rows, model.columns][unworn]
    plane = jacobian[unworn][:, :3]
    height = height - plane @ np.linalg.lstsq(plane, height, rcond=None)[0]
    return float(np.corrcoef(height, height - depth[unworn])[0, 1])
