"""Form of a surface, which is not roughness: a line, a plane, or a circle under a trace."""

from dataclasses import replace

import numpy as np

from ...core import PatchfemError, frozen_array
from ...formatting import format_length
from ..areal import Areal, level
from ..profile import Profile

CIRCLE_FORM = "circle"
MIN_CIRCLE_HEIGHTS = 10  # smallest number of heights that determine a circle


def parse_form_option(text: str) -> int | str:
    """Parse the text of the option that names the form to subtract: 1 (line or plane), or circle."""
    form = {"1": 1, CIRCLE_FORM: CIRCLE_FORM}.get(text.strip())
    if form is not None:
        return form
    raise PatchfemError(
        f"the form '{text}' is not possible; use 1 (a line or a plane) or {CIRCLE_FORM} (of a trace); polynomials "
        "were removed in patchfem 1.2"
    )


def subtract_form(surface: Profile | Areal, form: int | str = 1) -> tuple[Profile | Areal, str]:
    """Subtract the least-squares form of a surface; return the remainder and the name of the form.

    Raises PatchfemError if the heights do not determine it, and for a circle under a scan.

    Parameters
    ----------
    surface : Profile or Areal
        Trace or scan.
    form : int or str
        1 for a line or a plane, "circle" for a circle under a trace.

    Returns
    -------
    remainder : Profile or Areal
    name : str
        Name of the form, for the user.
    """
    is_scan = isinstance(surface, Areal)
    if form != CIRCLE_FORM:
        return level(surface), "plane" if is_scan else "line"
    if is_scan:
        raise PatchfemError(
            f"{surface.source}: the form of a scan is its plane; cylinders were removed in patchfem 1.2, so "
            "evaluate one line of the scan with --form circle"
        )

    known = ~surface.missing
    if known.sum() < MIN_CIRCLE_HEIGHTS:
        raise PatchfemError(
            f"{surface.source}: {known.sum()} heights; a circle needs at least {MIN_CIRCLE_HEIGHTS}"
        )
    from scipy.optimize import least_squares

    # A circle is given by its level, the sine of its slope in the middle and its curvature, relative to half the length.
    # This sine is linear along x, so that a large radius is well conditioned. The fit starts at the parabola
    # c0 + c1 x + c2 x^2, whose curvature is 2 c2.
    size = surface.length / 2
    x = (surface.x - (surface.x[0] + surface.x[-1]) / 2) / size
    start = np.polyfit(x[known], surface.z[known] / size, 2)[::-1] * [1, 1, 2]
    fitted = least_squares(
        lambda state: _evaluate_circle(state, x[known]) - surface.z[known] / size,
        start,
        x_scale="jac",
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
    ).x
    radius = format_length(size / max(abs(fitted[2]), 1e-12), 4)
    name = f"circle of radius {radius}, a {'crest' if fitted[2] < 0 else 'trough'}"
    remainder = surface.z - size * _evaluate_circle(fitted, x)
    return replace(surface, z=frozen_array(remainder)), name


def _evaluate_circle(state, x) -> np.ndarray:
    """Return the heights of a circle at places x (n,), both relative to the same length.

    The `state` are the level, the sine of the slope in the middle and the curvature.
    """
    height, sine, curvature = state
    sine = np.clip(sine, -1, 1)
    end = np.clip(sine + curvature * x, -1, 1)
    return height + x * (sine + end) / (np.sqrt(1 - sine**2) + np.sqrt(1 - end**2))
