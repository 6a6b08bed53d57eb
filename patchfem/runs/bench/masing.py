"""Friction along a prescribed slide by Masing's rules, for parallel elements under a constant load.

With the force B(x) of first loading, the branch from a reversal at (q_r, F_r) in the direction d is
F = F_r + 2 d B(d (q - q_r)/2). It ends where it meets the branch before the last one (Madelung's rule), which goes on. A
steady loop of the amplitude x has the area S = 4 (2 A - x B) with A = int B dx. So a branch of the length 2 x does the work
2 F_r d x + 4 A, of which S/2 is dissipated.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np


class MasingHistory(NamedTuple):
    """Friction along a slide at k samples.

    - force (k,): friction force [N].
    - slip (k,): mean slip of the elements, weighted by their slip forces [m].
    - work, loss (k,): work of the friction force and dissipated energy since the start [J].
    """

    force: np.ndarray
    slip: np.ndarray
    work: np.ndarray
    loss: np.ndarray


class _Branch(NamedTuple):
    """Branch of a path: place [m] and force [N] of its start, direction, and length over amplitude, 1 on first loading."""

    place: float
    force: float
    direction: float
    ratio: float

    def follow(self, find_loop, limit: float, slide) -> np.ndarray:
        """Return force [N], and slip [m], work and loss [J] since the start of the branch, (4, k).

        Parameters
        ----------
        find_loop : callable
            Function of amplitudes (k,) [m] that returns the steady loops.
        limit : float
            Force at which all elements slip [N].
        slide : (k,) array
            Slides [m].
        """
        moved = np.asarray(slide) - self.place
        x = np.abs(moved) / self.ratio
        loop = find_loop(x)
        loss = self.ratio * loop.area / 4
        work = self.force * moved + self.ratio**2 * (loop.area / 8 + x * loop.force / 2)
        force = self.force + self.ratio * self.direction * loop.force
        # Elements without friction slip as far as they are moved.
        slip = self.direction * loss / limit if limit > 0 else moved
        return np.array([force, slip, work, loss])


def follow_masing(find_loop, limit: float, slide) -> MasingHistory:
    """Return the friction of parallel elements along a slide (k,) [m] that starts from rest.

    Parameters
    ----------
    find_loop : callable
        Function of amplitudes (k,) [m] that returns the `friction.SteadyLoop`s (k,) of the elements.
    limit : float
        Force at which all elements slip [N].
    slide : (k,) array
        Samples of the slide [m].
    """
    values = np.zeros((4, slide.size))
    branches: list[_Branch] = []
    for begin, end in pairwise([0, *find_turns(slide), slide.size - 1]):
        direction = float(np.sign(slide[end] - slide[begin]))
        ratio = 2.0 if branches else 1.0
        branches.append(_Branch(slide[begin], values[0, begin], direction, ratio))

        # Slip, work and loss up to the start of the branch; its force is not a sum.
        before = values[:, begin] * [0, 1, 1, 1]
        first = begin + 1
        while first <= end:
            stop = _find_end(branches, slide[0])
            count = np.searchsorted(direction * slide[first : end + 1], direction * stop, "right")
            part = slice(first, first + int(count))
            values[:, part] = branches[-1].follow(find_loop, limit, slide[part]) + before[:, None]
            first = part.stop
            if first <= end:
                # The loop is closed, so that both of its branches are forgotten.
                before += branches[-1].follow(find_loop, limit, [stop])[:, 0]
                del branches[-2:]
                if not branches:
                    branches.append(_Branch(slide[0], 0.0, direction, 1.0))
                before -= branches[-1].follow(find_loop, limit, [stop])[:, 0]
                before[0] = 0.0
    return MasingHistory(*values)


def _find_end(branches: list[_Branch], origin: float) -> float:
    """Return the place [m] where the last branch meets the one before the last, or first loading in the other direction."""
    last = branches[-1]
    if len(branches) == 1:
        return last.direction * np.inf
    if len(branches) == 2:
        return 2 * origin - last.place
    return branches[-2].place


def find_stretches(yields, slide, frames) -> list[tuple[float, np.ndarray]]:
    """Return the slide [m] and the stretches (t,) [m] of elements at some samples of a slide.

    Parameters
    ----------
    yields : (t,) array
        Yield displacements of the elements [m].
    slide : (k,) array
        Samples of the slide [m].
    frames : (f,) array of int
        Indices of the samples.
    """
    # A stretch follows the slide up to its yield displacement; only reversals and frames matter.
    places = np.union1d(find_turns(slide), frames)
    stretch = np.zeros(yields.size)
    found = {}
    for begin, end in pairwise([0, *places.tolist()]):
        stretch = np.clip(stretch + slide[end] - slide[begin], -yields, yields)
        found[end] = float(slide[end]), stretch
    return [found[frame] for frame in np.asarray(frames).tolist()]


def find_turns(slide) -> np.ndarray:
    """Return the indices of the samples of a slide (k,) [m] at which its direction changes."""
    moves = np.diff(slide)
    moving = np.flatnonzero(moves)
    return moving[1:][np.diff(np.sign(moves[moving])) != 0]
