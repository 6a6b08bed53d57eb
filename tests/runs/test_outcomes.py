"""Outcome of runs, engine that they choose, and the sentences that warn of what a reader would not expect."""

import re

import pytest
from scene_runs import load_scene, run_scene
from scene_texts import (
    COATED,
    COULOMB,
    DRIVE,
    KILOGRAM,
    MODE,
    NONLOCAL,
    PIECE,
    PLASTIC,
    POINT,
    SHEAR,
    SLIDE,
    STRUCTURE,
    SWEEP,
    make_friction_table,
)

import patchfem as pf
from patchfem.core import NotConverged
from patchfem.event_driven import cases
from patchfem.runs.bench import bench

SINE = '[slide]\nkind = "sine"\nfrequency = "1 Hz"\ncycles = 1\namplitude = "1 um"\n'
COULOMB_RIG = POINT + COULOMB + STRUCTURE
PLASTIC_RIG = POINT + PLASTIC + STRUCTURE
TANH_RIG = POINT + make_friction_table("tanh") + STRUCTURE
COATED_RIG = COATED + COULOMB + STRUCTURE
TILTED = COATED + '[contact.tilt]\nangle = "0.02 mrad"\n'
RELEASE = MODE + '[drive]\nkind = "free"\ndisplacement = "0.3 mm"\nduration = "0.1 s"\n'
STEP = MODE + '[drive]\nkind = "force"\nwaveform = "step"\nforce = "100 N"\nduration = "0.1 s"\n'
SWEPT = MODE + SWEEP.replace("3 g", "6 g").replace("80", "60").replace("120", "135")
LEVELS = (
    MODE + '[drive]\nkind = "base"\nwaveform = "levels"\nfrequency = "143 Hz"\n'
    'levels = ["3 g", "6 g"]\ncycles = 15\n'
)
BOUNDED_SWEEP = (
    MODE + SWEEP.replace("3 g", "0.1 g").replace("80", "1") + '[accuracy]\nmethod = "harmonic"\n'
)
DAMPED = "structure.mode.axial.damping=0.3; "
UNDAMPED = "structure.mode.axial.damping=0; "
HARMONIC = "accuracy.method=harmonic; "
GROWING = "friction.kinetic=0.06; friction.rest_growth=2 m/s^2; friction.slip_growth=50 um; friction.rest_speed=10 um/s; "
DWELL = (
    POINT + NONLOCAL.replace("1 um", "2 um") + '[slide]\nkind = "dwell"\nspeed = "10 mm/s"\n'
    'distance = "200 um"\nhold = "1 ms"\ndistance_after = "20 um"\n'
    "[accuracy]\nsteps_per_cycle = 2000\n"
)
BLOCK = PIECE + 'load = "26 lbf"\nsubstrate = "steel"\nelement_size = "0.5 mm"\n'
IWAN_RIG = POINT + make_friction_table("iwan") + STRUCTURE
BOUC_WEN = (
    POINT + '[friction]\nlaw = "bouc-wen"\nstatic = 0.3\nstiffness = "1e8 N/m"\nexponent = 2.0\n'
    '[slide]\nkind = "sine"\namplitude = "2 um"\nfrequency = "1 Hz"\ncycles = 1\n'
)
BEATING = POINT + COULOMB + SINE
# Scene, changes, outcome, a pattern of one of its warnings and notes, and a pattern of none of them.
RUNS = [
    # ---- drives
    (POINT + COULOMB + RELEASE, "", "stuck", "", ""),
    (RELEASE, "", "transient", "", ""),
    (RELEASE, DAMPED, "steady", "", ""),
    (POINT + COULOMB + STEP, "drive.duration=0.5 s", "stuck", "", ""),
    (STEP, DAMPED, "steady", "", ""),
    (POINT + COULOMB + SWEPT, "", "transient", "changes until the end", ""),
    (SWEPT, "drive.from=100 Hz; drive.to=143 Hz", "transient", "changes until the end", ""),
    (POINT + COULOMB + LEVELS, "", "transient", "", ""),
    (POINT + COULOMB + LEVELS, 'drive.levels=["6 g", "3 g"]; drive.cycles=80', "stuck", "", ""),
    (POINT + PLASTIC + RELEASE, "", "stuck", "", ""),
    (PLASTIC_RIG, UNDAMPED + HARMONIC + "drive.acceleration=8 g", "grows", "", ""),
    # ---- ends of a run
    (
        COULOMB_RIG,
        "structure.travel=5 mm; structure.stiffening.cubic=-1e14 N/m^3; drive.acceleration=60 g",
        "exceeds_travel",
        "softening spring",
        "",
    ),
    (
        COULOMB_RIG,
        "structure.stiffening.cubic=-1e14 N/m^3; drive.acceleration=60 g",
        "grows",
        "softening spring",
        "",
    ),
    # a march ends at twice the displacement sqrt(m omega^2/k3) at which the force of the spring vanishes
    (
        COULOMB_RIG,
        "accuracy.method=march; structure.stiffening.cubic=-1e14 N/m^3; drive.acceleration=60 g",
        "grows",
        "beyond a displacement of 169 um the motion grows without limit.*softening spring",
        "",
    ),
    (
        PLASTIC_RIG,
        "accuracy.method=march; structure.stiffening.cubic=-1e14 N/m^3; drive.acceleration=60 g",
        "grows",
        "beyond a displacement of 169 um the motion grows without limit",
        "",
    ),
    (COATED_RIG, "drive.acceleration=60 g", "leaves_contact", "", ""),
    (COATED_RIG, HARMONIC + "drive.acceleration=60 g", "leaves_contact", "", ""),
    (
        COATED + COULOMB + LEVELS,
        'drive.levels=["5 g", "60 g", "5 g"]',
        "leaves_contact",
        "",
        "",
    ),
    (
        COATED_RIG,
        UNDAMPED + "drive.acceleration=9 g; drive.cycles=100; wear.coefficient=1e-14 m^2/N; wear.cycles=9",
        "leaves_contact",
        "nothing was worn",
        "",
    ),
    (
        COULOMB_RIG,
        UNDAMPED + "drive.acceleration=9 g; drive.cycles=100; wear.coefficient=1e-14 m^2/N; wear.cycles=9",
        "grows",
        "nothing was worn",
        "",
    ),
    # ---- effects outside the model
    (COATED + COULOMB + SINE, "slide.amplitude=1.1 mm", "done", "", "^the slide amplitude"),
    (
        COATED + COULOMB + SINE,
        "slide.amplitude=12.573 mm",
        "done",
        "^the slide amplitude, 12.6 mm, is 0.99 of the contact length 12.7 mm",
        "",
    ),
    (COATED + COULOMB + SINE, "slide.amplitude=12.827 mm", "leaves_contact", "is 1 of", ""),
    (
        TILTED + COULOMB + SINE,
        "slide.amplitude=3 mm",
        "done",
        r"^the slide amplitude, 3 mm, is 0.\d+ of the contact length [89]\.\d* mm",
        "",
    ),
    (
        BLOCK,
        'contact.upper.substrate={young = "1 MPa", poisson = 0.3, density = "1 kg/m^3"}',
        "done",
        "lowest Young",
        "",
    ),
    (
        BLOCK,
        'contact.upper.substrate={young = "1 GPa", poisson = 0.4995, density = "1 kg/m^3"}',
        None,
        "the elements become too stiff",
        "",
    ),
    (
        BLOCK,
        "contact.tilt.angle=18 mrad; contact.element_size=0.55 mm; accuracy.tolerance=0.1",
        None,
        "leave out contact.element_size",
        "",
    ),
    (BLOCK, "contact.element_size=3 mm", "done", "the 5 elements along the interface are too few", ""),
    # ---- bonds and loops
    (DWELL, GROWING + "friction.order=3", "done", "order = 3 and a growing", ""),
    (DWELL, GROWING + "friction.order=3; friction.static=1", "done", r"reaches (?P<friction_ratio_peak>\S+) times mu_s", ""),
    (DWELL, "friction.order=3", "done", "", "times mu_s N"),
    (
        DWELL,
        GROWING + "friction.reading=report",
        "done",
        "the initial bonds keep the bond length eps_0",
        "",
    ),
    (
        DWELL,
        GROWING + "friction.reading=report; friction.initial_bonds=0",
        "done",
        "",
        "initial bonds",
    ),
    (
        POINT + NONLOCAL + STRUCTURE,
        "friction.reading=report; friction.order=-0.5; drive.cycles=1; accuracy.steps_per_cycle=100",
        None,
        "infinite at the first instant",
        "",
    ),
    (BOUC_WEN, "", "done", "loop of the last cycle does not close.*set slide.cycles = 5$", ""),
    (BOUC_WEN, "slide.cycles=2", "done", "", "does not close"),
    (
        BEATING,
        "normal.amplitude=30 N; normal.frequency=1.1 Hz",
        "done",
        "loop of the last cycle does not close.*no steady loop is reached within 5 cycles$",
        "",
    ),
    # ---- steady states and sweeps
    (
        IWAN_RIG,
        HARMONIC + "drive.acceleration=0.2 g; drive.frequency=120 Hz",
        None,
        "the steady motion is therefore not unique",
        "",
    ),
    (
        IWAN_RIG,
        HARMONIC + "drive.acceleration=40 g; drive.frequency=120 Hz; normal.load=10 N",
        None,
        "",
        "not unique",
    ),
    (
        BOUNDED_SWEEP,
        "drive.from=100 Hz; drive.to=140 Hz",
        None,
        "the largest response lies at drive.to = 140 Hz.*raise drive.to",
        "",
    ),
    (
        BOUNDED_SWEEP,
        "drive.from=300 Hz; drive.to=320 Hz",
        None,
        "the largest response lies at drive.from = 300 Hz.*lower drive.from",
        "",
    ),
    (BOUNDED_SWEEP, "drive.from=120 Hz; drive.to=160 Hz", None, "", "the largest response lies at"),
    (
        BOUNDED_SWEEP + POINT + COULOMB,
        "normal.load=10 kN",
        "stuck",
        "sticks at all frequencies, and law 'coulomb' is rigid.*law 'elastic-plastic'",
        "the largest response lies at",
    ),
]  # fmt: skip


@pytest.mark.parametrize("text, changes, outcome, sentence, absent", RUNS)
def test_outcome_and_sentences(text, changes, outcome, sentence, absent):
    """A run has its outcome and its sentence. A run that changes until its end has no steady amplitude."""
    result = run_scene(
        text,
        changes,
        estimate="loop" in sentence or ("[slide]" not in text and "[drive]" not in text),
    )
    assert outcome in (None, str(result.outcome)), result.outcome
    sentences = [*result.warnings, *result.notes]
    found = [re.search(sentence, one, re.S) for one in ["", *sentences]]
    assert any(found), sentences
    # a named group of a pattern is the value of this measure
    for name, number in next(filter(None, found)).groupdict().items():
        assert float(number) == pytest.approx(result.measures[name].value, rel=5e-3)
    assert not absent or not any(re.search(absent, one) for one in sentences)
    if "changes until" in sentence:
        assert "relative_displacement_amplitude_steady" not in result.measures
    if "worn" in sentence:
        assert "worn_volume" not in result.measures


def test_always_comparison_with_longer_loop_never_ends_a_run(monkeypatch):
    """A complete run of a bench keeps its results if the longer run that shows a steady loop does not converge."""
    run_bench = bench.run_bench

    def refuse_longer(model, *arguments, **settings):
        """Compute a run of one cycle only."""
        if model.slide.cycles > 1:
            raise NotConverged("the force of a step has too large an error")
        return run_bench(model, *arguments, **settings)

    monkeypatch.setattr(bench, "run_bench", refuse_longer)
    warnings = run_scene(BOUC_WEN, "").warnings
    assert any(re.search("does not close.*; raise slide.cycles$", one) for one in warnings)


SHORT_BONDS = "friction.bond_length=0.1 nm; friction.kinetic=0.2; friction.rest_growth=9 m/s^2; friction.slip_growth=0.01 nm"
MANY = COATED.replace("0.5 mm", "10 um") + SHEAR + PLASTIC + KILOGRAM + DRIVE
BOND_RIG = POINT + NONLOCAL.replace("1 um", "5 um") + STRUCTURE
ENGINES = [  # Scene, changes and the engine that a plan chooses.
    (PLASTIC_RIG, "", "event_driven"),
    (PLASTIC_RIG, "accuracy.steps_per_cycle=400", "march"),
    (PLASTIC_RIG, "structure.stiffening.cubic=1e12 N/m^3", "event_driven"),
    (POINT + PLASTIC + MODE + SWEEP, "", "event_driven"),
    (IWAN_RIG, "", "event_driven"),
    (MANY, "", "event_driven"),  # 1271 elements slip one after the other
    (MANY, "drive.cycles=10030", "event_driven"),
    (BOND_RIG, GROWING, "event_driven"),
    (POINT + make_friction_table("lugre") + STRUCTURE, "friction.stribeck_speed=1 cm/s", "event_driven"),
    (BOND_RIG, "friction.order=0.5", "march"),
    (POINT + NONLOCAL + LEVELS, "", "event_driven"),
    (BOND_RIG, "structure.stiffening.cubic=1e12 N/m^3", "event_driven"),
    (POINT + COULOMB + SLIDE, "", "bench, closed form"),
    (POINT + PLASTIC + SLIDE, "", "bench, parallel elements"),
    (POINT + NONLOCAL + SLIDE, "", "bench, contact points"),
    (POINT + NONLOCAL + SLIDE, "friction.order=2", "bench, merged bond list"),
    (POINT + NONLOCAL + SLIDE, "friction.reading=report", "bench, merged bond list"),
    (POINT + NONLOCAL + SLIDE, "accuracy.quadrature=truncated", "bench, truncated bond list"),
    (TILTED + NONLOCAL + SLIDE, "contact.tilt.on=lower", "bench, contact points"),
    (TILTED + NONLOCAL + SLIDE, "contact.shear={}", "bench, contact points"),
]  # fmt: skip


@pytest.mark.parametrize("text, changes, engine", ENGINES)
def test_exact_plan_chooses_engine(text, changes, engine):
    """The plan names the engine that supports the scene with the smallest errors; a bench runs with it."""
    scene = load_scene(text, changes)
    run_plan = pf.plan(scene)
    assert run_plan.engine == engine
    if "bench" in engine:
        result = run_scene(text, changes + "; accuracy.steps_per_cycle=200", estimate=False)
        assert result.settings.engine == engine
        assert ("bond_list_about" in run_plan.unknowns) == engine.endswith("list")


def test_always_law_too_fast_for_events_moves_in_time_steps(monkeypatch):
    """A law that would need more steps from event to event than a run may take moves in time steps, and a note says so."""
    monkeypatch.setattr(cases, "MAX_STEPS", 1e5)  # not 3e6, which take 6 CPU s
    result = run_scene(BOND_RIG, SHORT_BONDS)
    assert result.settings.engine == "march"
    assert any("in time steps: from event to event the motion needs" in one for one in result.notes)


@pytest.mark.parametrize(
    "changes", ["10 urad", "1 urad", "1 urad; contact.step.height=1 um; contact.step.at=0 mm"]
)
def test_always_plan_predicts_full_contact_correctly(changes):
    """The plan predicts full contact only where the run finds it: at 10 urad elastic pieces touch on 94 % of the length."""
    text = COATED.replace('element_size = "0.5 mm"\n', "")
    changes = f"accuracy.tolerance=1e-2; contact.tilt.angle={changes}"
    verdict = pf.plan(load_scene(text, changes)).verdict
    fraction = run_scene(text, changes).measures["contact_fraction"].value
    assert any(line.endswith("the pieces touch everywhere") for line in verdict) == (fraction == 1)


def test_exact_motion_without_bound_or_energy_has_exact_measures():
    """With a damping ratio of 1e6 the mass moves with the base; an unbounded motion has no measures but its load; the
    energy of a stuck rig is round-off, and its balance zero."""
    peak = run_scene(
        TANH_RIG, "structure.mode.axial.damping=1e6; accuracy.method=march; drive.cycles=12"
    )
    measures = peak.measures
    assert measures["absolute_acceleration_peak"].value == pytest.approx(5 * 9.80665, rel=1e-6)
    assert measures["energy_balance"].value < 1e-12 and peak.outcome == "steady"
    unbounded = run_scene(COULOMB_RIG, UNDAMPED + HARMONIC + "normal.load=1 lbf")
    assert unbounded.outcome == "grows"
    amplitude = unbounded.measures["relative_displacement_amplitude"]
    assert amplitude.value is None and "no bounded motion" in amplitude.reason
    stuck = run_scene(COULOMB_RIG, "drive.acceleration=0.1 g; drive.cycles=12")
    assert stuck.outcome == "stuck" and stuck.measures["energy_balance"].value == 0
