"""Histories as a .mat file of version 5: column vectors in SI, and a struct of `units`."""

from pathlib import Path

import numpy as np

from .series import Histories, program_name

MAX_NAME_LENGTH = 63  # largest length of a MATLAB variable name, in characters


def write_arrays(path: Path, histories: Histories) -> None:
    """Write all arrays of a results folder as variables of a MATLAB file.

    `units.NAME` is the unit of NAME.
    """
    from scipy.io import savemat

    values = {
        name[:MAX_NAME_LENGTH]: np.asarray(array) for name, (array, _) in histories.arrays.items()
    }
    units = {name[:MAX_NAME_LENGTH]: unit for name, (_, unit) in histories.arrays.items()}
    with open(path, "wb") as file:
        savemat(
            file,
            {**values, "units": units, "title": histories.title, "source": program_name()},
            oned_as="column",
            long_field_names=True,
        )
