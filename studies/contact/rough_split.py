"""What does a rough contact lose if its short waves become a layer of asperities?

Split and unsplit agree in the stiffness on 18 of 20 traces, in the mean peak on 19, in the bearing length on 20. These
errors are large: that of the stiffness of a split is 14 % (median) and at most 67 %, that of its mean peak 33 % and
72 %; they include the full change of a layer that is pressed flat. The median difference of the stiffness
is 3.0 %; it reaches 62 % (trace 0, within its error) and 45 % (trace 19, not within) where less than 1 % of the length
touches, since a layer is a mean over many peaks. The averaged pressure peak of the split is lower by 13 % (median), at
most by 29 %. The contact fraction and the peak as reported do not agree: the layer carries on 17 to 100 % of the
length, peaks touch on 0.8 to 22 %. `own_patch` finds the stiffness unsplit within 1.6 % (median 0.3 %), the mean peak
within 0.6 %. Tamaas' stiffness of the short waves is 0.45 to 2.3 times that of the layer.

On even meshes the median difference of the stiffness from the resolved trace is 3.5, 0.6 and 0.2 % unsplit with 100,
200 and 400 elements (stated errors 19, 13 and 1.3 %), and 3.6, 3.0 and 3.0 % split (stated 8.3, 1.5 and 0.13 %, of the
mesh alone). The values of a split are no better than those of the coarse meshes; its mesh errors are smaller. All
answers are in rough_split.csv.

Recipe, fixed before the numbers were computed. The traces of seeds 0 to 19 are self-affine, 12.7 mm long, with 800
steps and no wave below 318 um, so that `patchfem run` resolves them. The load is random, 0.3 to 10 % of the pressure
E* times slope. Each trace is pressed unsplit, split where `patchfem profile --split` splits it for an even mesh of 200
elements, and by `own_patch`, which shares no code with patchfem. Tamaas (Frérot, Anciaux, Rey, Pham-Ba, Molinari, J.
Open Source Softw. 5, 2121, 2020) presses one period of the same trace, and of its short waves alone.

Measures of both kinds of model: the normal stiffness; and, at the scale of the split, the peak of the pressure averaged
over the cut-off with the weights of the Gaussian filter, and the fraction of the length that carries nine tenths of the
load after this average. The contact fraction and peak pressure as reported are printed beside them. The error of a
split is that of its mesh, plus the change at twice the cut-off, plus the change if the short waves are pressed flat (a
hundredth of the decay length), plus half the change over the range of Persson's factor (0.4 to 0.5; Persson, Phys. Rev.
Lett. 99, 125502, 2007, and the simulations cited at `PERSSON`). Two answers agree if they differ by at most the sum of
their errors; averaged pressures have the relative error of `pressure_peak`. The terms of this error were chosen on the
traces of seeds 1000 to 1007.

Run: python studies/contact/rough_split.py [--seeds 20] [--write]; with Tamaas: PATCHFEM_TAMAAS_PYTHON=INTERPRETER
"""

import argparse
import csv
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import own_patch
from peer import Peer, run
from synthetic import self_affine

import patchfem as pf
from patchfem.closed_forms.contact import combined_modulus
from patchfem.core import Missing
from patchfem.runs.patch.trace_split import split_trace
from patchfem.surface import level
from patchfem.surface.roughness.filter import ALPHA, REACH_FACTOR
from patchfem.surface.roughness.peaks import PERSSON

LENGTH = 12.7e-3  # [m] length of the pieces
HEIGHT = 6.35e-3  # [m] height of each piece
YOUNG = 206e9  # [Pa] Young's modulus
POISSON = 0.3
MODULUS = combined_modulus(YOUNG, POISSON)  # [Pa]
STEPS = 800  # number of steps of a trace
ELEMENTS = (100, 200, 400)  # numbers of elements of the uniform meshes
LOAD_FRACTION = 0.9  # fraction of the load on the bearing length
MEASURES = ("stiffness", "mean peak", "bearing length")
TABLE = Path(__file__).with_suffix(".csv")  # answers for seeds 0 to 19, written by --write
SCENE = f"""
[contact]
length = "{LENGTH!r} m"
width = "1 m"
height = "{HEIGHT!r} m"
load = "{{load!r}} N"
substrate = {{{{young = "{YOUNG!r} Pa", poisson = {POISSON}, density = "7800 kg/m^3"}}}}
{{size}}
[contact.profile]
file = "{{file}}"
heights = "surface"
"""
LAYER = """
[contact.asperities]
law = "exponential"
decay_length = "{decay!r} m"
cutoff = "{cutoff!r} m"
"""


class Trace(NamedTuple):
    """A trace with its load.

    - x, z: positions and heights (n,) [m]; the heights are levelled, as patchfem levels them.
    - period: heights before levelling (n - 1,) [m], which are periodic.
    - load: load [N] per metre of width.
    """

    x: np.ndarray
    z: np.ndarray
    period: np.ndarray
    load: float


class Answer(NamedTuple):
    """Values of MEASURES with their errors, and contact fraction and peak pressure as reported."""

    values: np.ndarray
    errors: np.ndarray
    fraction: float
    peak: float


def draw_trace(seed: int) -> Trace:
    """Return the trace of a seed with its load."""
    draw = np.random.default_rng(seed)
    profile = self_affine(
        LENGTH,
        STEPS,
        rms=10 ** draw.uniform(-6.7, -6),
        hurst=draw.uniform(0.5, 1),
        longest=draw.uniform(0.2, 1) * LENGTH,
        shortest=LENGTH / 40,
        seed=seed,
    )
    x = np.array(profile.x)
    z = np.array(level(profile).z)
    slope = np.sqrt(np.mean(np.gradient(z, x) ** 2))
    load = 10 ** draw.uniform(-2.5, -1) * MODULUS * slope * LENGTH
    return Trace(x, z, np.array(profile.z)[:-1], float(load))


def _average_pressure(x, pressure, cutoff: float) -> tuple:
    """Return the peak [Pa] of the averaged pressure and the fraction of the length that carries LOAD_FRACTION of the load.

    The average over a cut-off [m] has Gaussian weights; nothing presses beyond the ends.
    """
    places = np.linspace(-LENGTH / 2, LENGTH / 2, 4001)
    even = np.interp(places, x, pressure)
    step = places[1] - places[0]
    reach = np.ceil(REACH_FACTOR * cutoff / step)
    offsets = np.arange(-reach, reach + 1) * step
    weights = np.exp(-np.pi * (offsets / (ALPHA * cutoff)) ** 2)
    mean = np.convolve(even, weights / weights.sum(), mode="same")
    carried = np.cumsum(np.sort(mean)[::-1]) / mean.sum()
    return float(mean.max()), float(np.searchsorted(carried, LOAD_FRACTION) / mean.size)


def compute(text: str, cutoff: float) -> Answer:
    """Run a scene of patchfem."""
    result = pf.run(text)
    measures = result.measures
    x = result.patch.x
    peak, bearing = _average_pressure(x, result.patch.normal_stress, cutoff)
    stiffness = measures["normal_stiffness"]
    ratio = measures["pressure_peak"].error / measures["pressure_peak"].value
    return Answer(
        np.array([stiffness.value, peak, bearing]),
        np.array([stiffness.error, ratio * peak, ratio * bearing]),
        measures["contact_fraction"].value,
        measures["pressure_peak"].value,
    )


def _compute_split(text: str, cutoff: float, decay: float, decay_at_twice: float) -> Answer:
    """Run the scene of a split, with the errors of its model."""

    def press(divided: float, length: float) -> Answer:
        return compute(text + LAYER.format(decay=length, cutoff=divided), cutoff)

    answer = press(cutoff, decay)
    twice = press(2 * cutoff, decay_at_twice)
    mean_factor = sum(PERSSON) / 2
    low, high = (press(cutoff, decay * factor / mean_factor).values for factor in PERSSON)
    flat = press(cutoff, decay / 100).values
    changes = np.abs(twice.values - answer.values) + np.abs(flat - answer.values)
    errors = answer.errors + changes + np.abs(high - low) / 2
    return answer._replace(errors=errors)


def _press_own(trace: Trace, matrices: list, cutoff: float) -> Answer:
    """Press a trace by the other program, on its samples and on every second one."""
    answers = []
    for matrix, every in matrices:
        x = trace.x[::every]
        areas = np.full(x.size, x[1] - x[0])
        areas[[0, -1]] /= 2
        solution = own_patch.press(matrix, -trace.z[::every], areas, trace.load)
        values = [solution.stiffness, *_average_pressure(x, solution.pressure, cutoff)]
        answers.append((np.array(values), solution))
    (fine, solution), (coarse, _) = answers
    return Answer(fine, np.abs(fine - coarse), solution.fraction, float(solution.pressure.max()))


def ask_tamaas(trace: Trace, cutoff: float) -> list:
    """Return the answers of Tamaas for one period of a trace and of its short waves; Missing without Tamaas."""
    heights = trace.period
    waves = np.fft.rfftfreq(STEPS, LENGTH / STEPS)
    kept = 1 - 2.0 ** -((cutoff * waves) ** 2)
    short = np.fft.irfft(kept * np.fft.rfft(heights), STEPS)
    # a rigid flat face and a half plane with the combined modulus of both pieces
    request = {"length": LENGTH, "material": [MODULUS, 0.0], "pressure": trace.load / LENGTH}
    points = 8 * STEPS
    answers = []
    with Peer(
        "Tamaas",
        "contact/tamaas_child.py",
        "PATCHFEM_TAMAAS_PYTHON",
        sys.executable,
        "pip install tamaas",
    ) as peer:
        for z in (heights, short):
            # samples are refined by their Fourier series
            refined = np.fft.irfft(np.fft.rfft(z), points) * points / STEPS
            answers.append(peer.ask(heights=(refined - refined.mean()).tolist(), **request))
    return answers


def compare(seed: int, folder: Path, matrices: list) -> dict:
    """Press the trace of a seed by all programs.

    Parameters
    ----------
    seed : int
    folder : Path
        Folder for the file of the trace.
    matrices : list
        Compliances for `own_patch`, each with the number of samples between its nodes.

    Returns
    -------
    dict
        Answers by name.
    """
    trace = draw_trace(seed)
    file = folder / f"trace_{seed}.csv"
    np.savetxt(file, np.c_[trace.x, trace.z], delimiter=",", header="x [m],z [m]", comments="")

    def write(elements: int | None) -> str:
        size = f'element_size = "{LENGTH / elements!r} m"' if elements else ""
        return SCENE.format(load=trace.load, size=size, file=file)

    patch = pf.build(write(None)).patch
    split = split_trace(patch)
    cutoff = split.cutoff
    twice = split_trace(patch, 2 * cutoff)
    out = {"cutoff": cutoff, "unsplit": compute(write(None), cutoff)}
    out["split"] = _compute_split(write(None), cutoff, split.decay_length, twice.decay_length)
    out["own"] = _press_own(trace, matrices, cutoff)
    layer = LAYER.format(decay=split.decay_length, cutoff=cutoff)
    for elements in ELEMENTS:
        out[f"unsplit {elements}"] = compute(write(elements), cutoff)
        out[f"split {elements}"] = compute(write(elements) + layer, cutoff)
    try:
        whole, short = ask_tamaas(trace, cutoff)
        law = trace.load / LENGTH / split.decay_length
        out["tamaas"] = (whole["fraction"], whole["peak"], short["stiffness"] / law)
    except Missing:
        pass
    return out


def is_within(first: Answer, second: Answer) -> np.ndarray:
    """Return whether the values of two answers differ by at most the sum of their errors."""
    return np.abs(first.values - second.values) <= first.errors + second.errors


def mesh_models() -> list:
    """Return the names of the models on uniform meshes."""
    names = []
    for elements in ELEMENTS:
        names += [f"unsplit {elements}", f"split {elements}"]
    return names


def count_within(found: list, models: tuple) -> np.ndarray:
    """Count for each measure the traces on which two models agree within their errors."""
    first, second = models
    return np.sum([is_within(answers[first], answers[second]) for answers in found], axis=0)


def relative_differences(found: list, models: tuple) -> np.ndarray:
    """Return (n, 3) differences of the values of two models, relative to the second model."""
    first, second = models
    return np.array([answers[first].values / answers[second].values - 1 for answers in found])


def relative_errors(found: list, model: str) -> np.ndarray:
    """Return (n, 3) stated errors of a model relative to its values."""
    return np.array([answers[model].errors / answers[model].values for answers in found])


def write_table(found: list) -> None:
    """Write the answers for the seeds 0, 1, ... to TABLE."""
    with TABLE.open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        columns = ["seed", "model"]
        for name in MEASURES:
            columns += [name, f"{name} error"]
        rows.writerow([*columns, "contact fraction", "peak", "stiffness ratio"])
        for seed, answers in enumerate(found):
            for model in ("unsplit", "own", "split", *mesh_models()):
                answer = answers[model]
                pairs = np.column_stack([answer.values, answer.errors]).ravel()
                numbers = [*pairs, answer.fraction, answer.peak]
                rows.writerow([seed, model, *(f"{number:.5g}" for number in numbers), ""])
            if "tamaas" in answers:
                fraction, peak, ratio = answers["tamaas"]
                numbers = (f"{number:.5g}" for number in (fraction, peak, ratio))
                rows.writerow([seed, "tamaas", *[""] * 6, *numbers])


def read_table() -> list:
    """Read the answers for the seeds 0, 1, ... from TABLE."""
    found = []
    with TABLE.open(newline="") as file:
        for row in list(csv.reader(file))[1:]:
            if int(row[0]) == len(found):
                found.append({})
            if row[1] == "tamaas":
                found[-1]["tamaas"] = tuple(float(text) for text in row[8:])
                continue
            numbers = np.array([float(text) for text in row[2:10]])
            found[-1][row[1]] = Answer(numbers[0:6:2], numbers[1:6:2], numbers[6], numbers[7])
    return found


def print_trace(seed: int, answers: dict) -> None:
    """Print the answers for a trace."""
    print(f"trace {seed}, cut-off {1e6 * answers['cutoff']:.0f} um")
    for name in ("unsplit", "own", "split"):
        answer = answers[name]
        text = f"  {name:8}"
        for value, error in zip(answer.values, answer.errors):
            text += f" {value:11.4g} ± {error:8.2g}"
        print(f"{text}  fraction {answer.fraction:.4f}  peak {answer.peak / 1e6:.1f} MPa")
    if "tamaas" in answers:
        fraction, peak, ratio = answers["tamaas"]
        print(
            f"  Tamaas, periodic: fraction {fraction:.4f}, peak {peak / 1e6:.1f} MPa; stiffness of the short waves over "
            f"that of the layer {ratio:.2f}",
            flush=True,
        )


def print_summary(found: list) -> None:
    """Print how many traces agree, the differences and the stated errors."""
    for models in (("split", "unsplit"), ("split", "own"), ("unsplit", "own")):
        within = count_within(found, models)
        differences = relative_differences(found, models)
        print(f"{models[0]} against {models[1]}, {len(found)} traces:")
        for k, name in enumerate(MEASURES):
            middle = np.median(np.abs(differences[:, k]))
            worst = np.abs(differences[:, k]).max()
            print(
                f"  {name:15} {within[k]} within errors; difference: median {100 * middle:.2g} %, largest "
                f"{100 * worst:.2g} %, mean {100 * differences[:, k].mean():+.2g} %"
            )
    for model in ("unsplit", "own", "split"):
        errors = 100 * relative_errors(found, model)
        print(f"stated error of {model}, median and largest:")
        for name, column in zip(MEASURES, errors.T):
            print(f"  {name:15} {np.median(column):.2g} and {column.max():.2g} %")
    for model in mesh_models():
        medians = np.median(np.abs(relative_differences(found, (model, "unsplit"))), axis=0)
        stated = np.median(relative_errors(found, model)[:, 0])
        text = ", ".join(f"{name} {100 * m:.2g} %" for name, m in zip(MEASURES, medians))
        print(
            f"{model}: median difference from the resolved trace: {text}; stated error of the stiffness "
            f"{100 * stated:.2g} %"
        )


def main() -> list:
    """Compare all traces and print the answers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--write", action="store_true", help=f"write {TABLE.name}")
    options = parser.parse_args()
    matrices = []
    for every in (1, 2):
        matrix = own_patch.compliance(LENGTH, HEIGHT, STEPS // every, YOUNG, POISSON)
        matrices.append((matrix, every))
    seeds = range(options.seeds)
    found = []
    with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(options.jobs) as pool:
        run_trace = partial(compare, folder=Path(folder), matrices=matrices)
        for seed, answers in zip(seeds, pool.map(run_trace, seeds)):
            found.append(answers)
            print_trace(seed, answers)
    print_summary(found)
    if options.write:
        write_table(found)
    return found


if __name__ == "__main__":
    raise SystemExit(run(main))
