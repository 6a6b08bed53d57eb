"""A contact of the compiled loops slid along a given path, block by block."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...dynamics.march.capacity import full, keep, lengthened
from ...dynamics.march.march import GOAL
from ...dynamics.march.models import load_kernels
from .ledger import BLOCK, Watch, frame_numbers, ledger_of


@dataclass(frozen=True, eq=False, slots=True)
class Followed:
    """force, mean, stored: (k,) force at the samples [N], mean over the step that follows [N], energy stored [J];
    lost: (k - 1,) energy that a step does not store [J], below zero where it is created; at: (f,) numbers of the
    frames, states: the contact there; missed: steps that missed their residual."""

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
        """The energy book of the pass."""
        work = np.concatenate([[0.0], np.cumsum(self.mean[:-1] * np.diff(self.slide))])
        losses = np.zeros((self.slide.size, 2))
        losses[1:, 0], losses[1:, 1] = -np.minimum(self.lost, 0.0), np.maximum(self.lost, 0.0)
        return ledger_of(work, self.stored, losses)


def follow_path(model, time, slide, frames: int, watch: Watch, paced: bool = False) -> Followed:
    """Slide a ContactModel along the samples time [s], slide [m] (k,), with `frames` copies of its state on the way.

    paced: whether the law feels how fast it slides. Missing where a list of bonds outgrows its room.
    """
    loops = load_kernels(watch.say)
    contact = model.build()
    at = frame_numbers(slide.size, frames)
    turns = _new_pace(time) if paced else np.zeros(0, int)
    last = slide.size - 1
    edges = np.unique(np.concatenate([np.arange(0, last, BLOCK), at, turns, [last]]))
    forces, energies = np.zeros((slide.size, 3)), np.zeros((slide.size, 2))
    states, missed, told = [], 0, 0
    for a, b in pairwise(edges):
        kept = keep(contact)

        def slid(contact, a=a, b=b):
            dt = float(time[b] - time[a]) / float(b - a)
            return loops.follow_path(
                slide[a : b + 1].copy(),
                dt,
                model.kind,
                contact,
                GOAL * model.limit,
                energies[a : b + 1],
                forces[a : b + 1],
            )

        failed = slid(contact)
        while failed and full(contact):
            contact = lengthened(contact, kept, f"before sample {b} of the prescribed slide")
            failed = slid(contact)
        missed += failed
        if b in at:
            states.append((slide[b], next(iter(model.shown(contact).values()), None)))
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
    """Samples where the length of the time step changes."""
    step = np.diff(time)
    return 1 + np.flatnonzero(np.abs(np.diff(step)) > 1e-6 * np.minimum(step[1:], step[:-1]))
