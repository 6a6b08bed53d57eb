"""Histories as a .mat file of version 5: one variable each, column vectors in SI, and `units`, a structure of texts."""

from pathlib import Path

import numpy as np

from .series import Histories, program

LONGEST = 63  # letters of a name in MATLAB


def write(path: Path, found: Histories) -> None:
    """Write every array of the folder, histories as (k, 1), by its own name; `units.NAME` is the unit of NAME."""
    from scipy.io import savemat

    values = {name[:LONGEST]: np.asarray(array) for name, (array, _) in found.arrays.items()}
    units = {name[:LONGEST]: unit for name, (_, unit) in found.arrays.items()}
    with open(path, "wb") as file:
        savemat(
            file,
            {**values, "units": units, "title": found.title, "source": program()},
            oned_as="column",
            long_field_names=True,
        )
