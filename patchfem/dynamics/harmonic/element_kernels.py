"""Forces of parallel elastic-plastic elements along a cycle (compiled)."""

from ...compiled.flags_kernels import NJIT_NO_REFCOUNT
from ...compiled.jit import njit

# Ratio of the stretch to its limit above which an element slips. An element that sticks since the largest slide
# returns to its limit there but for round-off.
SLIP_RATIO = 1 + 1e-12


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def follow_elements(stiffness, limit_slide, q, reversal_of_node, first, out):
    """Add the forces of elements along a cycle, from its largest slide on, and their derivatives.

    An element sticks at q - offset, where its offset is the slide at which it is unstretched. While it slips it takes
    the offset along. At a reversal it sticks, so that its force then depends on the slide there.

    Parameters
    ----------
    stiffness, limit_slide : (t,) array
        Stiffness [N/m] and slide at which an element yields [m].
    q : (M,) array
        Slides at the nodes of the cycle [m].
    reversal_of_node : (M,) array
        Number of the reversal at a node, -1 at other nodes.
    first : int
        Node of the largest slide, to which the elements are loaded from 0.
    out : (2 + r, M) array
        Force [N], stiffness [N/m], and derivatives by the slides at the r reversals [N/m]. The values of the elements are
        added.
    """
    n = q.size
    for k, limit in zip(stiffness, limit_slide):
        offset = 0.0
        reversal = -1
        slips = False
        for step in range(n + 1):
            i = (first + step) % n
            stretch = q[i] - offset
            # The end of a slip is at a reversal, even if the slide has not changed there since the node before.
            slips = abs(stretch) > SLIP_RATIO * limit or (slips and reversal_of_node[i] >= 0)
            if slips:
                stretch = limit if stretch > 0 else -limit
                offset = q[i] - stretch
                reversal = reversal_of_node[i]
            # The first node is the last one too. It belongs to the cycle once the cycle is closed.
            if step == 0:
                continue

            out[0, i] += k * stretch
            if not slips:
                out[1, i] += k
                if reversal >= 0:
                    out[2 + reversal, i] -= k
