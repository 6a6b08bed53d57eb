"""Rough computing time of a scene, by which expensive random scenes are left out."""

from patchfem.runs import choose_numerics
from patchfem.runs.interfaces.bond_lists import has_bond_list, is_stuck_by_printed_law

NODE_SECONDS = 4e-5  # CPU time [s] per elastic unknown of the finest mesh
LIST_STRIP_STEP_SECONDS = 2e-6  # CPU time [s] per time step and strip of a list of bonds
EVENT_DRIVEN_CYCLE_SECONDS = 1e-3  # CPU time [s] of a cycle from event to event
STEP_SECONDS = 1.5e-6  # CPU time [s] of a time step of a point
POINT_STEP_SECONDS = 2e-7  # additional CPU time [s] of a time step per node of the interface
N_JUMPS = 40  # jumps of wear if the run chooses their number
JUMP_SECONDS = 0.05  # CPU time [s] of a jump besides the motion
MARCH_PASSES = (
    4  # steps of a time integration with its coarser and finer runs, relative to the first one
)


def estimate_seconds(plan) -> float:
    """Return the rough CPU time [s] of a Plan."""
    unknowns = plan.unknowns
    model = plan.model
    seconds = 0.5 + NODE_SECONDS * unknowns.get("elastic_unknowns_about", 0)
    n_points = max(unknowns.get("interface_points", 0), unknowns.get("bond_list_about", 0))
    motion = 0.0
    if plan.engine == "event_driven":
        motion = EVENT_DRIVEN_CYCLE_SECONDS * model.rig.drive.cycles
    elif plan.engine == "harmonic":
        motion = 2.0
    elif model.rig is not None:
        numerics = choose_numerics(model)
        step = STEP_SECONDS + POINT_STEP_SECONDS * n_points
        motion = MARCH_PASSES * numerics.cycles * numerics.steps * step
        if is_stuck_by_printed_law(model) and has_bond_list(model):
            # One strip per step, in the list of each node.
            strips = max(n_points, 1) * numerics.cycles * numerics.steps
            motion *= 1 + LIST_STRIP_STEP_SECONDS * strips / 2 / step
    if model.wear is not None:
        seconds += (model.wear.jumps or N_JUMPS) * (JUMP_SECONDS + motion)
    return seconds + motion
