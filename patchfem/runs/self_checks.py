"""Checks that a run makes of itself: two routes to one number, of which the second begins at the
scene.

A wrong factor in the chain from the mesh to the summary leaves the energy balance closed, because
both of its sides use the same wrong number. Each check here recomputes a number from the values of
the scene by a short formula and compares it with what the run found. The threshold follows from
what the two routes may differ by on a right run, so a failed check means a fault: the outcome
becomes `not_converged`, and a sentence states both numbers.

Notation: z, v modal coordinates and their rates, m the moving mass, s the slide participations, F
the friction force (positive against positive slip), a(t) the drive, T the length of the window of
the last cycles. Equation of motion of coordinate i (report, eq. 3.4): z_i'' + 2 zeta_i omega_i v_i
+ omega_i^2 z_i = -base_i a - s_i F/m.
"""

import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..core import Outcome
from ..dynamics import propagator
from .patch import values
from .results.result import Result, without_errors
from .rig import engines

ROUND_OFF = 1e-9  # relative; sums of some hundred terms of double precision stay below 1e-12
CONTACT_RESIDUAL = 1e-6  # relative; the contact solve balances the load to 1e-9 or better
STATED_ERRORS = (
    10.0  # times the stated error of a measure; an error that is too small is no fault of this kind
)
READING = 0.01  # relative; two readings of one smooth curve on a mesh or on samples
SAMPLED_PEAK = (
    0.05  # relative; a peak between two of 40 or more samples a cycle of the fastest motion
)
CUBIC_QUADRATURE = 2e-3  # relative; cubics through samples, for motions of up to a radian a step
STUCK_LENGTHS = (
    10.0  # elastic lengths that a stuck interface may be displaced by; a right run has at most 2
)
MIN_CYCLE_SAMPLES = 40  # a coarser window is not read
AT_MOST = "from the values of the scene at most"
AT_LEAST = "from the values of the scene at least"
LIMITED_LAWS = ("coulomb", "tanh", "elastic-plastic", "iwan", "bouc-wen", "convolution")
MAX_SLIP_CORRECTION = (
    0.05  # relative; equivalent damping over a window whose cycles differ as a steady run allows
)


class Finding(NamedTuple):
    """A number of the run, the same number by another route, and by how much the two may differ.

    route: words for the second number; phase_difference: |difference| of two complex numbers or of
    two curves, of which `found` and `expected` are the sizes.
    """

    quantity: str
    found: float
    expected: float
    threshold: float
    unit: str = ""
    route: str = "from the values of the scene"
    phase_difference: float = 0.0

    @property
    def difference(self) -> float:
        """By how much the two numbers differ."""
        return max(abs(self.found - self.expected), self.phase_difference)

    @property
    def is_failed(self) -> bool:
        """Whether the difference exceeds the threshold; a number that is not finite is left to
        other checks."""
        return bool(np.isfinite(self.difference) and self.difference > self.threshold)

    @property
    def sentence(self) -> str:
        """Sentence with both numbers for a person."""
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"a self-check of the run failed: {self.quantity} is {self.found:.6g}{unit}, but "
            f"{self.route} it is {self.expected:.6g}{unit}; they differ by {self.difference:.2g}{unit} (limit "
            f"{self.threshold:.2g}{unit}); do not use this result, and report it with the scene and what "
            "`patchfem doctor` prints"
        )


class Evidence:
    """What the checks read: a Result, and the scene as a table of numbers in SI."""

    def __init__(self, result: Result):
        self.result = result
        self.model = result.plan.model
        self.scene = tomllib.loads(self.model.source.resolved)

    def number(self, *keys) -> float | None:
        """Value of a key of the scene in SI, None if the scene does not have it."""
        value = self.scene
        for key in keys:
            if not isinstance(value, dict) or key not in value:
                return None
            value = value[key]
        return quantity(value)

    def value(self, name: str) -> float | None:
        """Value of a measure, None if the run does not have it."""
        measure = self.result.measures.get(name)
        return None if measure is None else measure.value

    def error(self, name: str) -> float:
        """Stated error of a measure with its floor, 0 where none is known."""
        measure = self.result.measures.get(name)
        return 0.0 if measure is None else (measure.error or 0.0) + measure.floor

    @property
    def area(self) -> float:
        """Area [m2] of the interface of all pairs."""
        contact = self.scene["contact"]
        return self.number("contact", "width") * self.model.patch.length * contact.get("pairs", 1)

    @cached_property
    def load(self) -> float | None:
        """Normal load [N] of the scene, None where an approach is given instead."""
        return self.number("normal", "load") or self.number("contact", "load")

    @cached_property
    def has_plain_friction(self) -> bool:
        """Whether one interface rubs under a load that does not change, with coefficients that do
        not change."""
        friction, model = self.scene.get("friction"), self.model
        if (
            friction is None
            or self.load is None
            or "wear" in self.scene
            or model.grooves is not None
        ):
            return False
        if model.load_varies if model.rig is None else model.rig.load_varies:
            return False
        across = model.slide is not None and model.slide.across is not None
        several = model.rig is not None and (
            len(model.rig.modes.interfaces) > 1 or bool(model.rig.names)
        )
        in_plane = model.rig is not None and model.rig.modes.lateral_faces is not None
        lists = "temperature" in friction or "spread" in friction
        return not (across or several or in_plane or lists)

    @cached_property
    def modes(self) -> "SceneModes | None":
        """Modes of [[structure.mode]], None where others or a bonded spring replace them."""
        structure = self.scene.get("structure", {})
        if (
            "mode" not in structure
            or "bonded" in structure
            or structure.get("measured", "free") != "free"
        ):
            return None
        columns = {
            key: np.array([quantity(mode[key]) for mode in structure["mode"]])
            for key in ("frequency", "damping", "slide", "base", "accelerometer")
        }
        if self.scene["drive"]["kind"] == "force":
            columns["base"] = -np.array([quantity(mode["output"]) for mode in structure["mode"]])
        return SceneModes(
            2 * np.pi * columns["frequency"],
            columns["damping"],
            columns["slide"],
            columns["base"],
            columns["accelerometer"],
            quantity(structure["moving_mass"]),
        )

    @cached_property
    def window(self):
        """Last cycles of a run under a sine, as a Response or BenchRun; None of other drives and of
        few samples."""
        window, frequency = self.result.window, self.frequency
        if window is None or frequency is None or window.time.size < 3:
            return None
        if self.model.rig is None:
            window = LastCycle(
                window.time[window.first :],
                window.slide[window.first :],
                window.force[window.first :],
            )
        cycles = (window.time[-1] - window.time[0]) * frequency
        is_whole = cycles > 0.5 and abs(cycles - round(cycles)) < 1e-6 * max(cycles, 1.0)
        return window if is_whole and (window.time.size - 1) / cycles >= MIN_CYCLE_SAMPLES else None

    @cached_property
    def frequency(self) -> float | None:
        """Frequency [Hz] of a drive or a slide that is a sine to the end, None of any other."""
        drive, slide = self.scene.get("drive"), self.scene.get("slide", {})
        if drive is None:
            return self.number("slide", "frequency") if slide.get("kind") == "sine" else None
        is_sine = drive.get("kind") in ("base", "force") and drive.get("waveform") == "sine"
        return self.number("drive", "frequency") if is_sine else None

    @cached_property
    def balance(self) -> "ForceBalance | None":
        """Friction by the equation of motion and by its samples, None where something else acts as
        well."""
        rig, modes, window = self.model.rig, self.modes, self.window
        if (
            rig is None
            or modes is None
            or window is None
            or not self.has_plain_friction
            or rig.bends
        ):
            return None
        engine = engines.ENGINES.get(self.result.extra.get("engine"))
        if engine is None or rig.strips_slide_apart or not modes.slide.any():
            return None
        if self.result.outcome in (Outcome.EXCEEDS_TRAVEL, Outcome.GROWS, Outcome.NOT_CONVERGED):
            return None
        size = self.number("drive", "acceleration")
        force = self.number("drive", "force")
        if size is None and force is None:  # of another kind, such as a displacement of the base
            return None
        drive = force / modes.mass if size is None else size
        return balance_of(modes, window, drive, 2 * np.pi * self.frequency)


class LastCycle(NamedTuple):
    """Time [s], slide [m] and friction force [N] of the last cycle of a bench, (k,) each."""

    time: np.ndarray
    slide: np.ndarray
    force: np.ndarray


class SceneModes(NamedTuple):
    """Modes as the scene writes them: omega [rad/s], zeta, slide, base, output [1], (n,) each, and
    the mass [kg]."""

    omega: np.ndarray
    zeta: np.ndarray
    slide: np.ndarray
    base: np.ndarray
    output: np.ndarray
    mass: float


class ForceBalance(NamedTuple):
    """First harmonics [N] of the friction force by the equation of motion and by its samples, of
    the slide [m]; what the samples leave open of the second [N], and the size [N] of the terms that
    the first is a difference of.
    """

    from_motion: complex
    from_samples: complex
    slide: complex
    sampling: float
    terms: float

    @property
    def threshold(self) -> float:
        """Largest difference [N] of the two first harmonics on a right run."""
        return self.sampling + CUBIC_QUADRATURE * self.terms


def quantity(value) -> float | None:
    """Number of a value in a resolved scene, such as 0.3 or "700.0 N"; None of other texts."""
    if isinstance(value, str):
        head = value.split()[0] if value else ""
        try:
            return float(head)
        except ValueError:
            return None
    return float(value) if isinstance(value, int | float) else None


def cubic_harmonic(time, value, rate, omega: float) -> complex:
    """Compute 2/T int y exp(-i omega t) dt of the cubics through samples (k,) and their rates, by
    Simpson's rule."""
    step = np.diff(time)
    middle = (value[1:] + value[:-1]) / 2 + step * (rate[:-1] - rate[1:]) / 8
    wave = np.exp(-1j * omega * time)
    wave_middle = np.exp(-1j * omega * (time[1:] + time[:-1]) / 2)
    ends = value * wave
    total = np.sum(step / 6 * (ends[:-1] + 4 * middle * wave_middle + ends[1:]))
    return complex(2 / (time[-1] - time[0]) * total)


def balance_of(modes: SceneModes, window, acceleration: float, omega: float) -> ForceBalance:
    """Compute the first harmonic of the friction force by its two routes.

    The equation of motion times exp(-i omega t), integrated by parts over the window: the harmonic
    of z'' is [v e + i omega z e] 2/T - omega^2 z1, that of v is [z e] 2/T + i omega z1. By the
    samples it is the trapezoidal rule; where the force is monotonic between two samples, that rule
    misses at most h |change of F|/2 per step. Twice as much is allowed, for a force that turns
    within a step.
    """
    time, span = window.time, window.time[-1] - window.time[0]
    wave = np.exp(-1j * omega * time)
    first, rest, size = (
        np.zeros(modes.omega.size, complex),
        np.zeros(modes.omega.size, complex),
        0.0,
    )
    drive = -1j * acceleration
    for i in range(modes.omega.size):
        z, v = window.modal[:, i], window.modal_rate[:, i]
        first[i] = cubic_harmonic(time, z, v, omega)
        ends = 2 / span * (z[-1] * wave[-1] - z[0] * wave[0])
        speed = ends + 1j * omega * first[i]
        inertia = 2 / span * (v[-1] * wave[-1] - v[0] * wave[0]) + 1j * omega * speed
        terms = (
            inertia,
            2 * modes.zeta[i] * modes.omega[i] * speed,
            modes.omega[i] ** 2 * first[i],
            modes.base[i] * drive,
        )
        rest[i] = -sum(terms)
        size += abs(modes.slide[i]) * sum(abs(term) for term in terms)
    scale = modes.mass / (modes.slide @ modes.slide)
    step, product = np.diff(time), window.force * wave
    samples = 2 / span * np.sum(step * (product[1:] + product[:-1]) / 2)
    sampling = 2 / span * np.sum(step * np.abs(np.diff(window.force)))
    return ForceBalance(
        complex(scale * (modes.slide @ rest)),
        complex(samples),
        complex(modes.slide @ first),
        float(sampling),
        float(scale * size),
    )


def check_interface_area(run: Evidence) -> Iterator[Finding]:
    """Compare the sum of the nodal areas with length × width × pairs.

    The nodal areas integrate a constant exactly, so the two differ by round-off; coordinates of a
    mesh file have some seven printed digits.
    """
    if run.result.patch is None:
        return
    found = float(run.result.patch.pieces.interface.weight.sum())
    tolerance = CONTACT_RESIDUAL if run.model.patch.mesh is not None else ROUND_OFF
    yield Finding("the sum of the nodal areas", found, run.area, tolerance * run.area, "m2")


def check_normal_load(run: Evidence) -> Iterator[Finding]:
    """Compare the sum of pressure × nodal area, and the measure `normal_load`, with the load of the
    scene.

    Equilibrium of the upper piece. The contact solve meets it to its residual.
    """
    if (
        run.result.patch is None
        or run.scene.get("contact", {}).get("load") is None
        or run.model.load_varies
    ):
        return
    pressure = run.result.patch.pressure
    if pressure.outcome is Outcome.NO_CONTACT or run.result.outcome is Outcome.NO_CONTACT:
        return
    total = float(pressure.sigma_n @ run.result.patch.pieces.interface.weight)
    for quantity_name, found in (
        ("the integral of the normal stress", total),
        ("the measure normal_load", run.value("normal_load")),
    ):
        if found is not None:
            yield Finding(quantity_name, found, run.load, CONTACT_RESIDUAL * run.load, "N")


def check_stiffness_bounds(run: Evidence) -> Iterator[Finding]:
    """Compare `normal_stiffness` and `tangential_stiffness` with the bounds of a layered column.

    Two alike-long pieces that are held over their whole far faces. A uniform strain is admissible
    (potential energy): the stiffness is at most that of columns M A/H in series, M = E (1 - nu)/((1
    + nu)(1 - 2 nu)) in plane strain and E/(1 - nu^2) in plane stress; in shear G A/H. Where the
    whole interface bears and nothing lies between the pieces, a uniform stress is admissible
    (complementary energy): at least E' A/H, E' = E/(1 - nu^2) or E. Contact over a part of the
    interface and asperities only soften. Elements on bilinear cells contain the uniform strain and
    are stiffer than the continuum, so they lie between the same bounds. The stated errors of the
    measures are added.
    """
    patch, found = run.result.patch, run.model.patch
    if (
        patch is None
        or found.mesh is not None
        or run.value("normal_stiffness") is None
        or found.outlined
    ):
        return
    if any(
        piece.length > found.length * (1 + ROUND_OFF) or piece.corner(found.length / 2) != "sharp"
        for piece in (found.lower, found.upper)
    ):
        return
    flexibility = {"column": 0.0, "stress": 0.0, "shear": 0.0}
    for piece in (found.lower, found.upper):
        for material, thickness in (
            (piece.substrate, piece.height - piece.thickness),
            (piece.coating and piece.coating.material, piece.thickness),
        ):
            if not thickness:
                continue
            young, nu = material.young, material.poisson
            if found.plane == "strain":
                column, stress = young * (1 - nu) / ((1 + nu) * (1 - 2 * nu)), young / (1 - nu**2)
            else:
                column, stress = young / (1 - nu**2), young
            for name, modulus in (
                ("column", column),
                ("stress", stress),
                ("shear", young / (2 * (1 + nu))),
            ):
                flexibility[name] += thickness / (modulus * run.area)
    normal, shear = run.value("normal_stiffness"), run.value("tangential_stiffness")
    slack = {
        name: READING * run.value(name) + STATED_ERRORS * run.error(name)
        for name in ("normal_stiffness", "tangential_stiffness")
    }
    upper = 1 / flexibility["column"]
    yield Finding(
        "normal_stiffness", normal, min(normal, upper), slack["normal_stiffness"], "N/m", AT_MOST
    )
    yield Finding(
        "tangential_stiffness",
        shear,
        min(shear, 1 / flexibility["shear"]),
        slack["tangential_stiffness"],
        "N/m",
        AT_MOST,
    )
    if patch.active.all() and not patch.skinned and patch.strips is None:
        yield Finding(
            "normal_stiffness",
            normal,
            max(normal, 1 / flexibility["stress"]),
            slack["normal_stiffness"],
            "N/m",
            AT_LEAST,
        )


def check_pressure_measures(run: Evidence) -> Iterator[Finding]:
    """Compare the measures of the pressure with the nodal pressures and with load/(length × width).

    mean = loaded_fraction × pressure_peak is the definition of the first; the peak is at least the
    mean; the moment is the sum of force × x; each edge of the contact lies within one cell beside
    its last node. Measures may come from another mesh than the nodal pressures, hence their stated
    errors.
    """
    patch = run.result.patch
    names = ("loaded_fraction", "pressure_peak", "moment", "contact_fraction", "normal_load")
    if patch is None or patch.strips is not None or any(run.value(name) is None for name in names):
        return
    if patch.pressure.outcome is Outcome.NO_CONTACT or "wear" in run.scene:
        return
    fraction, peak, moment, share, load = (run.value(name) for name in names)
    mean, weight = load / run.area, patch.pieces.interface.weight
    relative_errors = run.error("loaded_fraction") / fraction + run.error("pressure_peak") / peak
    relative = STATED_ERRORS * relative_errors
    yield Finding(
        "the mean pressure, loaded_fraction × pressure_peak,",
        fraction * peak,
        mean,
        (READING + relative) * mean,
        "Pa",
    )
    force = patch.pressure.sigma_n * weight
    yield Finding(
        "the moment of the pressure",
        moment,
        float(force @ patch.x),
        READING * load * run.model.patch.length / 2 + STATED_ERRORS * run.error("moment"),
        "N m",
    )
    cells = float(values.edge_cells(patch.x, patch.active).sum())
    bearing = float(weight[patch.active].sum()) / run.area
    yield Finding(
        "contact_fraction",
        share,
        bearing,
        READING
        + 2 * cells / run.model.patch.length
        + STATED_ERRORS * run.error("contact_fraction"),
    )


def check_modes(run: Evidence) -> Iterator[Finding]:
    """Compare the modes that the engine moves with those of the scene.

    [[structure.mode]]: frequency, damping ratio and participations of each. Masses and springs: the
    sum of omega^2 is the trace of M^-1 K, the sum of spring stiffness/mass over the masses that a
    spring joins. Both hold to round-off.
    """
    rig = run.model.rig
    if rig is None:
        return
    modes, structure = run.modes, run.scene["structure"]
    if modes is not None and modes.omega.size == rig.modes.omega.size:
        pairs = (
            ("natural frequency", rig.modes.omega / (2 * np.pi), modes.omega / (2 * np.pi), "Hz"),
            ("damping ratio", rig.modes.zeta, modes.zeta, ""),
            ("slide", rig.modes.slide, modes.slide, ""),
            ("base", rig.modes.base, modes.base, ""),
            ("output", rig.modes.output, modes.output, ""),
        )
        for name, found, expected, unit in pairs:
            for k, (one, other) in enumerate(zip(np.asarray(found, float), expected)):
                yield Finding(
                    f"the {name} of mode {k + 1}",
                    float(one),
                    float(other),
                    ROUND_OFF * np.abs(expected).max(initial=0.0),
                    unit,
                )
    elif (
        "masses" in structure
        and "bonded" not in structure
        and structure.get("measured", "free") == "free"
    ):
        masses = [quantity(mass) for mass in structure["masses"]]
        trace = sum(
            quantity(spring["stiffness"]) / masses[place - 1]
            for spring in structure.get("spring", ())
            for place in spring["between"]
            if place
        )
        found = float(np.sum(rig.modes.omega**2))
        yield Finding(
            "the sum of the squares of the natural frequencies",
            found,
            trace,
            1e-6 * trace,
            "rad2/s2",
        )


def check_step_compliance(run: Evidence) -> Iterator[Finding]:
    """Compare the motion of the interface per friction force of a step with its closed form.

    A constant force F over a step h moves coordinate i by (s_i F/m) g(h), g = (1 - exp(-zeta omega
    h) (cosh r h + zeta omega sinh(r h)/r))/omega^2 with r = omega (zeta^2 - 1)^1/2, or h^2/2 for a
    rigid mode. So the compliance is sum s_i^2 g_i(h)/m = s.s h^2/(2m) (1 - 2 zeta omega h/3 -
    (omega h)^2/12 + ...). The propagator is exact; the closed form loses digits as eps/(omega h)^2,
    below 1e-8 for the steps that are compared.
    """
    modes, rig = run.modes, run.model.rig
    if modes is None or run.result.extra.get("engine") != "march" or run.frequency is None:
        return
    if len(rig.modes.interfaces) != 1 or rig.modes.damping is not None or rig.bends:
        return
    found = propagator.propagator(rig.modes, rig.drive, run.result.extra["steps_per_cycle"])
    step = 1 / (run.frequency * run.result.extra["steps_per_cycle"])
    turn = modes.omega * step
    if found.beta.shape != (1, 1) or not (turn > 1e-4).all():
        return
    root = turn * np.sqrt(modes.zeta**2 - 1 + 0j)
    fade = np.exp(-modes.zeta * turn)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # of a mode that is locked
        ratio = np.where(np.abs(root) > 1e-6, np.sinh(root) / np.where(root == 0, 1, root), 1.0)
        gain = (1 - (fade * (np.cosh(root) + modes.zeta * turn * ratio)).real) / modes.omega**2
    expected = float(modes.slide**2 @ gain / modes.mass)
    if not np.isfinite(expected):
        return
    yield Finding(
        "the motion of the interface per friction force of a time step",
        float(found.beta[0, 0]),
        expected,
        CONTACT_RESIDUAL * expected,
        "m/N",
    )


def check_friction_harmonic(run: Evidence) -> Iterator[Finding]:
    """Compare the first harmonic of the friction force from the equation of motion with that from
    its samples.

    See `balance_of` for both routes and the threshold. `equivalent_stiffness` is Re(F1/q1) by
    definition.
    """
    balance = run.balance
    if balance is None:
        return
    size = abs(balance.from_samples)
    yield Finding(
        "the first harmonic of the friction force",
        size,
        abs(balance.from_motion),
        balance.threshold,
        "N",
        "from the equation of motion of the scene",
        abs(balance.from_motion - balance.from_samples),
    )
    stiffness = run.value("equivalent_stiffness")
    if stiffness is not None and abs(balance.slide) > 0:
        expected = (balance.from_samples / balance.slide).real
        # the slide enters as a divisor, so its quadrature counts in proportion
        slack = (balance.threshold + CUBIC_QUADRATURE * size) / abs(balance.slide)
        yield Finding(
            "equivalent_stiffness",
            stiffness,
            expected,
            slack + STATED_ERRORS * run.error("equivalent_stiffness"),
            "N/m",
        )


def check_friction_limit(run: Evidence) -> Iterator[Finding]:
    """Compare `friction_force_peak` with static × load, which no friction of a limited law exceeds.

    Laws that overshoot (lugre, growing bonds) are left out. A Coulomb contact of rigid pieces that
    slips bears at least kinetic × load; an elastic-plastic one that slides 4 bond lengths on a
    bench bears static × load.
    """
    peak = run.value("friction_force_peak")
    if (
        peak is None
        or run.result.outcome is Outcome.GROWS  # without bound, so that no error of the peak is known
        or not run.has_plain_friction
        or run.scene["friction"]["law"] not in LIMITED_LAWS
    ):
        return
    friction = run.scene["friction"]
    static = quantity(friction["static"])
    limit = static * run.load
    slack = CONTACT_RESIDUAL * limit + run.error("friction_force_peak")
    yield Finding("friction_force_peak", peak, min(peak, limit), slack, "N", AT_MOST)
    if run.result.patch is not None and (run.model.soft or run.model.side == "lower"):
        return
    slip, length = run.value("slip_amplitude"), quantity(friction.get("bond_length", "none"))
    least = None
    if (
        friction["law"] == "coulomb"
        and slip
        and run.result.outcome is not Outcome.STUCK
        and not run.model.soft
    ):
        least = (quantity(friction.get("kinetic", static)) or 0.0) * run.load
    elif (
        friction["law"] == "elastic-plastic"
        and run.model.rig is None
        and length is not None
        and (run.number("slide", "amplitude") or 0.0) > 4 * length
    ):
        least = limit
    if least is not None:
        yield Finding(
            "friction_force_peak", peak, max(peak, least), READING * limit + slack, "N", AT_LEAST
        )


def check_loop_area(run: Evidence) -> Iterator[Finding]:
    """Compare `loop_area` with the trapezoidal rule over slide and force, and with the damping
    ratio.

    Between two samples force and slide stay within their ranges where they are monotonic, so a step
    is missed by at most |change of F| |change of q|/2; twice as much is allowed.
    `equivalent_damping` is loop_area/(2 pi K A^2) with K and A of the first mode of the scene.
    """
    window, area = run.window, run.value("loop_area")
    if window is None or area is None or not run.has_plain_friction:
        return
    if run.model.rig is not None and engines.ENGINES[run.result.extra["engine"]].closes == np.inf:
        return
    cycles = round((window.time[-1] - window.time[0]) * run.frequency)
    move, force = np.diff(window.slide), window.force
    expected = float(np.sum(move * (force[1:] + force[:-1]) / 2)) / cycles
    missed = float(np.sum(np.abs(move) * np.abs(np.diff(force)))) / cycles
    largest = float(np.sum(np.abs(move) * np.abs(force[1:]))) / cycles
    yield Finding(
        "loop_area",
        area,
        expected,
        missed + CUBIC_QUADRATURE * largest + STATED_ERRORS * run.error("loop_area"),
        "J",
    )
    damping, modes = run.value("equivalent_damping"), run.modes
    if (
        damping is None
        or modes is None
        or run.model.rig is None
        or run.result.outcome is not Outcome.STEADY
    ):
        return
    k = int(np.argmax(modes.omega > 0))
    amplitude = float(np.ptp(window.slide)) / 2
    if modes.slide[k] and amplitude > 0:
        stiffness = modes.mass * (modes.omega[k] / modes.slide[k]) ** 2
        expected = area / (2 * np.pi * stiffness * amplitude**2)
        slack = MAX_SLIP_CORRECTION + 2 * run.error("loop_area") / max(abs(area), 1e-300)
        yield Finding(
            "equivalent_damping",
            damping,
            expected,
            slack * abs(expected) + STATED_ERRORS * run.error("equivalent_damping"),
        )


def check_motion_measures(run: Evidence) -> Iterator[Finding]:
    """Compare the amplitude and the acceleration with those of the modal coordinates and the
    participations.

    Half the range of sum output_i z_i over the samples is at most the amplitude, and a few percent
    less at most; so is the largest absolute acceleration over samples. The acceleration of a sample
    is that of the equation of motion, output . z'' + a(t); friction that jumps at a sample is taken
    on either side of it, so single samples are left out by the median.
    """
    modes, window, rig = run.modes, run.window, run.model.rig
    if rig is None or modes is None or window is None or rig.modes.gauge is not None or rig.bends:
        return
    if run.result.outcome in (Outcome.EXCEEDS_TRAVEL, Outcome.GROWS, Outcome.NOT_CONVERGED):
        return
    amplitude, peak = (
        run.value("relative_displacement_amplitude"),
        run.value("absolute_acceleration_peak"),
    )
    expected = float(np.ptp(window.modal @ modes.output)) / 2
    if amplitude is not None:
        yield Finding(
            "relative_displacement_amplitude",
            amplitude,
            expected,
            SAMPLED_PEAK * expected + STATED_ERRORS * run.error("relative_displacement_amplitude"),
            "m",
        )
    largest = float(np.abs(window.acceleration).max())
    if peak is not None:
        slack = SAMPLED_PEAK * largest + STATED_ERRORS * run.error("absolute_acceleration_peak")
        yield Finding(
            "absolute_acceleration_peak",
            peak,
            max(peak, largest),
            slack,
            "m/s2",
            "from the samples of the last cycles",
        )
    if run.balance is None or run.scene["drive"]["kind"] != "base":
        return
    drive = run.number("drive", "acceleration") * np.sin(2 * np.pi * run.frequency * window.time)
    friction = np.outer(window.force, modes.slide) / modes.mass
    second = (
        -np.outer(drive, modes.base)
        - friction
        - 2 * modes.zeta * modes.omega * window.modal_rate
        - modes.omega**2 * window.modal
    )
    recomputed = second @ modes.output + drive
    size = float(np.median(np.abs(recomputed)))
    yield Finding(
        "the median size of the acceleration",
        float(np.median(np.abs(window.acceleration))),
        size,
        SAMPLED_PEAK * size + 1e-4,
        "m/s2",
        "from the equation of motion of the scene",
        float(np.median(np.abs(window.acceleration - recomputed))),
    )


def check_stuck(run: Evidence) -> Iterator[Finding]:
    """Compare the relative displacement of an interface that is said to stick with its elastic
    lengths.

    A stuck contact stays below its limit, so it is displaced from one side to the other by at most
    twice static × load/ stiffness (two bond lengths); rigid friction is not displaced at all. The
    pieces behind it give way by twice the limit over `tangential_stiffness`.
    """
    window = run.result.window
    if run.result.outcome is not Outcome.STUCK or window is None or not run.has_plain_friction:
        return
    friction = run.scene["friction"]
    limit = quantity(friction["static"]) * run.load
    length, stiffness = (
        quantity(friction.get(key, "none")) for key in ("bond_length", "stiffness")
    )
    elastic = length if length is not None else limit / stiffness if stiffness else 0.0
    if run.result.patch is not None:
        pieces = run.value("tangential_stiffness")
        elastic += limit / pieces if pieces else 0.0
        if run.model.patch.slide_spring:
            elastic += limit / run.model.patch.slide_spring
    whole = float(np.ptp(window.output)) if hasattr(window, "output") else 0.0
    yield Finding(
        "the relative displacement of an interface that sticks",
        float(np.ptp(window.slide)),
        0.0,
        STUCK_LENGTHS * elastic
        + CONTACT_RESIDUAL * whole
        + run.error("relative_displacement_amplitude"),
        "m",
    )


def check_energy_balance(run: Evidence) -> Iterator[Finding]:
    """Compare the energy balance of a bench with zero.

    Work = change of the stored energy + dissipated - created. A bench keeps each of them by the
    same rule, so what is missing falls with the steps; a hundredth of the energy exchanged is more
    than its first run leaves.
    """
    missing = run.value("energy_balance")
    if missing is not None and run.model.rig is None:
        yield Finding(
            "energy_balance", missing, 0.0, READING + STATED_ERRORS * run.error("energy_balance")
        )


CHECKS: tuple[Callable[[Evidence], Iterator[Finding]], ...] = (
    check_interface_area,
    check_normal_load,
    check_stiffness_bounds,
    check_pressure_measures,
    check_modes,
    check_step_compliance,
    check_friction_harmonic,
    check_friction_limit,
    check_loop_area,
    check_motion_measures,
    check_stuck,
    check_energy_balance,
)


def failed_findings(result: Result) -> list:
    """All Findings of a Result that exceed their thresholds."""
    run = Evidence(result)
    return [finding for check in CHECKS for finding in check(run) if finding.is_failed]


def with_self_checks(result: Result) -> Result:
    """Return the result, as `not_converged` with a sentence for each of CHECKS that failed.

    A model that was changed after it was built from its scene is not checked against the scene.
    """
    model = result.plan.model
    if result.outcome is Outcome.NOT_CONVERGED or not model.source.describes(model):
        return result
    failed = failed_findings(result)
    if not failed:
        return result
    return replace(
        result,
        outcome=Outcome.NOT_CONVERGED,
        measures=without_errors(result.measures, False),
        warnings=[*(finding.sentence for finding in failed), *result.warnings],
    )
