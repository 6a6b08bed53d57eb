"""Many pieces of a run at once: values at times, turning points, energies and integrals, vectorised over the pieces."""

from dataclasses import dataclass

import numpy as np

from ...core import ModalBasis, Response
from .signals import ORDER, TERMS, derivative

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
NODES, WEIGHTS = (NODES + 1) / 2, WEIGHTS / 2
GRID = np.linspace(0.0, 1.0, 9)
TOGETHER = 4096  # pieces whose powers are held at once


@dataclass(frozen=True, eq=False, slots=True)
class Batch:
    """Pieces of a run in order, k of them.

    time, span, unit, cycle, first: (k,); coefs: (k, TERMS, n); constant: (k,) of the drive that is part of
    `push`; base: (k, TERMS) series of the whole drive [m s-2]; signs, held, forces: (k, f) of the faces that rub; push:
    (k, n); react: (k, f, n).
    """

    time: np.ndarray
    span: np.ndarray
    unit: np.ndarray
    cycle: np.ndarray
    first: np.ndarray
    coefs: np.ndarray
    constant: np.ndarray
    base: np.ndarray
    signs: np.ndarray
    held: np.ndarray
    forces: np.ndarray
    push: np.ndarray
    react: np.ndarray

    def __len__(self) -> int:
        return len(self.time)

    def cut(self, which) -> "Batch":
        """A Batch of some of the pieces; which: index or mask (k,)."""
        return Batch(*(getattr(self, name)[which] for name in Batch.__slots__))

    def ending(self, span: float) -> "Batch":
        """The Batch with its last piece only `span` [s] long."""
        spans = self.span.copy()
        spans[-1] = span
        return Batch(*(spans if name == "span" else getattr(self, name) for name in Batch.__slots__))

    @property
    def share(self):
        """Part of its unit that each piece lasts, (k,) in (0, 1]."""
        return self.span / self.unit

    def acceleration(self, owner, tau):
        """Drive [m s-2] at tau (..., j) [s] after the starts of the pieces `owner` (...,)."""
        lift = (slice(None),) + (None,) * (tau.ndim - 1)
        u, series, out = tau / self.unit[owner][lift], self.base[owner], np.zeros(tau.shape)
        for k in range(TERMS - 1, -1, -1):
            out = out * u + series[:, k][lift]
        return out


def gather(pieces) -> Batch:
    """Collect pieces of `engine.Engine`, a list of them, into a Batch."""
    scalar = [np.array([getattr(p, name) for p in pieces])
              for name in ("time", "span", "unit", "cycle", "first")]
    coefs, *rest = [np.array([getattr(p, name) for p in pieces], float)
                    for name in ("coefs", "signs", "held", "forces", "push")]
    constant, base = _drives(pieces, scalar[2])
    return Batch(*scalar, coefs, constant, base, *rest, np.array([p.flow.react for p in pieces]))


def _drives(pieces, unit) -> tuple:
    """Constant (k,) and series (k, TERMS) of the drives of pieces with units (k,)."""
    if not isinstance(pieces[0].drive, tuple):
        return np.zeros(len(pieces)), np.array([p.drive for p in pieces])
    constant, size, omega, theta = np.array([(*p.drive, p.theta) for p in pieces], float).T
    turn, base = omega * unit, np.zeros((len(pieces), TERMS))
    for k in range(TERMS):
        base[:, k] = size * np.sin(theta + k * np.pi / 2)
        size = size * turn / (k + 1)
    base[:, 0] += constant
    return constant, base


def join(batches) -> Batch:
    """Join Batches one after the other."""
    return Batch(*(np.concatenate([getattr(b, name) for b in batches]) for name in Batch.__slots__))


def powers(u):
    """Powers u^k (..., TERMS), k = 0, 1, ..., of u (...,)."""
    out = np.empty((*np.shape(u), TERMS))
    out[..., 0] = 1.0
    for k in range(1, TERMS):
        out[..., k] = out[..., k - 1] * u
    return out


def states(batch: Batch, owner, tau) -> tuple:
    """Coordinates (j, n) [m] and rates (j, n) [m/s] at tau (j,) [s] in the pieces `owner` (j,)."""
    u = tau / batch.unit[owner]
    power, coefs = powers(u), batch.coefs[owner]
    z = np.einsum("jk,jkn->jn", power, coefs)
    v = np.einsum("jk,jkn->jn", power[:, :-1] * ORDER[1:], coefs[:, 1:]) / batch.unit[owner][:, None]
    return z, v


def sample(batch: Batch, times, modes: ModalBasis, drive, live) -> Response:
    """Response at `times` (k,) [s], ascending; a time on the border of two pieces belongs to the later one.

    live: numbers of the faces that rub.
    """
    owner = np.clip(np.searchsorted(batch.time, times, side="right") - 1, 0, len(batch) - 1)
    return at(batch, owner, np.clip(times - batch.time[owner], 0.0, batch.span[owner]), times, modes, drive, live)


def at(batch: Batch, owner, tau, times, modes: ModalBasis, drive, live) -> Response:
    """Response at `times` (k,) [s], which are tau (k,) [s] after the starts of the pieces `owner` (k,).

    live: numbers of the faces that rub.
    """
    z, v = states(batch, owner, tau)
    base = batch.acceleration(owner, tau)
    faces, count = np.asarray(modes.interfaces, float), len(modes.interfaces)
    free = -(z * modes.omega**2) - v @ np.asarray(modes.dampers).T
    forces, slides, rates = np.zeros((times.size, count)), z @ faces.T, v @ faces.T
    if len(live):
        sine = base - batch.constant[owner]
        pull = free + batch.push[owner] - np.outer(sine, modes.base)
        forces[:, live] = batch.forces[owner] + np.einsum("jfn,jn->jf", batch.react[owner], pull)
        stuck = batch.signs[owner] == 0
        slides[:, live] = np.where(stuck, batch.held[owner], slides[:, live])
        rates[:, live] = np.where(stuck, 0.0, rates[:, live])
    accel = free - np.outer(base, modes.base) - forces @ faces / modes.mass
    moved = base if drive.moving else np.zeros(times.size)
    extra = {"slides": slides, "slide_rates": rates, "forces": forces} if count > 1 else {}
    return Response(times, z, v, slides[:, 0], rates[:, 0], z @ modes.output, v @ modes.output,
                    accel @ modes.output + moved, moved, forces[:, 0], slides[:, 0], extra)


def energies(batch: Batch, modes: ModalBasis, live) -> np.ndarray:
    """Work of the drive, viscous loss, integral of |power of the drive|, friction work [J], (4,), over all pieces.

    By 12 Gauss points a piece.
    """
    v = _rates(batch, powers(batch.share[:, None] * NODES))
    weight = batch.span[:, None] * WEIGHTS
    every = np.arange(len(batch))
    a = batch.acceleration(every, batch.span[:, None] * NODES)
    power = -modes.mass * a * (v @ modes.base)
    loss = modes.mass * np.einsum("kjn,nm,kjm->kj", v, np.asarray(modes.dampers, float), v)
    rate = np.einsum("kjn,fn->kjf", v, np.asarray(modes.interfaces, float)[live])
    rub = np.einsum("kjf,kf->kj", rate, batch.forces)
    return np.array([np.sum(weight * x) for x in (power, loss, np.abs(power), rub)])


def _nodes(batch: Batch) -> tuple:
    """Coordinates and rates (k, 12, n) at the Gauss points of the pieces."""
    power = powers(batch.share[:, None] * NODES)
    return power @ batch.coefs, _rates(batch, power)


def _rates(batch: Batch, power):
    """Rates (k, j, n) where the powers of u are `power` (k, j, TERMS)."""
    return power[:, :, :-1] @ (batch.coefs[:, 1:] * ORDER[1:, None] / batch.unit[:, None, None])


def loop_of(batch: Batch, modes: ModalBasis, live) -> tuple:
    """Quadrature over the pieces: time [s], weight [s], slide [m], rate [m/s], force [N] of the first interface.

    (12 k,) each.
    """
    parts = [_loop_of(batch.cut(slice(k, k + TOGETHER)), modes, live) for k in range(0, len(batch), TOGETHER)]
    return tuple(np.concatenate(columns) for columns in zip(*parts))


def _loop_of(batch: Batch, modes: ModalBasis, live) -> tuple:
    z, v = _nodes(batch)
    tau = batch.span[:, None] * NODES
    face = np.asarray(modes.interfaces, float)[0]
    slide, rate, force = z @ face, v @ face, np.zeros(tau.shape)
    if len(live) and live[0] == 0:
        sine = batch.acceleration(np.arange(len(batch)), tau) - batch.constant[:, None]
        pull = -(z * modes.omega**2) - v @ np.asarray(modes.dampers).T + batch.push[:, None] \
            - sine[..., None] * modes.base
        force = batch.forces[:, :1] + np.einsum("kn,kjn->kj", batch.react[:, 0], pull)
        stuck = batch.signs[:, :1] == 0
        slide, rate = np.where(stuck, batch.held[:, :1], slide), np.where(stuck, 0.0, rate)
    return tuple(x.ravel() for x in (batch.time[:, None] + tau, batch.span[:, None] * WEIGHTS, slide, rate, force))


def stored(batch: Batch, modes: ModalBasis, share: float) -> np.ndarray:
    """Energy of the modes (k,) [J], kinetic and elastic, at a share [0, 1] of every piece."""
    z, v = states(batch, np.arange(len(batch)), batch.span * share)
    return 0.5 * modes.mass * np.sum(v**2 + (modes.omega * z)**2, axis=1)


def turning_points(series, share) -> tuple:
    """Turning points (piece (j,), u (j,)) of series (k, TERMS) in u, for u inside (0, share (k,)).

    They are seen by a change of the slope's sign between 9 samples, and refined by Newton's method.
    """
    slope = derivative(series[..., None])[..., 0]
    bend = derivative(slope[..., None])[..., 0]
    u = share[:, None] * GRID
    value = np.einsum("kjp,kp->kj", powers(u), slope)
    piece, left = np.nonzero((value[:, :-1] * value[:, 1:] < 0) | ((value[:, 1:] == 0) & (value[:, :-1] != 0)))
    low, high = u[piece, left], u[piece, left + 1]
    a, b = value[piece, left], value[piece, left + 1]
    x = low - a * (high - low) / (b - a)
    for _ in range(6):
        power = powers(x)
        curve = np.einsum("jp,jp->j", power, bend[piece])
        step = np.einsum("jp,jp->j", power, slope[piece]) / np.where(curve == 0, np.inf, curve)
        x = np.clip(x - step, low, high)
    return piece, x


def values_at(series, piece, u):
    """Values of series (k, TERMS) at u (j,) of the pieces (j,)."""
    return np.einsum("jp,jp->j", powers(u), series[piece])


def absolute(batch: Batch, modes: ModalBasis, moving: bool):
    """Series (k, TERMS) [m s-2] of the acceleration at the output, that of a moving base included.

    The last two terms of the motion are lost.
    """
    out = batch.coefs @ modes.output
    series = np.zeros_like(out)
    series[:, :-2] = out[:, 2:] * (ORDER[2:] * (ORDER[2:] - 1)) / batch.unit[:, None]**2
    return series + batch.base if moving else series


def pushing(batch: Batch, modes: ModalBasis, face: int):
    """Series (k, TERMS) [N] of the friction force of the live face number `face`; the last term is lost."""
    react, coefs, series = batch.react[:, face], batch.coefs, np.zeros(batch.coefs.shape[:2])
    rate = np.zeros_like(coefs)
    rate[:, :-1] = coefs[:, 1:] * ORDER[1:, None] / batch.unit[:, None, None]
    series -= np.einsum("kjn,kn->kj", coefs * modes.omega**2 + rate @ np.asarray(modes.dampers, float).T, react)
    series[:, 0] += batch.forces[:, face] + np.einsum("kn,kn->k", batch.push, react)
    series -= batch.base * (react @ modes.base)[:, None]
    series[:, 0] += batch.constant * (react @ modes.base)  # `push` has it
    return series
