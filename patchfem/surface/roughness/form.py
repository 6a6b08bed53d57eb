"""The form of a trace or of a scan, which no roughness has: a line or plane, a polynomial, a circle or cylinder."""

from dataclasses import replace

import numpy as np

from ...core import PatchfemError, frozen_array, say
from ...scales import told
from ..areal import Areal
from ..areal import level as level_scan
from ..profile import Profile, level

MOST = 9  # degree of a polynomial
CYLINDER = "cylinder"
FITTED, LEFT = 1 << 16, 1 << 13  # heights that a cylinder is fitted to, at most, and those of its error
PARTS, SHARE = 10, 1.833  # parts left out in turn, and Student's t of 90 % with one degree of freedom less


def form_of(text: str) -> int | str:
    """A form as it is asked for: the degree of a polynomial, 1 to 9, or "cylinder"."""
    text = text.strip()
    if text == CYLINDER:
        return text
    if not text.isdecimal() or not 1 <= int(text) <= MOST:
        raise PatchfemError(f"the form '{text}' is not possible; use a degree from 1 (a line or a plane) to {MOST}, or "
                            f"{CYLINDER}")
    return int(text)


def without_form(surface: Profile | Areal, form: int | str = 1) -> tuple:
    """A surface less its least-squares form, and the name of that form for a sentence.

    form: degree of a polynomial (of a scan: total, in x and y), or "cylinder": a circle along a trace, a cylinder of
    any direction and tilt under a scan. Distances count along z, and all measured heights alike; to a cylinder a scan
    of more than 65536 heights gives every second, third ... row and column, a trace every second, third ... height.
    A scan of 1000 x 1000 heights: 0.1 s, less a cylinder 1 s. PatchfemError where the heights do not
    determine it.
    """
    scan = isinstance(surface, Areal)
    if form == CYLINDER:
        return _less_cylinder(surface)
    if form == 1:
        return (level_scan(surface, 1), "plane") if scan else (level(surface), "line")
    name = f"polynomial of degree {form}"
    if scan:
        return level_scan(surface, form), name
    there = ~surface.missing
    if there.sum() <= form + 1:
        raise PatchfemError(f"{surface.source}: {there.sum()} heights do not determine a polynomial of degree {form}")
    found = np.polynomial.Legendre.fit(surface.x[there], surface.z[there], form)
    return replace(surface, z=frozen_array(surface.z - found(surface.x))), name


def degree_of(form: int | str) -> int:
    """Degree of the polynomial that takes as much from the heights as a form."""
    return 2 if form == CYLINDER else form


def _less_cylinder(surface: Profile | Areal) -> tuple:
    """A surface less its circle or cylinder, and the name of it with its radius and that radius's 90 % error."""
    scan = isinstance(surface, Areal)
    x, y, z = (surface.x, surface.y, surface.z) if scan else (surface.x, np.zeros(1), surface.z[None, :])
    size = max(float(np.ptp(x)), float(np.ptp(y))) / 2
    x, y, z = (x - (x[0] + x[-1]) / 2) / size, (y - (y[0] + y[-1]) / 2) / size, z / size
    every = max(1, int(np.ceil((z.size / FITTED) ** (0.5 if scan else 1))))
    down, right = np.nonzero(~np.isnan(z[::every, ::every]))
    points = x[::every][right], y[::every][down], z[::every, ::every][down, right]
    if points[2].size < 10:
        raise PatchfemError(f"{surface.source}: {points[2].size} heights; a {CYLINDER} needs at least ten")
    found = _fitted(*points, scan)
    points = [one[::max(1, one.size // LEFT)] for one in points]
    across = -np.sin(found[4]) * points[0] + np.cos(found[4]) * points[1] if scan else points[0]
    place = np.floor((across - across.min()) / (np.ptp(across) * (1 + 1e-9)) * PARTS).astype(int)
    left = [_fitted(*(one[place != part] for one in points), scan, found)[3] for part in range(PARTS)]
    off = SHARE * float(np.sqrt((1 - 1 / PARTS) * np.sum((left - np.mean(left)) ** 2)))  # jackknife
    z = surface.z - size * (_height(found, x, y[:, None]) if scan else _height(found, x, 0.0))
    return replace(surface, z=frozen_array(z)), _named(found, off, size, scan)


def _named(found, off: float, size: float, scan: bool) -> str:
    curvature = float(found[3])
    name = CYLINDER if scan else "circle"
    if abs(curvature) <= 2 * off:  # its upper end tells nothing
        return f"{name}, of a radius above {say(size / (abs(curvature) + off), 3)} (90 % confidence)"
    error = size / (abs(curvature) - off) - size / abs(curvature)
    side = "crest" if curvature < 0 else "trough"
    name += f" of radius {told(size / abs(curvature), error, unit='m')} (90 % confidence), a {side}"
    return name + (f" whose axis lies {np.degrees(found[4]) % 180:.3g} deg from x" if scan else "")


def _height(found, x, y):
    """Height of a cylinder at (x, y): level, slope along the axis, sine of the slope across and curvature in the
    middle, and angle of the axis from x."""
    level, rise, sine, curve, angle = found
    v = -np.sin(angle) * x + np.cos(angle) * y
    end = np.clip(sine + curve * v, -1, 1)  # the sine of the slope grows evenly along a circle
    arc = v * (sine + end) / (np.sqrt(1 - sine**2) + np.sqrt(1 - end**2))
    return level + rise * (np.cos(angle) * x + np.sin(angle) * y) + np.sqrt(1 + rise**2) * arc


def _fitted(x, y, z, scan: bool, start=None) -> np.ndarray:
    """The least-squares cylinder (level, rise, sine, curvature, angle) of heights z at x, y; of a trace x lies across
    the axis."""
    from scipy.optimize import least_squares

    if start is None:
        one = np.ones(x.size)
        columns = (one, x, y, x * x / 2, x * y, y * y / 2) if scan else (one, x, x * x / 2)
        base = np.linalg.lstsq(np.column_stack(columns), z, rcond=None)[0]
        if scan:
            values, vectors = np.linalg.eigh([[base[3], base[4]], [base[4], base[5]]])
            most = int(np.argmax(np.abs(values)))
            across = vectors[:, most]
            angle = np.arctan2(-across[0], across[1])
            start = np.array([base[0], base[1:3] @ (np.cos(angle), np.sin(angle)),
                              base[1:3] @ (-np.sin(angle), np.cos(angle)), values[most], angle])
        else:
            start = np.array([base[0], 0.0, base[1], base[2], -np.pi / 2])
    free = slice(None) if scan else [0, 2, 3]

    def miss(values):
        full = np.array(start)
        full[free] = values
        return _height(full, x, y) - z

    out = np.array(start)
    out[free] = least_squares(miss, start[free], x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=30).x
    return out
