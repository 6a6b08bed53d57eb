"""A script of its own: reads the file named on its command line with SurfaceTopography and writes arrays to stdout.

It runs as another process, so that whatever a damaged file does to that library ends there: time, memory and faults.
In: path, most points. Out: one line of JSON, then the arrays as .npy: x and z of a trace, x, y and z (m, n) of a scan,
in metres, or in the file's own numbers where it names no unit. Exit code 3: SurfaceTopography is not installed.
"""

import io
import json
import os
import sys

MEMORY = 4 * 2**30  # bytes of address space


def main(path: str, most: int) -> int:
    """Read one file; 0 done or refused with a reason in the JSON, 3 the library is missing."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no data
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    except (ImportError, ValueError, OSError):
        pass
    try:
        import SurfaceTopography
        from SurfaceTopography.IO import open_topography
    except ImportError:
        return 3
    try:
        found, arrays = _read(open_topography(path), most)
    except Exception as error:
        found, arrays = {"error": f"{type(error).__name__}: {error}"}, []
    found["version"] = getattr(SurfaceTopography, "__version__", "")
    import numpy as np

    out.write(json.dumps(found).encode() + b"\n")
    for array in arrays:
        one = io.BytesIO()  # a pipe knows no position, which np.save wants
        np.save(one, np.ascontiguousarray(array, float), allow_pickle=False)
        out.write(one.getbuffer())
    out.close()
    return 0


def _read(reader, most: int) -> tuple:
    import numpy as np

    channel = reader.default_channel
    count = int(np.prod([int(n) for n in np.ravel(channel.nb_grid_pts)], dtype=object))
    if count > most:
        return {"error": f"{count} heights, more than {most:.0e}; export a part of the scan"}, []
    sizes = channel.physical_sizes
    if sizes is None:
        return {"error": "the file does not tell how large the scan is; export it as text with x, y and z"}, []
    topography = channel.topography()
    unit = topography.unit
    if unit is not None:
        topography = topography.to_unit("m")
    z = np.ma.filled(np.ma.asarray(topography.heights(), float), np.nan)
    found = {"unit": unit is not None, "format": type(reader).__name__.removesuffix("Reader")}
    if z.ndim == 1:
        return found, [topography.positions(), z]
    steps = [size / n for size, n in zip(topography.physical_sizes, z.shape)]
    return found, [np.arange(z.shape[0]) * steps[0], np.arange(z.shape[1]) * steps[1], z.T]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2])))
