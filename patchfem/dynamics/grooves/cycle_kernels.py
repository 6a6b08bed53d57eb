"""The loop of a law with memory along flanks over one cycle of a slide that repeats, compiled."""

from math import sqrt

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ..march.varying_friction_kernels import rub_commit, rub_state
from .contact_kernels import ALONG, KIND, LOAD, PATH, PLACE, pull, steep

LEAD = 32  # steps from rest to the first sample


@njit(error_model="numpy", **LEAN)
def kept(dq, q, c):
    """Slide the contact from q [m] over dq [m]; the force along the flank at its end [N]."""
    pull(dq, q, 1.0, c)
    bound, kind = c.force[0] * c.now[0], int(c.flank[KIND])
    after = min(max(2 * c.now_at[ALONG] - c.now_at[PLACE], -bound), bound)
    rub_commit(c.now_at[PATH] * dq, c.now_at[ALONG], 0.0, 0.0, 1.0, kind, c)
    c.before[0] = c.now[0]
    c.now_at[PLACE] = rub_state(kind, c, 0.0, 0.0)[0]
    return after


@njit(error_model="numpy", cache=True, **LEAN)
def cycle(q, c, along, normal, stretch, most, goal):
    """Slide the contact c (`contacts.arrays.Climbing`, no lifted mass) along the samples q (N,) [m] of a cycle until
    the force along the flank repeats to `goal` [N], `most` times at most: the cycles that it took.

    along, normal (N,): force along the flank and normal force there [N] at the samples; stretch (N,) [m] along the
    flank, what of the path there is elastic. The contact starts at rest at the slide 0. 0.3 us per sample and cycle.
    """
    n = q.size
    for i in range(LEAD):
        kept(q[0] / LEAD, i * (q[0] / LEAD), c)
    for turn in range(most):
        change = 0.0
        for i in range(n):
            j = i + 1 if i < n - 1 else 0
            after, end = kept(q[j] - q[i], q[i], c), steep(c.flank, q[j])
            change = max(change, abs(after - along[j])) if turn > 0 else goal + 1.0
            along[j] = after
            normal[j] = c.flank[LOAD] * sqrt(1 + end * end) + after * end
            stretch[j] = -rub_state(int(c.flank[KIND]), c, 0.0, 0.0)[2]
        if change <= goal:
            return turn + 1
    return most
