"""Arrays of the loops of one mode, and when they serve."""

import numpy as np

from ...compiled import kernels
from ..piecewise.elements import Memory, Table
from ..piecewise.plant import Books, Clock, Plant
from .names_kernels import DAMPING, FACE, MASS, MOST, NUMBERS, REPEATS, RING, SEGMENT, SQUARE, SWING

series, kinds = kernels("dynamics.piecewise.series_kernels"), kernels("dynamics.piecewise.drive_kernels")
march, wholes = kernels("dynamics.piecewise.march_kernels"), kernels("dynamics.piecewise_one.whole_kernels")

WHOLES = 2  # numbers of slipping elements for which whole pieces are known
__all__ = ["NUMBERS", "REPEATS", "RING", "SWING"]
# least angle [rad] that what rings turns in a stick: a ring is told of 1.5 periods, and a fit that leaves a tenth of it
# over is off by tenths of a radian where elements yield one by one and the frequency falls
RINGS = 0.95 * 3 * np.pi


def serves(plant: Plant, clock: Clock, travel: float) -> bool:
    """Whether these loops take a run: one mode, one interface that it moves, sines, no travel of the output."""
    one = len(plant.square) == 1 and len(plant.reach) == 1 and plant.faces[0, 0] != 0
    return bool(one and travel == np.inf and np.all(clock.segments[:, 2] == kinds.SINE))


def rig_of(plant: Plant) -> np.ndarray:
    """Numbers (6,) of a rig by the places SQUARE to MASS."""
    return np.array([plant.square[0], plant.damping[0, 0], plant.faces[0, 0], plant.base[0], plant.output[0],
                     plant.mass])


def room_of() -> tuple:
    """Room of the loop: lines (4, w), hulls of the search for roots, and what is known of whole pieces for the number
    of elements that slip."""
    return (np.zeros((4, series.MOST + 8)), np.zeros((series.DEEP + 2, series.WIDE)),
            np.zeros((WHOLES, wholes.LINES, wholes.LONG)))


def last_of(most: int) -> np.ndarray:
    """Room (4, t + 2) for the state one period before, of at most so many elements: none yet."""
    last = np.zeros((4, max(most + 2, REPEATS + 1)))
    last[0, SEGMENT] = -1.0
    return last


def memory_of(most: int) -> Memory:
    """Room for the memory of at most so many elements."""
    lists = [np.zeros((1, most + 2), kind) for kind in (np.int64, float, float)]
    zeros = [np.zeros(1) for _ in range(6)]
    return Memory(zeros[0], np.zeros(1, np.int64), zeros[1], np.ones(1, np.int64), *lists, *zeros[2:], np.zeros(1))


def search_room(most: int) -> tuple:
    """Room of `steady_kernels.settled` for at most so many elements."""
    return tuple(memory_of(most) for _ in range(4)), np.zeros((8, MOST)), np.zeros((5, 16, 16))


def work_of(most: int, cycles: int, wanted, rows: int) -> tuple:
    """All that `batch_kernels.runs` works in: for at most so many elements and rows of the window; wanted (c,): 1 for
    cycles with a phasor."""
    table = Table(np.zeros(1, np.int64), np.zeros((1, most + 1)), *np.zeros((3, 1, most + 1)))
    clock = Clock(np.zeros(6), np.zeros((1, 10)), np.ones(1), np.zeros(2))
    books = Books(np.zeros(8), np.zeros((cycles, 2)), np.zeros((cycles, 2)), np.array(wanted, float),
                  np.array([np.inf, 0.0]))
    return (table, np.zeros((2, 1)), memory_of(most), clock, books, last_of(most), room_of(),
            np.zeros((rows, march.HEAD + 2 + march.EACH)), search_room(most), np.zeros(10))


def ring_of(rig, stiff, amplitude) -> tuple:
    """(amplitude, frequency [rad/s], damping ratio) of what rings while an element of stiffness stiff [N/m] holds; 0
    where nothing does. rig (..., 6), stiff and amplitude (...)."""
    beta = rig[..., SQUARE] + stiff * rig[..., FACE]**2 / rig[..., MASS]
    half = rig[..., DAMPING] / 2
    own = np.sqrt(np.maximum(beta - half**2, 0.0))
    return np.where(own > 0, amplitude, 0.0)[()], own, half / np.sqrt(beta)
