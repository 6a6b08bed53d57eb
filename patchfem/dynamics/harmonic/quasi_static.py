"""Backbone of a mode by statics: one force along the shape of the held mode, and the loops that the laws run through.

A force alpha m phi along the shape phi of the mode with the contact held moves the coordinates to z:
m omega_i^2 z_i + (rows^T F)_i = alpha m phi_i. The slides turn together, so each law runs through its own loop, whose
tip is F. The frequency is omega^2 = alpha/q for the share q = phi z/(phi phi) of z along phi, and the damping what the
loops lose of 2 pi alpha q m phi phi. Where a law follows Masing's rule the loop is its curve of first loading, twice as
large: one static curve tells both (Festjens, Chevallier and Dion 2013; Lacayo and Allen 2019).
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import root

from ...core import ModalBasis, NotConverged, PatchfemError
from ...formatting import format_length
from ...friction.laws.elastic_plastic import masing_loop
from .forces import Group
from .laws import Jenkins, Track

STEP = 1e-6  # of a slide, over which the slope of a tip is taken
TURNS = 2.0  # ratio of two rates of a cycle whose forces are the same where a law knows no time
SAME = 1e-9  # of a force, what round-off may change of it
RATE = "a friction force that depends on the sliding speed has no static loop"


class Loops(NamedTuple):
    """Loops of the laws of a row at slides of amplitude u: tip [N], area [J]."""

    tip: float
    area: float


class Static(NamedTuple):
    """The static motion of a mode whose coordinate has a share q [m] of its shape: omega [rad/s], zeta [1], coordinates
    z (n,) [m], loss of the laws per cycle [J]."""

    share: float
    omega: float
    zeta: float
    z: np.ndarray
    loss: float


def loops(laws, u: float, samples: int) -> Loops:
    """Loops of the laws on one row at an amplitude u >= 0 [m] of its slide, those without a closed form on `samples` of
    a cycle."""
    found = [
        Loops(*map(float, masing_loop(law.stiffness, law.limit_slide, u)))
        if isinstance(law, Jenkins)
        else _sampled(law, u, samples)
        for law in laws
    ]
    return Loops(sum(one.tip for one in found), sum(one.area for one in found))


def _sampled(law, u: float, samples: int) -> Loops:
    """Of any law whose force knows no time: (F_max - F_min)/2 at the turns, the area by the samples."""
    if u == 0:
        return Loops(0.0, 0.0)
    track = Track(np.array([0.0, u], complex), 1.0, samples)
    force = law.sample(track).force
    return Loops(
        float(force[0] - force[samples // 2]) / 2, float(force @ track.rate) * 2 * np.pi / samples
    )


def follows_speed(group: Group, u: float) -> bool:
    """Whether a force changes with the rate of a cycle of amplitude u [m]."""
    for law in (one for laws in group.laws for one in laws if not isinstance(one, Jenkins)):
        slow, fast = (
            law.sample(Track(np.array([0.0, u], complex), rate, 512)).force for rate in (1.0, TURNS)
        )
        if np.abs(fast - slow).max() > SAME * np.abs(slow).max(initial=1e-300):
            return True
    return False


def along(
    modes: ModalBasis, group: Group, shares, held: tuple, samples: int = 4096, of=None
) -> list:
    """Static motions (k,) of a mode at shares (k,) [m] of its shape when the contact holds.

    modes: as they are without the contact; group: laws on the rows; held: (omega [rad/s], shape (n,)) of the mode;
    samples: of a cycle, for laws without a closed form; of (n,): what the shares are given of, 1 for the shape itself,
    such as the motion at the output; the part along the shape unless given. NaN where no equilibrium is found.
    PatchfemError where a law follows the speed.
    """
    if follows_speed(group, float(np.abs(group.rows).max()) * float(np.max(shares))):
        raise PatchfemError(RATE)
    omega, shape = held
    out = []
    near = np.append(shape, 1.0)
    of = shape / (shape @ shape) if of is None else of
    for share in shares:
        try:
            near = _balanced(modes, group, (*held, of), float(share), near, samples)
        except NotConverged:
            out.append(
                Static(float(share), np.nan, np.nan, np.full(modes.omega.size, np.nan), np.nan)
            )
            continue
        z = near[:-1] * share
        alpha = float(near[-1]) * omega**2 * share
        loss = sum(
            loops(laws, abs(one), samples).area for one, laws in zip(group.rows @ z, group.laws)
        )
        out.append(_read(modes, shape, (z, alpha, loss)))
    return out


def through(modes: ModalBasis, row, held: tuple, slides, found) -> list:
    """Static motions of a mode whose one interface, of slide `row` (n,) per coordinate, runs through loops that are
    known: slides (k,) [m], found: as many `Loops`. held as of `along`."""
    shape = held[1]
    n = modes.omega.size
    out = []
    matrix = np.zeros((n + 1, n + 1))
    matrix[:n, :n] = np.diag(modes.omega**2)
    matrix[:n, n] = -shape
    matrix[n, :n] = row
    for slide, one in zip(slides, found):
        x = np.linalg.solve(matrix, np.append(-np.asarray(row) * one.tip / modes.mass, slide))
        out.append(_read(modes, shape, (x[:n], float(x[n]), one.area)))
    return out


def _balanced(modes, group, held: tuple, share: float, near, samples: int) -> np.ndarray:
    """(z/share, alpha/(omega^2 share)) of the equilibrium at a share [m], from one nearby; held: omega, shape, `of`."""
    omega, shape, of = held
    m = modes.mass
    n = modes.omega.size
    stiff = np.diag(modes.omega**2) / omega**2

    def left(x):
        u = group.rows @ x[:n] * share
        force = np.array(
            [np.sign(one) * loops(laws, abs(one), samples).tip for one, laws in zip(u, group.laws)]
        )
        return np.append(
            stiff @ x[:n] + group.rows.T @ force / (m * omega**2 * share) - x[n] * shape,
            of @ x[:n] - 1,
        )

    def slopes(x):
        u = np.abs(group.rows @ x[:n] * share)
        rise = [_slope(laws, one, samples) for one, laws in zip(u, group.laws)]
        top = stiff + group.rows.T * rise @ group.rows / (m * omega**2)
        return np.block([[top, -shape[:, None]], [of[None], np.zeros((1, 1))]])

    for start in (near, np.append(shape, 1.0)):
        found = root(left, start, jac=slopes, tol=1e-13)
        if np.abs(found.fun).max() < 1e-9:
            return found.x
    raise NotConverged(
        f"backbone: no equilibrium was found at the amplitude {format_length(share, 3)} of the static curve"
    )


def _slope(laws, u: float, samples: int) -> float:
    """Slope [N/m] of the tips of loops over the amplitude."""
    step = max(STEP * u, 1e-30)
    return (loops(laws, u + step, samples).tip - loops(laws, u, samples).tip) / step


def _read(modes, shape, motion: tuple) -> Static:
    """The Static of (z (n,) [m], alpha [m s-2], loss [J])."""
    z, alpha, loss = motion
    share = float(shape @ z / (shape @ shape))
    omega = float(np.sqrt(alpha / share)) if alpha * share > 0 else np.nan
    viscous = np.pi * omega * modes.mass * float(z @ modes.damping_matrix @ z)
    work = 2 * np.pi * alpha * share * modes.mass * float(shape @ shape)
    return Static(share, omega, (loss + viscous) / work, z, float(loss))
