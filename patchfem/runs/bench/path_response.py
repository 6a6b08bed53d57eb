"""Response of a compiled contact model to a prescribed displacement, in blocks of samples.

In: a ContactModel and a `SlideTask`. Out: a `PathResponse`.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...core import NotConverged
from ...dynamics.march.capacity import copy_state, enlarge_list, is_full
from ...dynamics.march.faces import STEP_TOL
from ...dynamics.march.models import load_instances
from .ledger import N_BLOCK_SAMPLES, SlideHistories, SlideTask, stack_energies


class PathResponse(NamedTuple):
    """Response of a contact model to a prescribed displacement, at k samples.

    - force, slip (k,): friction force [N] and slip [m].
    - ledger (4, k): energies [J], see `stack_energies`.
    - frames (f,): indices of the samples with stored fields.
    - states: displacement and state of the contact in each frame.
    - n_failed: number of steps whose residual exceeds the tolerance.
    """

    force: np.ndarray
    slip: np.ndarray
    ledger: np.ndarray
    frames: np.ndarray
    states: list
    n_failed: int

    def require_convergence(self) -> None:
        """Raise NotConverged if any step has too large a residual."""
        if self.n_failed:
            raise NotConverged(
                f"in {self.n_failed} time steps of the prescribed slide the friction force has an error "
                "above the limit; raise accuracy.steps_per_cycle",
                "",
            )

    def to_slide_histories(self, load: float, tau, local) -> SlideHistories:
        """Return the histories of a bench run under constant load.

        Parameters
        ----------
        load : float
        tau, local : (f, m)
            Traction [Pa] and slip [m] at the nodes in each frame.
        """
        loads = np.full(self.force.size, load)
        return SlideHistories(self.force, loads, self.slip, self.ledger, self.frames, tau, local)


def follow_path(model, task: SlideTask, depends_on_speed: bool = False) -> PathResponse:
    """Compute the response of a ContactModel to the prescribed displacement of a bench run.

    Parameters
    ----------
    model : ContactModel
    task : SlideTask
    depends_on_speed : bool
        Whether the friction law depends on the sliding speed.

    Raises
    ------
    Missing
        If a bond list exceeds the available memory.
    """
    loops = load_instances(task.options.say)
    time = task.time
    slide = task.slide
    contact = model.allocate_contact()
    frames = task.frame_indices
    step_changes = _find_step_changes(time) if depends_on_speed else np.zeros(0, int)
    last = slide.size - 1
    ends = np.unique(
        np.concatenate([np.arange(0, last, N_BLOCK_SAMPLES), frames, step_changes, [last]])
    )
    forces = np.zeros((slide.size, 3))
    energies = np.zeros((slide.size, 2))

    def follow_block(contact, begin: int, end: int) -> int:
        """Compute the response in a block of samples and return the number of failed steps.

        Parameters
        ----------
        contact
            State of the contact at the start of the block; updated in place.
        begin, end : int
            Indices of the first and the last sample.
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
    ledger = stack_energies(work, energies[:, 1], losses)
    return PathResponse(forces[:, 0], forces[:, 2], ledger, frames, states, n_failed)


def _find_step_changes(time) -> np.ndarray:
    """Return the indices of the samples at which the time step changes."""
    step = np.diff(time)
    return 1 + np.flatnonzero(np.abs(np.diff(step)) > 1e-6 * np.minimum(step[1:], step[:-1]))
