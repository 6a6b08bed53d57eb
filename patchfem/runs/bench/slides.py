"""Response of an interface to the displacement of a bench: in closed form, by Masing's rules, or by contact points.

In: a `SlideTask`. Out: `SlideHistories`. The force of a law without memory is a fraction of the friction limit, which
depends only on the direction or the speed of the motion. Parallel elements under a constant load obey Masing's rules. All
other laws are contact points that follow the path (`time_steps.slides`). Pieces that are rigid in shear give all points the
same displacement; under a pressure that moves with the upper piece, one point under the whole load then has the resultant
force.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ... import partial_slip, time_steps
from ...core import NotConverged
from ...effects import law_has_trait
from ...friction.laws.elastic_plastic import masing_loop
from ...friction.record import make_law
from ..interfaces import averaged_law, contact_points
from ..patch import jenkins_elements
from . import masing
from .engine import CLOSED_FORM, PARALLEL_ELEMENTS, find_method, has_changing_pressure


@dataclass(frozen=True, eq=False)
class SlideHistories:
    """Histories of force, slip and energies of a bench run, at k samples.

    - force, load (k,): friction force and normal load [N].
    - slip (k,): irreversible part of the displacement [m].
    - ledger (4, k): cumulative work, stored energy, cumulative dissipated and created energy [J].
    - tau, local (f, m): traction [Pa] and slip [m] at the nodes in each frame.
    - contact: contact points that followed the path; None for other methods.
    - join_error: largest error of a join that made room in a full list of bonds, relative to the load.
    """

    force: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    ledger: np.ndarray
    tau: np.ndarray
    local: np.ndarray
    contact: "time_steps.contacts.Contact | None" = None
    join_error: float = 0.0


class SlideTask(NamedTuple):
    """Prescribed displacement of an interface.

    - model, patch: Model, and its Patch or None for a single point.
    - numerics: numbers of shear modes and cells, and method of bond summation.
    - time, slide (k,): samples of time [s] and relative displacement [m].
    - frames (f,): indices of the samples at which fields are stored.
    - say, progress: callbacks for messages about compilation and for the completed fraction, or None.
    """

    model: object
    patch: object
    numerics: object
    time: np.ndarray
    slide: np.ndarray
    frames: np.ndarray
    say: Callable | None = None
    progress: Callable | None = None

    @property
    def weight(self) -> np.ndarray:
        """Areas (m,) [m2] of the interface nodes; 1 for a single point."""
        return np.ones(1) if self.patch is None else self.patch.pieces.interface.weight

    @property
    def averages_pressure(self) -> bool:
        """Whether the law averages the pressure of a patch over the surface that a node has passed."""
        return self.patch is not None and law_has_trait(self.model.friction.law, "averaged")

    def evaluate_pressure(self, samples) -> np.ndarray:
        """Return the pressures (n, m) [Pa] at the interface nodes, or the loads (n, 1) [N] of a point, at n samples."""
        model = self.model
        if model.load_varies:
            return model.point.evaluate(self.time[samples])[:, None]
        if self.patch is None:
            return np.full((len(samples), 1), model.point.load)
        x = self.patch.x
        sigma = self.patch.pressure.sigma_n
        if model.side != "lower":
            return np.repeat(sigma[None], len(samples), axis=0)
        # The upper piece is displaced over the pressure, which ends where the lower piece does.
        places = x + self.slide[samples, None]
        return np.interp(places, x, sigma, left=0.0, right=0.0)

    def compute_loads(self) -> np.ndarray:
        """Return the normal load (k,) [N] at each sample."""
        size = self.slide.size
        if not has_changing_pressure(self.model):
            return np.full(size, float(self.evaluate_pressure([0])[0] @ self.weight))
        blocks = np.array_split(np.arange(size), 1 + size // time_steps.slides.BLOCK)
        return np.concatenate([self.evaluate_pressure(block) @ self.weight for block in blocks])

    def find_limits(self, load, direction: float) -> np.ndarray:
        """Return the friction limits (k,) [N] of a motion to +x (`direction` 1) or to -x (-1) at all samples.

        The limit is mu N with the load N (k,) [N]. If the law acts on a pressure that is averaged along x, it is the sum
        of the nodal limits, which depends on the position of the averaging windows, i.e. on the slide.
        """
        friction = self.model.friction
        coefficient = friction.static if friction.kinetic is None else friction.kinetic
        if not self.averages_pressure:
            return coefficient * load
        limits = []
        for offset in self.slide if self.model.side == "lower" else np.zeros(1):
            tractions = averaged_law.find_tractions(friction, self.patch, direction, float(offset))
            limits.append(coefficient * float(tractions @ self.weight))
        return np.broadcast_to(limits, load.shape)

    def distribute_evenly(self, force, node_slip) -> tuple[np.ndarray, np.ndarray]:
        """Return traction (f, m) [Pa] and slip (f, m) [m] in the frames where the pressed nodes slip alike.

        The traction is in proportion to the pressure. `force` [N] and `node_slip` [m] are those of all samples (k,).
        """
        sigma = self.evaluate_pressure(self.frames)
        load = sigma @ self.weight
        ratio = np.divide(force[self.frames], load, out=np.zeros_like(load), where=load > 0)
        slide = self.slide[self.frames, None]
        return ratio[:, None] * sigma, np.where(sigma > 0, node_slip[self.frames, None], slide)


def follow_path(task: SlideTask) -> SlideHistories:
    """Compute the friction histories of a bench run.

    Raises
    ------
    NotConverged
        If the force of a step has too large an error.
    """
    method = find_method(task.model)
    if method not in (CLOSED_FORM, PARALLEL_ELEMENTS):
        return _follow_by_points(task)
    follow = _follow_without_memory if method == CLOSED_FORM else _follow_elements
    histories = follow(task)
    if task.progress is not None:
        task.progress(1.0)
    return histories


# ---- laws without memory


def _follow_without_memory(task: SlideTask) -> SlideHistories:
    """Compute the histories of a law without memory from the force and the loss of each step.

    The work of lifting the load on the flanks of grooves is stored energy. The friction work is dissipated.
    """
    model = task.model
    slide = task.slide
    grooves = model.grooves
    load = task.compute_loads()
    rises = np.zeros(slide.size - 1)
    stored = np.zeros(slide.size)
    if grooves is None:
        force, losses = _slide_on_flat_surfaces(task, load)
    else:
        mean_load = 0.5 * (load[:-1] + load[1:])
        force, losses = _climb_grooves(task, load, mean_load)
        rises = mean_load * grooves.height_difference(slide[:-1], slide[1:])
        stored = np.cumsum([load[0] * grooves.height(slide[0]), *rises])

    # A force at the end of a rest is that of the motion that begins there.
    static = model.friction.static
    for sample, sign in find_rest_ends(model, slide).items():
        ratio = sign * static
        if grooves is not None:
            ratio = grooves.force_ratio(slide[sample], sign, static)
        force[sample] = ratio * load[sample]

    # The tractions of a frame are in proportion to the friction limits.
    tau, local = task.distribute_evenly(force, slide)
    if task.averages_pressure:
        frames = task.frames
        offsets = slide[frames] * (model.side == "lower")
        tau = averaged_law.distribute_slip_force(model.friction, task.patch, force[frames], offsets)
    ledger = stack_energies(rises + losses, stored, losses)
    return SlideHistories(force, load, slide, ledger, tau, local)


def _slide_on_flat_surfaces(task: SlideTask, load) -> tuple[np.ndarray, np.ndarray]:
    """Return the force (k,) [N] and the loss of each step (k - 1,) [J] of a law without memory on flat surfaces.

    The force is phi L, with the friction limit L under the pressure at the sample, and its fraction phi, from the
    direction or the speed of the step that ends there. The loss has the mean limit of both ends of the step.
    """
    friction = task.model.friction
    moves = np.diff(task.slide)
    is_set_valued = law_has_trait(friction.law, "set-valued")
    fraction = np.sign(moves)
    if not is_set_valued:
        fraction = make_law(friction, 1.0).limit_fraction(moves, np.diff(task.time))
    forward = task.find_limits(load, 1.0)
    back = task.find_limits(load, -1.0)
    begin = np.where(moves > 0, forward[:-1], back[:-1])
    end = np.where(moves > 0, forward[1:], back[1:])
    force = np.append(0.0, fraction * end)

    # At rest, a law that sticks keeps its force as far as the limit allows.
    for sample in np.flatnonzero(moves == 0) if is_set_valued else ():
        before = force[sample]
        limit = (forward if before > 0 else back)[sample + 1]
        force[sample + 1] = np.clip(before, -limit, limit)
    return force, fraction * (begin + end) / 2 * moves


def find_rest_ends(model, slide) -> dict[int, float]:
    """Return the samples at which sliding starts from rest, with the sign of the motion.

    These are the first sample of the path and the last sample of each rest. The dict is empty
    unless the static Coulomb coefficient exceeds the kinetic one.

    Parameters
    ----------
    model : Model
        Model of a bench, whose friction law decides.
    slide : (k,) array
        Relative displacement [m].
    """
    f = model.friction
    if not law_has_trait(f.law, "set-valued") or f.kinetic is None or not f.kinetic < f.static:
        return {}
    moves = np.sign(np.diff(slide))
    ends = np.flatnonzero((moves != 0) & np.append(True, moves[:-1] == 0))
    return {int(k): float(moves[k]) for k in ends}


def _climb_grooves(task: SlideTask, load, mean_load) -> tuple[np.ndarray, np.ndarray]:
    """Return the force (k,) [N] and the friction loss of each step (k - 1,) [J] on the flanks of grooves, without inertia.

    The force is N (t + phi)/(1 - phi t) under the load N (k,), with the slope t and the friction ratio phi = f/R along
    the flank. The loss of a step is that under its mean load (k - 1,) [N].
    """
    slide = task.slide
    grooves = task.model.grooves
    friction = task.model.friction
    moves = np.diff(slide)
    if law_has_trait(friction.law, "set-valued"):
        back, forward = (task.find_limits(load, sign) / load for sign in (-1.0, 1.0))
        # Index of the last step in which the interface moved, up to each step; -1 before the first one.
        last = np.maximum.accumulate(np.where(moves != 0, np.arange(moves.size), -1))
        direction = np.append(0.0, np.where(last < 0, 0.0, np.sign(moves)[last]))
        ratio = grooves.force_ratio(slide, direction, np.where(direction < 0, back, forward))
        # Before the motion starts, the friction on the flank balances the load as far as its limit allows.
        lowest, highest = grooves.force_ratio(slide[0], np.array([-1.0, 1.0]), friction.static)
        ratio[direction == 0] = np.clip(0.0, lowest, highest)
        losses = [grooves.friction_loss(slide[:-1], slide[1:], part[0]) for part in (back, forward)]
        return load * ratio, mean_load * np.where(moves < 0, *losses)

    durations = np.diff(task.time)
    speed = np.divide(moves, durations, out=np.zeros_like(moves), where=durations > 0)
    law = make_law(friction, 1.0)

    def find_flank(places, speed) -> tuple[np.ndarray, np.ndarray]:
        """Return the slope t of the flank and the friction ratio phi along it, at places [m] and speeds [m/s]."""
        t = grooves.slope(places)
        return t, friction.static * law.limit_fraction(np.sqrt(1 + t**2) * speed, 1.0)

    def find_loss(places) -> np.ndarray:
        """Return the dissipated energy per displacement [N] in each step, at places (k - 1,) [m]."""
        t, phi = find_flank(places, speed)
        return mean_load * phi * (1 + t**2) / (1 - phi * t)

    t, phi = find_flank(slide, np.append(0.0, speed))
    return load * (t + phi) / (1 - phi * t), integrate_steps(slide, find_loss)


def integrate_steps(slide, integrand) -> np.ndarray:
    """Integrate a function of the displacement over every time step by Gauss quadrature.

    Parameters
    ----------
    slide : (k,)
        [m].
    integrand : callable
        Function of the displacements (k - 1,) [m].
    """
    move = np.diff(slide)
    out = np.zeros_like(move)
    # Number of Gauss points per time step along the flank of a groove.
    for place, weight in zip(*np.polynomial.legendre.leggauss(8)):
        out += 0.5 * weight * integrand(slide[:-1] + 0.5 * (1 + place) * move) * move
    return out


def stack_energies(work, stored, losses) -> np.ndarray:
    """Return work, stored, dissipated and created energy (4, k) [J] at k samples.

    Parameters
    ----------
    work : (k - 1,)
        Friction work of each step [J].
    stored : (k,)
        Stored energy [J].
    losses : (k - 1,)
        Energy that is dissipated in each step [J]; below 0 if it is created.
    """
    steps = np.stack([work, np.maximum(losses, 0.0), np.maximum(-losses, 0.0)])
    work, dissipated, created = np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))
    # Largest ratio of created to dissipated energy at which the created energy counts as round-off.
    if created[-1] <= 1e-13 * dissipated[-1]:
        created = np.zeros(created.size)
    return np.stack([work, stored, dissipated, created])


# ---- parallel elements


def _follow_elements(task: SlideTask) -> SlideHistories:
    """Compute the histories of parallel elements under a constant load by Masing's rules, which are exact."""
    model = task.model
    friction = model.friction
    load = task.compute_loads()
    law = make_law(friction, load[0])
    if not model.partial_slip:
        loop = partial(law.steady_loop, load[0])
        history = masing.follow_masing(loop, friction.static * load[0], task.slide)
        tau, local = task.distribute_evenly(history.force, history.slip)
    else:
        # The stretches of the elements in a frame follow from the reversals before it.
        found = jenkins_elements.elements(task.patch, friction.static, law.length)
        yields = found.yield_displacement
        loop = partial(masing_loop, found.stiffness, yields)
        history = masing.follow_masing(loop, float(found.stiffness @ yields), task.slide)
        states = masing.find_stretches(yields, task.slide, task.frames)
        tau, local = partial_slip.fields.compute_element_fields(
            task.patch, found, states, law.length
        )

    stored = history.work - history.loss
    ledger = stack_energies(np.diff(history.work), stored, np.diff(history.loss))
    return SlideHistories(history.force, load, history.slip, ledger, tau, local)


# ---- contact points


def _follow_by_points(task: SlideTask) -> SlideHistories:
    """Compute the histories of a law with memory by contact points along the path."""
    model = task.model
    friction = model.friction
    slide = task.slide
    frames = task.frames
    contact = contact_points.make_contact(model, task.numerics, task.patch)

    # Steps of equal durations are followed together; durations matter only to laws of the velocity.
    load = task.compute_loads()
    time = task.time
    has_bonds = law_has_trait(friction.law, "bonds")
    if not model.bonds.has_growth if has_bonds else law_has_trait(friction.law, "timeless"):
        time = np.arange(slide.size, dtype=float)
        if contact.load is not None:
            contact = replace(contact, load=partial(np.interp, xp=time, fp=load))

    motion = time_steps.slides.follow(contact, time, slide, frames, task.say, task.progress)
    if motion.n_unsolved:
        raise NotConverged(
            f"in {motion.n_unsolved} time steps of the prescribed slide the friction force has an error "
            "above the limit; raise accuracy.steps_per_cycle",
            "",
        )

    def find_stretch(force, load) -> np.ndarray:
        """Return the stretch [m] of bonds on rigid pieces under forces and loads [N], or under stresses [Pa]."""
        limit = friction.static * load
        share = np.divide(force, limit, out=np.zeros_like(force), where=limit > 0)
        return friction.bond_length * share

    # The stretch of bonds on rigid pieces is that of their force, at most one bond length.
    is_rigid = has_bonds and not model.partial_slip and model.grooves is None
    local_slip = motion.slip
    if is_rigid:
        length = friction.bond_length
        local_slip = slide - np.clip(find_stretch(motion.force, load), -length, length)

    # Shear stress and local slip of the frames, by what represents the shear of the pieces.
    if contact.point_sets[0].shear is None and contact.point_sets[0].lower is None:
        tau, local = task.distribute_evenly(motion.force, local_slip)
    else:
        tau, local = contact_points.compute_point_fields(task.patch, contact, motion.snapshots)
        if is_rigid:
            local = slide[frames, None] - find_stretch(tau, task.evaluate_pressure(frames))
    ledger = stack_energies(motion.mean * np.diff(slide), motion.stored, motion.losses)
    return SlideHistories(
        motion.force, load, local_slip, ledger, tau, local, contact, motion.join_error
    )
