"""Form of a trace or of a scan, which is not roughness: a polynomial, circle or cylinder."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ...formatting import format_length, format_value
from ..areal import Areal
from ..areal import level as level_scan
from ..profile import Profile, level

MAX_DEGREE = 9  # largest degree of a polynomial; higher ones follow the waves of the surface
CYLINDER = "cylinder"
# Largest number of heights in the fit of a cylinder; more take seconds and do not change it.
MAX_FITTED_HEIGHTS = 65_536
MAX_JACKKNIFE_HEIGHTS = 8_192  # largest number of heights in each fit of the jackknife
N_PARTS = 10  # number of parts of the surface, each of which the jackknife leaves out once
STUDENT_T = 1.833  # Student's t for 90 % with N_PARTS - 1 degrees of freedom


class Cylinder(NamedTuple):
    """Circle of a trace or cylinder of a scan, fitted in scaled coordinates.

    level: height in the middle; rise: slope of the axis; sine: of the slope across the axis in the
    middle; angle [rad]: of the axis from x.
    """

    level: float
    rise: float
    sine: float
    curvature: float
    angle: float

    def height(self, x, y):
        """Evaluate the height of the cylinder at (x, y)."""
        across = -np.sin(self.angle) * x + np.cos(self.angle) * y
        end = np.clip(self.sine + self.curvature * across, -1, 1)  # sine of the slope of a circle
        arc = across * (self.sine + end) / (np.sqrt(1 - self.sine**2) + np.sqrt(1 - end**2))
        along = np.cos(self.angle) * x + np.sin(self.angle) * y
        return self.level + self.rise * along + np.sqrt(1 + self.rise**2) * arc


def parse_form_option(text: str) -> int | str:
    """Parse the option that names the form to subtract: a polynomial degree or "cylinder"."""
    text = text.strip()
    if text == CYLINDER:
        return text
    if not text.isdecimal() or not 1 <= int(text) <= MAX_DEGREE:
        raise PatchfemError(
            f"the form '{text}' is not possible; use a degree from 1 (a line or a plane) to "
            f"{MAX_DEGREE}, or {CYLINDER}"
        )
    return int(text)


def subtract_form(surface: Profile | Areal, form: int | str = 1) -> tuple[Profile | Areal, str]:
    """Subtract the least-squares form of a surface; return the remainder and the form's name.

    form: degree of a polynomial (of a scan: total degree in x and y), or "cylinder": a circle along
    a trace, a cylinder of any direction and tilt under a scan. Distances count along z. A scan of
    1000 x 1000 heights takes 0.1 s, with a cylinder 1 s. Raises PatchfemError if the heights do not
    determine the form.
    """
    is_scan = isinstance(surface, Areal)
    if form == CYLINDER:
        return _subtract_cylinder(surface)
    if form == 1:
        return (level_scan(surface, 1), "plane") if is_scan else (level(surface), "line")
    name = f"polynomial of degree {form}"
    if is_scan:
        return level_scan(surface, form), name
    known = ~surface.missing
    if known.sum() <= form + 1:
        raise PatchfemError(f"{surface.source}: {known.sum()} heights do not determine a {name}")
    fitted = np.polynomial.Legendre.fit(surface.x[known], surface.z[known], form)
    return replace(surface, z=frozen_array(surface.z - fitted(surface.x))), name


def form_degree(form: int | str) -> int:
    """Return the degree of the polynomial that takes as many degrees of freedom as a form."""
    return 2 if form == CYLINDER else form


def _subtract_cylinder(surface: Profile | Areal) -> tuple[Profile | Areal, str]:
    """Subtract the least-squares circle or cylinder from a surface; describe its radius."""
    is_scan = isinstance(surface, Areal)
    y = surface.y if is_scan else np.zeros(1)
    size = max(float(np.ptp(surface.x)), float(np.ptp(y))) / 2
    x = (surface.x - (surface.x[0] + surface.x[-1]) / 2) / size
    y = (y - (y[0] + y[-1]) / 2) / size
    z = np.atleast_2d(surface.z) / size
    stride = max(1, int(np.ceil((z.size / MAX_FITTED_HEIGHTS) ** (0.5 if is_scan else 1))))
    rows, columns = np.nonzero(~np.isnan(z[::stride, ::stride]))
    points = np.stack(
        [x[::stride][columns], y[::stride][rows], z[::stride, ::stride][rows, columns]]
    )
    if rows.size < 10:
        raise PatchfemError(
            f"{surface.source}: {rows.size} heights; a {CYLINDER} needs at least ten"
        )
    fitted = _fit_cylinder(
        points, _estimate_cylinder(points) if is_scan else _estimate_circle(points)
    )
    points = points[:, :: max(1, rows.size // MAX_JACKKNIFE_HEIGHTS)]
    across = -np.sin(fitted.angle) * points[0] + np.cos(fitted.angle) * points[1]
    part = np.floor((across - across.min()) / (np.ptp(across) * (1 + 1e-9)) * N_PARTS)
    curvatures = [_fit_cylinder(points[:, part != k], fitted).curvature for k in range(N_PARTS)]
    error = STUDENT_T * float(np.sqrt((N_PARTS - 1) * np.var(curvatures)))
    remainder = surface.z - size * fitted.height(x, y[:, None] if is_scan else 0.0)
    return replace(surface, z=frozen_array(remainder)), _describe_cylinder(
        fitted, error, size, "cylinder" if is_scan else "circle"
    )


def _describe_cylinder(fitted: Cylinder, error: float, size: float, name: str) -> str:
    """Describe a circle or cylinder by its radius.

    `size` [m] is the unit of its reduced coordinates.
    """
    curvature = abs(float(fitted.curvature))
    if curvature <= 2 * error:  # the largest radius is not determined
        return f"{name}, of a radius above {format_length(size / (curvature + error), 3)} (90 % confidence)"
    radius_error = size / (curvature - error) - size / curvature
    side = "crest" if fitted.curvature < 0 else "trough"
    radius = format_value(size / curvature, radius_error, unit="m")
    text = f"{name} of radius {radius} (90 % confidence), a {side}"
    if name == "circle":
        return text
    return f"{text} whose axis lies {np.degrees(fitted.angle) % 180:.3g} deg from x"


def _estimate_circle(points) -> Cylinder:
    """Return the least-squares parabola of a trace as the start of its circle."""
    x, _, z = points
    base = np.linalg.lstsq(np.column_stack([np.ones(x.size), x, x * x / 2]), z, rcond=None)[0]
    return Cylinder(base[0], 0.0, base[1], base[2], -np.pi / 2)


def _estimate_cylinder(points) -> Cylinder:
    """Return the least-squares quadric of a scan, curved only across one axis."""
    x, y, z = points
    columns = np.column_stack([np.ones(x.size), x, y, x * x / 2, x * y, y * y / 2])
    base = np.linalg.lstsq(columns, z, rcond=None)[0]
    values, vectors = np.linalg.eigh([[base[3], base[4]], [base[4], base[5]]])
    largest = int(np.argmax(np.abs(values)))
    angle = np.arctan2(-vectors[0, largest], vectors[1, largest])
    rise = base[1] * np.cos(angle) + base[2] * np.sin(angle)
    sine = base[2] * np.cos(angle) - base[1] * np.sin(angle)
    return Cylinder(base[0], rise, sine, values[largest], angle)


def _fit_cylinder(points, start: Cylinder) -> Cylinder:
    """Fit a cylinder to points (3, k) by least squares.

    The axis of a trace, all of whose y are 0, stays fixed.
    """
    from scipy.optimize import least_squares

    x, y, z = points
    free = [0, 1, 2, 3, 4] if y.any() else [0, 2, 3]
    full = np.array(start)

    def residual(values):
        full[free] = values
        return Cylinder(*full).height(x, y) - z

    tolerances = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
    full[free] = least_squares(
        residual, np.array(start)[free], x_scale="jac", max_nfev=30, **tolerances
    ).x
    return Cylinder(*full)
