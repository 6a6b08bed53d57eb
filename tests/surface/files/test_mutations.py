"""Randomly damaged files of all formats are read, or refused with a message that names the file."""

import gzip
import tempfile
import warnings
from collections import Counter
from pathlib import Path
from time import process_time

import numpy as np
import pytest
import surfaces as write
from torture.scenes import damage_bytes
from torture.trial import Trial

from patchfem.core import Missing, PatchfemError
from patchfem.surface import read_surface
from patchfem.surface.areal import Areal

Z = np.where(np.arange(24).reshape(4, 6) == 9, np.nan, write.draw_scan())
POINTS = np.array([(x * 0.5, y * 0.75, Z[y, x] * 1e6) for y in range(4) for x in range(6)])
LINES = "".join(f"{x:.2f},{y:.2f},{float(z)!r}\n" for x, y, z in POINTS)

ROWS = "".join(f"{k}.5,0.{k * 37 % 500:03d}\n" for k in range(40))

# file name, content that is damaged, and function that makes the file of it
SEEDS = {
    "text": ("a.csv", f"# tip 2 um\nx [um],z [um]\n{ROWS}".encode(), bytes),
    "decimal comma": ("a.csv", f"x_um;z_um\n{ROWS}".replace(",", ";").replace(".", ",").encode(), bytes),
    "raster": ("a.txt", f"x [um],y [um],z [um]\n{LINES}".encode(), bytes),
    "matrix": ("a.txt", ("# Width: 3.0 µm\n# Height: 3.0 µm\n# Value units: um\n" + "\n".join("\t".join(
        f"{float(z) * 1e6!r}".replace(".", ",") for z in row) for row in Z)).encode(), bytes),
    "names and units": ("a.txt", ("Nr.;Position;Höhe\n;mm;µm\n" + "".join(
        f"{k};{row.replace(',', ';')}\n" for k, row in enumerate(ROWS.split()))).encode(), bytes),
    "utf-16": ("a.txt", f"x [um],y [um],z [um]\n{LINES}".encode("utf-16"), bytes),
    "gzip": ("a.csv.gz", gzip.compress(f"x [um],y [um],z [um]\n{LINES}".encode(), mtime=0), bytes),
    "dektak": ("a.csv", write.make_dektak(np.sin(np.arange(60.0)), 9.375), bytes),
    "npy": ("a.npy", write.make_npy(POINTS), bytes),
    "mat": ("a.mat", write.make_mat(False, points=POINTS), bytes),
    "mat packed": ("a.mat", write.make_mat(points=POINTS), bytes),
}  # fmt: skip


def read_outcome(path: Path) -> str:
    """Return "read", "refused" or "missing", and check that what was read is a surface."""
    start = process_time()
    try:
        with warnings.catch_warnings(action="error"):
            found = read_surface(path, ("um", "um") if path.suffix in (".npy", ".mat") else None)
    except PatchfemError as error:
        assert str(path) in str(error) and len(str(error)) < 500 + len(str(path))
        result = "missing" if isinstance(error, Missing) else "refused"
    else:
        heights = found.z[np.isfinite(found.z)]
        assert heights.size >= 2 and not np.isinf(found.z).any() and np.abs(heights).max() <= 10.0
        axes = (found.x, found.y) if isinstance(found, Areal) else (found.x,)
        assert all(np.isfinite(axis).all() and (np.diff(axis) > 0).all() for axis in axes)
        assert found.z.shape == tuple(axis.size for axis in reversed(axes))
        result = "read"
    assert process_time() - start < 10.0
    return result


def count_outcomes(name: str, count: int) -> Counter:
    """Return the numbers of outcomes of randomly damaged copies of one file."""
    file, seed, make_file = SEEDS[name]
    trial = Trial(np.random.default_rng([81, len(seed)]))
    outcomes = Counter()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / file
        path.write_bytes(make_file(seed))
        assert read_outcome(path) == "read"
        for _ in range(count):
            data = bytearray(seed)
            for _ in range(trial.draw(1, 2, 3, 4)):
                damage_bytes(trial, data)
            path.write_bytes(make_file(bytes(data)))
            outcomes[read_outcome(path)] += 1
    return outcomes


@pytest.mark.parametrize("count", [40, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", SEEDS)
def test_always_damaged_files_are_read_or_refused(name, count):
    """Damaged copies of a file are read or refused with the file name, and at least about 5 % are refused."""
    outcomes = count_outcomes(name, count)
    assert outcomes.total() == count and outcomes["refused"] > count // 20 - 2
