"""Script that reads a file with SurfaceTopography and writes its arrays to stdout as .npz.

It runs as a separate process, so that a damaged file cannot exhaust or crash the calling process.
Arguments: the file, the largest number of points, the CPU seconds allowed. Output: x and z of a
trace, or x, y and z (m, n) of a scan, in metres, or in the numbers of the file if it states no
unit, and `about`, a JSON text with unit, format and version; or `error`. Exit code 3:
SurfaceTopography is not installed.
"""

import io
import json
import math
import os
import sys

# Address space of the script in bytes; the largest permitted scan takes a quarter of it.
MAX_MEMORY = 1 << 32


def main(path: str, max_points: int, max_seconds: float) -> int:
    """Read a surface file with SurfaceTopography and write its arrays to stdout.

    Parameters
    ----------
    path : str
    max_points : int
    max_seconds : float
        CPU time.

    Returns
    -------
    int
        Exit code: 0, or 3 without the library.
    """
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # a library may print to stdout
    limit_resources(max_seconds)
    try:
        import SurfaceTopography
        from SurfaceTopography.IO import open_topography
    except ImportError:
        return 3
    import numpy as np

    try:
        arrays, about = read_topography(open_topography(path), max_points)
        about["version"] = getattr(SurfaceTopography, "__version__", "")
        arrays["about"] = json.dumps(about)
    except Exception as error:
        arrays = {"error": f"{type(error).__name__}: {error}"}
    content = io.BytesIO()  # a pipe has no position, which savez needs
    np.savez(content, **arrays)
    out.write(content.getbuffer())
    out.flush()
    return 0


def limit_resources(max_seconds: float) -> None:
    """Limit CPU time and memory where the system supports such limits."""
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
        soft = math.ceil(max_seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (soft if hard < 0 else min(soft, hard), hard))
    except (ImportError, ValueError, OSError):
        pass


def read_topography(reader, max_points: int) -> tuple[dict, dict]:
    """Return the arrays of a surface file, with the metadata of the file."""
    import numpy as np

    channel = reader.default_channel
    count = math.prod(int(n) for n in np.ravel(channel.nb_grid_pts))
    if count > max_points:
        raise ValueError(f"{count} heights, more than {max_points:.0e}; export a part of the scan")
    if channel.physical_sizes is None:
        raise ValueError(
            "the file does not give the size of the scan; export it as text with x, y and z"
        )
    topography = channel.topography()
    has_unit = topography.unit is not None
    if has_unit:
        topography = topography.to_unit("m")
    z = np.ma.filled(np.ma.asarray(topography.heights(), float), np.nan)
    about = {"unit": has_unit, "format": type(reader).__name__.removesuffix("Reader")}
    if z.ndim == 1:
        return {"x": topography.positions(), "z": z}, about
    steps = [size / n for size, n in zip(topography.physical_sizes, z.shape)]
    x, y = (np.arange(n) * step for n, step in zip(z.shape, steps))
    return {"x": x, "y": y, "z": z.T}, about


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2]), float(sys.argv[3])))
