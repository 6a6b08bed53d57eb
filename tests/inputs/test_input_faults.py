"""Properties of input files for which mutation tests found no check."""

import pytest

from patchfem.core import PatchfemError
from patchfem.inputs import matrices, parse_requests, read_records, read_slide
from patchfem.inputs.records import MAX_BYTES


def test_exact_path_file_is_read_in_seconds_and_metres(tmp_path):
    """A path file is converted to seconds and metres; one with a second direction is refused."""
    path = tmp_path / "path.csv"
    path.write_text("time [ms],displacement [mm]\n0,0\n500,0.25\n1500,-0.5\n")
    time, displacement = read_slide(path)
    assert time == pytest.approx([0, 0.5, 1.5], rel=1e-15)
    assert displacement == pytest.approx([0, 2.5e-4, -5e-4], rel=1e-15)
    path.write_text("lateral [um],time [ms],displacement [mm]\n0,0,0\n4,500,0.25\n")
    with pytest.raises(PatchfemError, match=r"two directions was removed in patchfem 1\.3"):
        read_slide(path)


def test_refuses_oversized_matlab_file_before_reading(tmp_path):
    """A MATLAB file above the size limit is refused before it is read."""
    path = tmp_path / "large.mat"
    with path.open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    with pytest.raises(PatchfemError, match=f"more than {MAX_BYTES >> 20} MiB"):
        read_records(path, parse_requests(["force=F [N]"]))


def test_exact_mass_is_padded_to_size_of_stiffness(tmp_path):
    """A mass of lines of row, column and number is padded with zeros to the size of the stiffness.

    Such lines do not state the size of the matrix.
    """
    stiffness = tmp_path / "k.mtx"
    mass = tmp_path / "m.mtx"
    stiffness.write_text("1 1 4.0\n1 2 -1.0\n2 2 3.0\n")
    mass.write_text("1 1 2.5\n")
    pair = (matrices.read_matrix(stiffness, "stiffness"), matrices.read_matrix(mass, "mass"))
    matrix_lists = [matrix.values.toarray().tolist() for matrix in matrices.align_rows(*pair)]
    assert matrix_lists == [[[4.0, -1.0], [-1.0, 3.0]], [[2.5, 0.0], [0.0, 0.0]]]
