"""Zones of a patch that slip under a prescribed slide, and the errors of their work.

In: pressed patches and the `PrescribedSlip`. Out: slip zones for the grading of the mesh, and
the error of work and force of the slip over the tolerance.
"""

import numpy as np

from ...core import Measure
from ...response.errors import convergence_errors
from ...response.rows import error_floor
from ...slip.shear_modes import JenkinsSet
from .jenkins_elements import elements


def slip_zones(patch, slip, ends: list) -> tuple:
    """Return the parts (start, end) [m] of a patch that yield below the amplitude of a slide.

    The slide at which points yield is interpolated linearly between nodes. At an end of the contact
    between two nodes the pressure vanishes, so that Coulomb points yield at once.

    Parameters
    ----------
    patch : Patch
        The pressed patch.
    slip : PrescribedSlip
        Prescribed slide.
    ends : list of contact.edges.ContactEdge
        Ends of its contact inside the interface.
    """
    if patch.strips is not None or not patch.active.any():
        return ()
    found = elements(patch, slip.static, slip.bond_length)
    yields = dict(zip(found.points.tolist(), found.point_yields.tolist()))
    beyond = {(end.node, end.side): end.position for end in ends}
    out = []
    for stretch in np.split(found.points, 1 + np.flatnonzero(np.diff(found.points) > 1)):
        places = patch.x[stretch].tolist()
        slides = [yields[node] for node in stretch.tolist()]
        if slip.bond_length == 0:
            first = beyond.get((int(stretch[0]), -1))
            last = beyond.get((int(stretch[-1]), 1))
            if first is not None and first < places[0]:
                places = [first, *places]
                slides = [0.0, *slides]
            if last is not None and last > places[-1]:
                places = [*places, last]
                slides = [*slides, 0.0]
        out += _intervals_below(np.array(places), np.array(slides), slip.amplitude)
    return tuple(out)


def _intervals_below(x, slides, amplitude: float) -> list:
    """Return the intervals of x (k,) [m] in which slides (k,) [m] are below an amplitude [m]."""
    yields = slides < amplitude
    starts = np.flatnonzero(yields & ~np.append(False, yields[:-1]))
    stops = np.flatnonzero(yields & ~np.append(yields[1:], False))
    out = []
    for first, last in zip(starts.tolist(), stops.tolist()):
        low = float(x[first])
        high = float(x[last])
        if first > 0:
            low = _crossing(x[first - 1 : first + 1], slides[first - 1 : first + 1], amplitude)
        if last < x.size - 1:
            high = _crossing(x[last : last + 2], slides[last : last + 2], amplitude)
        if high > low:
            out.append((low, high))
    return out


def _crossing(x, slides, amplitude: float) -> float:
    """Return the position [m] between two nodes at which the slide of yielding is the amplitude."""
    share = (amplitude - slides[0]) / (slides[1] - slides[0])
    return float(x[0] + share * (x[1] - x[0]))


def cycle_work(found: JenkinsSet, amplitude: float) -> float:
    """Return the work [J] of parallel elements in a cycle between -amplitude and amplitude [m]."""
    beyond = np.maximum(amplitude - found.yield_displacement, 0.0)
    return float(4 * (found.stiffness * found.yield_displacement) @ beyond)


def peak_force(found: JenkinsSet, amplitude: float) -> float:
    """Return the force [N] of parallel elements at a first slide of `amplitude` [m]."""
    return float(found.stiffness @ np.minimum(found.yield_displacement, amplitude))


def slip_missed(patches, slip, tolerance: float) -> float:
    """Return the largest error of work and force of the slip over the allowed error [1].

    Parameters
    ----------
    patches : sequence of Patch
        The patch on two or more nested meshes, fine to coarse.
    slip : PrescribedSlip
    tolerance : float
    """
    values = []
    for patch in patches:
        found = elements(patch, slip.static, slip.bond_length)
        values.append(
            {
                "loop_area": cycle_work(found, slip.amplitude),
                "friction_force_peak": peak_force(found, slip.amplitude),
            }
        )
    errors = convergence_errors(*values)
    return max(
        Measure(value, "", errors[name], float(error_floor(name))).error_ratio(tolerance)
        for name, value in values[0].items()
    )
