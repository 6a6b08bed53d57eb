"""From the results of the stages to the arrays of the compiled hub, and the march in pieces of one drive cycle."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from .compiled import load_kernels
from .core import BaseSine, Missing, ModalBasis, NotConverged, Outcome, Response

LIST_CAPACITY = 20_000  # bonds of a shared list; beyond it a run is refused
GOAL = 1e-11  # residual of the step solve over the friction limit
MOST_KEPT = 400_000  # samples kept outside the last cycles


@dataclass(frozen=True, eq=False, slots=True)
class ContactModel:
    """What the hub needs to know of an interface; `build()` makes fresh arrays, so a model can be run many times.

    kind as in simulate_kernels; limit: friction limit [N]; fields: keyword arrays of simulate_kernels.Contact;
    shear_modes: r; follow: pressure stays on the lower piece; length: bond length for the stick criterion [m].
    """

    kind: int
    limit: float
    fields: dict
    follow: bool = False
    length: float = 0.0

    def build(self, hub):
        """(Contact, Work) with arrays of their own."""
        empty = {name: np.zeros((0, 0)) if name in ("psi", "bonds", "bondlist") else np.zeros(0)
                 for name in hub.Contact._fields}
        empty["growth"] = np.full(5, -1.0)
        arrays = {k: np.array(v, dtype=np.float64, order="C") for k, v in (empty | self.fields).items()}
        contact = hub.Contact(**arrays)
        r = contact.kappa.size
        scale = np.ones(1 + r)
        if r:
            scale[1:] = self.limit / np.maximum(contact.psi.T @ (contact.weight * contact.source), 1e-300)
            scale[1:] = np.minimum(np.abs(scale[1:]), 1 / np.sqrt((contact.psi**2).mean(axis=0)))
        work = hub.Work(np.zeros(1 + r), np.zeros(1 + r), np.zeros((1 + r, 1 + r)), np.zeros(1 + r), np.zeros(1 + r),
                        scale, np.zeros((2, 1 + r)), np.full(1, self.length))
        return contact, work


def coulomb_model(static: float, kinetic: float) -> ContactModel:
    """Rigid Coulomb contact with static and kinetic friction force [N]."""
    return ContactModel(0, static, {"force": [static, kinetic, static]})


def jenkins_model(stiffness, yield_slide) -> ContactModel:
    """Parallel Jenkins elements (t,) [N/m], [m]."""
    limit = float(np.dot(stiffness, yield_slide))
    fields = {"force": [limit, limit, limit], "stretch": np.zeros(len(stiffness)), "stiffness": stiffness,
              "limit": yield_slide}
    return ContactModel(1, limit, fields)


def growth_numbers(law) -> np.ndarray:
    """(a_s, l_k, v_h, eps_0, eps_k) of eq. 2.10, a_s = -1 for a constant bond length."""
    if not law.grows:
        return np.array([-1.0, 1.0, 1.0, law.length, law.length])
    return np.array([law.rest_growth, law.slip_growth, law.rest_speed, law.length, law.ratio * law.length])


def points_model(law, area, sigma, shear=None, pattern=None) -> ContactModel:
    """Bond points (stretch reading, p = 1) on nodal areas (m,) [m2] under sigma (m,) [Pa].

    shear: ShearModes of the contact set or None for a rigid slide; pattern: (x, sigma on x) when the pressure stays on
    the lower piece, `area` and `sigma` then belong to the points of the upper one.
    """
    area, sigma = np.asarray(area, float), np.asarray(sigma, float)
    places = np.zeros(0) if pattern is None else pattern[0]
    if shear is not None:
        area, sigma = area[shear.points], sigma[shear.points]
    bonds = np.zeros((4, area.size))
    bonds[0] = law.initial * sigma
    limit = law.static * float(area @ sigma)
    fields = {"force": [limit, limit, limit], "weight": law.static * area / law.length, "bonds": bonds,
              "source": sigma, "growth": growth_numbers(law)}
    if shear is not None:
        fields |= {"psi": shear.shape, "kappa": shear.stiffness, "b": np.zeros(shear.stiffness.size)}
    if pattern is not None:
        fields |= {"place": places, "x": pattern[0], "sigma": pattern[1]}
    return ContactModel(2, limit, fields, pattern is not None, law.length)


def list_model(law, limit: float, reach: float, merge: float) -> ContactModel:
    """One shared bond list for a rigid slide: any order, either reading; limit = mu_s N [N].

    reach: cut-off in bond lengths; merge: widest merged bond in bond lengths at zero age.
    """
    exact = law.reading == "report" and not law.grows
    capacity = 4_000 if exact else LIST_CAPACITY
    fields = {"force": [limit, limit, (1 + law.initial) * limit], "bondlist": np.zeros((7, capacity)),
              "now": [0.0, 0.0, 0.0, 0.0, law.length], "tally": [0.0, reach, merge],
              "law": [law.order, float(law.reading == "report"), law.length, law.initial, float(exact)],
              "growth": growth_numbers(law)}
    return ContactModel(3, limit, fields, False, law.length)


@dataclass(frozen=True, eq=False, slots=True)
class MarchResult:
    """A march: kept samples, the last cycles whole, extremes of every window, the energy ledger and how it ended."""

    response: Response
    window: Response
    amplitudes: np.ndarray
    ledger: dict
    outcome: Outcome | None
    snapshots: list
    cycles_done: float


def _response(rows, first, dt, modes, drive) -> Response:
    n = modes.omega.size
    z, rate = rows[:, :n], rows[:, n:2 * n]
    time = (first + np.arange(len(rows))) * dt
    base = drive.acceleration * np.sin(drive.omega * time)
    damp = 2 * modes.zeta * modes.omega
    accel = -np.outer(base, modes.base) - rate * damp - z * modes.omega**2 \
        - np.outer(rows[:, 2 * n + 2], modes.slide) / modes.mass
    return Response(time, z, rate, rows[:, 2 * n], rows[:, 2 * n + 1], z @ modes.output, rate @ modes.output,
                    accel @ modes.output + base, base, rows[:, 2 * n + 2], rows[:, 2 * n + 3])


def _thinned(rows, n) -> np.ndarray:
    """Numbers of the samples of a cycle worth keeping: every reversal of the slide and its extremes."""
    v = rows[:, 2 * n + 1]
    turn = np.flatnonzero(v[:-1] * v[1:] <= 0)
    return np.unique(np.concatenate([[0], turn]))


def march(modes: ModalBasis, drive: BaseSine, model: ContactModel, cycles: float, steps_per_cycle: int,
          window: int = 10, travel: float = np.inf, frames: int = 0, say=None, progress=None) -> MarchResult:
    """March from rest for `cycles` drive cycles at `steps_per_cycle` steps.

    window: whole cycles kept at the end; frames: snapshots of the interface during the last cycle. NotConverged when
    a step misses its residual, Missing when a bond list overflows; outcome is set for travel and blow-up only.
    """
    from .dynamics.propagator import GAUSS_W, propagator

    hub = load_kernels(say)
    prop = propagator(modes, drive, steps_per_cycle)
    c, work = model.build(hub)
    state = np.zeros((modes.omega.size, 2))
    held, ledger = np.zeros(1), np.zeros(8)
    arrays = hub.Modes(*(np.array(v) for v in (modes.omega, 2 * modes.zeta * modes.omega, modes.slide, modes.base,
                                               modes.output)))
    steps = hub.Steps(prop.step, prop.gauss, prop.sine, prop.sine_gauss, GAUSS_W.copy(), prop.dt, prop.beta)
    n, total = modes.omega.size, round(cycles * steps_per_cycle)
    last, kept, kept_at, extremes, snapshots = deque(maxlen=window + 1), [], [], [], []
    done, outcome, samples = 0, None, 0
    while done < total and outcome is None:
        size = min(steps_per_cycle, total - done)
        final = frames and total - done <= steps_per_cycle
        size = min(size, max(1, steps_per_cycle // frames)) if final else size
        rows = np.empty((size + 1, 2 * n + 4))
        did, status = hub.march(done, size, state, held, arrays, steps, drive.acceleration, modes.mass, model.kind,
                                model.follow, c, work, GOAL * model.limit, travel, ledger, rows)
        rows = rows[:did + 1]
        if status == 2:
            raise Missing(f"the bond list outgrew {c.bondlist.shape[1]} entries at step {done + did}; loosen "
                          "accuracy.tail or accuracy.merge, or use reading = \"stretch\" with order = 1")
        if status == 3:
            raise NotConverged(f"the motion is not finite at step {done + did}")
        if status == 1:
            outcome = Outcome.EXCEEDS_TRAVEL
        if final:
            snapshots.append((done * prop.dt, {"bonds": c.bonds.copy(), "stretch": c.stretch.copy(),
                                               "b": c.b.copy(), "slide": float(modes.slide @ state[:, 0])}))
        keep = _thinned(rows, n)
        if len(last) == last.maxlen and samples < MOST_KEPT:
            old_first, old = last[0]
            pick = _thinned(old, n)
            kept.append(old[pick])
            kept_at.append(old_first + pick)
            samples += len(keep)
        last.append((done, rows[:-1] if done + did < total and outcome is None else rows))
        extremes.append(_extremes(rows, modes, prop.dt))
        done += did
        if progress is not None:
            progress(done / total)
    if ledger[7]:
        raise NotConverged(f"{int(ledger[7])} of {done} steps missed the force residual {GOAL:.0e} of the friction "
                           "limit; raise accuracy.steps_per_cycle")
    return _collect(modes, drive, prop, last, kept, kept_at, extremes, ledger, state, held, c, hub, model, outcome,
                    snapshots, done / steps_per_cycle)


def _extremes(rows, modes, dt) -> tuple:
    """(smallest, largest) output of a cycle, found between the samples by the cubic through values and rates."""
    n = modes.omega.size
    y, v = rows[:, :n] @ modes.output, rows[:, n:2 * n] @ modes.output
    return hermite_extremes(y, v, dt)


def hermite_extremes(y, v, dt) -> tuple:
    """Smallest and largest value of the piecewise cubic with values y (k,) and rates v (k,) at spacing dt."""
    low, high = float(y.min()), float(y.max())
    at = np.flatnonzero(v[:-1] * v[1:] < 0)
    if at.size:
        a, b, p, q = y[at], y[at + 1], v[at] * dt, v[at + 1] * dt
        # derivative 3 s^2 A + 2 s B + p of a + p s + B s^2 + A s^3
        big, mid = 2 * (a - b) + p + q, 3 * (b - a) - 2 * p - q
        root = np.sqrt(np.maximum(mid**2 - 3 * big * p, 0))
        for sign in (1, -1):
            denominator = mid + sign * root
            s = np.where(denominator != 0, -p / np.where(denominator != 0, denominator, 1), -1.0)
            inside = (s >= 0) & (s <= 1)
            value = (a + p * s + mid * s**2 + big * s**3)[inside]
            if value.size:
                low, high = min(low, float(value.min())), max(high, float(value.max()))
    return low, high


def _collect(modes, drive, prop, last, kept, kept_at, extremes, ledger, state, held, c, hub, model, outcome, snapshots,
             cycles) -> MarchResult:
    rows = np.concatenate([part for _, part in last])
    first = last[0][0]
    window = _response(rows, first, prop.dt, modes, drive)
    response = window
    if kept:
        early = np.concatenate(kept)
        number = np.concatenate(kept_at)
        head = _response(early, 0, prop.dt, modes, drive)
        head = _at(head, number, prop.dt, modes, drive, early)
        response = Response(*(np.concatenate([getattr(head, k), getattr(window, k)]) for k in (
            "time", "modal", "modal_rate", "slide", "slide_rate", "output", "output_rate", "acceleration",
            "base_acceleration", "force", "slip")))
    _, energy, _ = hub.contact_state(model.kind, c, float(modes.slide @ state[:, 0]), float(held[0]))
    motion = 0.5 * modes.mass * float(np.sum(state[:, 1]**2 + (modes.omega * state[:, 0])**2))
    names = ("work_in", "viscous", "power", "friction", "peak_stored", "iterations", "worst_iterations")
    book = dict(zip(names, map(float, ledger))) | {"stored": motion + energy}
    return MarchResult(response, window, np.array(extremes), book, outcome, snapshots, cycles)


def _at(response, number, dt, modes, drive, rows) -> Response:
    """The same samples with their true step numbers (thinned samples are not equally spaced)."""
    from dataclasses import replace

    time = number * dt
    base = drive.acceleration * np.sin(drive.omega * time)
    change = base - response.base_acceleration
    return replace(response, time=time, base_acceleration=base,
                   acceleration=response.acceleration + change * (1 - modes.base @ modes.output))
