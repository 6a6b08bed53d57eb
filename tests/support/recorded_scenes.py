"""The scenes whose results are recorded: those of studies/ and the README, of recorded/scenes.toml, and random ones."""

import contextlib
import io
import json
import os
import random
import re
import shutil
import sys
import tomllib
from pathlib import Path
from string import Template

# NumPy reads this when it is imported: one thread adds in a fixed order.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
WRITTEN = tomllib.loads((ROOT / "tests/recorded/scenes.toml").read_text("utf-8"))
COUNT = 80
# Attributes of the netCDF file that repeat other contents or differ between files.
REPEATED = (
    "source scene scene_sha256 summary versions CLASS NAME DIMENSION_LIST REFERENCE_LIST".split()
)


def collect_scenes() -> dict:
    """Return {name: (text of the scene file, arguments of --set)}."""
    files = {
        path.stem: path.read_text("utf-8") for path in sorted((ROOT / "studies").rglob("*.toml"))
    }
    files["README"] = re.search(
        r"```toml\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.S
    )[1]
    out = {name: (text, WRITTEN["shorter"].get(name, [])) for name, text in files.items()}
    lines = WRITTEN["scenes"].splitlines()
    draw = random.Random(1985)
    lines += [random_line(draw) for _ in range(COUNT - len(out) - len(lines))]
    for number, line in enumerate(lines, 1):
        letters, *sets = Template(line).substitute(WRITTEN["words"]).split("; ")
        out[f"{number:02d}-{letters}"] = ("".join(WRITTEN["parts"][one] for one in letters), sets)
    return out


def random_line(draw: random.Random) -> str:
    """Return a random line in the format of recorded/scenes.toml."""
    letters = draw.choice(["NFSQ", "CFSQ", "NFMDQ", "CFMDQ"])
    words = [
        draw.choice(["friction.law=coulomb", "friction.law=elastic-plastic", "$BONDS"]),
        f"friction.static={draw.uniform(0.1, 0.6):.3f}",
        f"friction.bond_length={draw.uniform(0.5, 3):.3f} um",
    ]
    if "C" in letters:
        shapes = [
            f'contact.tilt={{angle="{draw.uniform(-0.1, 0.1):.4f} mrad"}}',
            "$SKIN",
            "contact.shear={}",
            f'contact.crown={{radius="{draw.uniform(1, 9):.3f} m"}}',
            'contact.upper={height="8 mm"}',
        ]
        words += draw.sample(shapes, draw.randint(1, 3))
    load = f"{'contact' if 'C' in letters else 'normal'}.load={draw.uniform(50, 200):.2f} N"
    size = "drive.acceleration={:.3f} g" if "D" in letters else "slide.amplitude={:.3f} um"
    return "; ".join([letters, *words, load, size.format(draw.uniform(2, 9))])


def write_input_files(folder: Path) -> None:
    """Write the data files that the scenes name."""
    import pyuff

    shutil.copy(ROOT / "studies/rig/table1.csv", folder)
    shutil.copy(ROOT / "meshes/test-piece.msh", folder)
    t = np.linspace(0, 1, 81)
    tables = {
        "gap.csv": ("x [mm],z [um]", 14 * t - 7, 0.4 * np.cos(9 * t) + 0.1 * t),
        "path.csv": ("time [ms],displacement [um]", 40 * t, 6 * np.sin(11 * t)),
        "shake.csv": ("time [ms],acceleration [g]", 80 * t, 6 * np.sin(60 * t) * np.exp(-t)),
    }
    for name, (head, *columns) in tables.items():
        rows = [",".join(f"{value:.6f}" for value in row) for row in zip(*columns)]
        (folder / name).write_text("\n".join([head, *rows]) + "\n", "utf-8")
    stiff = 1e6 * np.array([[1.0, -0.3], [-0.3, 0.3]])
    np.savez(
        folder / "rig.npz",
        M=np.diag([1.0, 0.6]),
        K=stiff,
        C=3e-5 * stiff,
        slide=[1.0, 0.0],
        output=[0.0, 1.0],
    )
    zero = np.zeros(1)
    shape = {
        "type": 55,
        "analysis_type": 2,
        "data_ch": 2,
        "spec_data_type": 8,
        "load_case": 1,
        "mode_n": 1,
        "node_nums": [7],
        **{"r1": np.ones(1), "r2": zero, "r3": zero},
        "modal_m": 0.884,
        "freq": 143.0,
        "modal_damp_vis": 0.003,
        "modal_damp_his": 0.0,
    }
    pyuff.UFF(str(folder / "rig.uff")).write_sets([shape], mode="overwrite")


def run_command(*words: str) -> dict:
    """Return exit code and stdout of a command; stdout is empty for `run`, stderr is kept after a failure."""
    from patchfem.__main__ import main as patchfem

    out = io.StringIO()
    err = io.StringIO()
    code = 0
    # answers record the command line of the process, which here is that of the tests
    arguments, sys.argv = sys.argv, ["patchfem"]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            patchfem(list(words))
        except SystemExit as end:
            code = end.code or 0
        finally:
            sys.argv = arguments
    return {
        "code": code,
        "out": "" if words[0] == "run" else out.getvalue(),
        "err": err.getvalue() if code else "",
    }


def read_results(folder: Path, name: str) -> dict:
    """Return {name: number, text or array} of all results of a scene."""
    out = {}
    place = folder / name
    for at, path in {
        "commands": folder / f"{name}.json",
        "summary": place / "summary.json",
    }.items():
        flatten(at, json.loads(path.read_text("utf-8")) if path.is_file() else {}, out)
    for path in (place / "result.nc", place / "fields.vtkhdf"):
        if path.is_file():
            out |= read_arrays(path, path.name)
    resolved = place / "scene.resolved.toml"
    return out | ({resolved.name: resolved.read_text("utf-8")} if resolved.is_file() else {})


def read_arrays(path: Path, name: str) -> dict:
    """Return the datasets of an HDF5 file as {name/key: array}, and its attributes as {name/key@attribute: value}.

    The fields of a VTKHDF file are returned in all frames, however many of them refer to the same rows.
    """
    out = {}
    with h5py.File(path) as data:
        data.visit((inside := ["/"]).append)
        for key in inside:
            if isinstance(data[key], h5py.Dataset):
                out[f"{name}/{key}"] = data[key][()]
            for attribute, value in data[key].attrs.items():
                if attribute not in REPEATED and not attribute.startswith("_"):
                    out[f"{name}/{key}@{attribute}"] = value
    for key in [key for key in out if "DataOffsets/" in key]:
        block, _, field = key.replace("Offsets", "").partition("/Steps/")
        items = "Points" if field.startswith("PointData") else "Cells"
        if f"{block}/NumberOf{items}" not in out:  # an image has a picture for each frame
            continue
        size = int(out[f"{block}/NumberOf{items}"][0])
        rows = out[f"{block}/{field}"]
        first_rows = out.pop(key)
        out[f"{block}/{field}"] = np.concatenate([rows[row : row + size] for row in first_rows])
    return out


def flatten(at: str, value: object, out: dict) -> None:
    """Store the leaves of nested tables under dotted names, without computing times and versions."""
    value = json.loads(value) if at == "commands.plan.out" and value else value
    value = dict(enumerate(value)) if isinstance(value, list) else value
    out |= {} if isinstance(value, dict) else {at: value}
    for key, item in value.items() if isinstance(value, dict) else ():
        if key not in ("seconds", "patchfem"):
            flatten(f"{at}.{key}", item, out)
