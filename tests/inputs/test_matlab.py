"""The reader of MATLAB files: arrays written by SciPy, and damaged files, some of which make SciPy's reader crash."""

import io

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from scipy.sparse import random as scattered

from patchfem.core import PatchfemError
from patchfem.inputs import read_variables

SPARSE_MATRIX = scattered(7, 5, 0.4, "csc", random_state=3)
TEXTS = np.array(["axial", "yaw", "é"], dtype=object)
ARRAYS = {
    "full": np.random.default_rng(1).normal(size=(4, 3)), "scalar": 2.0, "counts": np.arange(6, dtype="u1")[None],
    "small": np.array([[1.5, -2.5]], "f4"), "scattered": SPARSE_MATRIX, "none": np.zeros((0, 3)), "cells": TEXTS,
    "letters": np.array(["ab", "cde"]), "cube": np.arange(24.0).reshape(2, 3, 4), "waves": np.ones(3) * 1j,
    "pair": {"x": 1.0}, "big": np.tile(np.arange(40.0), (300, 1)),
}  # fmt: skip


def matlab5_bytes(packed: bool, names=tuple(ARRAYS)) -> bytes:
    """Return the arrays as the content of a MATLAB file of version 5."""
    out = io.BytesIO()
    savemat(out, {name: ARRAYS[name] for name in names}, do_compression=packed)
    return out.getvalue()


@pytest.mark.parametrize("packed", [False, True])
def test_exact_matlab_arrays_equal_scipy_arrays(packed):
    """Every array of a MATLAB file equals the array that SciPy reads."""
    data = matlab5_bytes(packed)
    variables = read_variables("a.mat", data)
    by_scipy = loadmat(io.BytesIO(data))
    assert {name: variable.kind for name, variable in variables.items()} == {
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
    for name, variable in variables.items():
        if variable.kind != "text":
            expected = (
                by_scipy[name].toarray()
                if variable.kind == "sparse"
                else by_scipy["pair"]["x"][0, 0]
                if "." in name
                else by_scipy[name]
            )
            assert variable.shape == expected.shape and np.array_equal(
                variable.values(), expected.astype(float)
            ), name
    assert variables["cells"].values().tolist() == ["axial", "yaw", "é"]
    assert variables["letters"].values().tolist() == ["ab", "cde"]


@pytest.mark.parametrize(
    "data, message",
    [
        (b"", "damaged or of version 4"),
        (b"MATLAB 5.0 MAT-file" + bytes(200), "damaged or of version 4"),
        (b"MATLAB 7.3 MAT-file" + bytes(200), r"version 7\.3 is damaged"),
        (matlab5_bytes(False)[:-4], "cut off or damaged"),
    ],
)
def test_refuses_invalid_matlab_files(data, message):
    """Files that are empty, truncated or not MATLAB files are refused."""
    with pytest.raises(PatchfemError, match=message):
        read_variables("a.mat", data)


def test_refuses_extreme_compression_ratio():
    """A variable that unpacks to more than 200 times its packed size is refused."""
    out = io.BytesIO()
    savemat(out, {"zeros": np.zeros((1500, 1500))}, do_compression=True)
    with pytest.raises(
        PatchfemError, match="unpacks to more than 200 times its packed size; save it with"
    ):
        read_variables("a.mat", out.getvalue())["zeros"].values()
