"""Modes of a rig from the arrays of a .npz or .mat file.

M, K and optionally C (n, n) [kg, N/m, N s/m]; slide (n,) or (i, n); base (n,), by default ones; output (n,), by default
the slide of the first interface; force (n,), by default the output. Other arrays of the file are ignored.
"""

from math import prod
from pathlib import Path

import numpy as np
from scipy.sparse import issparse

from ..core import ModalBasis, PatchfemError
from ..effects import MAX_RIG_COORDINATES
from ..inputs.damage import refuse_damage
from ..inputs.matlab import read_variables
from ..inputs.packed import open_arrays
from ..inputs.symmetric import to_real
from ..scene.keys.removed import describe_removed
from . import masses, matrices
from .modes import PATCH_MOTIONS

REMOVED_ARRAYS = ("omega", "frequency")  # arrays of a file of modes, which is no longer read
ARRAY_NAMES = ("M", "K", "C", "slide", "base", "output", "force", *PATCH_MOTIONS, *REMOVED_ARRAYS)
# What to do with a file of arrays that is too large
TOO_LARGE_REMEDY = "give a reduced model, or only the modes in the frequency range of the drive"


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read the arrays of a structure from a .npz or .mat file.

    Parameters
    ----------
    path : Path
        File to read.

    Returns
    -------
    dict
        Array (n,) or (n, n) by name, for those of `ARRAY_NAMES` that the file has.

    Raises
    ------
    PatchfemError
        If the file cannot be read or contains objects.
    """
    is_numpy = path.suffix.lower() == ".npz"
    with refuse_damage(f"{path} cannot be read", "; plain arrays are needed, not objects"):
        if is_numpy:
            with open_arrays(path, TOO_LARGE_REMEDY) as file:
                variables = {name: file[name] for name in ARRAY_NAMES if name in file}
        else:
            variables = read_variables(path)

    arrays = {}
    for name in filter(variables.__contains__, ARRAY_NAMES):
        values = variables[name]
        if prod(values.shape) > MAX_RIG_COORDINATES**2:
            raise PatchfemError(
                f"{name} of shape {'x'.join(map(str, values.shape))} is larger than {MAX_RIG_COORDINATES} coordinates "
                f"squared; {TOO_LARGE_REMEDY}"
            )
        full = values.toarray() if issparse(values) else values
        # MATLAB has no vectors: a matrix with a single row or column stands for one.
        arrays[name] = full.ravel() if 1 in full.shape and not is_numpy else full
    return arrays


def build_basis(
    data: dict[str, np.ndarray],
    pairs=(),
    driven_mass: int | None = None,
    *,
    is_forced: bool = False,
) -> ModalBasis:
    """Build the modal basis of a rig from the matrices of a file.

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

    Returns
    -------
    ModalBasis

    Raises
    ------
    PatchfemError
        If an array is missing or wrong; the message names it.
    """

    # Mass and stiffness must be there. Interfaces and drive must name coordinates that exist.
    for name in ("M", "K"):
        if name not in data:
            _refuse_missing(data, f"the matrix {name}")
    # A single number is a matrix (1, 1).
    matrices_by_name = {name: np.atleast_2d(data[name]) for name in ("M", "K", "C") if name in data}
    n = matrices_by_name["M"].shape[-1]
    if pairs and "slide" in data:
        raise PatchfemError(
            "contains `slide`, but [[structure.interface]] also defines where sliding "
            "occurs: keep only one of these two descriptions"
        )
    missing = [number for number in (*sum(pairs, ()), driven_mass or 0) if number > n]
    if missing:
        raise PatchfemError(f"there is no coordinate {missing[0]}: M has {n}, numbered from 1")

    # A file may have a single row for `slide`, one for each interface, or none.
    faces = masses.make_slide_rows(pairs, n) if pairs else data.get("slide")
    if faces is not None:
        faces = to_real(faces, "slide")
        faces = faces.reshape(-1, n) if n and faces.size % n == 0 else faces
        faces = faces if faces.size else None
    output = data.get("output", None if faces is None else faces[0])
    if output is None:
        _refuse_missing(
            data,
            "output (n,), what the accelerometer measures; slide (n,) serves as output if output is missing",
        )

    # A force acts at a numbered coordinate, along the array `force`, or at the output
    force = None
    if is_forced:
        force = np.eye(n)[driven_mass - 1] if driven_mass else data.get("force", output)

    return matrices.build_basis(
        **matrices_by_name,
        faces=faces,
        output=output,
        base=data.get("base"),
        force=force,
    )


def _refuse_missing(data: dict[str, np.ndarray], missing_name: str) -> None:
    """Raise PatchfemError for the array `missing_name`, which the file does not contain.

    The message lists the names of the arrays in `data`, those that the file contains.
    """
    names = ", ".join(data) or "none that patchfem knows"
    removed = ""
    if not data.keys().isdisjoint(REMOVED_ARRAYS):
        removed = f"; {describe_removed('a file of modes as arrays')}"
    raise PatchfemError(f"lacks {missing_name}; the file contains {names}{removed}")
