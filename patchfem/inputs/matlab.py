"""Arrays of a MATLAB file: versions 4 to 7 by SciPy, version 7.3, which is an HDF5 file, by h5py.

MATLAB stores an array in HDF5 with its dimensions in reverse order, and a sparse matrix or a structure as a group; the
attribute MATLAB_class distinguishes them. Files that are cut off, or whose elements have wrong types, are refused.
"""

import io
from pathlib import Path

import numpy as np
from scipy import sparse

from . import matlab_elements
from .damage import refuse_damage
from .packed import refuse_large_content
from .records import check_file

TOO_LARGE_MATLAB_REMEDY = "save only the variables that are needed"  # for a file that is too large
MAX_STRUCTURE_NESTING = 8  # largest depth of nested structures
# Signature at the beginning of an HDF5 file, or after the user block that MATLAB puts there.
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
NUMBER_DTYPE_KINDS = "iufbc"  # kinds of NumPy types that contain numbers
Arrays = dict[str, np.ndarray | sparse.csc_array]  # arrays of a file by name


def read_variables(path, data: bytes | None = None) -> Arrays:
    """Read the arrays of numbers of a MATLAB file.

    Parameters
    ----------
    path : path-like
        File to read.
    data : bytes, optional
        Content of the file, if it has been read.

    Returns
    -------
    dict
        Name -> array of float or complex numbers with at least two dimensions, or sparse matrix. A field of a structure
        has the name STRUCTURE.FIELD. Other content, such as texts or arrays of structures, is left out.

    Raises
    ------
    OSError
        If the file cannot be opened.
    PatchfemError
        If there is no file, or if it is damaged, too large or no MATLAB file.
    """
    if data is None:
        check_file(Path(path), TOO_LARGE_MATLAB_REMEDY)
        data = Path(path).read_bytes()
    is_hdf5 = data.startswith((HDF5_SIGNATURE, b"MATLAB 7.3")) or data[512:520] == HDF5_SIGNATURE

    # The size after unpacking is limited first. Damaged elements are refused before SciPy reads them, because some of them
    # would end the process.
    arrays = {}
    with refuse_damage(f"{path}: no readable MATLAB file", "; save it anew"):
        if is_hdf5:
            import h5py

            with h5py.File(io.BytesIO(data), "r") as file:
                sizes = []
                file.visititems(lambda _, item: sizes.append(getattr(item, "nbytes", 0)))
                refuse_large_content(path, sum(sizes), TOO_LARGE_MATLAB_REMEDY)
                _add_group(arrays, file, "", 0)
        else:
            refuse_large_content(
                path, matlab_elements.count_unpacked_bytes(data), TOO_LARGE_MATLAB_REMEDY
            )
            matlab_elements.check_elements(data)
            _read_version_5(data, arrays)
    return arrays


def read_real_arrays(path, data: bytes | None = None) -> dict[str, np.ndarray]:
    """Read the full arrays of real numbers of a MATLAB file, by name.

    `path` is the file, and `data` its content if it has been read. Errors are those of `read_variables`.
    """
    return {
        name: array
        for name, array in read_variables(path, data).items()
        if isinstance(array, np.ndarray) and array.dtype.kind == "f"
    }


def _read_version_5(data: bytes, arrays: Arrays) -> None:
    """Add the variables of a MATLAB file of version 4 to 7 to the arrays by name.

    `data` is the content of the file.
    """
    from scipy.io import loadmat, matlab

    try:
        variables = loadmat(io.BytesIO(data), struct_as_record=False)
    # a wrong type code raises a TypeError or UnboundLocalError, a wrong count a MemoryError
    except (matlab.MatReadError, TypeError, MemoryError, UnboundLocalError) as error:
        raise ValueError(str(error)) from None
    for name, value in variables.items():
        if not name.startswith("__"):
            _add_value(arrays, name, value)


def _add_value(arrays: Arrays, name: str, value, depth: int = 0) -> None:
    """Add an array that SciPy has read, or the fields of a structure.

    Parameters
    ----------
    arrays : dict of str to array
        Arrays by name, which are extended.
    name : str
        Name of the variable. Fields of a structure are named NAME.FIELD.
    value
        What SciPy has read.
    depth : int
        Number of structures that contain the value. Below MAX_STRUCTURE_NESTING, structures are opened.
    """
    if sparse.issparse(value):
        arrays[name] = _check_sparse(sparse.csc_array(value))
    elif value.dtype.kind in NUMBER_DTYPE_KINDS:
        arrays[name] = _to_numbers(value)
    elif value.size == 1 and hasattr(value.flat[0], "_fieldnames"):
        structure = value.flat[0]
        for field in structure._fieldnames if depth < MAX_STRUCTURE_NESTING else ():
            _add_value(arrays, f"{name}.{field}", getattr(structure, field), depth + 1)


def _to_numbers(values) -> np.ndarray:
    """Return values as floats, or as complex numbers if they are complex."""
    return values if values.dtype.kind == "c" else np.asarray(values, float)


def _add_group(arrays: Arrays, group, prefix: str, depth: int) -> None:
    """Add the arrays of a group of an HDF5 file, and those of the structures in it, by name.

    `prefix` stands before the names, and `depth` is the number of structures around the group. Links to other files
    are not followed.
    """
    import h5py

    for name in group:
        is_own = isinstance(group.get(name, getlink=True), h5py.HardLink)
        if name.startswith("#") or not is_own:
            continue
        item = group[name]
        kind = _find_class(item)
        if "MATLAB_sparse" in item.attrs:
            arrays[prefix + name] = _read_sparse(item)
        elif isinstance(item, h5py.Dataset):
            # Classes with numbers, besides integers; "" stands for data of other programs
            if item.shape is not None and (
                kind in ("", "double", "single", "logical") or "int" in kind
            ):
                _add_dataset(arrays, prefix + name, item)
        elif kind == "struct" and depth < MAX_STRUCTURE_NESTING:
            _add_group(arrays, item, f"{prefix}{name}.", depth + 1)


def _find_class(item) -> str:
    """Return the MATLAB class of an item (dataset or group), or "" if another program wrote it."""
    name = item.attrs.get("MATLAB_class", b"")
    return name.decode("latin-1") if isinstance(name, bytes) else ""


def _add_dataset(arrays: Arrays, name: str, dataset) -> None:
    """Add the numbers of a dataset of an HDF5 file to the arrays, by name.

    Other programs than MATLAB may write fewer than two dimensions. The array has two.
    """
    values = np.asarray(dataset[()])
    if "MATLAB_empty" in dataset.attrs:  # such a dataset contains the shape
        values = np.zeros(values.astype(int).ravel()).T
    if values.dtype.kind in NUMBER_DTYPE_KINDS:
        arrays[name] = _to_numbers(values.T if values.ndim > 1 else values.reshape(-1, 1))


def _read_sparse(group) -> sparse.csc_array:
    """Return the sparse matrix that a group of an HDF5 file contains.

    Its datasets are the row indices `ir`, the starts of the columns `jc` and the values `data`.
    """
    starts = group["jc"][()].astype(np.int64)
    shape = (int(np.ravel(group.attrs["MATLAB_sparse"])[0]), starts.size - 1)
    # MATLAB leaves out the entries of a matrix of zeros
    rows, values = (group[name][()] if name in group else np.zeros(0) for name in ("ir", "data"))
    return _check_sparse(
        sparse.csc_array((_to_numbers(values), rows.astype(np.int64), starts), shape)
    )


def _check_sparse(matrix: sparse.csc_array) -> sparse.csc_array:
    """Check that the indices of a sparse matrix fit its shape, and return it.

    ValueError is raised for others, with which SciPy would crash.
    """
    matrix.check_format(full_check=True)
    return matrix
