"""Slip zones of a patch under a prescribed displacement, and the error of the friction work.

In: solved patches and the `PrescribedSlip`. Out: slip zones for the grading of the mesh, and the
errors of friction work and friction force relative to the tolerance.
"""

import numpy as np

from ...contact.edges import ContactEdge
from ...core import Measure
from ...response.errors import convergence_errors
from ...response.rows import error_floor
from ...slip.shear_modes import JenkinsSet
from .jenkins_elements import elements

Zone = tuple[float, float]  # start and end [m]


def find_slip_zones(patch, slip, ends: list[ContactEdge]) -> tuple[Zone, ...]:
    """Return the zones (start, end) [m] that slip at a given displacement amplitude.

    The yield displacement is interpolated linearly between nodes. At a contact edge between two
    nodes the pressure vanishes, so that points there yield at once under Coulomb's law.

    Parameters
    ----------
    patch : Patch
        Solved patch.
    slip : PrescribedSlip
        Prescribed displacement.
    ends : list of contact.edges.ContactEdge
        Contact edges inside the interface.
    """
    if patch.strips is not None or not patch.active.any():
        return ()

    jenkins_set = elements(patch, slip.static, slip.bond_length)
    yield_by_node = dict(zip(jenkins_set.points.tolist(), jenkins_set.point_yields.tolist()))
    edge_by_node = {(end.node, end.side): end.position for end in ends}
    out = []

    # Each interval of neighbouring nodes in contact is interpolated by itself.
    for nodes in np.split(jenkins_set.points, 1 + np.flatnonzero(np.diff(jenkins_set.points) > 1)):
        positions = patch.x[nodes].tolist()
        yield_displacements = [yield_by_node[node] for node in nodes.tolist()]
        if slip.bond_length == 0:
            first = edge_by_node.get((int(nodes[0]), -1))
            last = edge_by_node.get((int(nodes[-1]), 1))
            if first is not None and first < positions[0]:
                positions = [first, *positions]
                yield_displacements = [0.0, *yield_displacements]
            if last is not None and last > positions[-1]:
                positions = [*positions, last]
                yield_displacements = [*yield_displacements, 0.0]

        out += _yielding_intervals(
            np.array(positions), np.array(yield_displacements), slip.amplitude
        )
    return tuple(out)


def _yielding_intervals(x, yield_displacement, amplitude: float) -> list[Zone]:
    """Return the intervals of x [m] in which the yield displacement is below an amplitude."""
    is_yielding = yield_displacement < amplitude
    starts = np.flatnonzero(is_yielding & ~np.append(False, is_yielding[:-1]))
    stops = np.flatnonzero(is_yielding & ~np.append(is_yielding[1:], False))
    out = []
    for first, last in zip(starts.tolist(), stops.tolist()):
        low = float(x[first])
        high = float(x[last])
        if first > 0:
            low = _interpolate_zone_end(
                x[first - 1 : first + 1], yield_displacement[first - 1 : first + 1], amplitude
            )
        if last < x.size - 1:
            high = _interpolate_zone_end(
                x[last : last + 2], yield_displacement[last : last + 2], amplitude
            )
        if high > low:
            out.append((low, high))
    return out


def _interpolate_zone_end(x, yield_displacement, amplitude: float) -> float:
    """Interpolate the position [m] at which the yield displacement equals a given amplitude."""
    fraction = (amplitude - yield_displacement[0]) / (yield_displacement[1] - yield_displacement[0])
    return float(x[0] + fraction * (x[1] - x[0]))


def friction_work_per_cycle(jenkins_set: JenkinsSet, amplitude: float) -> float:
    """Return the friction work [J] of parallel elements in a cycle of given amplitude [m]."""
    slip = np.maximum(amplitude - jenkins_set.yield_displacement, 0.0)
    return float(4 * (jenkins_set.stiffness * jenkins_set.yield_displacement) @ slip)


def peak_friction_force(jenkins_set: JenkinsSet, amplitude: float) -> float:
    """Return the force [N] of parallel elements at an amplitude [m] on first loading."""
    return float(jenkins_set.stiffness @ np.minimum(jenkins_set.yield_displacement, amplitude))


def max_slip_error_ratio(patches, slip, tolerance: float) -> float:
    """Return the larger ratio of error to allowed error of friction work and peak force.

    Parameters
    ----------
    patches : sequence of Patch
        The patch on two or more nested meshes, from fine to coarse.
    slip : PrescribedSlip
        Prescribed displacement of the holders, with the friction law.
    tolerance : float
        Relative error that work and peak force have to meet.
    """
    values = []
    for patch in patches:
        jenkins_set = elements(patch, slip.static, slip.bond_length)
        values.append(
            {
                "loop_area": friction_work_per_cycle(jenkins_set, slip.amplitude),
                "friction_force_peak": peak_friction_force(jenkins_set, slip.amplitude),
            }
        )
    errors = convergence_errors(*values)
    ratios = []
    for name, value in values[0].items():
        measure = Measure(value, "", errors[name], float(error_floor(name)))
        ratios.append(measure.error_ratio(tolerance))
    return max(ratios)
