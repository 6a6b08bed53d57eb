"""What every law of friction returns for a step, and how it hands itself to compiled code.

A law under a pressure that changes is start(sigma) -> state, step(state, dq, s0, s1, dt) -> Step for an increment of
slide over a pressure that changes along the way, and press(state, s0, s1) -> Step for a pressure that changes in time
at rest. Laws of constant load (Iwan, Bouc-Wen, LuGre) have only their Element. None of them changes the state it was
given. No traction outlives the contact, and at rest none exceeds mu sigma.

element(load) -> Element is the same law of a whole contact for the loops. The kernels that an Element names are a
module with three compiled functions of one signature, num (e, k) and mem (e, k) the numbers and memories of e contacts:
mean(num, mem, e, q, dq, eps, dt) -> (path-mean force [N], its slope over dq [N/m]) over an increment dq [m] in dt [s];
commit(num, mem, e, dq, force, v0, v1, dt, eps) -> energy dissipated [J], which moves the memory over that increment;
state(num, mem, e, q, v) -> (force [N], stored energy [J], irreversible part of the slide q [m]).
closed(num, mem, e, free, beta) -> (dq, path-mean force, whether it is) is a step dq = free - beta force solved without
an iteration; that of `flags_kernels` says that there is none. A law whose bonds grow has middle(num, mem, e, v, dt) ->
eps [m] besides, the bond length of the step. num[e, 0] is left to the loops. What a law is carried by besides asks for
more: press in varying loads; at_end(num, e, before, speed, travel) -> (force, slopes over speed and travel) at the end
of a step in comparison methods; of form "flow" in harmonic balance flow(num, e, z, dq, dt) -> (stretch z [m] after, its
slopes over z, dq and dt) and pull(num, e, z, v) -> (force, its slopes over z and v).

A law that is smooth between reversals may offer its rates, for integrators of high order: an Element with `sizes`, the
size of each of the l states y that move with time. turn (3,) holds the direction of the slide, the path [m] to the next
kink and 1 above, 0 below the speed of the knee; dq [m] is the slide since the motion began. begin(num, mem, way, y) ->
path to the next kink sets y from the memory; rate(num, mem, turn, dq, v, y, out) -> force [N] writes dy/dt into out;
shown(num, mem, turn, dq, q, v, y) -> (force, stored energy, irreversible part of q); finish(num, mem, turn, dq, v, y)
-> energy dissipated [J], or nan, moves the memory; knee(num) -> speed [m/s] at which the rates have a kink, 0 for none.
Its irreversible part of q turns where q does or the force passes zero. A law that holds the slide at rest has
SET_VALUED true: gives(num, turn) -> direction in which it lets go, 0 where it holds; of turn it takes besides what
`dynamics.smooth.arrays` lists, and its last two states are what is left of its hold and of its load [N], by their rates
alone. That of `flags_kernels` belongs to laws that hold nothing.

A law of one stretch z may march in lanes (`dynamics.lanes`): flowing(k, z, v, way) -> (force, dz/dq in the direction
`way`, slopes of the force over z and v) is all of it without an array or a branch, so that cases stand side by side; k
are its numbers, in the UNITS. BENDS says that dz/dq has a kink at z = 0; FOLLOWS that z follows the slide in closed
form: after(k, z, square, dx, way) -> (z, mean square of the stretches, work) after a slide dx; LAYERS that the force
changes within a layer of the speed: layer(k, h) -> (force beyond it, speed at its edge, change of the speed in a part
of a step h through it).
"""

from typing import NamedTuple

import numpy as np


class Step(NamedTuple):
    """What a law returns for one increment.

    mean: (m,) traction averaged over the path of the increment [Pa], > 0 against slip towards +x; dissipated: (m,)
    energy per area [J/m2], below zero only where a law creates energy; state: of the law after the step, the one before
    is unchanged.
    """

    mean: np.ndarray
    dissipated: np.ndarray
    state: object


class LastTraction:
    """Base of the laws in which nothing stretches: their state is the last traction (m,) [Pa].

    Each has `limit(sigma, way)`, `share(dq, dt)` and `step` of its own.
    """

    __slots__ = ()
    at_once = True  # a changing load is taken along with the motion

    def start(self, sigma):
        """State before any motion: no traction, under a pressure sigma (m,) [Pa]."""
        return np.zeros_like(sigma)

    def press(self, state, s0, s1) -> Step:
        """The law at rest while the pressure goes from s0 to s1 (m,) [Pa]: the traction is cut to its limit there.

        The mean of the Step is the traction after it; nothing is dissipated.
        """
        most = self.limit(s1, 1.0)
        held = np.clip(state, -most, most)
        return Step(held, np.zeros_like(held), held)

    def traction(self, state):
        """Traction (m,) [Pa] at the end of the last step, > 0 against slip towards +x."""
        return state

    def stored(self, state):
        """Elastic energy per area (m,) [J/m2]: none, as nothing stretches."""
        return np.zeros_like(state)


class Element(NamedTuple):
    """A law on one contact as compiled code takes it.

    kernels: module of its compiled form in this package; numbers (k,), the first one free, and memory (l,) at the
    start; limit: largest force [N], or the size of the force where none is largest; length [m]: slide over which it
    stretches before it slips, 0 where nothing stretches; bounded: whether no force exceeds the limit. form: what the
    memory is made of, for engines that look inside: "parallel" elements side by side, "points" of bonds, "places" of
    bonds under the pressure of the lower piece, "speed" alone and no memory, "flow" of one number, or "". sizes:
    typical magnitudes of the states where the law is rate equations, None where it is not.
    """

    kernels: str
    numbers: np.ndarray
    memory: np.ndarray
    limit: float
    length: float = 0.0
    bounded: bool = True
    form: str = ""
    sizes: tuple | None = None
