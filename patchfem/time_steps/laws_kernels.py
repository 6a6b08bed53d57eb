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
    """Slide a block of points of a law. A point of rigid friction (`Law.COULOMB`) is solved with its port.

    Parameters
    ----------
    law : Law
        Number of the law.
    numbers : (k,) array
        Numbers of the law, in rows of WIDTH points.
    memory : (l,) array
        State of the points at the start of the step.
    trial : (l,) array
        State of the points at the end of the step; output.
    values : (v,) array
        Rows of `step_rows_kernels.Value`; the outputs are written.
    count : int
        Number of points in the block.
    step : Step
        Duration of the step [s], and factors of the formula for a velocity [1/s].
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
    """Slide a block of points of a law, for calls from Python.

    Parameters
    ----------
    law : Law
        Number of the law.
    numbers : (k,) array
        Numbers of the law, in rows of WIDTH points.
    memory : (l,) array
        State of the points at the start of the step.
    trial : (l,) array
        State of the points at the end of the step; output.
    values : (v,) array
        Rows of `step_rows_kernels.Value`; the outputs are written.
    count : int
        Number of points in the block.
    step : Step
        Duration of the step [s], and factors of the formula for a velocity [1/s].
    """
    slide_points(law, numbers, memory, trial, values, count, step)
