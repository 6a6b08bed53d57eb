"""Bond laws of points that move alike, as objects for a prescribed motion (`friction.protocol`).

In: increments of relative displacement and pressures. Out: path-mean tractions, dissipated energies and states. The
compiled functions are those of `points_kernels`.
"""

from dataclasses import dataclass
from math import inf

import numpy as np

from ... import compiled
from ..protocol import Step
from .list_numbers import (
    cutoff_age,
    enlarge_lists,
    gamma_table,
    law_numbers,
    make_path_state,
    make_status,
)
from .list_rows_kernels import N_ROWS, STATUS, STRIP, BondList
from .parameters import Bonds, growth_numbers
from .point_rows_kernels import MOMENT

# Number of columns of a list before any motion; it is doubled when the list is full
N_FIRST_STRIPS = 32


@dataclass(frozen=True, slots=True)
class FirstOrderBonds:
    """Bonds of order p = 1 for friction.reading = "stretch", known by their moments; exact for any step.

    A state is an array (4, m): m [Pa], z [Pa m], s2 [Pa m2] and the bond length [m] of every point, rows of `MOMENT`.
    Tractions (m,) [Pa] are positive against slip.
    """

    law: Bonds

    def initial_state(self, sigma) -> np.ndarray:
        """Return unstretched bonds of density m_0 under a pressure (m,) [Pa]."""
        moments = np.zeros((4, np.size(sigma)))
        moments[MOMENT.m] = self.law.initial * np.asarray(sigma, float)
        moments[MOMENT.length] = self.law.length
        return moments

    def step(self, state: np.ndarray, dq: float, s0, s1, dt: float) -> Step:
        """Advance the bonds by an increment under a pressure that changes along it.

        New bonds form at the mean pressure. All bonds are lost where the step ends without pressure.

        Parameters
        ----------
        state : (4, m) array
            Moments and bond lengths of the points.
        dq : float
            Increment [m].
        s0, s1 : (m,) array
            Pressures at the ends [Pa].
        dt : float
            Duration [s].

        Returns
        -------
        Step
        """
        after = state.copy()
        out = np.zeros((2, state.shape[1]))
        kernels = compiled.load("friction.bonds.points_kernels")
        kernels.advance_moments(
            after, float(dq), _as_array(s0), _as_array(s1), float(dt), growth_numbers(self.law), out
        )
        return Step(*(self._stiffness * out), after)

    def press(self, state: np.ndarray, s0, s1) -> Step:
        """Change the pressure at rest; energy that is no longer stored is lost.

        Parameters
        ----------
        state : (4, m) array
            Moments and bond lengths of the points.
        s0, s1 : (m,) array
            Pressures before and after [Pa].

        Returns
        -------
        Step
            Its mean is the traction after the change.
        """
        after = state.copy()
        out = np.zeros((2, state.shape[1]))
        compiled.load("friction.bonds.points_kernels").press_moments(
            after, _as_array(s0), _as_array(s1), self.law.initial, self.law.length, out
        )
        return Step(*(self._stiffness * out), after)

    @property
    def _stiffness(self) -> float:
        """Traction per moment z: mu_s/eps_0 [1/m]."""
        return self.law.static / self.law.length

    def traction(self, state: np.ndarray):
        """Return the traction mu_s z/eps_0 (m,) [Pa], positive against slip."""
        return self._stiffness * state[MOMENT.z]

    def stored_energy(self, state: np.ndarray):
        """Return the elastic energy per area mu_s s2/(2 eps_0) (m,) [J/m2]."""
        return self._stiffness / 2 * state[MOMENT.s2]


@dataclass(frozen=True, slots=True)
class ListedBonds:
    """Bonds of any order and reading, summed over a list of strips that all points share.

    - law: parameters of the bonds
    - tail: largest fraction of the friction limit that the cut-off may leave out; 0 keeps every bond
    - merge: largest width of a joined strip of age 0 [bond lengths]; 0 joins nothing

    A state is a `BondList`. Tractions (m,) [Pa] are positive against slip. For reading="stretch" the mean traction comes
    from the energy balance, so no step creates energy.
    """

    law: Bonds
    tail: float = 1e-9
    merge: float = 0.0

    def initial_state(self, sigma) -> BondList:
        """Return unstretched and fully grown bonds of density m_0 under a pressure (m,) [Pa]."""
        law = self.law
        sigma = np.atleast_1d(np.asarray(sigma, float))
        reach = cutoff_age(law.order, self.tail) if self.tail > 0 else inf
        strips = np.zeros((N_ROWS + sigma.size - 1, N_FIRST_STRIPS))
        strips[STRIP.pressure :, 0] = sigma
        status = make_status(N_FIRST_STRIPS)
        status[STATUS.initial_pressure] = sigma[0]
        return BondList(
            strips,
            make_path_state(law),
            status,
            law_numbers(law, reach, self.merge),
            gamma_table(law),
            growth_numbers(law),
        )

    def step(self, state: BondList, dq: float, s0, s1, dt: float) -> Step:
        """Advance the bonds by an increment under a pressure that changes along it.

        New bonds form at the mean pressure. All bonds are lost where the step ends without pressure.

        Parameters
        ----------
        state : BondList
            List that all points share.
        dq : float
            Increment [m].
        s0, s1 : (m,) array
            Pressures at the ends [Pa].
        dt : float
            Duration [s].

        Returns
        -------
        Step
        """
        advance = compiled.load("friction.bonds.points_kernels").advance_list
        return self._change(state, advance, float(dq), _as_array(s0), _as_array(s1), float(dt))

    def press(self, state: BondList, s0, s1) -> Step:
        """Change the pressure at rest (`list_step_kernels.release`).

        Parameters
        ----------
        state : BondList
            List that all points share.
        s0, s1 : (m,) array
            Pressures before and after [Pa].

        Returns
        -------
        Step
            Its mean is the traction after the change.
        """
        press = compiled.load("friction.bonds.points_kernels").press_list
        return self._change(state, press, _as_array(s0), _as_array(s1))

    def _change(self, state: BondList, change, *arguments) -> Step:
        """Apply a compiled change to a copy of the state, with larger lists where they do not suffice.

        `change(state, *arguments, out)` writes traction and dissipation per mu_s into `out` and returns whether the list
        was large enough.
        """
        capacity = state.bondlist.shape[1]
        while True:
            status = state.status.copy()
            strips = enlarge_lists(state.bondlist, status[None], capacity)
            after = state._replace(bondlist=strips, now=state.now.copy(), status=status)
            out = np.zeros((2, len(strips) - STRIP.pressure))
            if change(after, *arguments, out):
                return Step(*(self.law.static * out), after)
            capacity *= 2

    def traction(self, state: BondList) -> np.ndarray:
        """Return the traction (m,) [Pa], positive against slip."""
        return self._sum(state, STRIP.present_force)

    def stored_energy(self, state: BondList) -> np.ndarray:
        """Return the elastic energy per area (m,) [J/m2] with the present damage of the bonds."""
        return self._sum(state, STRIP.present_energy)

    def _sum(self, state: BondList, row: int) -> np.ndarray:
        """Return mu_s times the sum of a row of the strips and of the initial bonds, weighted by their pressures."""
        columns = np.arange(int(state.status[STATUS.head]) - 1, int(state.status[STATUS.end]))
        columns[0] = state.status[STATUS.first_column]
        strips = state.bondlist
        return self.law.static * (strips[STRIP.pressure :, columns] @ strips[row, columns])


def _as_array(pressure) -> np.ndarray:
    """Return pressures as a contiguous array of floats."""
    return np.ascontiguousarray(pressure, float)
