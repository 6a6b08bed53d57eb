"""The reader of MATLAB files: what SciPy wrote, and damaged files, some of which make SciPy's own reader crash."""

import io

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from scipy.sparse import random as scattered

from patchfem.core import PatchfemError
from patchfem.inputs import read_variables

SPARSE = scattered(7, 5, 0.4, "csc", random_state=3)
NAMES = np.array(["axial", "yaw", "é"], dtype=object)
WRITTEN = {
    "full": np.random.default_rng(1).normal(size=(4, 3)), "scalar": 2.0, "counts": np.arange(6, dtype="u1")[None],
    "small": np.array([[1.5, -2.5]], "f4"), "scattered": SPARSE, "none": np.zeros((0, 3)), "cells": NAMES,
    "letters": np.array(["ab", "cde"]), "cube": np.arange(24.0).reshape(2, 3, 4), "waves": np.ones(3) * 1j,
    "pair": {"x": 1.0}, "big": np.tile(np.arange(40.0), (300, 1)),
}  # fmt: skip


def written(packed: bool, only=tuple(WRITTEN)) -> bytes:
    out = io.BytesIO()
    savemat(out, {name: WRITTEN[name] for name in only}, do_compression=packed)
    return out.getvalue()


@pytest.mark.parametrize("packed", [False, True])
def test_exact_every_array_is_the_one_that_scipy_reads(packed):
    data = written(packed)
    found = read_variables("a.mat", data)
    known = loadmat(io.BytesIO(data))
    assert {name: one.kind for name, one in found.items()} == {
        "full": "number",
        "scalar": "number",
        "counts": "number",
        "small": "number",
        "scattered": "sparse",
        "none": "number",
        "cells": "text",
        "letters": "text",
        "cube": "number",
        "pair.x": "number",
        "big": "number",
    }
    for name, one in found.items():
        if one.kind != "text":
            truth = (
                known[name].toarray()
                if one.kind == "sparse"
                else known["pair"]["x"][0, 0]
                if "." in name
                else known[name]
            )
            assert one.shape == truth.shape and np.array_equal(one.values(), truth.astype(float)), (
                name
            )
    assert found["cells"].values().tolist() == ["axial", "yaw", "é"]
    assert found["letters"].values().tolist() == ["ab", "cde"]


@pytest.mark.parametrize(
    "data, said",
    [
        (b"", "damaged or of version 4"),
        (b"MATLAB 5.0 MAT-file" + bytes(200), "damaged or of version 4"),
        (b"MATLAB 7.3 MAT-file" + bytes(200), r"version 7\.3 is damaged"),
        (written(False)[:-4], "cut off or damaged"),
    ],
)
def test_refuses_files_that_are_no_matlab_arrays(data, said):
    with pytest.raises(PatchfemError, match=said):
        read_variables("a.mat", data)


def test_refuses_a_variable_that_unpacks_to_much_more_than_its_size():
    out = io.BytesIO()
    savemat(out, {"zeros": np.zeros((1500, 1500))}, do_compression=True)
    with pytest.raises(
        PatchfemError, match="unpacks to more than 200 times its packed size; save it with"
    ):
        read_variables("a.mat", out.getvalue())["zeros"].values()
