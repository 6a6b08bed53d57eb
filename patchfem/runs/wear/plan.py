"""Predicted number of jumps and cost of the cycles of wear.

In: a model with [wear] and the cost of its motion. Out: `Cost`. Automatic jumps are counted on a
row of independent springs that wears like the patch.
"""

import numpy as np

from ...core import PatchfemError
from ...structure import drive_sizes
from ...wear.jumps import WearProblem, make_initial_wear_state, take_jump
from ..cost import Cost
from .evolve import find_cycle_of_next_table_row

SOLVES_PER_JUMP = 20  # Number of contact solutions per jump, with its corrections.
# Number of contact solutions per jump and strip; it is smaller because each solution starts from
# the previous one.
SOLVES_PER_STRIP = 7
# Ratio of the cost of the fine run to that of the motion with its coarse runs. It includes the
# increase of the number of nodes in contact due to wear.
FINE_RUN_FRACTION = 0.7
# CPU time [s] of a contact solution with its measures, divided by the squared number of interface
# nodes.
SOLVE_SECONDS = 1.2e-8
JUMP_SECONDS = 5e-3  # CPU time [s] of a jump besides its contact solutions.
N_SPRINGS = 192  # Number of springs of the spring row with which jumps are counted.
MAX_SPRINGS = 1000  # Largest number of springs of this row for a prescribed mesh.
# Ratio of the spring thickness to the contact length, for a contact inside the patch.
INNER_THICKNESS_RATIO = 0.3
# Ratio of the spring thickness to sqrt(contact length times piece height), for a contact at an end
# of the patch.
END_THICKNESS_RATIO = 0.44
N_SMOOTH_JUMPS = 8  # Number of jumps for an asperity layer with pressure everywhere.
MAX_COUNTED_JUMPS = 1500  # Largest number of jumps that are counted.


def estimate_jump_count(model) -> int:
    """Return the number of jumps over cycles, either prescribed or estimated.

    Automatic jumps are counted on a row of springs as stiff as the pieces, with the path of the
    prescribed displacement or of a mass that moves freely with the drive. The number is multiplied
    by 0.6 tolerance^-0.18, because the contact edges of the pieces need more jumps (193 nodes,
    tilts and crowns, 1e4 to 1e8 cycles, tolerances of 1e-2 and 1e-3). The estimate was within a
    factor of 1.5 in 54 of 56 cases, and within a factor of 2 in all.
    """
    patch = model.patch
    wear = model.wear
    if wear.jumps:
        return wear.jumps
    skin = patch.interface.skin
    pieces = patch.pieces
    size = patch.mesh.element_size
    if (skin is not None and skin.law != "linear") or not patch.loading.load:
        return N_SMOOTH_JUMPS
    count = max(N_SPRINGS, min(int(pieces.length / size), MAX_SPRINGS)) if size else N_SPRINGS
    x = np.linspace(-pieces.length / 2, pieces.length / 2, count + 1)
    area = np.gradient(x) * pieces.width * pieces.pairs
    springs = _SpringRow(patch, x, area)
    law = model.friction
    path = np.full(x.size, _estimate_slip_path(model))
    if wear.uses_friction_work:
        path = path * law.static

    def slip_path(depth):
        """Return the slip path (m,) [m] with the coefficient of friction at the mean worn depth."""
        if not wear.uses_friction_work or wear.friction is None or not law.static:
            return path
        mean = float(depth @ area / area.sum())
        return path * (wear.friction.compute_worn_law(law, mean).static / law.static)

    row = WearProblem(springs.press, slip_path, area, wear.coefficient, wear.cycles)
    state = make_initial_wear_state(row, wear.compute_earlier_depth(x, area))
    jumps = 0
    while state.cycle < wear.cycles and jumps < MAX_COUNTED_JUMPS:
        state = take_jump(
            row,
            state,
            model.accuracy.tolerance,
            until=find_cycle_of_next_table_row(wear, row, state),
        )
        jumps = jumps + 1
    first_jumps = min(jumps, 6)
    return round(first_jumps + (jumps - first_jumps) * 0.6 * model.accuracy.tolerance**-0.18)


def _estimate_slip_path(model) -> float:
    """Estimate the slip path [m] per cycle; for a rig, that of the motion without friction."""
    if model.rig is None:
        return (4.0 if model.slide.period else 1.0) * model.slide.amplitude
    signal = model.rig.drive.signal
    return 4 * drive_sizes.find_max_acceleration(signal) / drive_sizes.find_drive_omega(signal) ** 2


class _SpringRow:
    """Row of independent springs that approximates the contact of a patch in a plan.

    Parameters
    ----------
    patch : PatchModel
    x, area : (m,)
        Positions [m] and areas [m2] of the springs.
    """

    def __init__(self, patch, x, area):
        self.area = area
        self.load = patch.loading.load
        self.gap = _spring_row_gap(patch, x)
        pieces = patch.pieces
        skin = patch.interface.skin
        skin_compliance = 0.0 if skin is None else 1 / skin.normal_stiffness
        solid = area.sum() * pieces.series_compliance(
            lambda m: (1 + m.poisson) * (1 - 2 * m.poisson) / (1 - m.poisson) / m.young
        )
        height = max(pieces.lower.height, pieces.upper.height)
        # The depth of the deformed material is proportional to the contact length.
        fraction = 1.0
        unworn = np.zeros_like(x)
        for _ in range(12):
            self.compliance = solid * min(fraction, 1.0) + skin_compliance
            is_loaded = self.press(unworn, unworn) > 0
            length = pieces.length * float(is_loaded @ area) / area.sum()
            if is_loaded[0] or is_loaded[-1]:
                new_fraction = END_THICKNESS_RATIO * (length / height) ** 0.5
            else:
                new_fraction = INNER_THICKNESS_RATIO * length / height
            fraction = (fraction + new_fraction) / 2

    def press(self, worn, softening) -> np.ndarray:
        """Return the spring forces (m,) [N] at a worn depth (m,) [m].

        softening: additional compliance (m,) [m/N].
        """
        stiffness = 1 / (self.compliance / self.area + softening)
        level = self.gap + worn
        order = np.argsort(level)
        levels = level[order]
        carried = np.cumsum(stiffness[order])
        depth = (self.load + np.cumsum(stiffness[order] * levels)) / carried
        ends = np.flatnonzero(depth[:-1] <= levels[1:])
        return stiffness * np.maximum(depth[ends[0] if ends.size else -1] - level, 0.0)


def _spring_row_gap(patch, x) -> np.ndarray:
    """Return the gap (m,) [m] of the row of springs; tilt is left out if the piece can rotate."""
    try:
        gap = patch.gap.evaluate(x).heights
    except PatchfemError:  # The springs do not resolve the profile.
        return np.zeros_like(x)
    if patch.loading.can_rotate:
        gap = gap - np.polyval(np.polyfit(x, gap, 1), x)
    return gap


def _wear_changes_motion(model) -> bool:
    """Return whether wear changes the motion of a model."""
    return (
        bool(model.partial_slip)
        or model.side == "lower"
        or model.grooves is not None
        or model.wear.friction is not None
    )


def predict_cost(model, points: int, motion: float) -> Cost:
    """Predict the cost of all jumps of a run with wear.

    Parameters
    ----------
    model : Model
    points : int
        Nodes of the interface.
    motion : float
        CPU seconds of the motion with its coarse runs; a jump needs the fine run only.
    """
    jumps = estimate_jump_count(model)
    strips = model.patch.interface.strips
    solves = SOLVES_PER_JUMP
    if strips is not None:
        solves = max(solves, SOLVES_PER_STRIP * strips.count)
    jump_seconds = solves * SOLVE_SECONDS * points**2 + JUMP_SECONDS
    repetition = "with the motion computed only once, because wear does not change it"
    if _wear_changes_motion(model):
        jump_seconds += FINE_RUN_FRACTION * motion
        repetition = "with the motion computed again after each jump"
    number = f"{jumps} jumps"
    if not model.wear.jumps:
        number = f"about {jumps} jumps (the run chooses their number)"
    words = f"wear: {model.wear.cycles:.6g} cycles in {number} {repetition}"
    return Cost({"wear": jumps * jump_seconds}, words=(words,))
