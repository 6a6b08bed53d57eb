"""Fields of the interface during the last cycle of a run of a rig.

In: the Solution with its snapshots, and the Patch. Out: pressure, gap, shear stress and slip at the
interface nodes by name.
"""

import numpy as np

from ... import friction, partial_slip
from ...effects import law_has_trait, needs_bond_list
from ..interfaces import averaged_law, contact_points
from ..patch import jenkins_elements
from ..results.interfaces import PressedFace
from ..results.patch_rows import Arrays
from ..results.result import (
    N_INTERFACE_FRAMES,
    SlipRule,
    collect_rest_frame,
    compute_status,
    make_interface_frames,
)


def collect_interface_fields(model, numerics, patch, solution) -> Arrays:
    """Collect the fields of the interface at the output frames of the last cycle.

    Parameters
    ----------
    model : Model
        Friction law and partial slip of the interface.
    numerics : Numerics
        Window, and whether every node has its own bonds.
    patch : Patch
        Patch of [contact], whose nodes have the fields.
    solution : Solution
        Snapshots of the last cycle, or the window of a motion of one point.
    """
    sigma = patch.pressure.sigma_n
    f = model.friction
    window = solution.run.window
    if model.rig.friction.load_varies:
        return _collect_varying_load_fields(patch, solution)
    # A motion without snapshots is that of a single point.
    snapshots = solution.run.snapshots
    n_samples = len(window.time)
    first = max(0, n_samples - 1 - n_samples // numerics.window)
    samples = np.linspace(first, n_samples - 1, N_INTERFACE_FRAMES).round().astype(int)

    def list_frames(name: str) -> np.ndarray:
        """Return time [s], slide [m], force [N] or slip [m] in each frame (f,)."""
        if snapshots:
            return np.array([getattr(snapshot, name) for snapshot in snapshots])
        return getattr(window, name)[samples]

    # The points of a march are nodes of the patch, unless parallel elements replace them.
    has_shear = bool(snapshots) and model.partial_slip
    is_march = bool(snapshots) and numerics.engine == "march"
    has_nodes = False
    if is_march and snapshots[0].forces.size > 1:
        is_below = model.side == "lower" and model.grooves is None and not needs_bond_list(f)
        has_nodes = is_below or (has_shear and solution.contact.elements is None)

    if has_nodes or (has_shear and model.grooves is not None):
        tau, local = contact_points.compute_point_fields(patch, solution.contact, snapshots)
    elif has_shear:
        states = [(snapshot.slide, snapshot.stretch) for snapshot in snapshots]
        return _make_element_frames(patch, f, list_frames("time"), states)
    else:
        force = list_frames("force")
        tau = np.outer(force / patch.pressure.load, sigma)
        if f is not None and law_has_trait(f.law, "averaged"):
            tau = averaged_law.distribute_slip_force(f, patch, force, np.zeros(force.size))
        local = np.repeat(list_frames("slip")[:, None], sigma.size, axis=1)
    return make_interface_frames(patch, list_frames("time"), tau, local, list_frames("slide"))


def add_slip_fields(model, faces: tuple[PressedFace, ...], snapshots) -> tuple[PressedFace, ...]:
    """Return interfaces of a rig with frames of their slip and shear stress.

    Without elements or snapshots, an interface has only the fields of its static contact.

    Parameters
    ----------
    model : Model
        Model of the rig.
    faces : tuple of PressedFace
        Pressed interfaces of the rig, in their order.
    snapshots : list
        States of the event-driven engine: time [s], and for each interface its slide [m] and the
        stretch (t,) [m] of its elements.
    """
    out = []
    for face in faces:
        keys = model.rig.friction.interfaces[face.number].numbers
        fields = None
        # Only an interface whose pieces deform in shear has slip that varies along x.
        if face.partial_slip and snapshots:
            states = [snapshot.faces[face.number] for snapshot in snapshots]
            times = [snapshot.time for snapshot in snapshots]
            fields = _make_element_frames(face.patch, keys, times, states)
        out.append(face._replace(fields=fields or collect_rest_frame(face.patch)))
    return tuple(out)


def _make_element_frames(patch, keys, times, states) -> Arrays | None:
    """Return the fields of an interface whose pieces deform in shear, from the stretches of its parallel elements.

    They are None without load.

    Parameters
    ----------
    patch : Patch
        Solved patch.
    keys : Friction
        Effective keys of the friction law, whose bonds are in series with the pieces.
    times : (f,) list
        Times of the frames [s].
    states : list of tuple
        Slide [m] and stretches (t,) [m] in each frame.
    """
    static = keys.static
    length = friction.record.make_law(keys, patch.pressure.load).length
    jenkins_set = jenkins_elements.make_elements(patch, static, length).jenkins_set
    if jenkins_set is None:
        return None
    tau, local = partial_slip.fields.compute_element_fields(patch, jenkins_set, states, length)
    # The tractions of the cells of a face are interpolated, so that they do not reach their limits exactly.
    limit = None if patch.model.area is not None else static * patch.pressure.sigma_n
    slide = np.array([slide for slide, _ in states])
    return make_interface_frames(patch, np.array(times), tau, local, slide, SlipRule(limit))


def _collect_varying_load_fields(patch, solution) -> Arrays:
    """Collect the fields of an interface under varying normal load at the output frames.

    The first frame is the initial state. The status is 0 for open, 1 for stick and 2 for slip.
    """
    # The first frame is the pressed patch at rest; the others are snapshots of the motion.
    sets = solution.contact.press.sets
    weight = patch.pieces.interface.weight
    snapshots = solution.run.snapshots
    time = np.array([0.0, *(snapshot.time for snapshot in snapshots)])
    slide = np.array([0.0, *(snapshot.slide for snapshot in snapshots)])
    nodal = np.stack([patch.pressure.sigma_n * weight, *(snapshot.nodal for snapshot in snapshots)])
    lift = np.array([0.0, *(snapshot.heave for snapshot in snapshots)])[:, None]
    turn = np.array([0.0, *(snapshot.pitch for snapshot in snapshots)])[:, None]

    # Gap = opening without forces + motion of the holder + compliance times forces, and 0 in contact.
    gap = np.maximum(sets.opening + lift + turn * sets.x + nodal @ sets.c, 0.0)
    gap[nodal > 0] = 0.0
    gap[0] = patch.pressure.gap

    # Slip is the slide less the stretch of the law and the shear of the pieces.
    tau = np.zeros_like(nodal)
    local = np.zeros_like(nodal)
    for k, snapshot in enumerate(snapshots, 1):
        tau[k] = snapshot.forces
        local[k] = slide[k] - snapshot.stretch - snapshot.bend
        if snapshot.forces.size == 1:
            # The law acts on the resultant.
            total = nodal[k].sum()
            tau[k] = snapshot.force / total * nodal[k] if total > 0 else 0.0
            local[k] = slide[k]

    return {
        "time": time,
        "normal_stress": nodal / weight,
        "gap": gap,
        "shear_stress": tau / weight,
        "slip": local,
        "status": compute_status(nodal > 0, tau, local),
        "holder_slide": slide,
    }
