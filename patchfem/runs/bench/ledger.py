"""One pass of a bench: what it is told from outside, and its histories, its energy book and its frames."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...effects import law_has_trait

BLOCK = 4096  # samples between two words of progress; what it costs to enter compiled code is lost in it
ROUND = 1e-13  # of what a law dissipates: created energy below it is round-off


class Slid(NamedTuple):
    """Histories of a pass over k samples. force, load, slip: (k,) [N], [N], [m]; ledger: of `ledger_of` [J]; frames:
    (f,) numbers of the samples of the frames; tau, local: (f, m) traction [Pa] and irreversible slip [m] there."""

    force: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    ledger: np.ndarray
    frames: np.ndarray
    tau: np.ndarray
    local: np.ndarray


def ledger_of(work, stored, losses) -> np.ndarray:
    """(4, k): work, stored, dissipated and created energy [J] of samples, from the (gain, loss) (k, 2) [J] of every
    step over the points that create energy and those that lose it."""
    created, dissipated = np.cumsum(losses, axis=0).T
    created = created if created[-1] > ROUND * dissipated[-1] else 0 * created
    return np.stack([work, stored, dissipated, created])


def gains_and_losses(losses) -> tuple:
    """(created, dissipated) of the energy (..., m) that points lose, some of it below zero; summed over the points."""
    return -np.minimum(losses, 0.0).sum(axis=-1), np.maximum(losses, 0.0).sum(axis=-1)


def frame_numbers(count: int, frames: int) -> np.ndarray:
    """Numbers of the samples of the frames; the first sample is the pressed state, which is a frame of its own."""
    at = np.linspace(0, count - 1, frames + 1).round().astype(int)[1:]
    return np.unique(at[at > 0]) if frames else np.zeros(0, int)


def elastic_slip(model, slide, force, load) -> np.ndarray:
    """Irreversible slip (k,) [m] of the whole interface along the slide (k,) [m]: without the stretch of the bonds,
    which counts up to one bond length."""
    length, static = _length(model), model.friction.static
    stretch = length * np.divide(
        force, static * load, out=np.zeros_like(force), where=static * load > 0
    )
    return slide - np.clip(stretch, -length, length)


def local_slip(model, slide, tau, sigma) -> np.ndarray:
    """Irreversible slip (f, m) [m] of points under the traction tau (f, m) and the pressure sigma, (m,) or (f, m) [Pa],
    that share the slide (f,) [m]."""
    limit = np.broadcast_to(model.friction.static * sigma, tau.shape)
    return slide[:, None] - _length(model) * np.divide(
        tau, limit, out=np.zeros_like(tau), where=limit > 0
    )


def _length(model) -> float:
    """Bond length [m], 0 of a law that does not stretch."""
    f = model.friction
    return (f.bond_length or 0.0) if not law_has_trait(f.law, "averaged") else 0.0


@dataclass(frozen=True, slots=True)
class Watch:
    """What a pass is told from outside. choice: how bonds are summed, None to choose; say: called with one line when
    something compiles; progress: called with the done share; springs: function of the (stiffness, yield slide) of the
    elements of partial slip -> those that move, None: they do; modes: how many shear modes stand for pieces that give
    way, None: by the scene."""

    choice: object = None
    say: object = None
    progress: object = None
    springs: object = None
    modes: int | None = None

    def tell(self, share: float) -> None:
        """Pass the done share (0 to 1) on to `progress`, if there is one."""
        if self.progress is not None:
            self.progress(share)


UNWATCHED = Watch()
