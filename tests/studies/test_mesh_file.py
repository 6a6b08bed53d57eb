"""The study of a mesh from a file, assembled by scikit-fem, beside the generated mesh of the rig."""

import re

import pytest
from study_module import load_study

mesh_file = load_study("patch/from_file.py")


@pytest.mark.slow
def test_always_mesh_from_file_agrees_with_generated_mesh():
    """Results of both meshes differ by less than their error estimates, as the docstring states."""
    printed = [
        [float(number) for number in re.findall(r"-?[0-9.]+", line)]
        for line in mesh_file.__doc__.splitlines()
        if " mrad  " in line
    ]
    assert len(printed) == len(mesh_file.TILTS)
    for (tilt, pairs, difference), (_, *numbers) in zip(mesh_file.rows(), printed):
        assert all(abs(departure) < bound for departure, bound in pairs), tilt
        assert difference < 2
        assert numbers == pytest.approx(
            [value for pair in pairs for value in pair] + [difference], abs=6e-3, rel=0.02
        )
