"""method = "harmonic": the steady motion of a scene found directly, and its curve over frequency or level.

Coulomb interfaces by shooting on the map of their events, other laws by harmonic balance. What is found is a motion
that repeats with the drive; its regime, multipliers and stability are named.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np

from .core import BaseSine, Measure, Outcome, PatchfemError
from .response.measures import harmonic, interface_loop, run_measures, slip_measures
from .simulate_interfaces import other_measures
from .simulate_structure import mode_stiffness

SAMPLES = 1024  # of the cycle that measures are read off
POINTS = 121  # of a curve by the event map


def refuse(scene, drive) -> None:
    """PatchfemError where no steady motion can be asked for."""
    where, waveform = scene.where("accuracy.method"), scene.drive.waveform
    if scene.drive.kind == "free" or waveform not in ("sine", "sweep", "levels"):
        raise PatchfemError(f"{where}: 'harmonic' finds the steady motion under a sine, or its curve over a sweep or "
                            "over levels; use method = \"march\"")
    if waveform == "sweep" and drive.displacement is not None:
        raise PatchfemError(f"{where}: 'harmonic' keeps the acceleration over a sweep; give drive.acceleration")


def steady(scene, settings, modes, drive, patch, load: float, say=None):
    """(simulate_rig.Raw, errors by measure, extra for the report) of the steady motion at a sine, or of the largest on
    a curve over a sweep or over levels."""
    refuse(scene, drive)
    from .simulate_rig import no_closed_form

    sine = drive if isinstance(drive, BaseSine) else None
    shear = scene.contact.gives_way if scene.contact is not None else ""
    at_sine = sine or BaseSine(1.0, 1.0, drive.moving)
    if scene.friction is None or not no_closed_form(scene, at_sine, shear):
        finder = _Events(scene, settings, modes, load, say)
    else:
        finder = _Balance(scene, settings, modes, drive, patch, say)
    if sine is not None:
        return finder.point(sine)
    curve, best = finder.curve(drive)
    raw, errors, extra = finder.point(best)
    return raw, errors, extra | {"curve": curve}


def drives_of(drive, count: int) -> list:
    """Sines of a curve: over a sweep `count` frequencies from end to end, over levels each of them."""
    if hasattr(drive, "low"):
        space = np.geomspace if drive.logarithmic else np.linspace
        return [BaseSine(drive.acceleration, 2 * np.pi * f, drive.moving) for f in space(drive.low, drive.high, count)]
    return [BaseSine(s.amplitude, s.omega, drive.moving) for s in drive.segments]


class _Events:
    """Coulomb interfaces, or none at all, by the event map."""

    def __init__(self, scene, settings, modes, load, say):
        from .simulate_exact import _forces

        self.scene, self.settings, self.modes, self.load, self.say = scene, settings, modes, load, say
        self.forces = _forces(scene, modes, load, 1.0)

    def found(self, drive, start=None):
        """dynamics.steady_events.Steady."""
        from .dynamics.steady_events import steady

        return steady(self.modes, drive, *self.forces, start=start)

    def point(self, drive) -> tuple:
        """The steady motion as a run of the exact engine that begins in it."""
        from .simulate_exact import run_exact

        begin = perf_counter()
        found = self.found(drive)
        few = replace(self.settings, cycles=2.0, window=1)
        raw = run_exact(self.scene, few, self.modes, drive, self.load, found.start)
        outcome = {"unbounded": Outcome.GROWS, "stuck": Outcome.STUCK}.get(found.regime, Outcome.STEADY)
        extra = {"regime": found.regime, "multipliers": found.multipliers, "residual": found.residual}
        raw = replace(raw, outcome=outcome, book=raw.book | {"iterations": 0.0}, seconds=perf_counter() - begin)
        return raw, {name: abs(v) * (1e-9 + found.residual) for name, v in raw.values.items()}, extra

    def curve(self, drive) -> tuple:
        """(curve as arrays by name, the sine of its largest amplitude)."""
        drives = drives_of(drive, POINTS)
        rows = [self._row(one) for one in drives]
        names = ("frequency", "level", "amplitude", "regime", "multiplier")
        curve = {name: np.array(column) for name, column in zip(names, zip(*rows))}
        finite = np.where(np.isfinite(curve["amplitude"]), curve["amplitude"], -1.0)
        return curve, drives[int(np.argmax(finite))]

    def _row(self, drive) -> tuple:
        found = self.found(drive)
        bounded = found.regime != "unbounded"
        return (drive.omega / (2 * np.pi), drive.acceleration, found.amplitude if bounded else np.nan, found.regime,
                float(np.abs(found.multipliers).max(initial=0.0)))


class _Balance:
    """Laws with memory and springs that bend, by harmonic balance."""

    def __init__(self, scene, settings, modes, drive, patch, say):
        from .compiled import load
        from .simulate_rig import contact_model

        load("simulate_harmonic_kernels", say)
        from .simulate_harmonic import Group, Interlock, Spring

        structure = scene.structure
        if len(modes.interfaces) > 1:
            raise PatchfemError(f"{scene.where('accuracy.method')}: 'harmonic' with several interfaces of laws other "
                                "than 'coulomb': not yet built; use method = \"march\"")
        parts = []
        if scene.friction is not None:
            parts.append((0, contact_model(scene, settings, patch, drive)))
        if structure.bonded is not None and structure.bonded.wavelength is not None:
            parts.append((0, Interlock(structure.bonded.stiffness, structure.bonded.wavelength)))
        if structure.stiffening is not None:
            parts.append((modes.output, Spring(0.0, structure.stiffening.cubic)))
        self.scene, self.settings, self.modes, self.patch = scene, settings, modes, patch
        self.group, self.tolerance = Group(modes, parts), scene.accuracy.tolerance

    def point(self, drive) -> tuple:
        """The steady motion, its measures read off one cycle; errors from half the harmonics and the balance's own."""
        from .simulate_harmonic import point, with_stability
        from .simulate_rig import Raw

        begin = perf_counter()
        found = point(self.modes, drive, self.group, self.scene.accuracy.harmonics, self.tolerance)
        fewer = point(self.modes, drive, self.group, max(1, found.harmonics // 2), self.tolerance)
        stable = with_stability(found, self.modes)
        values, response, book = self._measured(found, drive)
        rough = self._measured(fewer, drive)[0]
        # what a corner of the loop leaves out falls at least with the square of the harmonics
        errors = {name: abs(v - rough.get(name, v)) / 4 + abs(v) * min(found.error, 1.0) for name, v in values.items()}
        if "slip_start_phase" in errors:
            errors["slip_start_phase"] = min(errors["slip_start_phase"], np.pi / 2) + 2 * np.pi / SAMPLES
            errors["stick_fraction"] = errors.get("stick_fraction", 0.0) + 4 / SAMPLES
        held = values.get("slip_amplitude", 1.0) < self._held()
        regime = "stuck" if held else "stable" if stable.stable else "unstable"
        extra = {"regime": regime, "multipliers": stable.multipliers, "residual": found.residual,
                 "harmonics": found.harmonics}
        amplitude = np.array([values["relative_displacement_amplitude"]])
        raw = Raw(values, response, response, amplitude, (None, None), Outcome.STUCK if held else Outcome.STEADY, [],
                  book, perf_counter() - begin)
        return raw, errors, extra

    def _held(self) -> float:
        friction = self.scene.friction
        return 1e-3 * (friction.bond_length or 0.0) if friction is not None and friction.law != "tanh" else 0.0

    def _measured(self, found, drive) -> tuple:
        from .simulate_harmonic import periodic_response

        response = periodic_response(found, self.modes, drive, SAMPLES)
        if not drive.moving:
            response = replace(response, base_acceleration=0 * response.base_acceleration)
        book = _cycle_book(found, self.modes, drive)
        top = found.amplitude(self.modes.output)
        middle = (response.output.max() + response.output.min()) / 2
        extremes = np.array([[middle - top, middle + top]])
        values = run_measures(response, extremes, book, drive, 1)
        values["drift_per_cycle"] = 0.0
        if self.scene.friction is None:
            values.pop("friction_force_peak")
            return values, response, book
        values |= slip_measures(response, drive, SAMPLES) | other_measures(response, drive, SAMPLES)
        weight = np.full(response.time.size, 1.0)
        weight[[0, -1]] = 0.5
        q, f = (harmonic(response.time, weight, y, drive.omega) for y in (response.slide, response.force))
        bears = self.patch.pressure.load if self.patch is not None else self.scene.normal.load
        values |= interface_loop(response.slide, q, f, book["friction"], mode_stiffness(self.scene))
        return values | {"normal_load": bears}, response, book

    def curve(self, drive) -> tuple:
        """(curve as arrays by name through its folds, the sine of its largest amplitude)."""
        from .simulate_harmonic import levels, response

        if hasattr(drive, "low"):
            first = BaseSine(drive.acceleration, 2 * np.pi * drive.low, drive.moving)
            branch = response(self.modes, first, self.group, (drive.low, drive.high), self.scene.accuracy.harmonics,
                              self.tolerance, True)
        else:
            sizes = [s.amplitude for s in drive.segments]
            first = BaseSine(sizes[0], drive.segments[0].omega, drive.moving)
            branch = levels(self.modes, first, self.group, sizes if len(sizes) != 2 else [sizes[0], np.mean(sizes),
                            sizes[1]], self.scene.accuracy.harmonics, self.tolerance, True)
        amplitude = branch.amplitudes(self.modes.output)
        curve = {"frequency": np.array([p.omega / (2 * np.pi) for p in branch.points]),
                 "level": np.array([p.level for p in branch.points]), "amplitude": amplitude,
                 "regime": np.array(["stable" if p.stable else "unstable" for p in branch.points]),
                 "multiplier": np.array([np.abs(p.multipliers).max(initial=0.0) for p in branch.points]),
                 "folds": np.array(branch.folds)}
        best = branch.points[int(np.argmax(amplitude))]
        return curve, BaseSine(best.level, best.omega, drive.moving)


def _cycle_book(found, modes, drive) -> dict:
    """Energies of one cycle [J] from the harmonics: work of the drive, viscous and friction loss."""
    k = np.arange(found.modal.shape[0])
    rate = 1j * k[:, None] * found.omega * found.modal
    period = 2 * np.pi / found.omega
    push = -1j * found.level  # a sin = Re(-i a exp(i omega t))
    work = -modes.mass * period / 2 * float((np.conj(push) * (rate[1] @ modes.base)).real)
    viscous = modes.mass * period / 2 * float(np.einsum("ki,ij,kj->", np.conj(rate), modes.dampers, rate).real)
    slides = 1j * np.arange(found.coefficients.shape[1]) * found.omega * found.coefficients
    friction = period / 2 * float((np.conj(found.forces) * slides).real.sum())
    return {"work_in": work, "viscous": viscous, "friction": friction, "stored": 0.0, "power": abs(work),
            "peak_stored": float(modes.mass / 2 * np.sum(np.abs(rate)**2)), "iterations": float(found.iterations)}


def curve_measures(extra: dict) -> dict:
    """Measures of a curve: where its largest amplitude lies."""
    curve = extra.get("curve")
    if curve is None:
        return {}
    finite = np.where(np.isfinite(curve["amplitude"]), curve["amplitude"], -1.0)
    k = int(np.argmax(finite))
    spacing = float(np.abs(np.diff(curve["frequency"])).max(initial=0.0))
    return {"peak_frequency": Measure(float(curve["frequency"][k]), "Hz", spacing, spacing)}

