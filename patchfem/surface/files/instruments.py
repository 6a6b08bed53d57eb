"""Files in formats of instruments and X3P, which the optional package SurfaceTopography reads.

The examples of its version 1.27.1 were compared with texts of the same scans: steps and units agree, but a
scan of Digital Surf (.mnt) is longer by one step than its .bcrf, scans of Igor (.ibw) have no units, so the
user states them, and the Nikon reader (.nms) states lengths in a wrong unit, which are refused as too long. Of X3P
files it reads matrices with their masks, and refuses traces and dates that it does not know.
"""

import io
from math import prod

import numpy as np

from ...core import Missing, PatchfemError
from ...inputs.damage import shorten
from ...inputs.packed import count_zip_bytes, refuse_large_content
from .content import Content
from .table import Table, refuse_many_heights
from .units import HEADER_EXAMPLE


def read_instrument(content: Content) -> Table:
    """Read the content of a file in an instrument's format with the package SurfaceTopography.

    Raises Missing without the package, and PatchfemError if it cannot read the file.
    """
    path = content.path
    kind = "a file in an instrument's own format"
    remedy = "export the surface as text"
    if content.data.startswith(b"PK"):
        kind = "a zip file; unpack it if it contains a text; X3P is such a format"
        remedy = f"unpack a text that it contains, or {remedy}"
        size = count_zip_bytes(io.BytesIO(content.data))
        refuse_large_content(path, size, "export a smaller part of the scan")
    try:
        # The import takes two seconds.
        import SurfaceTopography
        from SurfaceTopography.IO import open_topography
    except ImportError:
        raise Missing(
            f"{path}: {kind}; the package SurfaceTopography can read many such formats: pip install "
            f"'patchfem[profiles]', or export the surface as text and {HEADER_EXAMPLE}"
        ) from None

    # x runs along the first axis of SurfaceTopography, and a missing height is masked.
    try:
        reader = open_topography(io.BytesIO(content.data) if content.is_packed else str(path))
        channel = reader.default_channel
        if channel.physical_sizes is None:
            raise ValueError("the file does not give the size of the scan")
        # A packed file may state far more heights than it has bytes.
        refuse_many_heights(path, prod(channel.nb_grid_pts))
        topography = channel.topography()
        unit = topography.unit
        if unit is not None:
            topography = topography.to_unit("m")

        z = np.ma.filled(np.ma.asarray(topography.heights(), float), np.nan)
        if z.ndim == 1:
            columns = {"x": np.asarray(topography.positions(), float), "z": z}
        else:
            steps = np.divide(topography.physical_sizes, z.shape)
            x, y = (np.arange(count) * step for count, step in zip(z.shape, steps))
            columns = {"x": x, "y": y, "z": z.T}
    except PatchfemError:
        raise
    except Exception as error:  # a damaged file leads to any kind of exception in a library
        reason = shorten(f"{type(error).__name__}: {error}", 120)
        raise PatchfemError(
            f"{path}: SurfaceTopography cannot read this file ({reason}); {remedy}"
        ) from None

    name = type(reader).__name__.removesuffix("Reader")
    note = f"{path}: read as {name} by SurfaceTopography {SurfaceTopography.__version__}"
    return Table(
        path,
        columns,
        {} if unit is None else dict.fromkeys(columns, "m"),
        str(path),
        notes=(note,),
        remedy="export the surface as text" if unit is None else "",
    )
