"""Predicted number of jumps and cost of the cycles of wear.

In: a model with [wear] and the cost of its motion. Out: `Cost`. Automatic jumps are counted on
a row of independent springs that wears like the patch.
"""

import numpy as np

from ...core import PatchfemError
from ...structure.drive_sizes import find_drive_omega, find_max_acceleration
from ...wear.jumps import WearProblem, start_wear, take_jump
from ..cost import Cost
from .evolve import next_row

SOLVES_PER_JUMP = 20  # contact solutions per jump, with its corrections
SOLVES_PER_STRIP = (
    7  # contact solutions per jump and strip, because each starts from the previous one
)
# fraction of the cost of a motion with its coarse runs that the fine run has; includes more active
# nodes by wear
FINE_RUN_FRACTION = 0.7
# CPU seconds per squared number of interface points of a contact solution, including its measures
SOLVE_SECONDS = 1.2e-8
# springs of the row whose jumps are counted; most of them for a prescribed mesh
ROW, FINE = 192, 1000
# thickness of the springs over the length in contact, inside a patch; factor of the same at an end
# of it
INNER_THICKNESS, END_THICKNESS = (
    0.3,
    0.44,
)
SMOOTH = 8  # jumps of a patch whose asperities touch everywhere
MAX_COUNTED_JUMPS = 1500  # most jumps that are counted


def jumps_about(model) -> int:
    """Return the number of wear jumps: the prescribed one, or an estimate for automatic jumps.

    The estimate was within a factor of 1.5 in 54 of 56 cases, and of 2 in all. Automatic jumps are those of a
    row of springs as stiff as the pieces, with the path of the slide, or of a mass that moves
    freely with the drive; multiplied by 0.6 tolerance^-0.18, because the edges of a contact of
    pieces need more (193 nodes, tilts and crowns, 1e4 to 1e8 cycles, tolerances of 1e-2 and 1e-3).
    """
    asked = model.patch
    wear = model.wear
    if wear.jumps:
        return wear.jumps
    skin = asked.interface.skin
    pieces = asked.pieces
    size = asked.mesh.element_size
    if (skin is not None and skin.law != "linear") or not asked.loading.load:
        return SMOOTH
    most = max(ROW, min(int(pieces.length / size), FINE)) if size else ROW
    x = np.linspace(-pieces.length / 2, pieces.length / 2, most + 1)
    area = np.gradient(x) * pieces.width * pieces.pairs
    press = _springs(asked, x, area)
    path = np.full(x.size, _path_about(model))
    law = model.friction
    path = path * (law.static if wear.uses_friction_work else 1.0)

    def changing(worn):
        """Return the slip path with the friction coefficient at the mean worn depth."""
        mean = float(worn @ area / area.sum())
        if not law.static:
            return path
        return path * (wear.friction.compute_worn_law(law, mean).static / law.static)

    slides = (
        changing if wear.uses_friction_work and wear.friction is not None else lambda worn: path
    )
    row = WearProblem(press, slides, area, wear.coefficient, wear.cycles)
    state = start_wear(row, wear.compute_earlier_depth(x, area))
    count = 0
    while state.cycle < wear.cycles and count < MAX_COUNTED_JUMPS:
        state = take_jump(row, state, model.accuracy.tolerance, until=next_row(wear, row, state))
        count = count + 1
    least = min(count, 6)
    return round(least + (count - least) * 0.6 * model.accuracy.tolerance**-0.18)


def _path_about(model) -> float:
    """Return the slip path [m] of a cycle, without friction on the mass of a rig."""
    if model.rig is None:
        return (4.0 if model.slide.period else 1.0) * model.slide.amplitude
    return (
        4
        * find_max_acceleration(model.rig.drive.signal)
        / find_drive_omega(model.rig.drive.signal) ** 2
    )


def _springs(asked, x, area):
    """Return the forces of a row of springs under the load of a `PatchModel`.

    They are a function of worn depth and softening; x: positions (m,) [m], area: (m,) [m2].
    """
    try:
        gap = asked.gap.evaluate(x).heights
    except PatchfemError:  # the profile is too fine for the row
        gap = np.zeros_like(x)
    gap = gap - np.polyval(np.polyfit(x, gap, 1), x) if asked.loading.can_rotate else gap
    compliance = asked.pieces.series_compliance(
        lambda m: (1 + m.poisson) * (1 - 2 * m.poisson) / (1 - m.poisson) / m.young
    )
    solid = compliance * area.sum()
    # the depth that deforms is proportional to the length in contact
    share = 1.0
    height = max(asked.pieces.lower.height, asked.pieces.upper.height)
    for _ in range(12):
        soft = solid * min(share, 1.0) + (
            1 / asked.interface.skin.normal_stiffness if asked.interface.skin is not None else 0.0
        )

        def press(worn, softening, soft=soft):
            """Return the forces (m,) [N] of the springs."""
            stiff = 1 / (soft / area + softening)
            level = gap + worn
            order = np.argsort(level)
            rising = level[order]
            carried = np.cumsum(stiff[order])
            depth = (asked.loading.load + np.cumsum(stiff[order] * rising)) / carried
            last = np.flatnonzero(depth[:-1] <= rising[1:])
            return stiff * np.maximum(depth[last[0] if last.size else -1] - level, 0.0)

        bears = press(np.zeros_like(x), np.zeros_like(x)) > 0
        long = asked.pieces.length * float(bears @ area) / area.sum()
        share = (
            share
            + (
                END_THICKNESS * (long / height) ** 0.5
                if bears[0] or bears[-1]
                else INNER_THICKNESS * long / height
            )
        ) / 2
    return press


def _changes_motion(model) -> bool:
    """Return whether wear changes the motion."""
    return (
        bool(model.partial_slip)
        or model.side == "lower"
        or model.grooves is not None
        or model.wear.friction is not None
    )


def cost(model, points: int, motion: float) -> Cost:
    """Return the cost of all jumps.

    Parameters
    ----------
    model : Model
    points : int
        Nodes of the interface.
    motion : float
        CPU seconds of the march or of the bench with its coarse runs, of which a jump needs one
        run.
    """
    jumps = jumps_about(model)
    strips = model.patch.interface.strips
    again = FINE_RUN_FRACTION * motion if _changes_motion(model) else 0.0
    pressings = (
        SOLVES_PER_JUMP if strips is None else max(SOLVES_PER_JUMP, SOLVES_PER_STRIP * strips.count)
    )
    seconds = jumps * (pressings * SOLVE_SECONDS * points**2 + 5e-3 + again)
    number = (
        f"{jumps} jumps"
        if model.wear.jumps
        else f"about {jumps} jumps (the run chooses their number)"
    )
    once = "with the motion computed only once, because wear does not change it"
    shared = "with the motion computed again after each jump" if _changes_motion(model) else once
    return Cost(
        {"wear": seconds}, words=(f"wear: {model.wear.cycles:.6g} cycles in {number} {shared}",)
    )
