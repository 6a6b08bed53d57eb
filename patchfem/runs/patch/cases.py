"""Cases of a static patch as columns, and their solution: records with a leading case axis.

In: a `PatchModel` in whose loading and gap shapes numbers may be arrays (n,). Out: `Cases` with the columns of the contact
problem; `Batch` with the measures of all cases. `solve.solve_cases` turns the one into the other. A single run is a batch
of one case.

Letters of array shapes: n cases, p gap shapes, m interface nodes.
"""

from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ..results.patch_rows import Arrays


class Reason(IntEnum):
    """Code of a case in `Batch.reason`: why it has no values, or why they miss the tolerance.

    - NONE: the case has values within the tolerance.
    - MESH_LIMIT: the values are the best; their errors miss the tolerance, and a finer mesh would be too expensive.
    - REFUSED: the load, the approach or the shapes cannot be computed with.
    - NOT_CONVERGED: no contact set meets the contact conditions to round-off.
    """

    NONE = 0
    MESH_LIMIT = 1
    REFUSED = 2
    NOT_CONVERGED = 3


class OutcomeCode(IntEnum):
    """Code of a case in `Batch.outcome`; FAILED cases have no values, and their `Batch.reason` tells why."""

    DONE = 0
    NO_CONTACT = 1
    FAILED = 2


class Cases(NamedTuple):
    """Loads, prescribed motions and gap shapes of n patches with the same pieces, layer and mesh settings.

    - load (n,): normal load [N]; NaN where the approach is prescribed.
    - approach (n,): prescribed approach [m]; NaN under a load.
    - moment (n,): moment about x = 0 [N m] of a free rotation; NaN where the rotation is prescribed.
    - spring (n,): stiffness [N m/rad] of the holder against the rotation.
    - rotation (n,): rotation [rad] of the upper piece that the gap already contains.
    - amplitudes (n, p): factors of the gap shapes.
    """

    load: np.ndarray
    approach: np.ndarray
    moment: np.ndarray
    spring: np.ndarray
    rotation: np.ndarray
    amplitudes: np.ndarray

    def __len__(self) -> int:
        return len(self.load)

    def take(self, rows) -> "Cases":
        """Return selected cases; `rows` are indices or a mask (n,)."""
        return Cases(*(column[rows] for column in self))


@dataclass(frozen=True, eq=False, slots=True)
class Batch:
    """Static measures of n cases of a group.

    - values, errors, floors {name: (n,)}: measures in SI units (`patch_rows.PATCH_TABLE`). A value is NaN where the case
      failed or the measure is unbounded; an error is NaN without an estimate.
    - excess (n,): largest ratio of error to allowed error of the measures for which the mesh is refined; above 1 the
      case misses its tolerance.
    - outcome (n,) of int8: `OutcomeCode`; reason (n,) of int8: `Reason`.
    - n_nodes (n,): number of interface nodes of the finest mesh of each case.
    - views: what `patch` needs: for each mesh from coarse to fine its pressed cases and their numbers.
    """

    values: Arrays
    errors: Arrays
    floors: Arrays
    excess: np.ndarray
    outcome: np.ndarray
    reason: np.ndarray
    n_nodes: np.ndarray
    views: list = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.excess)
