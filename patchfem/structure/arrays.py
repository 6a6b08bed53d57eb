"""Modes of a rig from arrays in a .npz or .mat file: matrices M, K and C, or modal data.

- Matrices: M, K and optionally C (n, n) [kg, N/m, N s/m].
- Modal data: omega (n,) [rad/s] or frequency (n,) [Hz]; damping, ratios (n,) or a matrix D (n, n) [1/s];
  moving_mass [kg].
- Both: slide (n,) or (i, n); base (n,), for matrices by default ones; output (n,), by default the slide of
  the first interface; force (n,), by default the output; normal, pitch and yaw (n,), which a rig with
  friction refuses; names.

Other arrays of the file are ignored.
"""

from math import prod
from pathlib import Path
from zipfile import is_zipfile

import numpy as np
from numpy.lib import format as npy
from scipy.sparse import issparse

from ..core import ModalBasis, PatchfemError
from ..effects import MAX_COORDINATES
from ..inputs.matlab import read_variables
from ..inputs.symmetric import read_numbers, to_real
from . import masses, matrices
from .modes import PATCH_MOTIONS, make_basis

ARRAY_NAMES = (  # names of the arrays that are read from a file
    "M",
    "K",
    "C",
    "omega",
    "frequency",
    "damping",
    "moving_mass",
    "slide",
    "base",
    "output",
    "force",
    *PATCH_MOTIONS,
    "names",
)
# Largest size of a number [bytes], that of a complex number of double precision
MAX_NUMBER_BYTES = 16
MIN_MASS = 1e-50  # smallest modal mass [kg], which is that of structure.moving_mass
MAX_MASS_FRACTION = 1 + 1e-9  # largest sum of base^2: 1, plus round-off of the shapes


def read_arrays(path: Path) -> dict:
    """Read the arrays of a structure from a .npz or .mat file.

    Raises
    ------
    PatchfemError
        If the file cannot be read or contains objects.
    """
    try:
        if str(path).lower().endswith(".npz"):
            if path.is_file() and not is_zipfile(path):
                raise PatchfemError("it is not an archive of NumPy arrays")
            with np.load(path, allow_pickle=False) as file:
                return {name: _read_member(file, name) for name in ARRAY_NAMES if name in file}
        variables = read_variables(path)
        names = [name for name in ARRAY_NAMES if name in variables]
        for name in names:
            _refuse_large(name, variables[name].shape)
        return {name: _drop_dimensions(variables[name]) for name in names}
    except PatchfemError as error:
        reason = str(error).removeprefix(f"{path}: ")
        raise PatchfemError(f"{path} cannot be read ({reason})") from None
    except OSError as error:
        raise PatchfemError(f"{path} cannot be read ({error.strerror or error})") from None
    except Exception as error:
        # NumPy and zipfile raise errors of many types for a damaged file.
        raise PatchfemError(
            f"{path} cannot be read ({error}); plain arrays are needed, not objects"
        ) from None


def _read_member(file: np.lib.npyio.NpzFile, name: str) -> np.ndarray:
    """Read one array of a .npz file; its header is checked first, because NumPy reserves the memory that it states."""
    readers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    with file.zip.open(f"{name}.npy") as member:
        shape, _, dtype = readers[npy.read_magic(member)](member)
    _refuse_large(name, shape, dtype.itemsize)
    return file[name]


def _refuse_large(name: str, shape: tuple, itemsize: int = MAX_NUMBER_BYTES) -> None:
    """Raise PatchfemError if an array is larger than the matrices of the largest rig that is allowed."""
    if prod(shape) * itemsize > MAX_COORDINATES**2 * MAX_NUMBER_BYTES:
        raise PatchfemError(
            f"{name} of shape {'x'.join(map(str, shape))} is larger than {MAX_COORDINATES} coordinates "
            "squared; give a reduced model, or only the modes in the frequency range of the drive"
        )


def _drop_dimensions(values) -> np.ndarray:
    """Return an array of a .mat file in full; a matrix that has a single row or column becomes a vector."""
    values = values.toarray() if issparse(values) else values
    return values if values.ndim == 2 and min(values.shape) > 1 else values.ravel()


def build_basis(
    data: dict,
    pairs=(),
    driven_mass: int | None = None,
    *,
    is_forced: bool = False,
    mass: float | None = None,
) -> ModalBasis:
    """Build the modal basis of a rig from the arrays of a file.

    Parameters
    ----------
    data : dict
        Arrays by name, from `read_arrays`.
    pairs : sequence of (i, j)
        Interfaces between coordinates of the matrices, from 1 on and 0 for the base, in place of
        `slide`.
    driven_mass : int, optional
        Coordinate that a force drives, in place of `force`.
    is_forced : bool
        Whether a force drives the rig, and not its base.
    mass : float, optional
        Moving mass [kg] of modal data, in place of `moving_mass`.

    Returns
    -------
    ModalBasis

    Raises
    ------
    PatchfemError
        If an array is missing or wrong; the message names it.
    """
    if "M" in data or "K" in data:
        return _build_basis_from_matrices(data, pairs, driven_mass, is_forced)
    return _build_basis_from_modes(data, pairs, driven_mass, is_forced, mass)


def _refuse_missing(data: dict, missing_name: str) -> None:
    """Raise PatchfemError for an array that the file does not contain."""
    names = ", ".join(data) or "none that patchfem knows"
    raise PatchfemError(f"lacks {missing_name}; the file contains {names}")


def _build_basis_from_matrices(
    data: dict, pairs, driven_mass: int | None, is_forced: bool
) -> ModalBasis:
    """Build the modal basis of a rig from mass, stiffness and damping matrices."""
    for name in ("M", "K"):
        if name not in data:
            _refuse_missing(data, f"the matrix {name}")
    M, K, C = (_to_matrix(data.get(name), name) for name in ("M", "K", "C"))
    n = len(M)
    if n == 0:
        raise PatchfemError(
            "M has no coordinate (the matrix is empty); a square matrix [kg] with at least "
            "one row is needed"
        )
    if pairs and "slide" in data:
        raise PatchfemError(
            "contains `slide`, but [[structure.interface]] also defines where sliding "
            "occurs: keep only one of these two descriptions"
        )
    coordinates = [coordinate for pair in pairs for coordinate in pair] + [driven_mass or 0]
    missing = [coordinate for coordinate in coordinates if coordinate > n]
    if missing:
        raise PatchfemError(f"there is no coordinate {missing[0]}: M has {n}, numbered from 1")
    faces = masses.make_slide_rows(pairs, n) if pairs else data.get("slide")
    if faces is not None:
        faces = to_real(faces, "slide")
        faces = faces.reshape(-1, n) if faces.size % n == 0 else faces
        faces = faces if faces.size else None
    output = data.get("output")
    if output is None:
        if faces is None:
            _refuse_missing(
                data,
                "output (n,), what the accelerometer measures; slide (n,) serves as output if output "
                "is missing",
            )
        output = faces[0]
    force = None
    if is_forced:
        force = np.eye(n)[driven_mass - 1] if driven_mass else data.get("force", output)
    return matrices.build_basis(
        M,
        K,
        C,
        faces=faces,
        output=output,
        base=data.get("base"),
        force=force,
        names=_read_names(data, n),
        **{name: data.get(name) for name in PATCH_MOTIONS},
    )


def _to_matrix(values, name: str):
    """Convert a single number to a matrix with one row; return other arrays and None unchanged."""
    if values is None or np.ndim(values) == 2:
        return values
    if np.size(values) != 1:
        raise PatchfemError(f"{name} must be square, not of shape {np.shape(values)}")
    return np.reshape(values, (1, 1))


def _build_basis_from_modes(
    data: dict, pairs, driven_mass: int | None, is_forced: bool, mass: float | None
) -> ModalBasis:
    """Build the modal basis of a rig from natural frequencies and mode shapes."""
    if pairs or driven_mass:
        raise PatchfemError(
            "modal data have no numbered masses, which [[structure.interface]] and "
            "drive.mass need; give `slide` and `force` in the file"
        )
    if "omega" in data:
        omega = read_numbers(data["omega"], "omega")
    elif "frequency" in data:
        omega = 2 * np.pi * read_numbers(data["frequency"], "frequency")
    else:
        _refuse_missing(data, "M and K, or omega [rad/s] or frequency [Hz] of modes")
    n = omega.size
    required_names = ("damping", "slide") if is_forced else ("damping", "slide", "base")
    for name in required_names:
        if name not in data:
            _refuse_missing(data, f"{name} of the modes")
    if mass is None and "moving_mass" in data:
        masses_of_modes = read_numbers(data["moving_mass"], "moving_mass")
        if masses_of_modes.size > 1:
            raise PatchfemError(
                f"moving_mass has {masses_of_modes.size} values; one mass [kg] of all modes is needed"
            )
        mass = float(masses_of_modes[0])
    if mass is None or mass < MIN_MASS:
        raise PatchfemError(
            f"lacks moving_mass >= {MIN_MASS:g}, the modal mass [kg]; give moving_mass in the file or in "
            "[structure]"
        )
    if (omega < 0).any():
        raise PatchfemError(f"frequencies must be >= 0, not {omega.min():g}")
    faces = np.atleast_2d(read_numbers(data["slide"], "slide", (n,), (None, n)))
    zeta, damping = _read_damping(data, omega)
    output = read_numbers(data["output"], "output", (n,)) if "output" in data else faces[0]
    if not is_forced:
        base = read_numbers(data["base"], "base", (n,))
        mass_fraction = np.sum(base**2)
        if mass_fraction > MAX_MASS_FRACTION:
            raise PatchfemError(
                f"the sum of `base`^2 over the modes is {mass_fraction:.6g}, but at most 1 is "
                "possible"
            )
    else:
        base = -(read_numbers(data["force"], "force", (n,)) if "force" in data else output)
    patch_motions = {
        name: read_numbers(data[name], name, (n,)) for name in PATCH_MOTIONS if name in data
    }
    return make_basis(
        _read_names(data, n) or tuple(f"mode {k + 1}" for k in range(n)),
        mass,
        omega=omega,
        zeta=zeta,
        slide=faces[0],
        base=base,
        output=output,
        damping=damping,
        faces=faces if len(faces) > 1 else None,
        **patch_motions,
    )


def _read_damping(data: dict, omega) -> tuple:
    """Read damping ratios (n,), and the damping matrix (n, n) [1/s] if it is not diagonal."""
    n = omega.size
    damping = read_numbers(data["damping"], "damping", (n,), (n, n))
    if damping.ndim == 1:
        if (damping < 0).any():
            raise PatchfemError(f"damping must be >= 0, not {damping.min():g}")
        return damping, None
    lowest = np.linalg.eigvalsh(damping + damping.T).min()
    if lowest < matrices.MIN_DAMPING_EIGENVALUE * np.abs(damping).max():
        raise PatchfemError(
            "the damping matrix adds energy; a positive semidefinite matrix D [1/s] is needed"
        )
    return matrices.split_damping(damping, omega)


def _read_names(data: dict, n: int) -> tuple | None:
    """Read the names of n coordinates; return None if the file contains no names."""
    if "names" not in data:
        return None
    # A cell of a .mat file is an array with one string.
    texts = [np.ravel(name)[:1] for name in np.atleast_1d(data["names"])]
    names = tuple(str(text[0]).strip() for text in texts if text.size)
    if len(names) != n or len(set(names)) != n:
        raise PatchfemError(f"names must be {n} different texts")
    return names
