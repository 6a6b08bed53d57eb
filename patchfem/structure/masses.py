"""Masses in a row or a net, joined by springs and dampers, 0 being the base (report, section 3 and figure 16)."""

from dataclasses import replace

import numpy as np

from ..core import ModalBasis, frozen_array
from . import matrices


def slide_rows(pairs, n: int) -> np.ndarray:
    """Relative displacements x_i - x_j as rows (len(pairs), n) over n masses.

    pairs: (i, j) of masses counted from 1, 0 the base.
    """
    out = np.zeros((len(pairs), n))
    for row, (i, j) in zip(out, pairs):
        if i:
            row[i - 1] += 1.0
        if j:
            row[j - 1] -= 1.0
    return out


def basis(
    masses, springs, dampers, interfaces, output: int, pushed: int | None = None
) -> ModalBasis:
    """ModalBasis (mass 1 kg) of masses (n,) [kg] joined by springs and dampers ((i, j), [N/m] or [N s/m]).

    interfaces: pairs (i, j), slide x_i - x_j; output: the mass that is watched; pushed: the one a force drives, None:
    the base moves them all. A mass that nothing holds has a rigid mode.
    """
    n = len(masses)
    stretch = slide_rows([pair for pair, _ in springs], n) * np.sqrt(
        [[k] for _, k in springs] or np.zeros((0, 1))
    )
    dash = slide_rows([pair for pair, _ in dampers], n) * np.sqrt(
        [[c] for _, c in dampers] or np.zeros((0, 1))
    )
    unit = np.eye(n)
    return matrices.basis(
        np.diag(np.asarray(masses, float)),
        faces=slide_rows(interfaces, n) if interfaces else None,
        output=unit[output - 1],
        force=None if pushed is None else unit[pushed - 1],
        stretch=stretch,
        dash=dash if len(dash) else None,
    )


def set_lateral_faces(found: ModalBasis, laterals) -> ModalBasis:
    """The basis whose faces after the first len(laterals) are second directions of those interfaces whose entry is not
    None."""
    count, second = len(laterals), [k for k, pair in enumerate(laterals) if pair is not None]
    if not second:
        return found
    rows = np.zeros((count, found.omega.size))
    rows[second] = found.faces[count:]
    return replace(
        found,
        faces=None if count == 1 else frozen_array(found.faces[:count]),
        lateral_faces=frozen_array(rows),
    )
