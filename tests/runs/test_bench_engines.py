"""Compiled engines of a bench agree with the NumPy laws, and their errors, energy balance and
progress are right."""

from dataclasses import replace

import numpy as np
import pytest

from patchfem import build
from patchfem.friction import steady_loop
from patchfem.runs.bench import bench
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


def build_bench(law, slide, *sets, contact=POINT):
    """Return the model of a bench with a friction law and a slide."""
    return build(loads(contact + FRICTION + law + "[slide]\n" + SLIDES[slide], sets=sets))


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


# ---- choice of the engine and its name


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
