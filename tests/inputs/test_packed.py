"""Small files with a large content are refused before it fills the memory."""

import io
import tracemalloc

import numpy as np
import pytest
from scipy import sparse
from scipy.io import savemat

from patchfem.core import PatchfemError
from patchfem.inputs import read_matrix

MIB = 2**20
LIMIT = 1024 * MIB  # of the content


def write_mat(path) -> None:
    """Write a MATLAB file of version 7 with a compressed variable of 16 MiB of zeros, again and again."""
    file = io.BytesIO()
    savemat(file, {"K": np.zeros((2 * MIB, 1))}, do_compression=True)
    data = file.getvalue()
    path.write_bytes(data + data[128:] * (LIMIT // (16 * MIB)))


def write_hdf5(path) -> None:
    """Write a file of version 7.3 with a compressed variable, of which no number is stored."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("s/K", (1, LIMIT // 8 + 1), "f8", compression="gzip")


def write_npz(path) -> None:
    """Write an archive of NumPy arrays that states a larger array than it has."""
    np.savez_compressed(path, K=np.eye(2))
    data = bytearray(path.read_bytes())
    # The size of the unpacked file stands at byte 24 of its entry in the directory.
    place = data.index(b"PK\x01\x02") + 24
    data[place : place + 4] = (LIMIT + 1).to_bytes(4, "little")
    path.write_bytes(data)


@pytest.mark.parametrize(
    "write, name", [(write_mat, "a.mat"), (write_hdf5, "b.mat"), (write_npz, "c.npz")]
)
def test_refuses_large_content_of_small_file(tmp_path, write, name):
    """A file of at most 2 MiB with a content above the limit is refused with little memory."""
    path = tmp_path / name
    write(path)
    assert path.stat().st_size < 2 * MIB
    tracemalloc.start()
    with pytest.raises(PatchfemError, match="more than 1024 MiB after it is unpacked; save"):
        read_matrix(path, "stiffness")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 16 * MIB


@pytest.mark.parametrize("kind", ["coo", "csr", "csc", "dia"])
def test_refuses_sparse_matrix_of_too_many_rows(tmp_path, kind):
    """A small file with a sparse matrix of more rows than can be read is refused."""
    matrix = sparse.dia_array(([[1.0]], [0]), shape=(2 * 10**6 + 1,) * 2).asformat(kind)
    sparse.save_npz(tmp_path / "a.npz", matrix)
    with pytest.raises(
        PatchfemError, match=r"a\.npz: a matrix of 2000000 rows and columns at most"
    ):
        read_matrix(tmp_path / "a.npz", "stiffness")


@pytest.mark.parametrize("kind", ["csr", "csc"])
@pytest.mark.parametrize("index", [2, 10**6, -(10**7)])
def test_refuses_sparse_matrix_with_indices_beyond_its_shape(tmp_path, kind, index):
    """A sparse matrix whose indices do not fit its shape, with which SciPy would end the process, is refused."""
    matrix = sparse.eye_array(2, format=kind)
    matrix.indices[1] = index
    sparse.save_npz(tmp_path / "a.npz", matrix)
    with pytest.raises(PatchfemError, match=r"a\.npz cannot be read \(.*indices must be"):
        read_matrix(tmp_path / "a.npz", "stiffness")
