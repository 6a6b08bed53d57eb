"""Random rigs of `hybrid` against the independent integrator; campaign `hybrid-rigs` of `campaigns`.

The group of a line names the laws and the kind of drive of the rig.
"""

from time import process_time

import numpy as np
from campaigns import Row
from hybrid_rigs import draw_spec, make_case
from motion_laws import LAWS, PressedSpringsLaw
from motion_read import compute_measures, evaluate_state
from motion_reference import ModalSystem, Motion

from patchfem.hybrid import cases, runs
from patchfem.hybrid.records import Status

REFERENCE_ERROR = 1e-6  # relative
ZERO = 1e-12  # relative to the values that the drive alone would give
LOAD_EVENT = (
    9  # number of the event in which the load of a Coulomb or tanh interface changes its sign
)


class RigMotion(Motion):
    """Motion of a spec of `hybrid_rigs`: every interface has a law and a load of its own."""

    def __init__(self, spec: dict, share: float = 0.04):
        self.spec = spec
        mass, omega = spec["mass"], spec["omega"]
        tones = [tone[1] for tone in spec["tones"]] + [face["omega"] for face in spec["faces"]]
        plant = ModalSystem(
            M=mass * np.eye(omega.size),
            C=np.diag(2 * mass * spec["zeta"] * omega),
            K=np.diag(mass * omega**2),
            base=mass * spec["base"],
            faces=spec["slides"],
            output=spec["output"],
            first=0.0,
            cubic=0.0,
            fastest=max(*omega, *tones) / (2 * np.pi),
        )
        breaks = [] if spec["rows"] is None else list(spec["rows"][0])
        # Names of `Motion`: size and seeded are the scales of accelerations [m s-2] and frequencies [1/s].
        numbers = {
            "drive": "tones",
            "law": "several",
            "frequency": 1 / spec["period"],
            "size": spec["acceleration"],
            "seeded": omega[0],
        }
        laws = [self.make_law(face, k) for k, face in enumerate(spec["faces"])]
        drive = (self.evaluate_drive, breaks, spec["kind"] != "release")
        self.set_equations(numbers, plant, drive, laws, share)
        self.is_pressed = [self.evaluate_load(k, 0.0)[0] >= 0 for k in range(len(laws))]

    def make_law(self, face: dict, k: int):
        """Return the law of interface k."""
        keys = {key: value for key, value in face["keys"].items() if value is not None}
        name, stiffness = keys.pop("law"), keys["stiffness"]
        limit = keys["static"] * face["load"]
        if name == "elastic-plastic":
            del keys["stiffness"]
            keys["bond_length"] = limit / stiffness
            if face["amplitude"]:
                return PressedSpringsLaw(
                    lambda t: self.evaluate_load(k, t),
                    keys["static"],
                    keys["bond_length"],
                    face["load"],
                )
        if name == "nonlocal":
            del keys["stiffness"]
        return LAWS[name](limit, **keys)

    def evaluate_drive(self, t: float) -> float:
        """Return the acceleration of the base [m s-2]."""
        if self.spec["rows"] is not None:
            return float(np.interp(t, *self.spec["rows"], right=0.0))
        return sum(a * np.sin(w * t + p) for a, w, p in self.spec["tones"])

    def evaluate_load(self, k: int, t: float, z=0.0) -> tuple:
        """Return the load [N] of interface k, negative as if the pieces pulled, and its rate without the motion."""
        face = self.spec["faces"][k]
        phase = face["omega"] * t + face["phase"]
        load = face["load"] + face["amplitude"] * np.cos(phase)
        by_motion = face["stiffness"] * np.sum(face["heave"] * z)
        return load - by_motion, -face["amplitude"] * face["omega"] * np.sin(phase)

    def load_ratios(self, t, y):
        """Return the load of every interface divided by its mean."""
        faces = self.spec["faces"]
        loads = [self.evaluate_load(k, t, y[: self.n])[0] for k in range(len(faces))]
        return np.array(
            [
                1.0 if isinstance(law, PressedSpringsLaw) else max(load, 0.0) / face["load"]
                for law, load, face in zip(self.laws, loads, faces)
            ]
        )

    def force_without_friction(self, t, y):
        """Return the modal forces without friction, with the change of the loads by the motion."""
        out = super().force_without_friction(t, y)
        for k, face in enumerate(self.spec["faces"]):
            if face["stiffness"]:
                load = max(self.evaluate_load(k, t, y[: self.n])[0], 0.0)
                out = out + face["heave"] * (load - self.evaluate_load(k, t)[0])
        return out

    def start(self):
        """Return the initial state."""
        y = super().start()
        y[: self.n] = self.spec["z"]
        y[self.n : 2 * self.n] = self.spec["v"]
        return y

    def guards(self) -> list:
        """Return the event functions, with the signs of the loads that vary."""
        out = super().guards()
        for k, (law, face) in enumerate(zip(self.laws, self.spec["faces"])):
            if face["amplitude"] and not isinstance(law, PressedSpringsLaw):
                sign = 1 if self.is_pressed[k] else -1
                out.append(
                    (
                        k,
                        LOAD_EVENT,
                        lambda t, y, k=k, sign=sign: (
                            sign * self.evaluate_load(k, t, y[: self.n])[0]
                        ),
                    )
                )
        return out

    def apply_event(self, t, y, k, g):
        """Apply event g of interface k."""
        if g == LOAD_EVENT:
            self.is_pressed[k] = not self.is_pressed[k]
            self.choose_modes(t, y, self.find_resting())
        else:
            super().apply_event(t, y, k, g)


def integrate(spec: dict, rtol: float = 1e-9) -> dict:
    """Return the measures of the last cycles of a spec: ten, or a tenth of the run where that is shorter."""
    window = max(1, min(10, spec["cycles"] // 10))
    motion = RigMotion(spec)
    end = spec["cycles"] * spec["period"]
    pieces = motion.run(end, rtol)
    measures = compute_measures(motion, pieces, spec["period"], spec["cycles"], window)
    # The work of all interfaces is that of the whole run.
    return measures | {"friction_work": evaluate_state(pieces, end)[-1]}


def find_errors(spec: dict, values: dict) -> dict:
    """Return the errors of the measures of a spec at the default tolerance, from a run with larger steps."""
    rtol = cases.DEFAULT_RTOL
    coarse = make_case(spec, runs.COARSE * rtol, cases.MIN_STEPS / runs.COARSE_STEP)
    return runs.estimate_errors(values, runs.run_case(coarse).values, rtol)


def compare_rig(seed: int, folder, earlier) -> dict:
    """Compare the rig of a seed with the independent integrator; see `campaigns`."""
    spec = draw_spec(seed)
    begin = process_time()
    case = make_case(spec)
    motion = runs.run_case(case)
    errors = find_errors(spec, motion.values)
    line = {
        "seconds": process_time() - begin,
        "engine": "hybrid",
        "group": [*sorted({face["keys"]["law"] for face in spec["faces"]}), spec["kind"]],
    }
    if motion.status is not Status.DONE:
        return line | {"rows": [], "refused": motion.message}
    sizes = {
        "relative_displacement_amplitude": spec["length"],
        "absolute_acceleration_peak": spec["acceleration"],
    }
    rows = []
    for name, truth in integrate(spec).items():
        if name in motion.values:
            doubt = REFERENCE_ERROR * abs(truth) + ZERO * sizes.get(name, 1.0)
            value, error = motion.values[name], errors[name]
            rows.append(Row(name, value, error, 0.0, float(truth), doubt))
    return line | {"rows": rows}
