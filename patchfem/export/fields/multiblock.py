"""Fields of the pieces as objects of PyVista, with the numbers of fields.vtkhdf and stresses in MPa.

pyvista is imported only when the fields are converted.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from . import bodies
from .series import Frame, Series
from .vtkhdf import NAME

PASCALS_PER_MEGAPASCAL = np.float32(1e6)
# Array of each part that PyVista colours by default.
ACTIVE_ARRAYS = {"lower": "von_mises", "upper": "von_mises", "interface": "normal_stress"}


def read_multiblocks(result, numbers) -> list:
    """Return frames of the fields of a run with a patch, each as a pyvista.MultiBlock.

    Parameters
    ----------
    result : Result
    numbers : sequence of int
        Numbers of the frames, negative from the end.

    Returns
    -------
    list of pyvista.MultiBlock
    """
    with TemporaryDirectory() as folder:
        bodies.write_fields(result, Path(folder) / NAME)
        with Series(Path(folder)) as series:
            return [make_multiblock(series.frame(number)) for number in numbers]


def make_multiblock(frame: Frame):
    """Return the blocks of a frame as a pyvista.MultiBlock of named grids.

    Stresses are in MPa. The field arrays `units` and `TimeValue` of every grid have the unit of each array
    and the time [s].
    """
    import pyvista as pv

    blocks = pv.MultiBlock()
    for name, block in frame.blocks.items():
        cells = np.insert(block.connectivity, block.offsets[:-1], np.diff(block.offsets))
        grid = pv.UnstructuredGrid(cells, block.types, block.points)
        unit_texts = []
        for target, data in (
            (grid.point_data, block.point_data),
            (grid.cell_data, block.cell_data),
        ):
            for array_name, values in data.items():
                unit = frame.units.get(array_name, "1")
                if unit == "Pa":
                    unit = "MPa"
                    values = values / PASCALS_PER_MEGAPASCAL
                target[array_name] = values
                unit_texts.append(f"{array_name} [{unit}]")
        grid.field_data["units"] = unit_texts
        grid.field_data["TimeValue"] = [frame.time]
        if name in ACTIVE_ARRAYS:
            grid.set_active_scalars(ACTIVE_ARRAYS[name])
        blocks.append(grid, name)
    return blocks
