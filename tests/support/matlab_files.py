"""Contents of MATLAB files: version 5 by SciPy, version 7.3 by h5py."""

import io

import h5py
import numpy as np
from scipy.io import savemat


def add_matlab_value(group, name: str, value) -> None:
    """Add a value to an HDF5 group as MATLAB 7.3 stores it."""
    if isinstance(value, dict):
        inner = group.create_group(name)
        inner.attrs["MATLAB_class"] = np.bytes_("struct")
        for key, item in value.items():
            add_matlab_value(inner, key, item)
        return
    kind, value = (
        ("char", np.array([list(map(ord, value))], "u2"))
        if isinstance(value, str)
        else ("double", np.asarray(value))
    )
    item = group.create_dataset(name, data=value.T)
    item.attrs["MATLAB_class"] = np.bytes_(kind)


def matlab73_bytes(values: dict, add_items=None) -> bytes:
    """Return values as the content of a MATLAB file of version 7.3: HDF5 after a block of 512 bytes."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=512) as file:
        for name, value in values.items():
            add_matlab_value(file, name, value)
        if add_items is not None:
            add_items(file)
    return (
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM" + buffer.getvalue()[128:]
    )


def matlab5_bytes(values: dict, packed: bool = True) -> bytes:
    """Return values as the content of a MATLAB file that SciPy writes."""
    out = io.BytesIO()
    savemat(out, values, do_compression=packed)
    return out.getvalue()
