"""Task of a bench engine, the histories that it returns, and their energy balance.

In: forces, losses and samples of a pass. Out: `SlideHistories`, the ledger (4, k), and slip of the
interface and of its points.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...effects import law_has_trait

# Number of samples between two progress reports. With so many, the cost of calling compiled code is
# negligible.
N_BLOCK_SAMPLES = 4096
# Ratio of created to dissipated energy below which the created energy is round-off.
ROUND_OFF_FRACTION = 1e-13


class SlideHistories(NamedTuple):
    """Histories of force, slip and energies along the bench path, at k samples.

    - force, load (k,): [N].
    - slip (k,): [m].
    - ledger (4, k): energies of `make_ledger` [J].
    - frames (f,): samples of the frames.
    - tau, local (f, m): traction [Pa] and slip [m] of the nodes in the frames.
    """

    force: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    ledger: np.ndarray
    frames: np.ndarray
    tau: np.ndarray
    local: np.ndarray


def make_ledger(work, stored, losses) -> np.ndarray:
    """Return work, stored, dissipated and created energy (4, k) [J] of k samples.

    Parameters
    ----------
    work, stored : (k,)
        Cumulative work and stored energy [J].
    losses : (k, 2)
        Created and dissipated energy of every step [J], summed over the points.
    """
    created, dissipated = np.cumsum(losses, axis=0).T
    created = created if created[-1] > ROUND_OFF_FRACTION * dissipated[-1] else 0 * created
    return np.stack([work, stored, dissipated, created])


def split_losses(losses) -> tuple:
    """Sum the created and the dissipated energy over m points.

    losses (..., m): dissipated energy of each point; a negative one is created energy.
    """
    return -np.minimum(losses, 0.0).sum(axis=-1), np.maximum(losses, 0.0).sum(axis=-1)


def elastic_slip(model, slide, force, load) -> np.ndarray:
    """Return the slip (k,) [m] of a rigid interface: displacement minus elastic bond stretch.

    The stretch is at most one bond length.

    Parameters
    ----------
    model : Model
    slide, force, load : (k,)
        [m], [N], [N].
    """
    length = _bond_length(model)
    static = model.friction.static
    stretch = length * np.divide(
        force, static * load, out=np.zeros_like(force), where=static * load > 0
    )
    return slide - np.clip(stretch, -length, length)


def local_slip(model, slide, tau, sigma) -> np.ndarray:
    """Return the slip (f, m) [m] of points under a common relative displacement.

    Parameters
    ----------
    model : Model
    slide : (f,)
        [m].
    tau : (f, m)
        Tractions [Pa].
    sigma : (m,) or (f, m)
        Pressures [Pa].
    """
    limit = np.broadcast_to(model.friction.static * sigma, tau.shape)
    return slide[:, None] - _bond_length(model) * np.divide(
        tau, limit, out=np.zeros_like(tau), where=limit > 0
    )


def _bond_length(model) -> float:
    """Return the bond length [m]; 0 for a law without elastic stretch."""
    if law_has_trait(model.friction.law, "averaged"):
        return 0.0
    return model.friction.bond_length or 0.0


@dataclass(frozen=True, slots=True)
class PassOptions:
    """Options and callbacks of one computation along a bench path.

    - choice: method of the sum over bonds; None: chosen by the pass.
    - say: callback for a line of text when something compiles.
    - progress: callback for the completed fraction.
    - springs: function that maps (stiffness, yield slide) of the elements of partial slip to those
      that are used; None: all of them.
    - modes: number of shear modes of the pieces; None: by the scene.
    """

    choice: object = None
    say: object = None
    progress: object = None
    springs: object = None
    modes: int | None = None

    def report(self, fraction: float) -> None:
        """Report the completed fraction (0 to 1) to the progress callback, if there is one."""
        if self.progress is not None:
            self.progress(fraction)


DEFAULT_OPTIONS = PassOptions()


class Slide(NamedTuple):
    """Relative displacement of an interface, sampled along a prescribed path for an engine.

    - model, patch: Model and its pressed Patch; None under [normal].
    - time, slide (k,): samples [s], [m].
    - frames: number of frames of the fields.
    - engine: BenchEngine.
    - options: PassOptions.
    """

    model: object
    patch: object
    time: np.ndarray
    slide: np.ndarray
    frames: int = 0
    engine: object = None
    options: PassOptions = DEFAULT_OPTIONS

    @property
    def frame_numbers(self) -> np.ndarray:
        """Indices of the samples with stored fields, without the first sample (the pressed state)."""
        if not self.frames:
            return np.zeros(0, int)
        numbers = np.linspace(0, self.slide.size - 1, self.frames + 1).round().astype(int)[1:]
        return np.unique(numbers[numbers > 0])
