"""Claims about input files that planted faults showed to be unchecked."""

import pytest

from patchfem.core import PatchfemError
from patchfem.inputs import matrices, parse_requests, read_records, read_slide
from patchfem.inputs.records import MAX_BYTES


def test_exact_path_of_a_file_in_metres_with_its_lateral_column(tmp_path):
    path = tmp_path / "path.csv"
    path.write_text("lateral [um],time [ms],displacement [mm]\n0,0,0\n4,500,0.25\n-2,1500,-0.5\n")
    time, along, across = read_slide(path)
    assert time == pytest.approx([0, 0.5, 1.5], rel=1e-15)
    assert along == pytest.approx([0, 2.5e-4, -5e-4], rel=1e-15)
    assert across == pytest.approx([0, 4e-6, -2e-6], rel=1e-15)


def test_refuses_a_matlab_file_that_is_too_large_before_it_is_read(tmp_path):
    path = tmp_path / "large.mat"
    with path.open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    with pytest.raises(PatchfemError, match=f"more than {MAX_BYTES >> 20} MiB"):
        read_records(path, parse_requests(["force=F [N]"]))


def test_exact_rows_of_numbers_without_mass_at_the_end_fit_a_larger_stiffness(tmp_path):
    """Lines of row, column and number do not state the size of the matrix, so the mass is extended by zeros."""
    stiffness = tmp_path / "k.mtx"
    mass = tmp_path / "m.mtx"
    stiffness.write_text("1 1 4.0\n1 2 -1.0\n2 2 3.0\n")
    mass.write_text("1 1 2.5\n")
    pair = (matrices.read_matrix(stiffness, "stiffness"), matrices.read_matrix(mass, "mass"))
    found = [one.values.toarray().tolist() for one in matrices.align_rows(*pair)]
    assert found == [[[4.0, -1.0], [-1.0, 3.0]], [[2.5, 0.0], [0.0, 0.0]]]
