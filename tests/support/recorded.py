"""Results of scenes and commands in a form that can be stored and compared with later results.

    python tests/support/recorded.py [NAME ...]

runs the scenes and groups of commands of tests/test_recorded_results.py (all, or those named), prints each difference
from tests/recorded/NAME.json and stores the new results there. Read the differences before you commit them.

Results are kept as {key: value}. A value is a number, a text, or the statistics of an array: its size, extremes, mean,
and a sum with weights that depend on the place, so that exchanged values are seen. Omitted are seconds, versions and
names made from hashes.
"""

import csv
import io
import json
import os
import re
import shlex
import sys
import tempfile
import tomllib
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
TESTS = HERE.parent
RECORDED = TESTS / "recorded"
sys.path[:0] = [str(HERE), str(TESTS)] if __name__ == "__main__" else []

import recorded_scenes  # noqa: E402
import scene_texts  # noqa: E402
from traces import KINDS, write_traces  # noqa: E402

from patchfem.runs.patch.store import clear_cache  # noqa: E402
from patchfem.scene import UNIT_FACTORS  # noqa: E402

GROUPS = tomllib.loads((RECORDED / "commands.toml").read_text("utf-8"))
SCENES = GROUPS.pop("scenes")
# Relative difference of two computed numbers that passes. Other processors and versions of libraries differ by less.
RELATIVE = 1e-6
# Difference of two values that passes, as a part of their stated error.
PART_OF_ERROR = 1e-3
# Relative difference of two stated errors that passes: an error is the difference of nearly equal numbers.
RELATIVE_OF_ERRORS = 0.02
# Difference that passes of all errors, and of checks that are zero but for round-off.
MIN_ERROR = 1e-12
MIN_CHECK = 1e-7
# Difference that passes of the shares of a variance, which are sums of terms of order 1.
MIN_SHARE = 1e-9
# Difference that passes of stiffnesses [N/m], which are zero but for round-off for a rigid law.
MIN_STIFFNESS = 1e-3
# Printed numbers up to this size are round-off errors; percentages of prose up to this size are errors, which the JSON files
# state as well.
MIN_PRINTED = 1e-20
MIN_PERCENT = 0.1
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
# A text of so many words is prose, of which only numbers with their units, keys and quoted words are compared.
MIN_WORDS = 4
WORD = re.compile(r"[A-Za-z]{2,}")
ERROR = re.compile(rf"± ?{NUMBER.pattern}")
QUANTITY = re.compile(rf"({NUMBER.pattern})" + r"(?: ?([^\s,;:)]+))?")
# Keys of scenes and names of measures have a dot or an underscore; names of laws and files are quoted, as are quantities.
KEY = re.compile(
    r"[A-Za-z]\w*(?:\.[A-Za-z]\w*)+|[A-Za-z]+(?:_\w+)+|\"(?![-\d])[^\"\n]*\"|'[^'\n]*'"
)
UNITS = {unit for units in UNIT_FACTORS.values() for unit in units} | {"%"} - {"in"}
UNSTABLE_KEYS = re.compile(
    r"seconds|versions|\bpatchfem$|version|sha256|\bdate\b|\bcreated\b|\.motions$|\.evaluations$"
)


def run_group(name: str, folder: Path) -> dict:
    """Run the commands of a group in an empty folder; return {command: results}."""
    group = GROUPS[name]
    for stem, blocks in group["scenes"].items():
        text = "".join(getattr(scene_texts, block) for block in blocks.split())
        (folder / f"{stem}.toml").write_text(text, "utf-8")
    write_measurements(folder)
    if name in ("surfaces", "traces"):
        write_surfaces(folder)
    os.chdir(folder)
    out = {}
    known = set(folder.rglob("*"))
    for command in group["commands"]:
        answer = recorded_scenes.run_command(*shlex.split(command))
        out[command] = {"code": answer["code"], "stdout": answer["out"], "stderr": answer["err"]}
        written = sorted(set(folder.rglob("*")) - known)
        known.update(written)
        left_out = list_other_cases(written)
        for path in written:
            if path.is_file() and path.parent.name != "chunks" and path.parent not in left_out:
                file_name = str(path.relative_to(folder))
                out[command] |= describe_file(path, file_name)
    return {command: clean(results, folder) for command, results in out.items()}


def list_other_cases(written: list) -> set:
    """Return the case folders of sweeps except the one of each sweep whose scene or keys are last in the alphabet.

    The folders are named by hashes, whose order changes with the version of the package.
    """
    sweeps = {}
    for path in written:
        if path.name == "summary.json" and path.parent.parent.name == "cases":
            scene = path.with_name("scene.resolved.toml")
            if scene.exists():
                keys = scene.read_text("utf-8")
            else:
                keys = json.dumps(json.loads(path.read_text("utf-8"))["case"], sort_keys=True)
            sweeps.setdefault(path.parent.parent, {})[keys] = path.parent
    return {folder for cases in sweeps.values() for folder in cases.values()} - {
        cases[max(cases)] for cases in sweeps.values()
    }


def run_scene(name: str, folder: Path) -> dict:
    """Run a scene of recorded_scenes.py in an empty folder; return its results."""
    text, sets = recorded_scenes.collect_scenes()[name]
    (folder / "scenes").mkdir()
    os.chdir(folder / "scenes")
    recorded_scenes.write_input_files(Path())
    Path(f"{name}.toml").write_text(text, "utf-8")
    words = [f"{name}.toml", *(word for assignment in sets for word in ("--set", assignment))]
    commands = {  # The plan comes last: it depends on whether all code is compiled.
        "check": ["check", *words],
        "run": ["run", *words, "-o", f"../{name}", "-q"],
        "plan": ["plan", *words, "--json"],
        "cite": ["cite", *words],
    }
    clear_cache()
    answers = {verb: recorded_scenes.run_command(*command) for verb, command in commands.items()}
    (folder / f"{name}.json").write_text(json.dumps(answers), "utf-8")
    results = recorded_scenes.read_results(folder, name)
    results = {key: describe_value(value) for key, value in results.items() if "@" not in key}
    page = folder / name / "report.html"
    if page.is_file():
        results |= describe_file(page, page.name)
    return clean(results, folder)


def write_measurements(folder: Path) -> None:
    """Write the response of a mode of 143 Hz and 2 % damping to base accelerations, as rows of a shaker test."""
    lines = ["frequency [Hz],input [g],acceleration [g],displacement [um],flag"]
    for frequency in range(134, 154, 2):
        ratio = frequency / 143
        gain = 1 / np.hypot(1 - ratio**2, 0.04 * ratio)
        stretch = 9.80665e6 / (2 * np.pi * 143) ** 2 * gain
        total = np.hypot(1, 0.04 * ratio) * gain
        lines.append(f"{frequency},1,{total:.4f},{stretch:.3f},")
    (folder / "rows.csv").write_text("\n".join(lines) + "\n", "utf-8")


def write_surfaces(folder: Path) -> None:
    """Write a pair of traces of each kind, a table of two pairs, and a pair of scans."""
    for kind in KINDS:
        write_traces(kind, 41003, folder, (f"{kind}_before", f"{kind}_after"))
    (folder / "pairs.csv").write_text(
        "before,after\ngroove_before.csv,groove_after.csv\ngroove_after.csv,groove_before.csv\n",
        "utf-8",
    )
    draw = np.random.default_rng(7)
    waves = np.fft.irfft2(
        np.fft.rfft2(draw.normal(size=(90, 120)))
        / (1 + 40 * np.hypot(np.fft.fftfreq(90)[:, None], np.fft.rfftfreq(120))) ** 2
    )
    scan = 0.5 * waves / waves.std()
    groove = 0.8 * np.clip(1 - ((np.arange(120) - 60) / 20) ** 2, 0, None)
    for name, heights in {"scan": scan, "worn_scan": scan - groove}.items():
        noise = 0.003 * draw.normal(size=scan.shape)
        np.savetxt(
            folder / f"{name}.csv",
            heights + noise,
            fmt="%.5f",
            delimiter=",",
            header="Width: 240 um\nHeight: 180 um\nValue units: um",
        )


def describe_file(path: Path, name: str) -> dict:
    """Return the contents of a file as {key: value}; only the name for a file of an unknown kind."""
    if path.suffix == ".json":
        out = {}
        recorded_scenes.flatten(name, json.loads(path.read_text("utf-8")), out)
    elif path.suffix in (".html", ".svg"):
        out = describe_page(path.read_text("utf-8"), name)
    elif path.suffix in (".nc", ".vtkhdf"):
        arrays = recorded_scenes.read_arrays(path, name)
        out = {key: value for key, value in arrays.items() if "@" not in key}
    elif path.suffix == ".csv":
        out = describe_table(path.read_text("utf-8"), name)
    elif path.suffix in (".toml", ".txt", ".py"):
        out = {name: path.read_text("utf-8")}
    elif path.suffix == ".vtu":
        import meshio

        mesh = meshio.read(path)
        out = {f"{name}/points": mesh.points, f"{name}/cells": mesh.cells[0].data}
        out |= {f"{name}/{key}": value for key, value in mesh.point_data.items()}
        out |= {f"{name}/{key}": value[0] for key, value in mesh.cell_data.items()}
    elif path.suffix == ".mat":
        from scipy.io import loadmat

        out = {f"{name}/{key}": value for key, value in loadmat(path).items() if key[0] != "_"}
    else:
        out = {name: "a file"}
    return {key: describe_value(value) for key, value in out.items()}


def describe_table(text: str, name: str) -> dict:
    """Return header and columns of a table; columns that are not numbers are joined to a text."""
    comments = [line for line in text.splitlines() if line.startswith("#")]
    header, *rows = csv.reader(
        io.StringIO("\n".join(line for line in text.splitlines() if not line.startswith("#")))
    )
    out = {f"{name}/header": " | ".join([*comments, *header])}
    for place, column in enumerate(header):
        cells = [row[place] if place < len(row) else "" for row in rows]
        try:
            out[f"{name}/{column}"] = np.array([cell or "nan" for cell in cells], float)
        except ValueError:
            out[f"{name}/{column}"] = " | ".join(cells)
    return out


class _PageParser(HTMLParser):
    """Parser that collects the visible text in `texts`, and numbers of attributes by tag in `numbers`."""

    def __init__(self):
        super().__init__()
        self.texts = []
        self.numbers = {}
        self.hidden = 0

    def handle_starttag(self, tag, attrs):
        """Collect the numbers in the attributes of a tag."""
        self.hidden += tag in ("script", "style")
        words = " ".join(value or "" for _, value in attrs)
        numbers = [float(number) for number in NUMBER.findall(words) if len(number) < 20]
        self.numbers.setdefault(tag, []).extend([1.0, *numbers])

    def handle_endtag(self, tag):
        """Note the end of a script or a style."""
        self.hidden -= tag in ("script", "style")

    def handle_data(self, data):
        """Collect visible text."""
        if data.strip() and not self.hidden:
            self.texts.append(" ".join(data.split()))


def describe_page(text: str, name: str) -> dict:
    """Return the visible text of a page or a picture, and the numbers by tag (`test_pages` compares its charts)."""
    parser = _PageParser()
    parser.feed(text)
    out = {f"{name}/text": "\n".join(parser.texts)}
    out |= {f"{name}/<{tag}>": np.array(numbers) for tag, numbers in parser.numbers.items()}
    return out


def describe_value(value: object) -> object:
    """Return a number or text as it is, and statistics of an array: size, extremes, mean and a weighted mean."""
    if isinstance(value, (str, int, float, type(None))):
        return value
    array = np.asarray(value)
    if array.dtype.kind in "SUO":
        return " | ".join(str(item) for item in array.ravel()[:50])
    if array.dtype.names:
        return " | ".join(array.dtype.names)
    parts = [array.real, array.imag] if array.dtype.kind == "c" else [array]
    out = []
    for part in parts:
        part = part.astype(float).ravel()
        finite = part[np.isfinite(part)]
        weights = np.cos(1.0 + np.arange(finite.size))
        out += [part.size, part.size - finite.size]
        out += (
            [finite.min(), finite.max(), finite.mean(), (weights * finite).mean()]
            if finite.size
            else []
        )
    return [float(f"{number:.8g}") for number in out]


def clean(results: dict, folder: Path) -> dict:
    """Return results without unstable keys, and with placeholders for folder, version, hashes, times and sizes."""
    version = recorded_scenes.run_command("--version")["out"].split()[-1]
    out = {}
    for key, value in results.items():
        if UNSTABLE_KEYS.search(key):
            continue
        key, value = (
            re.sub(r"(?<![.\w])((?=\d*[a-f])[0-9a-f]{12,}|\d{16}(?!\.))\b", "HASH", text)
            if isinstance(text, str)
            else text
            for text in (key, value)
        )
        if isinstance(value, str):
            value = value.replace(str(folder), "FOLDER").replace(version, "VERSION")
            lines = [hide_times(line.rstrip()) for line in value.splitlines()]
            value = lines if len(lines) > 1 else "".join(lines)
        elif isinstance(value, float):
            value = float(f"{value:.8g}")
        out[key] = value
    return out


def hide_times(line: str) -> str:
    """Return a line with # in place of numbers that depend on the speed of the machine.

    Seconds stand alone in a line of a page, with three decimals. Other numbers that do so are hidden
    too; they are compared in the files of the results.
    """
    if "CPU" in line or "Wall-clock" in line or re.fullmatch(r"\d+\.\d{3}( s)?", line):
        return NUMBER.sub("#", line)
    # The first evenly spaced row depends on the round-off of the times.
    line = re.sub(r"before [\d.]+ ms the rows", "before # ms the rows", line)
    line = re.sub(r" \(and [\d.]+ s once for compiling\)", "", line)
    return re.sub(r"computed in [\d.]+ (CPU )?s\b", "computed in # s", line)


def find_differences(recorded: dict, found: dict) -> list:
    """Return a line for each key whose value differs from the recorded one."""
    out = []
    for key in dict.fromkeys([*recorded, *found]):
        if key not in recorded or key not in found:
            out.append(f"{key}: {'new' if key in found else 'missing'}")
        elif not is_equal(key, recorded, found):
            pair = find_first_difference(recorded[key], found[key])
            out.append(f"{key}:\n    recorded {pair[0]!r}\n    found    {pair[1]!r}")
    return out


def find_first_difference(old: object, new: object) -> tuple:
    """Return two values, or the facts of each text that the other one does not have."""
    if is_text(old) and is_text(new):
        facts = [Counter(read_facts("\n".join(text))) for text in (old, new)]
        return tuple(list(one - other)[:9] for one, other in (facts, facts[::-1]))
    return old, new


def is_text(value: object) -> bool:
    """Return whether a value is a list of lines."""
    return isinstance(value, list) and bool(value) and isinstance(value[0], str)


def is_equal(key: str, recorded: dict, found: dict) -> bool:
    """Return whether two values agree within the tolerances of this module."""
    old = recorded[key]
    new = found[key]
    if is_text(old) and is_text(new):
        old, new = "\n".join(old), "\n".join(new)
    if isinstance(old, str) and isinstance(new, str):
        is_prose = min(len(WORD.findall(text)) for text in (old, new)) >= MIN_WORDS
        return have_equal_facts(old, new) if is_prose else have_equal_words(old, new)
    is_error = "error" in key.rpartition("/")[2]
    is_check = re.search("energy_balance|work_check", key) is not None
    relative = RELATIVE_OF_ERRORS if is_error else RELATIVE
    smallest = MIN_CHECK if is_check else MIN_ERROR if is_error else 0.0
    if ".ranking." in key:
        smallest = MIN_SHARE
    elif "stiffness" in key:
        smallest = MIN_STIFFNESS
    if isinstance(old, list) and isinstance(new, list):
        margin = relative * max(map(abs, old[2:]), default=0.0) + smallest
        return len(old) == len(new) and np.allclose(old, new, rtol=relative, atol=margin)
    is_number = [isinstance(value, (int, float)) for value in (old, new)]
    if not all(is_number):
        return old == new
    stem = key.rpartition(".")[0]
    error, floor = (recorded.get(f"{stem}.{name}") or 0.0 for name in ("error", "floor"))
    tolerance = relative * abs(old) + floor + smallest
    if key.endswith(".value"):
        tolerance += PART_OF_ERROR * error
    return abs(new - old) <= tolerance or (np.isnan(old) and np.isnan(new))


def read_facts(text: str) -> list[tuple]:
    """Return (unit, number as text) of the numbers of a text, and (key, "") of its keys and quoted words.

    Left out are numbers behind "±": errors, which the JSON files state beside their values.
    """
    text = ERROR.sub("±", text)
    facts = []
    for number, word in QUANTITY.findall(text):
        unit = word.rstrip(".")
        facts.append((unit if unit in UNITS else "", number))
    return facts + [(NUMBER.sub("#", key), "") for key in KEY.findall(text)]


def have_equal_facts(old: str, new: str) -> bool:
    """Return whether two texts contain the same keys and, for each unit, the same numbers, in any order and words."""
    facts = [
        sorted(read_facts(text), key=lambda fact: (fact[0], float(fact[1] or 0.0)))
        for text in (old, new)
    ]
    return len(facts[0]) == len(facts[1]) and all(
        a[0] == b[0] and are_equal_numbers(a[1] or "0", b[1] or "0", MIN_PERCENT * (a[0] == "%"))
        for a, b in zip(*facts)
    )


def have_equal_words(old: str, new: str) -> bool:
    """Return whether two texts have the same words, and equal numbers."""
    return NUMBER.split(old) == NUMBER.split(new) and all(
        map(are_equal_numbers, NUMBER.findall(old), NUMBER.findall(new))
    )


def are_equal_numbers(old: str, new: str, smallest: float = MIN_PRINTED) -> bool:
    """Return whether two printed numbers differ by a unit of their last place at most, or have at most the smallest size."""
    if max(abs(float(old)), abs(float(new))) <= max(smallest, MIN_PRINTED):
        return True
    mantissa, _, exponent = old.partition("e")
    unit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    margin = max(1.01 * unit * ("." in mantissa), RELATIVE * abs(float(old)))
    return abs(float(old) - float(new)) <= margin


def run_recorded(name: str, folder: Path) -> dict:
    """Run a group of commands or a scene in an empty folder; return {command: results}."""
    here = Path.cwd()
    try:
        return run_group(name, folder) if name in GROUPS else {"run": run_scene(name, folder)}
    finally:
        os.chdir(here)


def read_recorded(name: str) -> dict:
    """Return the recorded results of a group of commands or a scene; {} if there are none."""
    path = RECORDED / f"{name}.json"
    return json.loads(path.read_text("utf-8")) if path.is_file() else {}


def write_recorded(name: str, found: dict) -> None:
    """Write results with one line for each number, line of text or statistics of an array."""
    text = json.dumps(found, indent=0, ensure_ascii=False)
    text = re.sub(r",\n(?=-?\d|NaN)", ", ", text)
    (RECORDED / f"{name}.json").write_text(text + "\n", "utf-8")


def compare_with_recorded(name: str, found: dict) -> list:
    """Return a line for each difference between results and the recorded ones."""
    recorded = read_recorded(name)
    out = []
    for command in dict.fromkeys([*recorded, *found]):
        differences = find_differences(recorded.get(command, {}), found.get(command, {}))
        out += [f"{name}: {command}: {line}" for line in differences]
    return out


def main() -> None:
    """Run scenes and commands, print the differences from the recorded results and store the new ones."""
    for name in sys.argv[1:] or [*GROUPS, *SCENES]:
        with tempfile.TemporaryDirectory() as folder:
            found = run_recorded(name, Path(folder).resolve())
        for line in compare_with_recorded(name, found):
            print(line)
        write_recorded(name, found)


if __name__ == "__main__":
    main()
