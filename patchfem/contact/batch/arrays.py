"""What the compiled contacts of many cases work on, as named tuples of arrays."""

from typing import NamedTuple

import numpy as np


class Body(NamedTuple):
    """A compliance of m nodes and what is worked out along its left ends.

    c (m, m) [m/N]; x (m,) [m]; upper (m, m): factor of the nodes from a on, which is overwritten; side (2, m): U^-T of
    1 and of x; table (m + 1, 3, m + 1): of the stretches [a, stop) the sums of the first squared, of both and of the
    second squared, which are dN/d closing, -dN/d theta and -dM/d theta; room (m,): scratch.
    """

    c: np.ndarray
    x: np.ndarray
    upper: np.ndarray
    side: np.ndarray
    table: np.ndarray
    room: np.ndarray


class Cases(NamedTuple):
    """q problems on one body and what is found of them.

    begin, reach (q,): the first left end that is tried, and the node by which the contact is expected to have ended;
    gap (q, m) [m]; target (q, 3): load [N], moment [N m] about x = 0, spring [N m/rad]. Written are first, stop (q,):
    the stretch, a stop of 0 where none was found; force (q, m) [N]; moved (q, 2): closing [m] and theta [rad]; leave,
    fall (q, 2): of the left and of the right end the force of the last node over its rise per approach [m], and the
    fall of the gap at the next one per approach; left alone where the stretch ends with the interface.
    """

    begin: np.ndarray
    reach: np.ndarray
    gap: np.ndarray
    target: np.ndarray
    first: np.ndarray
    stop: np.ndarray
    force: np.ndarray
    moved: np.ndarray
    leave: np.ndarray
    fall: np.ndarray
