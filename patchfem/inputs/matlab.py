"""Arrays of a MATLAB file: versions 4 to 7 by SciPy, version 7.3, which is an HDF5 file, by h5py.

MATLAB stores an array in HDF5 with its dimensions in reverse order, a text as the codes of its letters, a cell array
of texts as references to them, and a sparse matrix or a structure as a group; the attribute MATLAB_class distinguishes
them. Files that are cut off are refused. SciPy 1.17 ends the process for some files without compression of which single
bits are wrong; compressed files, which MATLAB writes by default, have a checksum.
"""

import io
from pathlib import Path

import numpy as np
from scipy import sparse

from .damage import refuse_damage
from .records import check_file

MAX_NESTING = 8  # largest depth of nested structures
# Signature at the beginning of an HDF5 file, or after the user block that MATLAB puts there.
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
NUMBER_KINDS = "iufbc"  # kinds of NumPy types that contain numbers


def read_variables(path, data: bytes | None = None) -> dict[str, np.ndarray | sparse.csc_array]:
    """Read the arrays of numbers and the texts of a MATLAB file.

    Parameters
    ----------
    path : path-like
    data : bytes, optional
        Content of the file, if it has been read.

    Returns
    -------
    dict
        Name -> array of float or complex numbers with at least two dimensions, sparse matrix, or array (k,) of strings. A
        field of a structure has the name STRUCTURE.FIELD. Other content, such as arrays of structures, is left out.

    Raises
    ------
    OSError
        If the file cannot be opened.
    PatchfemError
        If there is no file, or if it is damaged, too large or no MATLAB file.
    """
    if data is None:
        check_file(Path(path), "save only the variables that are needed")
        data = Path(path).read_bytes()
    is_hdf5 = data.startswith((HDF5_SIGNATURE, b"MATLAB 7.3")) or data[512:520] == HDF5_SIGNATURE
    arrays = {}
    with refuse_damage(f"{path}: no readable MATLAB file", "; save it anew"):
        if is_hdf5:
            _read_hdf5(data, arrays)
        else:
            _read_version_5(data, arrays)
    return arrays


def read_real_arrays(path, data: bytes | None = None) -> dict[str, np.ndarray]:
    """Read the full arrays of real numbers of a MATLAB file; parameters and errors as in `read_variables`."""
    return {
        name: array
        for name, array in read_variables(path, data).items()
        if isinstance(array, np.ndarray) and array.dtype.kind == "f"
    }


def _read_version_5(data: bytes, arrays: dict) -> None:
    """Add the variables of a file of version 4 to 7."""
    from scipy.io import loadmat, matlab

    try:
        variables = loadmat(io.BytesIO(data), struct_as_record=False)
    # a wrong type code raises a TypeError, a wrong count a MemoryError
    except (matlab.MatReadError, TypeError, MemoryError) as error:
        raise ValueError(str(error)) from None
    for name, value in variables.items():
        if not name.startswith("__"):
            _add_value(arrays, name, value)


def _add_value(arrays: dict, name: str, value, depth: int = 0) -> None:
    """Add an array that SciPy has read, or the fields of a structure."""
    if sparse.issparse(value):
        arrays[name] = _check_sparse(sparse.csc_array(value))
    elif value.dtype.kind in NUMBER_KINDS:
        arrays[name] = _to_numbers(value)
    elif value.dtype.kind == "U":
        arrays[name] = _to_texts(value)
    elif value.size == 1 and hasattr(value.flat[0], "_fieldnames"):
        structure = value.flat[0]
        for field in structure._fieldnames if depth < MAX_NESTING else ():
            _add_value(arrays, f"{name}.{field}", getattr(structure, field), depth + 1)
    elif value.size and all(getattr(cell, "dtype", value.dtype).kind == "U" for cell in value.flat):
        arrays[name] = _to_texts("".join(cell[:1]) for cell in value.flat)


def _to_numbers(values) -> np.ndarray:
    """Return numbers as floats, or as complex numbers if they are complex."""
    return values if values.dtype.kind == "c" else np.asarray(values, float)


def _to_texts(texts) -> np.ndarray:
    """Return an array of strings without the blanks at their ends."""
    return np.array([text.rstrip() for text in texts], dtype=object)


def _read_hdf5(data: bytes, arrays: dict) -> None:
    """Add the variables of a file of version 7.3."""
    import h5py

    with h5py.File(io.BytesIO(data), "r") as file:
        _add_group(arrays, file, "", 0)


def _add_group(arrays: dict, group, prefix: str, depth: int) -> None:
    """Add the arrays of a group, and those of the structures in it; links to other files are not followed."""
    import h5py

    for name in group:
        is_own = isinstance(group.get(name, getlink=True), h5py.HardLink)
        if name.startswith("#") or not is_own:
            continue
        item = group[name]
        if isinstance(item, h5py.Dataset):
            value = _read_dataset(item)
        elif "MATLAB_sparse" in item.attrs:
            value = _read_sparse(item)
        else:
            value = None
            if _find_class(item) == "struct" and depth < MAX_NESTING:
                _add_group(arrays, item, f"{prefix}{name}.", depth + 1)
        if value is not None:
            arrays[prefix + name] = value


def _find_class(item) -> str:
    """Return the MATLAB class of a dataset or group, or "" if another program wrote it."""
    name = item.attrs.get("MATLAB_class", b"")
    return name.decode("latin-1") if isinstance(name, bytes) else ""


def _read_dataset(dataset) -> np.ndarray | None:
    """Return numbers, a text or a cell array of texts; None for other content."""
    if dataset.shape is None:
        return None
    kind = _find_class(dataset)
    values = np.asarray(dataset[()])
    if "MATLAB_empty" in dataset.attrs:  # such a dataset contains the shape
        return np.zeros(values.astype(int).ravel()) if kind not in ("cell", "struct") else None
    if kind == "cell" and values.dtype.kind == "O":
        cells = [dataset.file[reference] for reference in values.ravel()]
        if any(_find_class(cell) != "char" for cell in cells):
            return None
        return _to_texts(_decode(np.ravel(cell[()].T[0])) for cell in cells)
    if values.dtype.kind not in NUMBER_KINDS or kind in ("cell", "struct"):
        return None
    # MATLAB always writes at least two dimensions; other programs may write only one
    values = values.T if values.ndim > 1 else values.reshape(-1, 1)
    if kind == "char":
        return _to_texts(map(_decode, values))
    return _to_numbers(values)


def _decode(codes) -> str:
    """Return the text of the codes of its letters."""
    return "".join(map(chr, codes))


def _read_sparse(group) -> sparse.csc_array:
    """Return a sparse matrix from the row indices `ir`, the starts of the columns `jc` and `data`."""
    starts = group["jc"][()].astype(np.int64)
    shape = (int(np.ravel(group.attrs["MATLAB_sparse"])[0]), starts.size - 1)
    # MATLAB leaves out the entries of a matrix of zeros
    rows, values = (group[name][()] if name in group else np.zeros(0) for name in ("ir", "data"))
    return _check_sparse(
        sparse.csc_array((_to_numbers(values), rows.astype(np.int64), starts), shape)
    )


def _check_sparse(matrix: sparse.csc_array) -> sparse.csc_array:
    """Return a sparse matrix; raise ValueError if its indices do not fit its shape, with which SciPy would crash."""
    matrix.check_format(full_check=True)
    return matrix
