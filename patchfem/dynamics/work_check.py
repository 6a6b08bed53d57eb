"""A check of the friction work: that off the samples alone, with which the ledger of an engine must agree.

A ledger and the energy balance built from it share one path mean, so neither shows a mean that is wrong. The
trapezoidal rule on slide and force as they are sampled knows nothing of it.
"""

import numpy as np

NOTHING = 1e-18  # J, the work of what stands still
ROUND = 1e-10  # of the energy that passes through a run, below which friction work is round-off


def sampled_work(slide, force, after=None) -> np.ndarray:
    """Friction work (k - 1,) [J] of the steps between samples, by the trapezoidal rule int F dq.

    slide (k,) [m]; force (k,) [N], > 0 against positive slip; after (k - 1,) [N]: force of the step that follows a
    sample, of friction that jumps where the slide starts or turns. It stands for the sample there, which may hold the
    force before the jump.
    """
    move, ends = np.diff(slide), force[:-1] + force[1:]
    if after is not None:
        way = np.sign(move)
        turned = (way != 0) & (way != np.append(0.0, way[:-1]))
        ends = np.where(turned, 2 * after, ends)
    return ends * move / 2


def gap(sampled, booked, passed, energy=0.0):
    """Relative gap [1] of samples and ledger: |sampled - booked| over the work that went to and fro; 0 where none did.

    sampled, booked: friction work [J]; passed: sum of its sizes [J]; energy [J] that passed through the whole run, of
    which ROUND counts besides, so that a stuck interface shows no round-off. Numbers of one run, or (n,) of many.
    """
    apart = np.abs(sampled - booked)
    return share(apart * (apart > NOTHING), passed + ROUND * energy)


def share(part, whole):
    """part/whole, 0 where nothing is the whole; numbers or (n,)."""
    some = np.asarray(whole) > 0
    return (part / np.where(some, whole, 1.0) * some)[()]
