"""The rig from arrays in a .npz or .mat file: matrices M, K, C, or modal data.

Matrices: M, K, optional C (n, n) [kg, N/m, N s/m]; modal: omega (n,) [rad/s] or frequency (n,) [Hz], damping (n,)
ratios or (n, n) D [1/s], moving_mass [kg]. Both: slide (n,) or (i, n), base (n,) [ones for matrices], output (n,)
[slide of the first interface], force (n,) [output], normal, pitch, lateral, yaw (n,), names. Names of arrays are taken
as they stand; other arrays in the file are left alone.
"""

from math import prod
from zipfile import ZipFile

import numpy as np
from numpy.lib import format as npy

from ..core import ModalBasis, PatchfemError, frozen_array
from ..effects import MOST_COORDINATES
from ..inputs.matlab import read_variables
from . import masses, matrices

PATCH = ("normal", "pitch", "lateral", "yaw")
KNOWN = (
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
    *PATCH,
    "names",
)
LONGEST = 1024  # bytes of a name
WIDEST = 16  # bytes of a number
DIRECTORY = 2**20  # bytes of the list of members of a zip file


def read(path) -> dict:
    """Known arrays of a .npz or .mat file by name (`KNOWN`); other arrays are left alone.

    PatchfemError for a file that cannot be read or holds objects.
    """
    try:
        if str(path).lower().endswith(".npz"):
            _refuse_long(path)
            with ZipFile(path) as file:
                return {key: _member(file, key) for key in KNOWN if f"{key}.npy" in file.namelist()}
        found = read_variables(path)
        for key in KNOWN:
            if key in found:
                _refuse_large(key, found[key].shape)
        return {key: _plain(found[key].values()) for key in KNOWN if key in found}
    except PatchfemError as error:
        why = str(error).removeprefix(f"{path}: ")
        raise PatchfemError(f"structure.file: {path} cannot be read ({why})") from None
    except Exception as error:  # a damaged file raises whatever its reader trips over
        raise PatchfemError(
            f"structure.file: {path} cannot be read ({error}); plain arrays are needed, not objects"
        ) from None


def _member(file: ZipFile, key: str) -> np.ndarray:
    """An array of a .npz file, refused by its header where it is large or holds objects."""
    with file.open(f"{key}.npy") as part:
        head = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}[
            npy.read_magic(part)
        ]
        shape, _, kind = head(part)
    _refuse_large(key, shape)
    if kind.itemsize > (LONGEST if key == "names" else WIDEST):
        raise PatchfemError(
            f"{key} contains values of {kind.itemsize} bytes each, which is too long"
        )
    if key == "names" and prod(shape) > MOST_COORDINATES:
        raise PatchfemError(f"{key} contains {prod(shape)} names; {MOST_COORDINATES} is the limit")
    with file.open(f"{key}.npy") as part:
        return npy.read_array(part, allow_pickle=False)


def _refuse_long(path) -> None:
    """PatchfemError for a zip file whose list of members is too long to be read."""
    with open(path, "rb") as file:
        file.seek(max(0, file.seek(0, 2) - 2**16 - 22))
        tail = file.read()
    end = tail.rfind(b"PK\x05\x06")
    size = int.from_bytes(tail[end + 12 : end + 16], "little") if end >= 0 else 0
    if size > DIRECTORY:
        raise PatchfemError(f"the list of members takes {size} bytes; {DIRECTORY} is the limit")


def _refuse_large(key: str, shape: tuple) -> None:
    if prod(shape) > MOST_COORDINATES**2:
        raise PatchfemError(
            f"{key} of shape {'x'.join(map(str, shape))} is larger than {MOST_COORDINATES} coordinates "
            "squared; give a reduced model, or only the modes in the frequency range of the drive"
        )


def _plain(value):
    """An array of a .mat file without the two dimensions that it always has."""
    return value if value.ndim == 2 and min(value.shape) > 1 else value.ravel()


def basis(
    data: dict,
    pairs=(),
    pushed: int | None = None,
    forced: bool = False,
    mass: float | None = None,
    where: str = "structure.file",
) -> ModalBasis:
    """ModalBasis of arrays as `read` gives them.

    pairs: interfaces (i, j) between coordinates of the matrices from 1, 0 the base, instead of `slide`; pushed: the
    coordinate a force drives instead of `force`; forced: a force drives; mass: moving mass [kg] of modal data.
    PatchfemError names the array that is missing or wrong.
    """
    try:
        if "M" in data or "K" in data:
            return _of_matrices(data, pairs, pushed, forced, where)
        return _of_modes(data, pairs, pushed, forced, mass, where)
    except PatchfemError as error:
        text = str(error).removeprefix("structure: ")
        raise PatchfemError(text if text.startswith(where) else f"{where}: {text}") from None


def _lacks(data: dict, what: str, where: str):
    held = ", ".join(data) or "none that patchfem knows"
    raise PatchfemError(f"{where}: lacks {what}; the file contains {held}")


def _of_matrices(data, pairs, pushed, forced, where) -> ModalBasis:
    for key in ("M", "K"):
        if key not in data:
            _lacks(data, f"the matrix {key}", where)
    M, K, C = (_square(data, key, where) for key in ("M", "K", "C"))
    n = len(M)
    if n == 0:
        raise PatchfemError(
            f"{where}: M has no coordinate (the matrix is empty); a square matrix [kg] with at least "
            "one row is needed"
        )
    if pairs and "slide" in data:
        raise PatchfemError(
            f"{where}: contains `slide`, but [[structure.interface]] also defines where sliding "
            "occurs: keep only one of these two descriptions"
        )
    over = [k for pair in pairs for k in pair if k > n]
    if over or (pushed or 0) > n:
        raise PatchfemError(
            f"{where}: there is no coordinate {(over or [pushed])[0]}: M has {n}, numbered from 1"
        )
    faces = masses.slide_rows(pairs, n) if pairs else data.get("slide")
    if faces is not None:
        faces = matrices.as_real(faces, "slide")
        faces = faces.reshape(-1, n) if faces.size % n == 0 else faces
    output = data.get("output", faces[0] if faces is not None and len(faces) else None)
    if output is None:
        _lacks(
            data,
            "output (n,), what the accelerometer measures; slide (n,) serves as output if output is missing",
            where,
        )
    force = None
    if forced:
        force = np.eye(n)[pushed - 1] if pushed else data.get("force", output)
    rows = {key: data.get(key) for key in PATCH}
    return matrices.basis(
        M,
        K,
        C,
        faces=faces,
        output=output,
        base=data.get("base"),
        force=force,
        names=_names(data, n, where) or tuple(str(k + 1) for k in range(n)),
        **rows,
    )


def _square(data, key, where):
    value = data.get(key)
    if value is None or np.ndim(value) == 2:
        return value
    if np.size(value) != 1:
        raise PatchfemError(f"{where}: {key} must be square, not of shape {np.shape(value)}")
    return np.reshape(value, (1, 1))


def _of_modes(data, pairs, pushed, forced, mass, where) -> ModalBasis:
    if pairs or pushed:
        raise PatchfemError(
            f"{where}: modal data have no numbered masses, which [[structure.interface]] and "
            "drive.mass need; give `slide` and `force` in the file"
        )
    if "omega" not in data and "frequency" not in data:
        _lacks(data, "M and K, or omega [rad/s] or frequency [Hz] of modes", where)
    omega = (
        _numbers(data, "omega", where)
        if "omega" in data
        else 2 * np.pi * _numbers(data, "frequency", where)
    )
    n = omega.size
    for key in ("damping", "slide", *(() if forced else ("base",))):
        if key not in data:
            _lacks(data, f"{key} of the modes", where)
    if mass is None and "moving_mass" in data:
        mass = float(_numbers(data, "moving_mass", where)[0])
    if mass is None or not mass > 0:
        raise PatchfemError(
            f"{where}: lacks moving_mass > 0, the modal mass [kg]; give moving_mass in the file or in "
            "[structure]"
        )
    if (omega < 0).any():
        raise PatchfemError(f"{where}: frequencies must be >= 0, not {omega.min():g}")
    faces = np.atleast_2d(_numbers(data, "slide", where, (n,), (None, n)))
    damping = _numbers(data, "damping", where, (n,), (n, n))
    if damping.ndim == 1 and (damping < 0).any():
        raise PatchfemError(f"{where}: damping must be >= 0, not {damping.min():g}")
    # round-off of a singular D
    if (
        damping.ndim == 2
        and np.linalg.eigvalsh(damping + damping.T).min() < -1e-9 * np.abs(damping).max()
    ):
        raise PatchfemError(
            f"{where}: the damping matrix adds energy; a positive semidefinite matrix D [1/s] is "
            "needed"
        )
    zeta, coupled = (
        matrices.split_damping(damping, omega)
        if damping.ndim == 2
        else (frozen_array(damping), None)
    )
    output = _numbers(data, "output", where, (n,)) if "output" in data else faces[0]
    base = (
        -(_numbers(data, "force", where, (n,)) if "force" in data else output)
        if forced
        else _numbers(data, "base", where, (n,))
    )
    if not forced and np.sum(base**2) > 1 + 1e-9:  # modes of unit mass hold at most the whole of it
        raise PatchfemError(
            f"{where}: the sum of `base`^2 over the modes is {np.sum(base**2):.6g}, but at most 1 is "
            "possible"
        )
    moved = {
        key: frozen_array(_numbers(data, key, where, (n,)))
        for key in PATCH
        if key in data and data[key].any()
    }
    return ModalBasis(
        _names(data, n, where) or tuple(f"mode {k + 1}" for k in range(n)),
        frozen_array(omega),
        zeta,
        frozen_array(faces[0]),
        frozen_array(base),
        frozen_array(output),
        mass,
        coupled,
        frozen_array(faces) if len(faces) > 1 else None,
        **moved,
    )


def _numbers(data, key, where, *shapes) -> np.ndarray:
    """Array data[key] as finite real numbers of one of the shapes (None in a shape: any length); (n,) without one."""
    value = matrices.as_real(data[key], key)
    if value.dtype.kind not in "iufb":
        raise PatchfemError(f"{where}: {key} does not contain real numbers")
    value = value.astype(float)
    if not shapes:
        value = value.ravel()
    elif value.ndim == 1 and shapes[-1] == (1, 1):
        value = value.reshape(-1)
    if not np.isfinite(value).all():
        raise PatchfemError(f"{where}: {key} contains values that are not finite")
    fits = [
        s
        for s in shapes
        if len(s) == value.ndim and all(a in (None, b) for a, b in zip(s, value.shape))
    ]
    if shapes and not fits:
        n = shapes[0][0]
        raise PatchfemError(f"{where}: {key} has shape {value.shape}, but there are {n} modes")
    return value


def _names(data, n, where):
    if "names" not in data:
        return None
    names = tuple(
        str(one if isinstance(one, str) else np.asarray(one).ravel()[0]).strip()
        for one in data["names"]
    )
    if len(names) != n or len(set(names)) != n:
        raise PatchfemError(f"{where}: names must be {n} different texts")
    return names
