"""Patches with bonds behind shear modes in lanes: numbers of cases, their march, and what it leaves."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...compiled import load
from ...core import ModalBasis, SineDrive
from ..propagator import propagator

KERNELS = "dynamics.march.lanes_kernels"


class Points(NamedTuple):
    """The points of a case: limits (p,) [N], shape (p, r) slides per coordinate, stiffness (r,) [N/m] of the pieces,
    bond length [m]; amplitude [m s-2] of its drive."""

    limit: np.ndarray
    shape: np.ndarray
    stiffness: np.ndarray
    length: float
    amplitude: float


class Marched(NamedTuple):
    """n cases after their march: extremes (n, c, 2) [m] of the output and its phasors (n, c) [m] by cycles; book: sums
    of the run by name, (n,) [J]; of the last cycles the samples: z, rate (s, modes, n), force [N] and slip [m] (s, n),
    and the friction work `worked` (n,) [J]; reach (n,) [m]: largest slide; bad (n,): steps without a solution."""

    extremes: np.ndarray
    phasors: np.ndarray
    book: dict
    z: np.ndarray
    rate: np.ndarray
    force: np.ndarray
    slip: np.ndarray
    worked: np.ndarray
    reach: np.ndarray
    bad: np.ndarray


def fits(modes: ModalBasis) -> bool:
    """Whether lanes march a rig."""
    return modes.omega.size <= load(KERNELS).RIG and modes.damping is None


def _rig(kernels, modes: ModalBasis, prop) -> np.ndarray:
    """The rows of a rig as the kernels take them."""
    n = modes.omega.size
    out = np.zeros((kernels.RIGS + 1, 3))
    for first, rows in (
        (kernels.ZZ, prop.free),
        (kernels.BY_Z, prop.push),
        (kernels.REACH_Z, prop.reach[0].reshape(2, n)),
        (kernels.LOSS, prop.loss),
        (kernels.SLIDE, [modes.slide, modes.output, modes.omega**2]),
    ):
        out[first : first + len(rows), :n] = rows
    out[-1] = prop.beta[0, 0], modes.mass, prop.dt
    # of forces [N] in place of accelerations
    for first, power in (
        (kernels.BY_Z, 1),
        (kernels.BY_V, 1),
        (kernels.LOSS + 3, 1),
        (kernels.LOSS + 4, 1),
        (kernels.LOSS + 5, 2),
    ):
        out[first] /= modes.mass**power
    return out


def _table(kernels, modes: ModalBasis, drive, steps: int, prop) -> np.ndarray:
    """The table of the steps of a cycle under a drive of 1 m s-2."""
    n = modes.omega.size
    unit = replace(drive, acceleration=1.0)
    found = prop.tables(unit, 0, steps)
    out = np.zeros((steps, kernels.COLUMNS))
    for k in range(8):  # one column of each kind per mode
        out[:, k * kernels.RIG : k * kernels.RIG + n] = found[:, k * n : (k + 1) * n]
    angle = 2 * np.pi * np.arange(steps) / steps
    for forms in (kernels.WORKS, kernels.LOSSES):  # of forces [N] in place of accelerations
        out[:, forms + 2 * kernels.RIG : forms + 3 * kernels.RIG] /= modes.mass
    out[:, kernels.REST : kernels.REST + 2] = found[:, 8 * n : 8 * n + 2]
    out[:, kernels.PORT] = found[:, 8 * n + 3]
    out[:, kernels.WAVE :] = np.array([np.cos(angle), np.sin(angle)]).T
    return out


def _room(kernels, cases: list) -> np.ndarray:
    """The workspace of cases at rest; of one too few lanes the last case has more than one."""
    out = np.zeros((kernels.NUMBERS, kernels.LANES))
    points = kernels.POINTS
    for i in range(kernels.LANES):
        one = cases[min(i, len(cases) - 1)]
        few, modes = one.shape.shape
        out[[kernels.PUSH, kernels.LENGTH, kernels.LIMIT], i] = (
            one.amplitude,
            one.length,
            one.limit.sum(),
        )
        out[kernels.OF_POINT : kernels.OF_POINT + few, i] = one.limit
        out[kernels.KAPPA : kernels.KAPPA + kernels.MODES, i] = one.stiffness.max()
        for k in range(modes):
            first = kernels.SHAPE + k * points
            out[first : first + few, i] = one.shape[:, k]
            out[kernels.KAPPA + k, i] = one.stiffness[k]
            out[kernels.REACH + k, i] = np.abs(one.shape[:, k]).max()
            out[kernels.MEAN + k, i] = one.limit @ one.shape[:, k] / one.limit.sum()
    return out


def march(
    modes: ModalBasis, drive: SineDrive, cases: list, cycles: int, steps: int, window: int
) -> Marched:
    """March cases of `Points` over so many cycles of a drive, each under its own amplitude, from rest."""
    kernels = load(KERNELS)
    prop = propagator(modes, drive, steps)
    rig = _rig(kernels, modes, prop)
    table = _table(kernels, modes, drive, steps, prop)
    n = len(cases)
    parts = []
    for first in range(0, n, kernels.LANES):
        workspace = _room(kernels, cases[first : first + kernels.LANES])
        few = min(kernels.LANES, n - first)
        history = np.zeros((cycles, 4, kernels.LANES))
        work = np.zeros(kernels.LANES)
        samples = np.zeros((window * steps + 1, kernels.KEPT, kernels.LANES))
        kernels.march(workspace.ravel(), rig, table, history, samples, work)
        parts.append((workspace[:, :few], history[:, :, :few], samples[:, :, :few], work[:few]))
    workspace, history, samples, work = (np.concatenate(one, axis=-1) for one in zip(*parts))
    m = modes.omega.size
    r = kernels.RIG
    names = (
        "WORK_IN",
        "VISCOUS",
        "POWER",
        "LOST",
        "PEAK",
        "BOOKED",
        "SAMPLED",
        "PASSED",
        "GONE",
        "CREATED",
    )
    book = {name.lower(): workspace[getattr(kernels, name)] for name in names}
    moving = (
        workspace[kernels.V : kernels.V + m] ** 2 + (modes.omega[:, None] * workspace[:m]) ** 2
    ).sum(axis=0)
    book["stored"] = 0.5 * modes.mass * moving + workspace[kernels.ENERGY]
    return Marched(
        history[:, :2].transpose(2, 0, 1),
        (history[:, 2] + 1j * history[:, 3]).T,
        book,
        samples[:, :m],
        samples[:, r : r + m],
        samples[:, 2 * r],
        samples[:, 2 * r + 1],
        book["booked"] - work,
        workspace[kernels.FAR],
        workspace[kernels.BAD],
    )
