"""Contact points along a prescribed slide: the march without modes."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..friction.bonds.strip_rows_kernels import ListState
from .contacts import Contact
from .march_rows_kernels import N_PORT_COLUMNS, Sample, Total
from .systems import make_system
from .time_march import Snapshot, load_kernels, make_snapshot, split_losses

BLOCK = 4096  # samples between two reports of the progress
SAME_STEP = 1e-6  # relative change of the duration of a step below which steps are equal


class SlideMotion(NamedTuple):
    """Friction along a prescribed slide at k samples.

    - force, slip (k,): friction force [N] and slip [m]
    - mean (k - 1,): mean force of each step [N]
    - stored (k,): stored energy [J]
    - losses (k - 1,): dissipated energy of each step [J], below 0 if energy is created
    - snapshots: states of the points at the frames
    - n_unsolved: number of steps that did not converge
    - join_error: largest error of a join that made room in a full list of bonds, relative to the load
    """

    force: np.ndarray
    slip: np.ndarray
    mean: np.ndarray
    stored: np.ndarray
    losses: np.ndarray
    snapshots: list[Snapshot]
    n_unsolved: int
    join_error: float = 0.0


def follow(contact: Contact, time, slide, frames=(), say=None, report=None) -> SlideMotion:
    """Move contact points along a prescribed slide of the first port.

    Parameters
    ----------
    contact : Contact
        Laws and loads of the points.
    time, slide : (k,) array
        Samples of time [s] and slide [m].
    frames : sequence of int
        Samples at which the state of the points is returned.
    say, report : callable, optional
        Callbacks for a line of text and for the completed fraction.
    """
    kernels = load_kernels(contact, say)

    # Blocks of samples with one step each; a block ends at every sample whose state is asked for.
    time = np.asarray(time, float)
    slide = np.asarray(slide, float)
    last = slide.size - 1
    system = make_system(contact, 1.0)
    steps = np.diff(time)
    changes = 1 + np.flatnonzero(
        np.abs(np.diff(steps)) > SAME_STEP * np.minimum(steps[1:], steps[:-1])
    )
    ends = np.unique(
        np.concatenate([np.arange(0, last, BLOCK), np.asarray(frames, int), changes, [last]])
    )

    # A row has energies and loads, and of each port the force, the slip and the mean force of the next step.
    width = Sample.PORTS + N_PORT_COLUMNS * len(contact.point_sets)
    rows = np.zeros((slide.size, width))
    snapshots = []

    for begin, end in pairwise(ends):
        # The slide is prescribed on the first port, so that the march has a path in place of a drive.
        size = end - begin
        structure = system.structure._replace(
            path=slide[begin : end + 1].copy(), drive=np.zeros((size + 1, 3))
        )
        if contact.load is not None:
            structure = structure._replace(
                loads=np.asarray(contact.load(time[begin : end + 1]), float)
            )

        step = float(time[end] - time[begin]) / size
        options = system.options._replace(step=step if step > 0 else 1.0)
        system = system._replace(structure=structure, options=options)
        samples = np.zeros((size + 1, width))
        kernels.march(system, size, samples)
        rows[begin : end + 1] = samples
        if end in frames:
            force, slip = samples[-1, Sample.PORTS : Sample.PORTS + 2]
            motion = (float(time[end]), float(slide[end]), force, slip, 0.0, 0.0)
            snapshots.append(make_snapshot(system, contact.first_sets, motion))
        if report is not None:
            report(end / last)

    join_error = 0.0
    if system.options.has_lists:
        join_error = float(system.points.lists.states[:, ListState.JOIN_ERROR].max(initial=0.0))
    return SlideMotion(
        rows[:, Sample.PORTS],
        rows[:, Sample.PORTS + 1],
        rows[:-1, Sample.PORTS + 2],
        rows[:, Sample.ENERGY],
        split_losses(rows, 0, system.options.scale),
        snapshots,
        int(system.totals[Total.UNSOLVED]),
        join_error,
    )
