"""Arrays of the contacts that a march can meet: one law on one slide, points behind shear modes, a list of bonds."""

from typing import NamedTuple

import numpy as np


class Element(NamedTuple):
    """num (1, k), mem (1, l) as the law has them; last (2,): the last two slide increments [m]; eps (1,): bond length
    of the step [m]; bound (1,): largest force [N], infinite where none is."""

    num: np.ndarray
    mem: np.ndarray
    last: np.ndarray
    eps: np.ndarray
    bound: np.ndarray


class Sheared(NamedTuple):
    """Bond points (m,) of the stretch reading with p = 1 behind r shear modes.

    weight = mu_s area/eps_0, bonds (4, m) = m, z, s2, local slide, and play (5, m) where bonds stretch freely over the
    share growth[5] of their length; source (m,) [Pa]; growth (6,) of eq. 2.10; eps (2,): bond length [m] at the start
    and in the middle of the step; modes psi (r, m), kappa (r,) [N/m], coordinates b (r,) [m]. Scratch of the solve: y =
    (dq, db), out, trial, other, scale (1 + r,), hess (1 + r, 1 + r), points (3, m); last (2, 1 + r) two steps.
    """

    weight: np.ndarray
    bonds: np.ndarray
    source: np.ndarray
    growth: np.ndarray
    eps: np.ndarray
    psi: np.ndarray
    kappa: np.ndarray
    b: np.ndarray
    y: np.ndarray
    out: np.ndarray
    trial: np.ndarray
    other: np.ndarray
    scale: np.ndarray
    hess: np.ndarray
    points: np.ndarray
    last: np.ndarray


class Joints(NamedTuple):
    """Elements (e,) on ports (p,) beside a patch on port 0 where `there` (1,) is 1.

    beta (p, p) [m/N]; rows (p, n): slide of every port per coordinate; ports (e,); rubs (e,): 1 for friction, 0 for
    springs; num, mem (e, ...) as the laws have them, num[e, 0] which law; bound (e,) [N], infinite where nothing
    bounds it; goal (1 + e,) [N] of the patch and the elements; give (n,) [m/N] of the coordinates. State: last (e, 2)
    slide increments, forces (e,), own (2,): force of the patch and its last increment. Scratch: free (p,); q, v, eps,
    dq, miss (e,); system (e, e); room (3, n); hess (n, n).
    """

    there: np.ndarray
    beta: np.ndarray
    rows: np.ndarray
    ports: np.ndarray
    rubs: np.ndarray
    num: np.ndarray
    mem: np.ndarray
    bound: np.ndarray
    goal: np.ndarray
    give: np.ndarray
    last: np.ndarray
    forces: np.ndarray
    own: np.ndarray
    free: np.ndarray
    q: np.ndarray
    v: np.ndarray
    eps: np.ndarray
    dq: np.ndarray
    miss: np.ndarray
    system: np.ndarray
    room: np.ndarray
    hess: np.ndarray


class BondList(NamedTuple):
    """One list of bonds for a slide that all share: force = mu_s N [N]; bondlist (10, capacity), now (6,), tally (12,),
    law (24,), table (k,) as in friction.bonds.list_kernels; growth (6,) of eq. 2.10; last (2,) slide increments [m];
    bound (1,): largest force [N]."""

    force: np.ndarray
    bondlist: np.ndarray
    now: np.ndarray
    tally: np.ndarray
    law: np.ndarray
    table: np.ndarray
    growth: np.ndarray
    last: np.ndarray
    bound: np.ndarray
