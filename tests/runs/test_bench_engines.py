"""Compiled engines of a bench agree with the NumPy laws, and their errors, energy balance and
progress are right."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from patchfem import SceneError, build, plan
from patchfem.core import Missing
from patchfem.friction import MAX_LIST_SECONDS, steady_loop
from patchfem.runs import BenchOptions, solve_with_coarser
from patchfem.runs.bench import bench
from patchfem.runs.bench.averaged_law import distribute_slip_force
from patchfem.runs.bench.ledger import N_BLOCK_SAMPLES, SlideTask
from patchfem.runs.bench.step_by_step import slide_step_by_step
from patchfem.runs.run import run
from patchfem.scene import loads

POINT = '[normal]\nload = "100 N"\n'
PATCH = (
    '[contact]\nlength = "12.7 mm"\nwidth = "12.7 mm"\nheight = "6.35 mm"\nload = "100 N"\n'
    'element_size = "0.5 mm"\nsubstrate = "Ti-8Al-1Mo-1V"\n[contact.tilt]\nangle = "0.02 mrad"\n'
)
FRICTION = "[friction]\nstatic = 0.3\n"
BONDS = 'law = "nonlocal"\nbond_length = "2 um"\n'
GROWTH = 'kinetic = 0.15\nrest_growth = "2 m/s^2"\nslip_growth = "1 um"\nrest_speed = "10 um/s"\n'
SLIDES = {
    "sine": 'kind = "sine"\namplitude = "4 um"\nfrequency = "50 Hz"\ncycles = 2\n',
    "small": 'kind = "sine"\namplitude = "0.1 um"\nfrequency = "50 Hz"\ncycles = 2\n',
    "dwell": 'kind = "dwell"\nspeed = "1 mm/s"\ndistance = "20 um"\nhold = "0.3 s"\ndistance_after = "10 um"\n',
}  # fmt: skip
ROUND_OFF_LAWS = {
    "coulomb": 'law = "coulomb"\n', "coulomb that holds more": 'law = "coulomb"\nkinetic = 0.2\n',
    "tanh": 'law = "tanh"\nreference_speed = "1 mm/s"\n',
    "elastic-plastic": 'law = "elastic-plastic"\nbond_length = "2 um"\n',
    "averaged": 'law = "convolution"\nbond_length = "0.8 mm"\n',
    "bonds": BONDS + "initial_bonds = 0.4\n", "growing": BONDS + GROWTH,
}  # fmt: skip
SUM_LAWS = (
    [("stretch", order, growth) for order in (0, 0.5, 2.5) for growth in ("", GROWTH)]
    + [("report", order, growth) for order in (0, 0.5, 1, 2) for growth in ("", GROWTH)]
    + [("report", -0.5, "")]
)


def build_bench(law, slide, *sets, contact=POINT):
    """Return the model of a bench with a friction law and a slide."""
    return build(loads(contact + FRICTION + law + "[slide]\n" + SLIDES[slide], sets=sets))


def format_sum_law(reading, order, growth):
    """Return the [friction] keys of a nonlocal law that needs the sum over all bonds."""
    return (
        BONDS
        + growth
        + f'reading = "{reading}"\norder = {order}\n'
        + ("initial_bonds = 0\n" if order < 0 else "")
    )


def run_both_ways(model, steps, patch=None, frames=0):
    """Return the results of the compiled engine and of the law as an object, whose list keeps all bonds."""
    time, slide = model.slide.samples(steps)[:2]
    compiled = bench.run_bench(model, patch, steps, frames)
    choice = compiled.engine.choice
    if choice is not None:
        choice = replace(choice, tail=0.0, merge=0.0)
    engine = replace(compiled.engine, choice=choice)
    stepped = slide_step_by_step(SlideTask(model, patch, time, slide, frames, engine))
    return compiled, stepped


# ---- compiled engines and their NumPy versions


@pytest.mark.share(0, 4, 8, 10, 13, 17, 19, 23)
@pytest.mark.parametrize("slide", SLIDES)
@pytest.mark.parametrize("law", ROUND_OFF_LAWS)
def test_exact_compiled_bench_agrees_with_numpy_law(law, slide):
    """The compiled engine agrees with the law stepped in NumPy to round-off, in force, slip and energies."""
    compiled, stepped = run_both_ways(build_bench(ROUND_OFF_LAWS[law], slide), 80)
    limit = np.abs(stepped.force).max()
    assert compiled.force == pytest.approx(stepped.force, abs=1e-13 * limit)
    assert compiled.slip == pytest.approx(stepped.slip, abs=1e-18)
    assert compiled.ledger == pytest.approx(
        stepped.ledger, abs=1e-13 * np.abs(np.diff(stepped.ledger[0])).sum()
    )


@pytest.mark.share(0, 4, 8, 12)
@pytest.mark.parametrize(
    "reading, order, growth, slide",
    [
        pytest.param(*law, slide, marks=() if (k + n) % len(SLIDES) == 0 else pytest.mark.slow)
        for k, law in enumerate(SUM_LAWS)
        for n, slide in enumerate(SLIDES)
    ],
)
def test_exact_bond_list_agrees_with_numpy_sum_within_error(reading, order, growth, slide):
    """The bond list agrees with the NumPy sum over all bonds within its stated error, plus 1e-5 for
    the two points per strip, whose error falls with the step."""
    compiled, stepped = run_both_ways(
        build_bench(format_sum_law(reading, order, growth), slide), 60
    )
    error = compiled.engine.choice.error + (2e-5 if growth else 1e-5)
    assert compiled.engine.name.endswith("bond list")
    assert np.abs(compiled.force - stepped.force).max() <= error * 30
    assert (
        np.abs(compiled.ledger - stepped.ledger).max()
        <= 3 * error * np.abs(np.diff(stepped.ledger[0])).sum()
    )


@pytest.mark.parametrize(
    "law", ["coulomb that holds more", "averaged", "elastic-plastic", "growing"]
)
def test_exact_frames_of_patch_agree_with_numpy_law(law):
    """The tractions and displacements of the stored frames of a compiled patch agree with those of
    the law stepped in NumPy."""
    model = build_bench(ROUND_OFF_LAWS[law], "sine", contact=PATCH)
    patch = solve_with_coarser(model.patch, 1e-3, False)[0]
    compiled, stepped = run_both_ways(model, 40, patch, 5)
    peak_traction = np.abs(stepped.tau).max()
    assert (compiled.frames == stepped.frames).all() and compiled.tau.shape == (5, patch.x.size)
    assert compiled.force == pytest.approx(stepped.force, abs=1e-12 * np.abs(stepped.force).max())
    assert compiled.tau == pytest.approx(stepped.tau, abs=1e-12 * peak_traction)
    assert compiled.local == pytest.approx(stepped.local, abs=1e-17)


# ---- choice of the engine and its name


@pytest.mark.share(0, 1, 3, 4, 6)
@pytest.mark.parametrize("law, contact, name", [
    (ROUND_OFF_LAWS["coulomb"], POINT, "closed form"), (ROUND_OFF_LAWS["elastic-plastic"], POINT, "parallel elements"),
    (BONDS, POINT, "recursion"), (BONDS + "order = 2\n", POINT, "merged bond list"),
    (BONDS + 'reading = "report"\n', POINT, "truncated bond list"),
    (BONDS, PATCH + 'on = "lower"\n', "law step by step"), (BONDS, PATCH + "[contact.shear]\n", "bond points"),
    (ROUND_OFF_LAWS["coulomb"], PATCH + "[contact.shear]\n", "parallel elements"),
])  # fmt: skip
def test_exact_plan_names_engine_of_run(law, contact, name):
    """The plan names the engine that the run uses, and the length of its bond list, if it has one."""
    run_plan = plan(build_bench(law, "sine", "accuracy.steps_per_cycle=200", contact=contact))
    result = run(run_plan, estimate=False)
    assert (
        run_plan.engine == result.extra["engine"] == result.response.engine.name == f"bench, {name}"
    )
    assert ("bond_list_about" in run_plan.unknowns) == name.endswith("list")


def test_refuses_long_bond_list_and_unsupported_merging():
    """A bond list that takes longer than the limit, and merging of bonds under a pressure that
    varies, are refused."""
    model = build_bench(
        BONDS + "order = 2\n",
        "sine",
        "accuracy.quadrature=direct",
        "slide.cycles=400",
        "accuracy.steps_per_cycle=4000",
    )
    with pytest.raises(
        Missing,
        match=f"more than the limit of {MAX_LIST_SECONDS:.0f} s; lower accuracy.steps_per_cycle",
    ):
        plan(model)
    with pytest.raises(SceneError, match=r"'merged' with a shape on the lower piece"):
        plan(
            build_bench(
                BONDS + "order = 2\n",
                "sine",
                "accuracy.quadrature=merged",
                contact=PATCH + 'on = "lower"\n',
            )
        )


@pytest.mark.parametrize("keys, slide", [
    ("order = 0.5\n", "small"), ('reading = "report"\norder = 0.5\n' + GROWTH, "sine"),
])  # fmt: skip
def test_exact_errors_cover_merging_of_bonds(keys, slide):
    """The errors of a run that merges bonds cover its difference from the sum over every bond with
    four times the steps."""
    sets = ["accuracy.tolerance=1e-2", "accuracy.quadrature=merged", "accuracy.steps_per_cycle=400"]
    model = build_bench(BONDS + keys, slide, *sets)
    result = run(model)
    choice = result.response.engine.choice
    assert choice.engine == "merged" and choice.merge > 0
    assert result.measures["friction_force_peak"].error >= choice.error * 30
    steps = 4 * model.slide.steps(model.accuracy.tolerance, model.accuracy.steps_per_cycle, 2e-6)
    direct = replace(choice, engine="direct", merge=0.0, tail=0.0, error=0.0)
    reference = bench.run_bench(model, None, steps, options=BenchOptions(direct))
    for name, measure in result.measures.items():
        if name not in ("work_check", "energy_balance"):
            assert abs(measure.value - reference.values[name]) <= measure.error + measure.floor, (
                name
            )


# ---- progress


@pytest.mark.parametrize(
    "law, contact",
    [
        (ROUND_OFF_LAWS["coulomb"], POINT),
        (BONDS + "order = 2\n", POINT),
        (ROUND_OFF_LAWS["tanh"], PATCH + 'on = "lower"\n'),
    ],
)
def test_always_progress_grows_to_one(law, contact):
    """The reported progress never falls and ends at 1."""
    fractions = []
    run(
        build_bench(law, "sine", "accuracy.steps_per_cycle=6000", contact=contact),
        progress=fractions.append,
        estimate=False,
    )
    assert fractions[-1] == 1.0 and (np.diff([0.0, *fractions]) >= 0).all()
    assert len(fractions) >= (1 if law == ROUND_OFF_LAWS["coulomb"] else 12000 // N_BLOCK_SAMPLES)


def test_always_interrupt_ends_bench_between_blocks():
    """An interrupt ends a bench after the present block of samples."""
    fractions = []

    def interrupt_after_half(fraction):
        fractions.append(fraction)
        if fraction > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(
            build_bench(BONDS, "sine", "accuracy.steps_per_cycle=20000"),
            progress=interrupt_after_half,
        )
    assert fractions[-1] <= 0.5 + N_BLOCK_SAMPLES / 40000


# ---- energy balance and work check


@pytest.mark.parametrize(
    "chi, beta, amplitude",
    [(-0.4, 0.5, 2e-9), (0.0, 0.0, 2e-7), (-0.9, 2.0, 1e-5)],
)
def test_exact_iwan_loop_agrees_with_closed_form(chi, beta, amplitude):
    """The area and the peak force of the steady loop of the Iwan law agree within their errors with
    the closed form (Segalman 2005)."""
    scene = loads(
        '[normal]\nload = "5 kN"\n[friction]\nlaw = "iwan"\nstatic = 0.3\nstiffness = "1e9 N/m"\n'
        f'chi = {chi}\nbeta = {beta}\n[slide]\nkind = "sine"\namplitude = "{amplitude!r} m"\n'
        'frequency = "1 Hz"\ncycles = 2\n'
    )
    tip, area = steady_loop(scene.friction, 5e3, amplitude)
    measures = run(scene).measures
    for name, exact in (
        ("loop_area", area),
        ("friction_force_peak", tip),
        ("secant_stiffness", tip / amplitude),
    ):
        difference = abs(measures[name].value - exact)
        assert difference <= measures[name].error + 1e-12 * abs(exact), name
    assert (
        0 < measures["loop_area"].error < 40 * abs(measures["loop_area"].value - area) + 1e-6 * area
    )


def test_exact_averaged_tractions_shift_by_bond_length():
    """The tractions of the averaged law sum to the force, and their centroid is that of the pressure
    moved by the bond length, to larger x for a positive force and to smaller x for a negative one."""
    x = np.linspace(-1.0, 1.0, 2001)
    sigma = np.maximum(1 - np.abs(x) / 0.5, 1e-9)
    patch = SimpleNamespace(
        x=x,
        pressure=SimpleNamespace(sigma_n=sigma),
        pieces=SimpleNamespace(interface=SimpleNamespace(weight=np.full(x.size, 1e-3))),
    )
    model = SimpleNamespace(friction=SimpleNamespace(bond_length=0.02, order=0))
    force = np.array([3.0, -2.0, 0.0])
    tractions = distribute_slip_force(model, patch, force)
    assert tractions.sum(axis=1) * 1e-3 == pytest.approx(force, rel=1e-12)
    assert tractions @ x * 1e-3 == pytest.approx([3.0 * 0.02, 2.0 * 0.02, 0.0], rel=1e-3)
