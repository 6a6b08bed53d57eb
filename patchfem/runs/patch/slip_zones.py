"""Slip zones of a patch under a prescribed displacement, and the errors of their work.

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
    """Return the zones (start, end) [m] that slip at a given displacement amplitude.

    The displacement at which points yield is interpolated linearly between nodes. At an end of the
    contact
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
    zones = elements(patch, slip.static, slip.bond_length)
    yields = dict(zip(zones.points.tolist(), zones.point_yields.tolist()))
    beyond = {(end.node, end.side): end.position for end in ends}
    out = []
    for stretch in np.split(zones.points, 1 + np.flatnonzero(np.diff(zones.points) > 1)):
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
    """Return the intervals of x [m] in which the yield displacement is below an amplitude."""
    yields = slides < amplitude
    starts = np.flatnonzero(yields & ~np.append(False, yields[:-1]))
    stops = np.flatnonzero(yields & ~np.append(yields[1:], False))
    out = []
    for first, last in zip(starts.tolist(), stops.tolist()):
        low = float(x[first])
        high = float(x[last])
        if first > 0:
            low = _interpolate_zone_end(
                x[first - 1 : first + 1], slides[first - 1 : first + 1], amplitude
            )
        if last < x.size - 1:
            high = _interpolate_zone_end(x[last : last + 2], slides[last : last + 2], amplitude)
        if high > low:
            out.append((low, high))
    return out


def _interpolate_zone_end(x, slides, amplitude: float) -> float:
    """Interpolate the position [m] at which the yield displacement equals the amplitude."""
    fraction = (amplitude - slides[0]) / (slides[1] - slides[0])
    return float(x[0] + fraction * (x[1] - x[0]))


def cycle_work(jenkins_set: JenkinsSet, amplitude: float) -> float:
    """Return the friction work [J] of parallel elements in a cycle of given amplitude [m]."""
    beyond = np.maximum(amplitude - jenkins_set.yield_displacement, 0.0)
    return float(4 * (jenkins_set.stiffness * jenkins_set.yield_displacement) @ beyond)


def peak_force(jenkins_set: JenkinsSet, amplitude: float) -> float:
    """Return the force [N] of parallel elements on initial loading to `amplitude` [m]."""
    return float(jenkins_set.stiffness @ np.minimum(jenkins_set.yield_displacement, amplitude))


def max_slip_error_ratio(patches, slip, tolerance: float) -> float:
    """Return the largest ratio of error to allowed error of friction work and friction force.

    Parameters
    ----------
    patches : sequence of Patch
        The patch on two or more nested meshes, fine to coarse.
    slip : PrescribedSlip
    tolerance : float
    """
    values = []
    for patch in patches:
        jenkins_set = elements(patch, slip.static, slip.bond_length)
        values.append(
            {
                "loop_area": cycle_work(jenkins_set, slip.amplitude),
                "friction_force_peak": peak_force(jenkins_set, slip.amplitude),
            }
        )
    errors = convergence_errors(*values)
    return max(
        Measure(value, "", errors[name], float(error_floor(name))).error_ratio(tolerance)
        for name, value in values[0].items()
    )
