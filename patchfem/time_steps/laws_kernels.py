"""Functions of the laws by their numbers (compiled)."""

from ..kernel_cache.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..kernel_cache.jit import njit
from . import no_law_kernels as own
from .bonds_kernels import slide_bonds
from .bouc_wen_kernels import slide_bouc_wen
from .cells_kernels import slide_cells, slide_sliders
from .springs_kernels import slide_cubic, slide_interlock
from .step_rows_kernels import Law
from .tanh_kernels import slide_tanh


@njit(**NJIT_CALL)
def slide_points(law, numbers, memory, trial, values, count, step):
    """Slide a block of points of a law; the package describes the arguments (`time_steps`).

    A point of rigid friction (`Law.COULOMB`) is solved with its port.
    """
    if law == Law.CELLS:
        slide_cells(numbers, memory, trial, values, count, step)
    elif law == Law.SLIDERS:
        slide_sliders(numbers, memory, trial, values, count, step)
    elif law == Law.BONDS:
        slide_bonds(numbers, memory, trial, values, count, step)
    elif law == Law.BOUC_WEN:
        slide_bouc_wen(numbers, memory, trial, values, count, step)
    elif law == Law.TANH:
        slide_tanh(numbers, memory, trial, values, count, step)
    elif law == Law.CUBIC:
        slide_cubic(numbers, memory, trial, values, count, step)
    elif law == Law.INTERLOCK:
        slide_interlock(numbers, memory, trial, values, count, step)
    elif law == Law.OWN:
        own.slide(numbers, memory, trial, values, count, step)


@njit(**NJIT_KERNEL)
def slide_law(law, numbers, memory, trial, values, count, step):
    """Slide a block of points as `slide_points`, for calls from Python."""
    slide_points(law, numbers, memory, trial, values, count, step)
