"""Input of a bench engine, its result, and energies and slip along the path.

In: forces, losses and samples of a run. Out: `SlideHistories`, energies (4, k), and slip of the
interface and of its points.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...effects import law_has_trait

# Number of samples per block, after which the progress is reported. With this size the cost of
# calling compiled code is negligible.
N_BLOCK_SAMPLES = 4096
# Largest ratio of created to dissipated energy at which the created energy counts as round-off.
ROUND_OFF_FRACTION = 1e-13


class SlideHistories(NamedTuple):
    """Histories of force, slip and energies of a bench run, at k samples.

    - force, load (k,): friction force and normal load [N].
    - slip (k,): irreversible part of the displacement [m].
    - ledger (4, k): energies [J], see `stack_energies`.
    - frames (f,): indices of the samples with stored fields.
    - tau, local (f, m): traction [Pa] and slip [m] at the nodes in each frame.
    """

    force: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    ledger: np.ndarray
    frames: np.ndarray
    tau: np.ndarray
    local: np.ndarray


def stack_energies(work, stored, losses) -> np.ndarray:
    """Return work, stored, dissipated and created energy (4, k) [J] at k samples.

    Parameters
    ----------
    work, stored : (k,)
        Cumulative work and stored energy [J].
    losses : (k, 2)
        Created and dissipated energy of each step [J], summed over the points.
    """
    created, dissipated = np.cumsum(losses, axis=0).T
    created = created if created[-1] > ROUND_OFF_FRACTION * dissipated[-1] else 0 * created
    return np.stack([work, stored, dissipated, created])


def sum_losses_by_sign(losses) -> tuple:
    """Return the created and the dissipated energy, each summed over m points.

    `losses` (..., m) is the dissipated energy of each point; a negative value is created energy.
    """
    return -np.minimum(losses, 0.0).sum(axis=-1), np.maximum(losses, 0.0).sum(axis=-1)


def compute_interface_slip(model, slide, force, load) -> np.ndarray:
    """Return the slip (k,) [m] of a rigid interface, i.e. displacement minus elastic bond stretch.

    The stretch is limited to one bond length.

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


def compute_local_slip(model, slide, tau, sigma) -> np.ndarray:
    """Return the slip (f, m) [m] of the points of a rigidly moving interface.

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
class BenchOptions:
    """Options and callbacks of a bench run.

    - choice: method of bond summation; None: chosen automatically.
    - say: callback for messages about compilation.
    - progress: callback for the completed fraction.
    - springs: function that replaces the stiffnesses and yield displacements of the parallel
      elements; None: they are used unchanged.
    - modes: number of shear modes of the pieces; None: set by the scene or the tolerance.
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


DEFAULT_OPTIONS = BenchOptions()


class SlideTask(NamedTuple):
    """Input of a bench engine: model, patch, displacement path and options.

    - model, patch: Model, and its Patch or None for a single point.
    - time, slide (k,): samples of time [s] and relative displacement [m].
    - frames: number of output frames of the fields.
    - engine: BenchEngine.
    - options: BenchOptions.
    """

    model: object
    patch: object
    time: np.ndarray
    slide: np.ndarray
    frames: int = 0
    engine: object = None
    options: BenchOptions = DEFAULT_OPTIONS

    @property
    def frame_indices(self) -> np.ndarray:
        """Indices of the samples with stored fields; the initial state is not one of them."""
        if not self.frames:
            return np.zeros(0, int)
        numbers = np.linspace(0, self.slide.size - 1, self.frames + 1).round().astype(int)[1:]
        return np.unique(numbers[numbers > 0])
