"""Modes that feel the whole wrench of the contact: normal force, moment and friction under the load of the moment.

The upper holder moves from its solved preload by heave h = normal . z and pitch th = pitch . z; the nodal forces are
those of the unilateral contact at approach delta0 - h and rotation theta0 + th (`contact.atlas`), the modes count from
the preloaded equilibrium: modal force normal (N - N0) + pitch (M - M0) - slide F. The holder's rotational spring is in
series with the pitch, a compliance x_i x_j/K beside that of the pieces.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from .compiled import load as compiled
from .contact.atlas import Atlas
from .core import ModalBasis, Outcome, PatchfemError, Response, Start
from .simulate_march import GOAL, MOST_KEPT, MarchResult, _extremes, _joined, _phasor, _thinned

COULOMB, PLASTIC, POINTS, RATE = 0, 1, 2, 4
PRESS = ("normal_load", "normal_moment", "normal_energy", "heave", "turn")


@dataclass(frozen=True, eq=False, slots=True)
class Rubbing:
    """A law of friction under a load that changes: kind and numbers as in `simulate_rub_kernels`; static: mu_s, which
    times the preload is the scale of the residuals."""

    kind: int
    static: float
    force: tuple
    growth: tuple = (-1.0, 1.0, 1.0, 1.0, 1.0, 0.0)
    length: float = 0.0


def coulomb(static: float, kinetic: float | None = None) -> Rubbing:
    """Set-valued Coulomb friction on the resultant load."""
    return Rubbing(COULOMB, static, (static, static if kinetic is None else kinetic, 0.0, 1.0))


def rate(static: float, speed: float) -> Rubbing:
    """Eq. 2.4, mu N tanh(v/v_0), v_0 [m/s]."""
    return Rubbing(RATE, static, (static, speed, 0.0, 1.0))


def plastic(static: float, length: float) -> Rubbing:
    """Eq. 3.12 at every point under its own load, length [m]."""
    return Rubbing(PLASTIC, static, (static, static, length, 1.0), length=length)


def bonds(law) -> Rubbing:
    """The stretch reading with p = 1 of a friction.law.Bonds at every point. PatchfemError for any other."""
    if law.reading != "stretch" or law.order != 1 or law.breakaway:
        raise PatchfemError("friction: under a load that changes only reading = \"stretch\" with order = 1 and no "
                            "breakaway; the others are not yet built")
    from .simulate_march import growth_numbers

    return Rubbing(POINTS, law.static, (law.static, law.static, law.length, law.initial), tuple(growth_numbers(law)),
                   law.length)


def atlas_of(patch, spring: float = 0.0) -> Atlas:
    """The atlas around the solved state of a patch; spring [N m/rad] of the holder's rotation, 0: rigid.

    PatchfemError for a smooth skin, strips, or a patch that carries no load.
    """
    if patch.skin is not None:
        raise PatchfemError("contact.asperities: the exponential and hertz laws beside modes with normal or pitch: use "
                            "law = \"linear\"; not yet built")
    if patch.strips is not None:
        raise PatchfemError("contact.strips: beside modes with normal or pitch: leave it out; not yet built")
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    c, x = patch.pieces.normal, patch.x
    if spring > 0:
        c = c + np.outer(x, x) / spring
    return Atlas(c, x, patch.pressure.gap - c @ force, force > 0)


def rows_of(modes: ModalBasis) -> np.ndarray:
    """(3, n): slide, heave and pitch per coordinate."""
    none = np.zeros(modes.omega.size)
    return np.stack([none if part is None else np.asarray(part, float)
                     for part in (modes.slide, modes.normal, modes.pitch)])


def strip_rows(basis: ModalBasis, offsets) -> np.ndarray:
    """(s, n): slide of strips at offsets y (s,) [m] from the middle, slide - y yaw (yaw > 0 turns +x to +y, so a piece
    at +y goes back); a moment about +z on the upper piece is sum y f of the friction f that resists."""
    yaw = np.zeros(basis.slide.size) if basis.yaw is None else basis.yaw
    return basis.slide - np.outer(offsets, yaw)


def contact_frequencies(modes: ModalBasis, atlas: Atlas) -> np.ndarray:
    """Natural frequencies [rad/s] of the modes on the preloaded contact set, without friction: what a step must
    resolve."""
    rows = rows_of(modes)[1:]
    q = atlas.reference.energy
    hessian = np.array([[q[3], -q[4]], [-q[4], q[5]]])
    return np.sqrt(np.maximum(np.linalg.eigvalsh(np.diag(modes.omega**2) + rows.T @ hessian @ rows / modes.mass), 0))


class _Run:
    """The arrays of one march and its clock."""

    def __init__(self, modes, drive, atlas, law, steps_per_cycle, travel, start, load, say):
        from .dynamics.propagator import GAUSS_W, propagator

        self.hub = compiled("simulate_wrench_kernels", say)
        press, rub = compiled("contact.press_kernels"), compiled("simulate_rub_kernels")
        steps = compiled("simulate_step_kernels")
        self.modes, self.drive, self.law, self.travel, self.load = modes, drive, law, travel, load
        self.prop = p = propagator(modes, drive, steps_per_cycle)
        rows = rows_of(modes)
        beta = np.einsum("in,n,jn->ij", rows, p.step[:, 0, 2], rows) / modes.mass
        self.steps = steps.Steps(p.step, p.gauss, p.sine, p.sine_gauss, GAUSS_W.copy(), p.dt, p.beta)
        arrays = atlas.arrays() if load is None else _one_point(float(load(np.zeros(1))[0]))
        self.book = press.Book(**arrays)
        arm = max(np.ptp(arrays["x"]) / 2, 1e-300) if load is None and np.ptp(arrays["x"]) > 0 else 1.0
        self.body = self.hub.Body(*(np.array(v) for v in (modes.omega, 2 * modes.zeta * modes.omega, modes.base,
                                                          modes.output)), rows, beta, float(arm))
        slot = press.begin(self.book, atlas.name(arrays)) if load is None else 0
        self.slot = np.array([slot])
        m = arrays["x"].size
        now = np.zeros(m)
        self.state = np.zeros((modes.omega.size, 2))
        if start is not None:
            self.state[:, 0], self.state[:, 1] = start.z, start.v
        self.preload = float(arrays["base"][0])
        if load is None:
            heave, turn = rows[1:] @ self.state[:, 0]
            self.slot[0] = press.locate(self.book, slot, -heave, turn)
            press.press_state(self.book, int(self.slot[0]), -heave, turn, now)
        else:
            now[0] = self.preload
        memory = np.zeros((3, m))
        memory[1 if law.kind == PLASTIC else 0] = now * (1.0 if law.kind == PLASTIC else law.force[3])
        self.rub = rub.Rub(np.array(law.force, float), memory, memory.copy(), now.copy(), now,
                           np.full(1, law.length), np.full(1, law.length), np.array(law.growth, float))
        self.held, self.ledger, self.totals = np.zeros(2), np.zeros(9), np.zeros(3)
        self.done, self.outcome, self.message = 0, None, ""
        self.limit = law.static * self.preload if law.static > 0 else self.preload
        self.peak = law.static * self.preload

    def cycle(self, size: int, frames: int, snapshots: list) -> tuple:
        """March `size` steps in `frames` pieces (0: one), a snapshot after each. (first step, rows, friction work)."""
        first, before, parts = self.done, self.ledger[8], []
        edges = np.unique(np.linspace(0, size, max(frames, 1) + 1).round().astype(int))
        for piece in np.diff(edges) if size else [0]:
            rows, press = np.empty((piece + 1, 2 * self.modes.omega.size + 6)), np.zeros((piece + 1, 5))
            loads = np.zeros(0) if self.load is None else \
                np.ascontiguousarray(self.load((self.done + np.arange(piece + 1)) * self.prop.dt), dtype=float)
            did, status = self.hub.march_wrench(self.done, int(piece), self.state, self.held, self.slot, self.body,
                                                self.steps, float(self.drive.acceleration), float(self.modes.mass),
                                                self.law.kind, self.rub, self.book, loads, GOAL * self.limit,
                                                float(self.travel), self.ledger, rows, press)
            self.done += did
            parts.append(np.concatenate([rows, press], axis=1)[:did + 1])
            self._judge(status)
            if frames:
                snapshots.append(self._snapshot(parts[-1][-1]))
            if self.outcome is not None:
                break
        return first, self._booked(np.concatenate([part[:-1] for part in parts[:-1]] + parts[-1:])), \
            self.ledger[8] - before

    def _booked(self, rows) -> np.ndarray:
        """Rows with friction work, energy dissipated and created since the start [J] before those of the pressure."""
        n = 2 * self.modes.omega.size
        work = rows[:-1, n + 4] * np.diff(rows[:, n])
        lost = work - np.diff(rows[:, n + 5])
        size = np.maximum(self.limit, np.abs(rows[:-1, n + 4]))
        digit = np.abs(rows[:-1, :n // 2]) @ np.abs(self.modes.slide)  # of the slide, a sum over the modes
        noise = size * (1e-12 * np.abs(np.diff(rows[:, n])) + 2e-15 * digit) \
            + 1e-14 * np.maximum(rows[:-1, n + 5], rows[1:, n + 5])
        parts = np.stack([work, np.where(lost > -noise, lost, 0.0), np.where(lost < -noise, -lost, 0.0)])
        sums = self.totals[:, None] + np.concatenate([np.zeros((3, 1)), np.cumsum(parts, axis=1)], axis=1)
        self.totals = sums[:, -1]
        return np.concatenate([rows[:, :n + 6], sums.T, rows[:, n + 6:]], axis=1)

    def _judge(self, status: int) -> None:
        if status == 1:
            self.outcome = Outcome.EXCEEDS_TRAVEL
        if status == 3:
            self.message = f"the motion is not finite at step {self.done}; raise accuracy.steps_per_cycle"
        if status == 4:
            self.message = f"no contact set fits the motion at step {self.done}; raise accuracy.steps_per_cycle"
        if status in (3, 4):
            self.outcome = Outcome.NOT_CONVERGED

    def _snapshot(self, row) -> dict:
        n = self.modes.omega.size
        return {"time": self.done * self.prop.dt, "slide": row[2 * n], "rate": row[2 * n + 1], "force": row[2 * n + 2],
                "slip": row[2 * n + 3], "heave": row[-2], "turn": row[-1], "nodal": self.rub.now.copy(),
                "memory": self.rub.memory.copy()}

    def check(self) -> None:
        """Mark the run not_converged when a step missed its residual; what was computed is kept."""
        if self.ledger[7]:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (f"{int(self.ledger[7])} of {self.done} steps missed the force residual {GOAL:.0e} of the "
                            "friction limit; raise accuracy.steps_per_cycle")

    def book_of(self, last) -> dict:
        """The energy ledger [J] at the last row, with the sets visited and the pivots made."""
        n = 2 * self.modes.omega.size
        motion = 0.5 * self.modes.mass * float(np.sum(self.state[:, 1]**2 + (self.modes.omega * self.state[:, 0])**2))
        names = ("work_in", "viscous", "power", "friction", "peak_stored", "iterations", "worst_iterations")
        _, _, built, pivots, renewed = map(int, self.book.meta)
        return dict(zip(names, map(float, self.ledger))) | {
            "stored": motion + float(last[n + 5]) + float(last[-3]), "contact_sets": built, "pivots": pivots,
            "renewed": renewed}


def _one_point(load: float) -> dict:
    """Arrays of a book that is never asked, for a load that is prescribed."""
    m, table = 1, np.zeros((1, 4))
    return {"c": np.ones((1, 1)), "x": np.zeros(m), "b": np.zeros(m), "tableau": table, "here": np.zeros(m, bool),
            "rows": np.zeros((1, 3, m)), "on": np.zeros((1, m), bool), "energy": np.zeros((1, 6)),
            "names": np.zeros(1, np.int64), "heads": np.full(2, -1, np.int64), "link": np.full(1, -1, np.int64),
            "node": np.zeros(m, np.int64), "wanted": np.zeros(m, bool), "base": np.array([load, 0.0, 0.0, 1.0, 1.0]),
            "side": np.zeros((2, 3, m)), "row": np.zeros(m + 3), "meta": np.zeros(5, np.int64)}


def _response(rows, number, dt, modes, drive, base) -> Response:
    """Histories of the samples with step numbers `number` (k,); base: (N0, M0)."""
    n = modes.omega.size
    z, speed, time = rows[:, :n], rows[:, n:2 * n], number * dt
    ground = drive.values(time)
    forces = np.stack([rows[:, 2 * n + 2], base[0] - rows[:, -5], base[1] - rows[:, -4]], axis=1)
    accel = -np.outer(ground, modes.base) - speed * (2 * modes.zeta * modes.omega) - z * modes.omega**2 \
        - forces @ rows_of(modes) / modes.mass
    total = accel @ modes.output + (ground if drive.moving else 0.0)
    extra = {"ledger": rows[:, [2 * n + 6, 2 * n + 5, 2 * n + 7, 2 * n + 8]].T}
    extra |= dict(zip(PRESS, rows[:, -5:].T))
    return Response(time, z, speed, rows[:, 2 * n], rows[:, 2 * n + 1], z @ modes.output, speed @ modes.output, total,
                    ground, rows[:, 2 * n + 2], rows[:, 2 * n + 3], extra)


def march(modes: ModalBasis, drive, atlas: Atlas | None, law: Rubbing, cycles: float, steps_per_cycle: int,
          window: int = 10, travel: float = np.inf, frames: int = 0, start: Start | None = None, load=None, say=None,
          progress=None) -> MarchResult:
    """March for `cycles` drive cycles at `steps_per_cycle` steps, from rest in the preloaded state or from `start`.

    load: function of times (k,) [s] to a prescribed load [N] >= 0 on one point, in place of the atlas; its modes have
    no normal and no pitch. As `simulate_march.march`, with normal_load [N], normal_moment [N m], normal_energy [J] of
    the preloaded contact, heave [m] and turn [rad] in `response.extra`.
    """
    if load is not None and any(part is not None and np.any(part) for part in (modes.normal, modes.pitch)):
        raise PatchfemError("structure.mode.normal: a load on one rigid point leaves no room for heave or pitch; name "
                            "[contact] in place of [normal]")
    run = _Run(modes, drive, atlas, law, steps_per_cycle, travel, start, load, say)
    total, n = round(cycles * steps_per_cycle), modes.omega.size
    last, kept, kept_at, extremes, phasors, snapshots, samples = deque(maxlen=max(window, 2)), [], [], [], [], [], 0
    size = total % steps_per_cycle or min(steps_per_cycle, total)
    while run.outcome is None and (run.done < total or not last):
        final = run.done + size >= total
        first, rows, work = run.cycle(size, frames if final else 0, snapshots)
        if len(last) == last.maxlen and samples < MOST_KEPT:
            pick = _thinned(last[0][1], n)
            kept.append(last[0][1][pick])
            kept_at.append(last[0][0] + pick)
            samples += len(pick)
        last.append((first, rows, work))
        extremes.append(_extremes(rows, modes, run.prop.dt))
        phasors.append(_phasor(rows, modes, first, steps_per_cycle))
        size = steps_per_cycle
        if progress is not None:
            progress(run.done / max(total, 1))
    run.check()
    base = (run.preload if load is None else 0.0, atlas.moment if load is None else 0.0)
    end = list(last)[-window:]
    rows, first = _joined(end)
    whole, begin = _joined(list(last))
    number = np.concatenate([*kept_at, begin + np.arange(len(whole))])
    full = _response(np.concatenate([*kept, whole]), number, run.prop.dt, modes, drive, base)
    tail = _response(rows, first + np.arange(len(rows)), run.prop.dt, modes, drive, base)
    return MarchResult(full, tail, rows[:-1, 2 * n + 4].copy(), np.array(extremes), np.array(phasors),
                       run.book_of(rows[-1]), run.outcome, snapshots, sum(work for _, _, work in end),
                       run.done / steps_per_cycle, run.message)
