"""Contact of the compiled loops that follows a prescribed slide, in blocks of samples.

In: a ContactModel and samples of time and slide. Out: `Followed`.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...dynamics.march.capacity import copy_state, enlarge_list, is_full
from ...dynamics.march.faces import STEP_TOL
from ...dynamics.march.models import load_instances
from .ledger import BLOCK, PassOptions, frame_numbers, make_ledger


@dataclass(frozen=True, eq=False, slots=True)
class Followed:
    """Histories of a contact along a slide, at k samples.

    - slide (k,): [m].
    - force (k,): force at the samples [N].
    - mean (k,): mean force over the following step [N].
    - stored (k,): stored energy [J].
    - slip (k,): [m].
    - lost (k - 1,): energy that a step dissipates [J]; negative if it creates energy.
    - at (f,): samples of the frames.
    - states: contact state in each frame.
    - missed: number of steps with too large a residual.
    """

    slide: np.ndarray
    force: np.ndarray
    mean: np.ndarray
    stored: np.ndarray
    slip: np.ndarray
    lost: np.ndarray
    at: np.ndarray
    states: list
    missed: int

    @property
    def ledger(self) -> np.ndarray:
        """Energy balance of the pass (4, k) [J], as of `make_ledger`."""
        work = np.concatenate([[0.0], np.cumsum(self.mean[:-1] * np.diff(self.slide))])
        losses = np.zeros((self.slide.size, 2))
        losses[1:, 0], losses[1:, 1] = -np.minimum(self.lost, 0.0), np.maximum(self.lost, 0.0)
        return make_ledger(work, self.stored, losses)


def follow_path(
    model, time, slide, frames: int, watch: PassOptions, paced: bool = False
) -> Followed:
    """Slide a ContactModel along samples of time and slide.

    Parameters
    ----------
    model : ContactModel
    time, slide : (k,)
        [s], [m].
    frames : int
        Number of copies of its state that are kept.
    watch : PassOptions
    paced : bool
        Whether the law depends on the speed.

    Returns
    -------
    Followed

    Raises
    ------
    Missing
        If a list of bonds exceeds its memory.
    """
    loops = load_instances(watch.say)
    contact = model.build()
    at = frame_numbers(slide.size, frames)
    turns = _new_pace(time) if paced else np.zeros(0, int)
    last = slide.size - 1
    edges = np.unique(np.concatenate([np.arange(0, last, BLOCK), at, turns, [last]]))
    forces = np.zeros((slide.size, 3))
    energies = np.zeros((slide.size, 2))
    states = []
    missed = 0
    told = 0
    for a, b in pairwise(edges):
        kept = copy_state(contact)

        def slid(contact, a=a, b=b):
            """Follow the samples a to b; return the number of steps with too large a residual."""
            dt = float(time[b] - time[a]) / float(b - a)
            return loops.follow_path(
                slide[a : b + 1].copy(),
                dt,
                model.kind,
                contact,
                STEP_TOL * model.limit,
                energies[a : b + 1],
                forces[a : b + 1],
            )

        failed = slid(contact)
        while failed and is_full(contact):
            contact = enlarge_list(contact, kept, f"before sample {b} of the prescribed slide")
            failed = slid(contact)
        missed += failed
        if b in at:
            states.append((slide[b], next(iter(model.picture_fields(contact).values()), None)))
        if b == last or b - told >= BLOCK:
            watch.tell(b / last)
            told = b
    return Followed(
        slide,
        forces[:, 0],
        forces[:, 1],
        energies[:, 1],
        forces[:, 2],
        energies[:-1, 0],
        at,
        states,
        missed,
    )


def _new_pace(time) -> np.ndarray:
    """Return the samples at which the length of the time step changes."""
    step = np.diff(time)
    return 1 + np.flatnonzero(np.abs(np.diff(step)) > 1e-6 * np.minimum(step[1:], step[:-1]))
