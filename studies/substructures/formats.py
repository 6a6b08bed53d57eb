"""Does each format of matrices bring a structure of 1e5 unknowns here whole, and what do the digits that it lacks cost?

Yes, to the last bit, from every format in double precision; 10 digits of a slender beam cost 0.25 % of its first
frequency, and single precision all of it. A clamped beam of 1 m x 16 mm x 20 mm, 97 040 unknowns, stiffness, mass and
damping of 6.2 million entries each (seed 5; CPU seconds of a machine that seven others used):

| format, writer | MB | read [CPU s] | entries off by | frequencies off by | what the run says |
|---|---|---|---|---|---|
| NumPy, scipy.sparse.save_npz | 238 | 0.9 | 0 | 0 | |
| Matrix Market, scipy.io.mmwrite | 249 | 1.3 | 0 | 0 | |
| MATLAB 5, scipy.io.savemat | 178 | 2.7 | 0 | 0 | |
| MATLAB 7.3, h5py | 238 | 2.7 | 0 | 0 | |
| Nastran OUTPUT4 binary | 160 | 11 | 0 | 0 | |
| Nastran OUTPUT4 text | 430 | 33 | 0 | 0 | |
| Abaqus, 16 digits | 299 | 13 | 5e-17 | 4e-10 | |
| Nastran DMIG, fields of 16 (10 digits) | 444 | 28 | 2e-10 | 0.25 % | uncertain by 0.29 % |
| Nastran OUTPUT4 binary, single precision | 101 | 11 | 2.5e-8 | 62 % | uncertain by 320 % |

DMIG cards in fields of 8 letters have 3 digits: of 2 850 unknowns they leave a stiffness that is not positive, which is
refused. OUTPUT4 text takes 4 GB to read, the others 3 GB at most. Entries are off by a share of the largest. OUTPUT4,
DMIG, Abaqus and MATLAB 7.3 are written here by their published layouts; pyNastran 1.4.1 reads the OUTPUT4 files to the
last bit, and what it writes itself in text is read so here (`tests/studies/test_substructures.py`).

Run: python studies/substructures/formats.py [cells along the beam] [cells across], 400 and 8
"""

import struct
import sys
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import NamedTuple

import h5py
import numpy as np
from scipy import sparse
from scipy.io import mmwrite, savemat

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import models
from peer import Peer  # noqa: F401  of its test

import patchfem as pf
from patchfem.inputs import matrices

SEED = 5
SIZE = 1.0, 16e-3, 20e-3  # of the beam [m]
NAMES = {"K": "stiffness", "M": "mass", "C": "damping"}
SCENE = """\
[structure]
[structure.reduced]
stiffness = "{K}"
mass = "{M}"
damping = "{C}"
boundary = [{rows[0]}, {rows[1]}]
modes = 6
[drive]
kind = "force"
force = "1 N"
mass = 1
frequency = "10 Hz"
cycles = 5
"""


class Row(NamedTuple):
    """A format, bytes of its files, CPU seconds to read them, largest difference of an entry over the largest entry,
    largest relative change of the first frequency and of any of the eight, what patchfem says of the digits."""

    name: str
    bytes: int
    seconds: float
    off: float
    first: float
    moved: float
    says: str


def beam(along: int, across: int) -> models.Model:
    """A clamped beam of cells; `tip` and `middle` move in the second direction across it.

    Each unknown has a unit of its own, 0.8 to 1.2 m, so that no two numbers of a matrix are the same by the mesh.
    """
    counts = along, across, across
    one = models.block(counts, np.array(SIZE) / counts, (0.0, 0.0, 0.0))
    slices = {name: one.near((place, SIZE[1] / 2, SIZE[2] / 2), (1.1 * SIZE[0] / along, 1.0, 1.0))
              for name, place in (("clamp", 0.0), ("middle", SIZE[0] / 2), ("tip", SIZE[0]))}
    made = models.put_together([one], {name: [(0, slices[name], 2)] for name in ("tip", "middle")},
                               [(0, slices["clamp"])])
    unit = np.random.default_rng(SEED).uniform(0.8, 1.2, made.mass.shape[0])
    every = []
    for matrix in made[:3]:
        found = matrix.tocoo()
        i, j = found.coords
        every.append(sparse.coo_array((found.data * (unit[i] * unit[j]), (i, j)), found.shape).tocsr())
        every[-1].eliminate_zeros()
    return models.Model(*every, made.places)


def _lower(matrix) -> tuple:
    """(rows, columns, numbers) of the lower triangle, column by column."""
    found = sparse.tril(matrix).tocsc().tocoo()
    return tuple(part.tolist() for part in (*found.coords, found.data))


def _each(write, ending: str):
    """A writer of one file for each matrix."""
    def of_all(folder: Path, every: dict) -> dict:
        for name, matrix in every.items():
            write(folder / f"{name}{ending}", matrix)
        return {name: f"{name}{ending}" for name in every}
    return of_all


def _one(write, ending: str):
    """A writer of one file for all matrices."""
    def of_all(folder: Path, every: dict) -> dict:
        write(folder / f"all{ending}", every)
        return dict.fromkeys(every, f"all{ending}")
    return of_all


def abaqus(path: Path, matrix) -> None:
    """What *MATRIX GENERATE stores with FORMAT=MATRIX INPUT: node, direction, node, direction, number."""
    with open(path, "w") as file:
        file.writelines(f"{i // 3 + 1},{i % 3 + 1}, {j // 3 + 1},{j % 3 + 1}, {value:.15e}\n"
                        for i, j, value in zip(*_lower(matrix)))


def punch(path: Path, every: dict, narrow: bool = False) -> None:
    """DMIG cards of the lower triangles, in fields of 16 letters or of 8."""
    with open(path, "w") as file:
        for name, matrix in every.items():
            last = None
            file.write(f"DMIG    {name:8s}{0:8d}{6:8d}{1 if narrow else 2:8d}{0:8d}\n")
            for i, j, value in zip(*_lower(matrix)):
                place = f"{i // 3 + 1:{8 if narrow else 16}d}{i % 3 + 1:{8 if narrow else 16}d}"
                if j != last:
                    own = f"{j // 3 + 1:{8 if narrow else 16}d}{j % 3 + 1:{8 if narrow else 16}d}"
                    file.write(f"DMIG    {name:8s}{own}\n" if narrow else f"DMIG*   {name:16s}{own}\n")
                    last = j
                if narrow:
                    digits, power = f"{value:.2e}".split("e")
                    file.write(f"{'':8s}{place}{f'{digits}{int(power):+d}':>8s}\n")
                else:
                    file.write(f"*       {place}{value:16.9E}\n".replace("E", "D"))


def output4(path: Path, every: dict, text: bool = False, single: bool = False) -> None:
    """OUTPUT4 with strings of rows for matrices of more than 65535 of them, in text or in records of Fortran."""
    number, words = ("f4", 1) if single else ("f8", 2)
    width, digits = (16, 9) if single else (23, 16)
    with open(path, "w" if text else "wb") as file:
        def record(*ints, data=b""):
            if text:
                file.write("".join(f"{one:8d}" for one in ints) + "\n")
            else:
                size = struct.pack("<i", 4 * len(ints) + len(data))
                file.write(size + struct.pack(f"<{len(ints)}i", *ints) + data + size)

        def numbers(values):
            line = 80 // width
            file.writelines("".join(f"{one:{width}.{digits}E}" for one in values[k:k + line]) + "\n"
                            for k in range(0, len(values), line))

        for name, matrix in every.items():
            matrix, n = matrix.tocsc(), matrix.shape[0]
            if text:
                file.write(f"{n:8d}{-n:8d}{6:8d}{words:8d}{name:8s}1P,{80 // width}E{width}.{digits}\n")
            else:
                record(n, -n, 6, words, data=name.ljust(8).encode())
            for j in range(n):
                part = slice(*matrix.indptr[j:j + 2])
                rows, values = matrix.indices[part], matrix.data[part].astype(number)
                cuts = [0, *(np.flatnonzero(np.diff(rows) > 1) + 1).tolist(), rows.size]
                strings = [(int(rows[a]) + 1, values[a:b]) for a, b in pairwise(cuts)]
                heads = [(words * one.size + 1, row) for row, one in strings]
                if text:
                    record(j + 1, 0, sum(size + 1 for size, _ in heads))
                    for head, (_, one) in zip(heads, strings):
                        record(*head)
                        numbers(one.tolist())
                else:
                    record(j + 1, 0, sum(size + 1 for size, _ in heads), data=b"".join(
                        struct.pack("<2i", *head) + one.tobytes() for head, (_, one) in zip(heads, strings)))
            if text:
                record(n + 1, 1, 1)
                numbers([1.0])
            else:
                record(n + 1, 1, words, data=np.ones(1, number).tobytes())


def matlab73(path: Path, every: dict) -> None:
    """What MATLAB saves with -v7.3: HDF5 with a group for each sparse matrix."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, matrix in every.items():
            group, own = file.create_group(name), matrix.tocsc()
            group.attrs["MATLAB_class"] = np.bytes_("double")
            group.attrs["MATLAB_sparse"] = np.uint64(own.shape[0])
            for key, one in (("data", own.data), ("ir", own.indices.astype("u8")), ("jc", own.indptr.astype("u8"))):
                group[key] = one
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + struct.pack("<HH", 0x0200, 0x4D49))


WRITERS = {
    "NumPy, scipy.sparse.save_npz": _each(lambda path, one: sparse.save_npz(path, one, compressed=False), ".npz"),
    "Matrix Market, scipy.io.mmwrite": _each(lambda path, one: mmwrite(path, sparse.coo_array(one),
                                                                       symmetry="symmetric"), ".mtx"),
    "MATLAB 5, scipy.io.savemat": _one(lambda path, every: savemat(
        path, {name: sparse.csc_array(one) for name, one in every.items()}), ".mat"),
    "MATLAB 7.3, h5py": _one(matlab73, ".mat"),
    "OUTPUT4 binary": _one(output4, ".op4"),
    "OUTPUT4 text": _one(lambda path, every: output4(path, every, True), ".op4"),
    "Abaqus, 16 digits": _each(abaqus, ".mtx"),
    "DMIG, fields of 16": _one(punch, ".pch"),
    "OUTPUT4 binary, single precision": _one(lambda path, every: output4(path, every, single=True), ".op4"),
    "DMIG, fields of 8": _one(lambda path, every: punch(path, every, True), ".pch"),
}


def trip(name: str, model: models.Model, folder: Path, true=None) -> tuple:
    """(Row, frequencies (8,) [Hz]) of a format; true: frequencies of the model itself, None: those found are."""
    every = dict(zip(NAMES, model[:3]))
    files = WRITERS[name](folder, every)
    size = sum((folder / one).stat().st_size for one in set(files.values()))
    begin = process_time()
    found = matrices.aligned(*(matrices.read(folder / files[key], what) for key, what in NAMES.items()))
    seconds = process_time() - begin
    off = max(abs(one.values - own).max() / abs(own).max() for one, own in zip(found, every.values()))
    rows = [model.places[one] + 1 for one in ("tip", "middle")]
    if found[0].places is not None:
        rows = [f'"{(row - 1) // 3 + 1}:{"xyz"[(row - 1) % 3]}"' for row in rows]
    if true is not None and off == 0.0:
        return Row(name, size, seconds, 0.0, 0.0, 0.0, ""), true
    (folder / "scene.toml").write_text(SCENE.format(**files, rows=rows))
    try:
        built = pf.build(pf.load(folder / "scene.toml"))
    except pf.PatchfemError as error:
        return Row(name, size, seconds, off, np.inf, np.inf, str(error)), None
    modes = built.rig.modes
    frequencies = modes.omega[:8] / (2 * np.pi)
    moved = np.abs(frequencies / (frequencies if true is None else true) - 1)
    says = " ".join(note for note in built.rig.kept if "uncertain" in note)
    return Row(name, size, seconds, off, moved[0], moved.max(), says), frequencies


def main(along: int = 400, across: int = 8, names=tuple(WRITERS)) -> list:
    """A Row for each format, printed."""
    model, rows, true = beam(along, across), [], None
    print(f"{model.stiffness.shape[0]} unknowns, {model.stiffness.nnz} entries")
    for name in names:
        with TemporaryDirectory() as folder:
            row, found = trip(name, model, Path(folder), true)
        true = found if true is None else true
        rows.append(row)
        print(f"| {row.name} | {row.bytes / 1e6:.3g} | {row.seconds:.3g} | {row.off:.1e} | {row.first:.1e} | "
              f"{row.moved:.1e} | {row.says} |", flush=True)
    return rows


if __name__ == "__main__":
    main(*(int(one) for one in sys.argv[1:]))
