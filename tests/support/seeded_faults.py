"""Seeded faults: how many wrong factors, signs and comparisons in the chain does a run notice by itself?

    python tests/support/seeded_faults.py draw [--seed 1] [LINK]  # draw 24 faults, print them as FAULTS
    python tests/support/seeded_faults.py try PACKAGE_ROOT        # run them in copies of a state of the package

A fault changes one operator, one number or one comparison in one line of the package. `draw` takes the lines by
chance among those that a scene executes, two for each LINK of the chain from the mesh to the summary, and keeps a
fault if the run then ends with another answer: a measure that changes by more than 1 %. What a check of the package
might see plays no part. Kernels run as plain Python (NUMBA_DISABLE_JIT), so that no fault waits for a compiler, and
caches begin empty, so that no fault hides behind one.
"""

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
MIN_CHANGE = 0.01  # relative change of a measure that makes a fault harmful
TIME_LIMIT = 120.0  # seconds of a run; a longer one is not kept

PATCH = """
[contact]
length = "14 mm"
width = "7.5 mm"
height = "10 mm"
load = "700 N"
substrate = "Ti-8Al-1Mo-1V"
[contact.coating]
material = "WC-Co"
thickness = "0.25 mm"
[contact.tilt]
angle = "0.05 mrad"
"""
POINT = """
[normal]
load = "100 N"
"""
COULOMB = """
[friction]
law = "coulomb"
static = 0.3
"""
PLASTIC = """
[friction]
law = "elastic-plastic"
static = 0.3
bond_length = "20 um"
"""
BONDS = """
[friction]
law = "nonlocal"
static = 0.3
bond_length = "20 um"
"""
SLIDE = """
[slide]
kind = "sine"
amplitude = "5 um"
frequency = "50 Hz"
cycles = 2
"""
RIG = """
[structure]
moving_mass = "0.5 kg"
[[structure.mode]]
name = "axial"
frequency = "100 Hz"
damping = 0.01
slide = 1.0
base = 0.9
[[structure.mode]]
name = "yaw"
frequency = "170 Hz"
damping = 0.01
slide = 0.4
output = 0.7
base = 0.3
[drive]
kind = "base"
frequency = "85 Hz"
acceleration = "8 g"
cycles = 20
"""
COARSE = """
[accuracy]
steps_per_cycle = 100
"""
SCENES = {
    "static": PATCH,
    "bench": PATCH + "[contact.shear]\n" + COULOMB + SLIDE,
    "point": POINT + PLASTIC + SLIDE.replace("5 um", "60 um"),
    "exact": POINT + COULOMB + RIG,
    "march": POINT
    + BONDS
    + RIG.replace("cycles = 20", "cycles = 10")
    + COARSE
    + 'method = "march"\n',
    "balance": POINT
    + PLASTIC
    + RIG
    + COARSE.replace("steps_per_cycle = 100", 'method = "harmonic"'),
}
# link of the chain -> files of the package that make it, scene that runs them
LINKS = {
    "mesh": (
        ("mesh/grading.py", "mesh/tensor.py", "mesh/ends.py", "mesh/pairs.py", "mesh/nested.py"),
        "static",
    ),
    "assembly": (("elasticity/tensor_stiffness.py", "elasticity/elasticity.py"), "static"),
    "condensation": (
        (
            "elasticity/condense.py",
            "elasticity/fronts.py",
            "elasticity/grid_fronts.py",
            "elasticity/substructure.py",
        ),
        "static",
    ),
    "contact": (
        (
            "contact/unilateral.py",
            "contact/active_set.py",
            "contact/gaps.py",
            "contact/edges.py",
            "runs/patch/press.py",
        ),
        "static",
    ),
    "law": (
        (
            "friction/laws/elastic_plastic.py",
            "friction/laws/elastic_plastic_kernels.py",
            "friction/record.py",
            "friction/laws/stretch.py",
        ),
        "point",
    ),
    "shear": (
        (
            "slip/shear_modes.py",
            "slip/elements.py",
            "slip/fields.py",
            "runs/bench/shear.py",
            "runs/bench/ledger.py",
            "runs/bench/follow.py",
        ),
        "bench",
    ),
    "quadrature": (
        (
            "friction/bonds/recursion.py",
            "friction/bonds/parameters.py",
            "friction/bonds/point_kernels.py",
            "friction/laws/exponential_kernels.py",
            "friction/laws/stretch_kernels.py",
        ),
        "march",
    ),
    "propagator": (
        ("dynamics/propagator.py", "dynamics/doubling.py", "dynamics/march/loop_kernels.py"),
        "march",
    ),
    "events": (
        (
            "dynamics/events/stick_kernels.py",
            "dynamics/events/series_kernels.py",
            "dynamics/events/march_kernels.py",
            "dynamics/events/modal_system.py",
            "dynamics/events/drive_kernels.py",
            "dynamics/events/slope_kernels.py",
            "dynamics/events/search_kernels.py",
        ),
        "exact",
    ),
    "participation": (
        (
            "structure/modes.py",
            "structure/drives.py",
            "structure/drive_sizes.py",
            "model/structure.py",
            "model/rig.py",
            "model/drive.py",
        ),
        "exact",
    ),
    "measures": (
        ("response/measures.py", "response/loops.py", "response/rows.py", "response/spectrum.py"),
        "march",
    ),
    "units": (
        (
            "scene/keys/quantities.py",
            "export/summary.py",
            "response/rows.py",
            "runs/patch/values.py",
            "runs/patch/measures.py",
        ),
        "bench",
    ),
}
OPERATORS = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*"}
COMPARISONS = {ast.Lt: ">", ast.Gt: "<", ast.LtE: ">=", ast.GtE: "<="}

# (file, line, original text, mutated text, scene), drawn by `draw --seed 1` before any check was written
FAULTS = (  # drawn by seed 1: file, line, original and changed text, scene
    (
        "friction/laws/elastic_plastic.py",
        26,
        "return parallel([self.static * load / self.length], [self.length])._replace(length=self.length)",
        "return parallel([self.static * load * self.length], [self.length])._replace(length=self.length)",
        "point",
    ),
    (
        "friction/laws/elastic_plastic_kernels.py",
        27,
        "rest = free - end",
        "rest = free + end",
        "point",
    ),
    (
        "dynamics/events/march_kernels.py",
        88,
        "row[HEAD + i], row[HEAD + n + i] = motion[0, i], motion[1, i]",
        "row[HEAD + i], row[HEAD - n + i] = motion[0, i], motion[1, i]",
        "exact",
    ),
    (
        "dynamics/events/series_kernels.py",
        249,
        "rest, wide = 0.0, FEW // 4 * 4 + 4",
        "rest, wide = 0.0, FEW // 4 * 4 - 4",
        "exact",
    ),
    (
        "structure/drive_sizes.py",
        108,
        "return span > drive.period * (1 - 1e-6)  # round-off of times after many cycles",
        "return span < drive.period * (1 - 1e-6)  # round-off of times after many cycles",
        "exact",
    ),
    (
        "structure/modes.py",
        21,
        'return ModalBasis(tuple(mode.name for mode in modes), frozen_array(2 * np.pi * column["frequency"]),',
        'return ModalBasis(tuple(mode.name for mode in modes), frozen_array(2 / np.pi * column["frequency"]),',
        "exact",
    ),
    (
        "response/spectrum.py",
        19,
        "waves = np.exp(-1j * omega * time[:-1])",
        "waves = np.exp(1j * omega * time[:-1])",
        "march",
    ),
    (
        "response/spectrum.py",
        19,
        "waves = np.exp(-1j * omega * time[:-1])",
        "waves = np.exp(-1j / omega * time[:-1])",
        "march",
    ),
    (
        "runs/patch/values.py",
        100,
        '"contact_half_width": float(stretches[-1, 1] - stretches[0, 0]) / 2,',
        '"contact_half_width": float(stretches[-1, 1] + stretches[0, 0]) / 2,',
        "bench",
    ),
    (
        "runs/patch/values.py",
        83,
        '"pressure_centre": p.moment / p.load if p.load > 0 else 0.0, "loaded_fraction": 0.0, "normal_stiffness": 0.0,',
        '"pressure_centre": p.moment * p.load if p.load > 0 else 0.0, "loaded_fraction": 0.0, "normal_stiffness": 0.0,',
        "bench",
    ),
    (
        "dynamics/propagator.py",
        55,
        "a = drive.values((start[:, None] + self.nodes).ravel()).reshape(count, -1)",
        "a = drive.values((start[:, None] - self.nodes).ravel()).reshape(count, -1)",
        "march",
    ),
    (
        "dynamics/propagator.py",
        185,
        "c, s = fade * np.cos(under), fade * np.sinc(under / np.pi)",
        "c, s = fade * np.cos(under), fade / np.sinc(under / np.pi)",
        "march",
    ),
    (
        "friction/bonds/point_kernels.py",
        92,
        "mean = z * f1 + g * eps * x * (sigma * f2 - young * (f1 - f2))",
        "mean = z * f1 + g / eps * x * (sigma * f2 - young * (f1 - f2))",
        "march",
    ),
    (
        "friction/bonds/point_kernels.py",
        26,
        "return f1, (1 - f1) / x, e",
        "return f1, (1 + f1) / x, e",
        "march",
    ),
    (
        "slip/shear_modes.py",
        231,
        "c, s = float(low[k, k] / size), float(low[k, k + 1] / size)",
        "c, s = float(low[k, k] * size), float(low[k, k + 1] / size)",
        "bench",
    ),
    (
        "slip/shear_modes.py",
        236,
        "one[both] = c * one[k] + s * one[k + 1], s * one[k] - c * one[k + 1]",
        "one[both] = c * one[k] - s * one[k + 1], s * one[k] - c * one[k + 1]",
        "bench",
    ),
    (
        "contact/unilateral.py",
        216,
        "return Pressure(frozen_array(out.force / weight), frozen_array(opening), float(touch + out.closing),",
        "return Pressure(frozen_array(out.force / weight), frozen_array(opening), float(touch - out.closing),",
        "static",
    ),
    (
        "contact/unilateral.py",
        216,
        "return Pressure(frozen_array(out.force / weight), frozen_array(opening), float(touch + out.closing),",
        "return Pressure(frozen_array(out.force * weight), frozen_array(opening), float(touch + out.closing),",
        "static",
    ),
    (
        "elasticity/condense.py",
        169,
        "return (out + out.T) / 2",
        "return (out + out.T) * 2",
        "static",
    ),
    (
        "elasticity/condense.py",
        162,
        "half[np.ix_(place, place)] = part / 2",
        "half[np.ix_(place, place)] = part * 2",
        "static",
    ),
    (
        "mesh/ends.py",
        28,
        'return length / 2 - self.size + (self.size * GENTLE / hypot(1, GENTLE) if self.kind == "radius" else 0.0)',
        'return length * 2 - self.size + (self.size * GENTLE / hypot(1, GENTLE) if self.kind == "radius" else 0.0)',
        "static",
    ),
    ("mesh/grading.py", 89, "if coating > 0:", "if coating < 0:", "static"),
    (
        "elasticity/elasticity.py",
        33,
        "mu = young / (2 * (1 + poisson))",
        "mu = young / (2 / (1 + poisson))",
        "static",
    ),
    (
        "elasticity/tensor_stiffness.py",
        42,
        "stiff, mass, half = weight / h, weight * h / 6, weight / 2",
        "stiff, mass, half = weight / h, weight / h / 6, weight / 2",
        "static",
    ),
)


class Fault(NamedTuple):
    """One changed line: file below patchfem/, line number from 1, text before and after, name of the scene."""

    file: str
    line: int
    original: str
    mutated: str
    scene: str


class Ending(NamedTuple):
    """How a run ended: exit code, outcome, measures by name, warnings, last line of stderr."""

    code: int
    outcome: str
    measures: dict
    warnings: list
    said: str


def run_scene(package_parent: Path, scene: str) -> Ending:
    """Run a scene with the package below a folder, in a process and with a cache of its own."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "scene.toml").write_text(SCENES[scene], "utf-8")
        environment = os.environ | {
            "PYTHONPATH": str(package_parent),
            "PATCHFEM_CACHE": str(folder / "cache"),
            "NUMBA_DISABLE_JIT": "1",
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        words = [
            sys.executable,
            "-m",
            "patchfem",
            "run",
            "scene.toml",
            "-o",
            "out",
            "--no-page",
            "-q",
        ]
        try:
            done = subprocess.run(
                words,
                cwd=folder,
                env=environment,
                capture_output=True,
                text=True,
                timeout=TIME_LIMIT,
            )
        except subprocess.TimeoutExpired:
            return Ending(124, "", {}, [], "timeout")
        summary = folder / "out" / "summary.json"
        found = json.loads(summary.read_text("utf-8")) if summary.is_file() else {}
        values = {name: one["value"] for name, one in found.get("measures", {}).items()}
        said = done.stderr.strip().splitlines()
        return Ending(
            done.returncode,
            found.get("outcome", ""),
            values,
            found.get("warnings", []),
            said[-1] if said else "",
        )


def changed_measures(before: Ending, after: Ending) -> dict:
    """Measures that differ by more than MIN_CHANGE, name -> (before, after)."""
    out = {}
    for name, old in before.measures.items():
        new = after.measures.get(name)
        if name in ("energy_balance", "work_check") or old is None:
            continue
        if new is None or abs(new - old) > MIN_CHANGE * abs(old) + 1e-15:
            out[name] = (old, new)
    return out


def mutations_of(text: str) -> list:
    """All (line, original line, mutated line) of a module: one operator, number or comparison each."""
    lines, out = text.splitlines(), []

    def replace_in(line: int, start: int, end: int, new: str) -> None:
        old = lines[line - 1]
        raw = old.encode()
        out.append((line, old, (raw[:start] + new.encode() + raw[end:]).decode()))

    for node in ast.walk(ast.parse(text)):
        if (
            isinstance(node, ast.BinOp)
            and type(node.op) in OPERATORS
            and node.left.end_lineno == node.right.lineno
        ):
            between = (
                lines[node.left.end_lineno - 1]
                .encode()[node.left.end_col_offset : node.right.col_offset]
                .decode()
            )
            sign = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}[type(node.op)]
            if between.count(sign) == 1:
                replace_in(
                    node.right.lineno,
                    node.left.end_col_offset,
                    node.right.col_offset,
                    between.replace(sign, OPERATORS[type(node.op)]),
                )
        elif isinstance(node, ast.Constant) and isinstance(node.value, float) and node.value:
            replace_in(node.lineno, node.col_offset, node.end_col_offset, f"{2 * node.value!r}")
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            replace_in(node.lineno, node.col_offset, node.col_offset + 1, "")
        elif (
            isinstance(node, ast.Compare)
            and len(node.ops) == 1
            and type(node.ops[0]) in COMPARISONS
            and node.left.end_lineno == node.comparators[0].lineno
        ):
            right = node.comparators[0]
            between = (
                lines[right.lineno - 1]
                .encode()[node.left.end_col_offset : right.col_offset]
                .decode()
            )
            sign = {ast.Lt: "<", ast.Gt: ">", ast.LtE: "<=", ast.GtE: ">="}[type(node.ops[0])]
            replace_in(
                right.lineno,
                node.left.end_col_offset,
                right.col_offset,
                between.replace(sign, COMPARISONS[type(node.ops[0])]),
            )
    return out


def executed_lines(scene: str) -> dict:
    """File below patchfem/ -> numbers of the lines that a run of a scene executes, by a trace in a process."""
    code = (
        "import sys, json, pathlib, runpy\n"
        "seen = {}\n"
        "def local(frame, event, arg):\n"
        "    if event == 'line': seen[frame.f_code.co_filename].add(frame.f_lineno)\n"
        "    return local\n"
        "def begin(frame, event, arg):\n"
        "    name = frame.f_code.co_filename\n"
        "    if '/patchfem/' not in name: return None\n"
        "    seen.setdefault(name, set()).add(frame.f_lineno)\n"
        "    return local\n"
        "sys.settrace(begin)\n"
        "sys.argv = ['patchfem', 'run', 'scene.toml', '-o', 'out', '--no-page', '-q']\n"
        "try: runpy.run_module('patchfem', run_name='__main__')\n"
        "except SystemExit: pass\n"
        "sys.settrace(None)\n"
        "pathlib.Path('lines.json').write_text(json.dumps({k: sorted(v) for k, v in seen.items()}))\n"
    )
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "scene.toml").write_text(SCENES[scene], "utf-8")
        environment = os.environ | {
            "PYTHONPATH": str(ROOT),
            "PATCHFEM_CACHE": str(folder / "cache"),
            "NUMBA_DISABLE_JIT": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }
        subprocess.run(
            [sys.executable, "-c", code],
            cwd=folder,
            env=environment,
            check=True,
            capture_output=True,
        )
        found = json.loads((folder / "lines.json").read_text("utf-8"))
    return {name.rpartition("/patchfem/")[2]: set(lines) for name, lines in found.items()}


def applied(fault: Fault, package: Path) -> Path:
    """Write a fault into a copy of the package; returns its file."""
    path = package / fault.file
    lines, original = path.read_text("utf-8").splitlines(), fault.original.strip()
    number = fault.line - 1
    if lines[number].strip() != original:  # the line has moved since the draw
        number = [line.strip() for line in lines].index(original)
    lines[number] = lines[number].replace(original, fault.mutated.strip())
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


def try_fault(fault: Fault, root: Path) -> Ending:
    """Run the scene of a fault in a copy of the package of a root."""
    with tempfile.TemporaryDirectory() as place:
        shutil.copytree(
            root / "patchfem",
            Path(place) / "patchfem",
            ignore=shutil.ignore_patterns("__pycache__"),
        )
        applied(fault, Path(place) / "patchfem")
        return run_scene(Path(place), fault.scene)


def draw(seed: int, links: list) -> None:
    """Draw two faults of each link and print them."""
    lines, before = {}, {}
    for link in links or LINKS:
        (files, scene), chance = LINKS[link], random.Random(f"{seed} {link}")
        if scene not in lines:
            lines[scene], before[scene] = executed_lines(scene), run_scene(ROOT, scene)
        candidates = []
        for file in files:
            path = ROOT / "patchfem" / file
            if path.is_file():
                candidates += [
                    Fault(file, *one, scene)
                    for one in mutations_of(path.read_text("utf-8"))
                    if one[0] in lines[scene].get(file, ())
                ]
        chance.shuffle(candidates)
        kept, tried = 0, 0
        for fault in candidates:
            if kept == 2:
                break
            tried += 1
            after = try_fault(fault, ROOT)
            if after.code in (0, 3) and after.measures and changed_measures(before[scene], after):
                kept += 1
                print(
                    f"    Fault({fault.file!r}, {fault.line}, {fault.original!r},\n          {fault.mutated!r}, "
                    f"{fault.scene!r}),",
                    flush=True,
                )
        print(f"    # {link}: {kept} of {tried} tried, {len(candidates)} candidates", flush=True)


def try_all(root: Path) -> None:
    """Run all FAULTS in copies of the package of a root, and print how each ends."""
    for number, fault in enumerate(FAULTS, 1):
        fault = Fault(*fault)
        try:
            after = try_fault(fault, root)
        except ValueError:
            print(
                f"{number:2} {fault.file}:{fault.line} [{fault.scene}] the package has this line no longer"
            )
            continue
        before = run_scene(root, fault.scene)
        new = [text for text in after.warnings if text not in before.warnings]
        print(
            f"{number:2} {fault.file}:{fault.line} [{fault.scene}] exit {after.code} {after.outcome}"
        )
        print(f"   - {fault.original.strip()}\n   + {fault.mutated.strip()}")
        for name, (old, new_value) in [*changed_measures(before, after).items()][:3]:
            print(
                f"   {name} {old:.6g} -> {new_value if new_value is None else format(new_value, '.6g')}"
            )
        for text in new:
            print(f"   warning: {text[:300]}")
        print(f"   {after.said[:300]}", flush=True)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    drawing = verbs.add_parser("draw")
    drawing.add_argument("--seed", type=int, default=1)
    drawing.add_argument(
        "links", nargs="*", choices=[[], *LINKS], help="links of the chain, all unless given"
    )
    verbs.add_parser("try").add_argument("root", type=Path)
    asked = parser.parse_args()
    if asked.verb == "draw":
        draw(asked.seed, asked.links)
    else:
        try_all(asked.root.resolve())


if __name__ == "__main__":
    main()
