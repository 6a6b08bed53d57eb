"""Response of a compiled contact model to a prescribed displacement, in blocks of samples.

In: a ContactModel and a `Slide`. Out: `PathResponse`.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...core import NotConverged
from ...dynamics.march.capacity import copy_state, enlarge_list, is_full
from ...dynamics.march.faces import STEP_TOL
from ...dynamics.march.models import load_instances
from .ledger import N_BLOCK_SAMPLES, Slide, SlideHistories, make_ledger


class PathResponse(NamedTuple):
    """Histories of a contact model under a prescribed displacement, at k samples.

    - force, slip (k,): [N], [m].
    - ledger (4, k): energies of `make_ledger` [J].
    - frames (f,): samples of the frames.
    - states: contact state in each frame.
    - n_failed: number of steps with too large a residual.
    """

    force: np.ndarray
    slip: np.ndarray
    ledger: np.ndarray
    frames: np.ndarray
    states: list
    n_failed: int

    def require_convergence(self) -> None:
        """Raise NotConverged if the residual of any step was too large."""
        if self.n_failed:
            raise NotConverged(
                f"in {self.n_failed} time steps of the prescribed slide the friction force has an error "
                "above the limit; raise accuracy.steps_per_cycle",
                "",
            )

    def histories(self, load: float, tau, local) -> SlideHistories:
        """Return the histories in the form of a bench run under constant load [N].

        Parameters
        ----------
        load : float
        tau, local : (f, m)
            Traction [Pa] and slip [m] of the nodes in the frames.
        """
        loads = np.full(self.force.size, load)
        return SlideHistories(self.force, loads, self.slip, self.ledger, self.frames, tau, local)


def follow_path(model, task: Slide, depends_on_speed: bool = False) -> PathResponse:
    """Compute the response of a ContactModel to the displacement path of a bench.

    Parameters
    ----------
    model : ContactModel
    task : Slide
    depends_on_speed : bool
        Whether the law depends on the speed.

    Raises
    ------
    Missing
        If a list of bonds exceeds its memory.
    """
    loops = load_instances(task.options.say)
    time = task.time
    slide = task.slide
    contact = model.build()
    frames = task.frame_numbers
    pace_changes = _find_step_changes(time) if depends_on_speed else np.zeros(0, int)
    last = slide.size - 1
    ends = np.unique(
        np.concatenate([np.arange(0, last, N_BLOCK_SAMPLES), frames, pace_changes, [last]])
    )
    forces = np.zeros((slide.size, 3))
    energies = np.zeros((slide.size, 2))

    def follow_block(contact, begin: int, end: int) -> int:
        """Compute the samples of a block and return the number of steps that did not converge.

        Parameters
        ----------
        contact
            Contact at the start of the block, which the computation changes.
        begin, end : int
            First and last sample.
        """
        block = slice(begin, end + 1)
        return loops.follow_path(
            slide[block].copy(),
            float(time[end] - time[begin]) / float(end - begin),
            model.kind,
            contact,
            STEP_TOL * model.limit,
            energies[block],
            forces[block],
        )

    states = []
    n_failed = 0
    reported = 0
    for begin, end in pairwise(ends):
        start = copy_state(contact)
        n_failed_in_block = follow_block(contact, begin, end)
        while n_failed_in_block and is_full(contact):
            contact = enlarge_list(contact, start, f"before sample {end} of the prescribed slide")
            n_failed_in_block = follow_block(contact, begin, end)
        n_failed += n_failed_in_block
        if end in frames:
            states.append((slide[end], next(iter(model.get_plot_fields(contact).values()), None)))
        if end == last or end - reported >= N_BLOCK_SAMPLES:
            task.options.report(end / last)
            reported = end
    work = np.concatenate([[0.0], np.cumsum(forces[:-1, 1] * np.diff(slide))])
    losses = np.zeros((slide.size, 2))
    losses[1:, 0] = -np.minimum(energies[:-1, 0], 0.0)
    losses[1:, 1] = np.maximum(energies[:-1, 0], 0.0)
    ledger = make_ledger(work, energies[:, 1], losses)
    return PathResponse(forces[:, 0], forces[:, 2], ledger, frames, states, n_failed)


def _find_step_changes(time) -> np.ndarray:
    """Return the indices of the samples at which the time step changes its length."""
    step = np.diff(time)
    return 1 + np.flatnonzero(np.abs(np.diff(step)) > 1e-6 * np.minimum(step[1:], step[:-1]))
