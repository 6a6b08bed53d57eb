"""A contact of the compiled loops slid along a given path, block by block."""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil

import numpy as np

from ...core import Missing
from ...dynamics.march.march import GOAL, MOST_STRIPS
from ...dynamics.march.models import load_kernels
from .ledger import frame_numbers, ledger_of
from .watch import BLOCK, Watch

AGED_PIECES = 17  # strips that a step of growing bonds may add besides those of its length


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


def follow(model, time, slide, frames: int, watch: Watch, paced: bool = False) -> Followed:
    """Slide a ContactModel along the samples time [s], slide [m] (k,), with `frames` copies of its state on the way.

    paced: whether the law feels how fast it slides. Missing where a list of bonds outgrows its room.
    """
    hub = load_kernels(watch.say)
    contact, work = model.build(hub)
    at = frame_numbers(slide.size, frames)
    turns = _new_pace(time) if paced else np.zeros(0, int)
    last = slide.size - 1
    edges = np.unique(np.concatenate([np.arange(0, last, BLOCK), at, turns, [last]]))
    forces, energies = np.zeros((slide.size, 3)), np.zeros((slide.size, 2))
    states, missed, told = [], 0, 0
    for a, b in pairwise(edges):
        contact = _with_room(contact, model, slide[a:b + 1])
        missed += hub.follow_path(slide[a:b + 1].copy(), float(time[b] - time[a]) / float(b - a), model.kind, contact,
                                  work, GOAL * model.limit, energies[a:b + 1], forces[a:b + 1])
        if missed and hasattr(contact, "bondlist"):
            raise Missing(f"the bond list outgrew {contact.bondlist.shape[1]} entries before sample {b} of the bench; "
                          "loosen accuracy.tail or accuracy.merge, or use reading = \"stretch\" with order = 1", "")
        if b in at:
            states.append((slide[b], next(iter(model.shown(contact).values()), None)))
        if b == last or b - told >= BLOCK:
            watch.tell(b / last)
            told = b
    return Followed(slide, forces[:, 0], forces[:, 1], energies[:, 1], forces[:, 2], energies[:-1, 0], at, states,
                    missed)


def _with_room(contact, model, slide):
    """The contact with a list of bonds that holds what the samples slide (k,) [m] may add."""
    if not hasattr(contact, "bondlist"):
        return contact
    have = contact.bondlist.shape[1]
    least = max(min(contact.growth[3], contact.growth[4]), 1e-3 * contact.growth[3])
    each = np.minimum(np.ceil(4 * np.abs(np.diff(slide)) / least), 4 * ceil(min(contact.law[6] / least, 1e6)) + 1)
    want = int(contact.tally[1] - contact.tally[0] + (each + AGED_PIECES).sum()) + 256
    if want <= have or have >= MOST_STRIPS:
        return contact
    wider = np.zeros((contact.bondlist.shape[0], min(max(want, 2 * have), MOST_STRIPS)))
    wider[:, :have] = contact.bondlist
    return contact._replace(bondlist=wider)


def _new_pace(time) -> np.ndarray:
    """Samples where the length of the time step changes."""
    step = np.diff(time)
    return 1 + np.flatnonzero(np.abs(np.diff(step)) > 1e-6 * np.minimum(step[1:], step[:-1]))
