"""A script of its own: reads files with SurfaceTopography that are named on stdin and writes arrays to stdout.

It runs as another process, so that whatever a damaged file does to that library ends there: time, memory and faults.
One process reads many files, since the library takes seconds to import. On its command line: most points, most CPU
seconds of a file. In: a JSON text for each path, in a line. Out, for each: a line of JSON, whose "sizes" are the bytes
of the arrays that follow as .npy: x and z of a trace, x, y and z (m, n) of a scan, in metres, or in the file's own
numbers where it names no unit. Exit code 3: SurfaceTopography is not installed; 0: nothing came for IDLE seconds.
"""

import io
import json
import math
import os
import select
import sys
import time

MEMORY = 4 * 2**30  # bytes of address space
IDLE = 60.0  # seconds without a file after which the process ends


def main(most: int, seconds: float) -> int:
    """Read files until stdin ends; 0 done, 3 the library is missing."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no data
    _limited(seconds, True)
    try:
        import SurfaceTopography
        from SurfaceTopography.IO import open_topography
    except ImportError:
        return 3
    version = getattr(SurfaceTopography, "__version__", "")
    while (os.name != "posix" or select.select([0], [], [], IDLE)[0]) and (line := sys.stdin.buffer.readline()):
        _limited(seconds)
        try:
            found, arrays = _read(open_topography(json.loads(line)), most)
        except Exception as error:
            found, arrays = {"error": f"{type(error).__name__}: {error}"}, []
        _written(out, found | {"version": version}, arrays)
    return 0


def _limited(seconds: float, memory: bool = False) -> None:
    """From here on so many seconds of CPU time, and so much memory; where the system knows such limits."""
    try:
        import resource

        if memory:
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
        soft = math.ceil(time.process_time() + seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (soft if hard < 0 else min(soft, hard), hard))
    except (ImportError, ValueError, OSError):
        pass


def _written(out, found: dict, arrays: list) -> None:
    import numpy as np

    parts = []
    for array in arrays:
        parts.append(io.BytesIO())  # a pipe knows no position, which np.save wants
        np.save(parts[-1], np.ascontiguousarray(array, float), allow_pickle=False)
    out.write(json.dumps(found | {"sizes": [one.getbuffer().nbytes for one in parts]}).encode() + b"\n")
    for one in parts:
        out.write(one.getbuffer())
    out.flush()


def _read(reader, most: int) -> tuple:
    import numpy as np

    channel = reader.default_channel
    count = int(np.prod([int(n) for n in np.ravel(channel.nb_grid_pts)], dtype=object))
    if count > most:
        return {"error": f"{count} heights, more than {most:.0e}; export a part of the scan"}, []
    sizes = channel.physical_sizes
    if sizes is None:
        return {"error": "the file does not give the size of the scan; export it as text with x, y and z"}, []
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
    sys.exit(main(int(sys.argv[1]), float(sys.argv[2])))
