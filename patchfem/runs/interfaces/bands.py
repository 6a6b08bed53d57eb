"""Average of the histories of bands of a face that slide independently.

In: a run in which each band of cells is an interface, and the AreaPatch. Out: the run with the histories of a single
interface. A band has the pressure of the coupled face; `[contact.shear]` couples the bands.
"""

from dataclasses import replace

import numpy as np

from ...model.structure import N_YAW_BANDS, compute_band_offsets


def number_bands(patch) -> np.ndarray:
    """Return the number (m,) of the band in which each cell of a face lies, counted from -y."""
    place = patch.y / patch.model.pieces.width + 0.5
    return np.clip((place * N_YAW_BANDS).astype(int), 0, N_YAW_BANDS - 1)


def sum_bands(patch, values) -> np.ndarray:
    """Return the sums (b,) of values (m,) of the cells of a face over each band."""
    return np.bincount(number_bands(patch), values, N_YAW_BANDS)


def compute_band_loads(patch) -> np.ndarray:
    """Sum the normal forces of the cells in each band of a face: the loads (b,) [N] of the bands."""
    return sum_bands(patch, patch.normal_stress * patch.pieces.interface.weight)


def average_over_bands(run, patch):
    """Return a run with the histories of independently sliding bands averaged, in `response` and `window`.

    Displacement, velocity and slip are means weighted by the loads; the force is the resultant.
    `extra` retains the histories of the bands, and gets the yaw moment (k,) [N m], i.e. the sum of
    y f of the friction on the upper piece at the positions y of the bands.
    """
    loads = compute_band_loads(patch)
    weights = loads / loads.sum()
    offsets = compute_band_offsets(patch.model.pieces.width)

    def average(histories):
        """Return the histories of the bands as those of one interface that carries the whole load."""
        return replace(
            histories,
            slide=histories.slides @ weights,
            slide_rate=histories.extra["slide_rates"] @ weights,
            force=histories.forces.sum(axis=1),
            slip=histories.slips @ weights,
            extra=histories.extra | {"yaw_moment": histories.forces @ offsets},
        )

    return replace(run, response=average(run.response), window=average(run.window))
