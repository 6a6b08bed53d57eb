"""Matrix-free compliance of the interface at thousands of evenly spaced points.

u = H p + V E V^T f: H multiplies each wave cos(n pi x/L) of the pressure by its closed form (`layer.layer_compliance`),
which takes two cosine transforms; V E V^T is what the free ends of the pieces change (`layer.end_compliance`), a few
smooth functions.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.fft import dct, idct

from ...core import NotConverged
from ..edges import ContactEdge, parabola_change, place_edges

# Smallest magnitude of a compliance of the free ends, relative to the largest, whose eigenfunction
# is kept
MIN_KEPT_COMPLIANCE_RATIO = 1e-9
# Relative residual of the equations on the active points at which their solution has converged
ACTIVE_POINTS_RESIDUAL_TOL = 1e-10
# Offset of a contact edge (see `edges.compute_edge_offset`) relative to the cell length, measured to 0.001
# for Hertz contact on 24 rows of points
POINT_EDGE_OFFSET_FRACTION = 0.189
# Largest number of points that are counted to find the longest contact; longer contacts count as
# equal
MAX_REFERENCE_POINTS = 64


@dataclass(frozen=True, eq=False, slots=True)
class PointCompliance:
    """Compliance of a row of n equal cells, each of which is loaded at its centre.

    - x (n,): Centres of the cells [m].
    - area: Area of a cell [m2].
    - waves (n,): Compliance [m/Pa] for a pressure cos(j pi x/L), j = 0, 1, ...
    - modes (n, r): Functions of the free ends [1].
    - mode_compliances (r,): Compliance [m/N] of these functions.
    """

    x: np.ndarray
    area: float
    waves: np.ndarray
    modes: np.ndarray
    mode_compliances: np.ndarray

    @property
    def node_compliance(self) -> float:
        """Mean displacement of a point per force on it [m/N]."""
        return float(self.waves.mean()) / self.area

    @property
    def eigenvalue_bound(self) -> float:
        """Upper bound of the largest eigenvalue [m/N]."""
        of_ends = float(np.abs(self.mode_compliances) @ (self.modes**2).sum(axis=0))
        return float(self.waves.max()) / self.area + of_ends

    def product(self, force: np.ndarray) -> np.ndarray:
        """Return the displacements (n,) [m] under forces (n,) [N]."""
        by_ends = self.modes @ (self.mode_compliances * (force @ self.modes))
        return idct(self.waves * dct(force)) / self.area + by_ends

    def solve_forces(
        self, active: np.ndarray, motion: np.ndarray, max_iterations: int = 400
    ) -> np.ndarray:
        """Solve for the forces at the active points that produce a prescribed motion.

        The method is that of conjugate gradients, preconditioned by the stiffness of each wave.

        Parameters
        ----------
        active : (n,) bool ndarray
            Points in contact.
        motion : (n,) ndarray
            Displacement of the active points [m].
        max_iterations : int
            Number of steps after which the method gives up.

        Returns
        -------
        (n,) ndarray
            Forces [N], 0 outside the active points.

        Raises
        ------
        NotConverged
            After `max_iterations` steps.
        """

        # Conjugate gradients. The inverse of the compliance without contact edges (by cosine transforms) is the
        # preconditioner.
        residual = np.where(active, motion, 0.0)
        tolerance = ACTIVE_POINTS_RESIDUAL_TOL * np.abs(residual).max()
        force = np.zeros(residual.size)
        direction = np.zeros(residual.size)
        last_square = np.inf
        for _ in range(max_iterations):
            if np.abs(residual).max() <= tolerance:
                return force
            preconditioned = np.where(active, idct(dct(residual) / self.waves) * self.area, 0.0)
            square = float(residual @ preconditioned)
            direction = preconditioned + square / last_square * direction
            last_square = square
            displacement = np.where(active, self.product(direction), 0.0)
            step = square / float(direction @ displacement)
            force = force + step * direction
            residual = residual - step * displacement
        raise NotConverged(
            f"contact: the iteration did not converge; after {max_iterations} steps the residual is "
            f"{np.abs(residual).max():.1e} m, more than the permitted {tolerance:.1e} m"
        )


class SmoothModes(NamedTuple):
    """Eigenfunctions of a smooth compliance.

    - modes (n, r): eigenfunctions in columns.
    - mode_compliances (r,): compliance [m2/N] of each.
    """

    modes: np.ndarray
    mode_compliances: np.ndarray


def smooth_modes(positions, change, x) -> SmoothModes:
    """Compute the eigenfunctions of a symmetric compliance that varies smoothly along x.

    Parameters
    ----------
    positions : (k,) ndarray
        Increasing positions [m].
    change : (k, k) ndarray
        Compliance between them [m2/N].
    x : (n,) ndarray
        Positions at which the functions are evaluated [m].
    """
    from scipy.interpolate import CubicSpline

    cells = np.diff(positions)
    weight = np.sqrt((np.append(cells, 0.0) + np.append(0.0, cells)) / 2)
    compliances, vectors = np.linalg.eigh(weight[:, None] * change * weight)
    is_kept = np.abs(compliances) > MIN_KEPT_COMPLIANCE_RATIO * np.abs(compliances).max(initial=0.0)
    return SmoothModes(
        CubicSpline(positions, vectors[:, is_kept] / weight[:, None])(x), compliances[is_kept]
    )


def find_edges(compliance: PointCompliance, force, gap, force_rate) -> list[ContactEdge]:
    """Find the contact edges between equally spaced points.

    Parameters
    ----------
    compliance : PointCompliance
        Compliance of the n points.
    force, gap : (n,) ndarray
        Forces [N] and gap under load [m].
    force_rate : (n,) ndarray
        Increase of the forces per approach on the contact set [N/m].

    Returns
    -------
    list of ContactEdge
        By increasing x.
    """
    gap_rate = 1 - compliance.product(force_rate)
    return place_edges(
        compliance.x,
        force,
        gap,
        force_rate,
        gap_rate,
        lambda node, inner, outer, fraction: POINT_EDGE_OFFSET_FRACTION * outer,
    )


def set_stiffness(compliance: PointCompliance, active, motion, edges: list[ContactEdge]) -> float:
    """Return the stiffness of a contact whose edges may lie between equally spaced points.

    Each edge adds the change along the parabola through the set with one point less and one more (`contact.edges`). The
    compliances of these points are taken from the edge of the longest contact, because they are the same at all edges
    but those of the shortest contacts.

    Parameters
    ----------
    compliance : PointCompliance
        Compliance of the n points.
    active : (n,) bool ndarray
        Contact set.
    motion : (n,) ndarray
        Displacement of the points per unit: 1 for a translation, x for a rotation.
    edges : list of ContactEdge
        Edges of the set.
    """
    force = compliance.solve_forces(active, motion)
    stiffness = float(force @ motion)
    if not edges or active.sum() < 3:
        return stiffness

    # Compliance of the point beyond the edge of the longest contact, and stiffness of the last point before it, while the
    # other points in contact are held (Schur complements)
    mismatch = motion - compliance.product(force)
    longest_edge = max(edges, key=lambda edge: _contact_length(active, edge))
    indices = np.arange(motion.size)
    outside = longest_edge.node + longest_edge.side
    inner = compliance.solve_forces(active, (indices == longest_edge.node).astype(float))
    inner_stiffness = inner[longest_edge.node]
    column = compliance.product((indices == outside).astype(float))
    outer_compliance = column[outside] - float(compliance.solve_forces(active, column) @ column)

    for edge in edges:
        gain = mismatch[edge.node + edge.side] ** 2 / outer_compliance
        loss = force[edge.node] ** 2 / inner_stiffness
        stiffness += parabola_change(edge.fraction - 0.5, gain, loss)
    return stiffness


def _contact_length(active: np.ndarray, edge: ContactEdge) -> int:
    """Count the points of the contact interval that ends at a given edge.

    `active` (n,) is True at points in contact. At most `MAX_REFERENCE_POINTS` are counted.
    """
    if edge.side > 0:
        first = max(edge.node - MAX_REFERENCE_POINTS + 1, 0)
        points = active[first : edge.node + 1][::-1]
    else:
        points = active[edge.node : edge.node + MAX_REFERENCE_POINTS]
    return int(np.argmin(np.append(points, False)))
