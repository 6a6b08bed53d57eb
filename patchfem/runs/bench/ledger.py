"""Energy book of a bench, its frames, and the refusal of sums that would take too long."""

import numpy as np

from ...core import Missing

MOST_WORK = 2e11  # strip-point products of a direct quadrature beyond which a bench is refused


def ledger_of(work, stored, losses) -> np.ndarray:
    """(4, k): work, stored, dissipated and created energy [J] of samples, from the (gain, loss) (k, 2) [J] of every
    step over the points that create energy and those that lose it."""
    created, dissipated = np.cumsum(losses, axis=0).T
    created = created if created[-1] > 1e-13 * dissipated[-1] else 0 * created  # round-off
    return np.stack([work, stored, dissipated, created])


def _split(losses) -> tuple:
    """(created, dissipated) of the energy that places lose, some of it below zero."""
    return -np.minimum(losses, 0.0).sum(), np.maximum(losses, 0.0).sum()


def _frame_numbers(count: int, frames: int) -> np.ndarray:
    """Samples of the frames; the first sample is the pressed state, which is a frame of its own."""
    at = np.linspace(0, count - 1, frames + 1).round().astype(int)[1:]
    return np.unique(at[at > 0]) if frames else np.zeros(0, int)


def _refuse_costly(scene, law, samples: int, points: int, slide) -> None:
    if not hasattr(law, "weights"):
        return
    reach = 25 * scene.friction.bond_length
    per_step = max(float(np.abs(np.diff(slide)).mean()), 1e-300)
    strips = min(samples, 2 * reach / per_step + 64)
    if 6 * strips * samples * points > MOST_WORK:
        raise Missing(f"{scene.path}: the direct quadrature would form {6 * strips * samples * points:.1e} products, "
                      f"more than {MOST_WORK:.0e}; lower accuracy.steps_per_cycle or slide.cycles")
