"""The pages for users: lengths, links, and the numbers and commands that they print."""

import ast
import csv
import json
import math
import re
import shlex
import shutil
from pathlib import Path

import pytest
from command_line import read_json, run_cli, run_successfully

import patchfem as pf

ROOT = Path(__file__).parents[1]
GUIDE = ROOT / "patchfem/scene/guide"


def test_exact_version_agrees_in_all_documents(tmp_path):
    """Citation file, change log, `--version`, `doctor`, summary and report give the version of the package."""
    citation = (ROOT / "CITATION.cff").read_text()
    changes = (ROOT / "patchfem/CHANGES.md").read_text()
    released = re.search(r"^date-released: (\S+)$", citation, re.M).group(1)
    assert re.search(r"^version: (\S+)$", citation, re.M).group(1) == pf.__version__
    assert re.search(r"^## (.+?):", changes, re.M).group(1) == f"{pf.__version__} ({released})"
    assert run_cli("--version").out.strip() == pf.__version__
    assert re.search(rf"patchfem +{re.escape(pf.__version__)}\n", run_cli("doctor").out)
    pf.run(pf.new("bench")).save(tmp_path)
    assert read_json(tmp_path / "summary.json")["patchfem"] == pf.__version__
    assert f"patchfem {pf.__version__}" in (tmp_path / "report.html").read_text()


def read_page(page: str) -> str:
    """Return the text of a page."""
    return (ROOT / page).read_text("utf-8")


@pytest.mark.parametrize("page, words", [("README.md", 1000), ("studies/README.md", 1500)])
def test_always_first_pages_are_short(page: str, words: int):
    """The README has at most 1000 words and 120 lines, the index of studies at most 1500 words."""
    text = read_page(page)
    assert len(text.split()) <= words
    assert page != "README.md" or len(text.splitlines()) <= 120


def test_always_guide_pages_are_short():
    """The guide has at most 9000 words and each page at most 900; a page begins with its question and ends with links."""
    pages = {path.name: path.read_text("utf-8").rstrip("\n") for path in GUIDE.glob("*.md")}
    words = {name: len(page.split()) for name, page in pages.items()}
    assert max(words.values()) <= 900 and sum(words.values()) <= 9000, words
    for name, page in pages.items():
        first, last = page.splitlines()[0], page.split("\n\n")[-1]
        assert first.startswith("# ") and first.endswith("?"), name
        assert last.startswith("See also: ") and "](" in last, name


def test_always_gallery_lists_every_study():
    """Index and answers of the studies link every script that can be run as a study."""
    pages = [read_page(f"studies/{name}.md") for name in ("README", "answers")]
    runs = [
        path
        for path in (ROOT / "studies").glob("*/*.py")
        if f"Run: python {path.relative_to(ROOT)}" in path.read_text("utf-8")
        or f"python {path.relative_to(ROOT)}" in path.read_text("utf-8")
    ]
    assert len(runs) > 20
    lost = [
        path.name
        for path in runs
        if path.name != "picture.py"
        and not all(f"({path.relative_to(ROOT / 'studies')})" in page for page in pages)
    ]
    assert lost == []


def test_exact_readme_scene_and_settings_are_valid():
    """The scene of the README and the settings of its examples can be loaded."""
    from patchfem.scene import loads

    scene = loads(re.search(r"```toml\n(.*?)```", read_page("README.md"), re.S)[1])
    assert scene.kind == "rig" and scene.contact.tilt.angle == pytest.approx(1e-4)
    sets = dict(re.findall(r'\*\*\{"([\w.]+)": "([^"]+)"\}', read_page("README.md")))
    assert sets and all(
        loads(scene.text, sets=[f"{key}={value}"]).kind == "rig" for key, value in sets.items()
    )


def test_always_guide_python_example_runs(tmp_path, monkeypatch):
    """The Python example of the guide runs, gives a friction ratio of 0.4 and writes its files."""
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(
        re.search(r"```python\n(.*?)```", read_page("patchfem/scene/guide/python.md"), re.S)[1],
        names,
    )
    assert names["result"].measures.friction_ratio_peak.value == pytest.approx(0.4, rel=1e-6)
    assert {path.name for path in tmp_path.iterdir()} == {"loop.png", "out"}
    assert len(names["axes"].lines) == 2 and (tmp_path / "out/mine/summary.json").is_file()


@pytest.mark.slow
def test_exact_guide_numbers_of_damper_are_reproduced(tmp_path, monkeypatch):
    """The commands of the page on responses run, and their answers are those of the page."""
    monkeypatch.chdir(tmp_path)
    page = read_page("patchfem/scene/guide/response.md")
    text = " ".join(page.replace("\n> ", " ").split())
    blocks = re.findall(r"```bash\n(.*?)```", page, re.S)
    answers = []
    for line in "".join(blocks).replace("\\\n", "").splitlines():
        if "cases/*" not in line:
            answers.append(run_successfully(*shlex.split(line)[1:]).out)
    measures = read_json("out/curve/summary.json")["measures"]
    peak = measures["relative_displacement_amplitude"]["value"]
    frequency = measures["peak_frequency"]["value"]
    assert f"here {1e6 * peak:.1f} um at {frequency:.2f} Hz" in text
    quotes = re.findall(r"(?:^> .*\n)+", page, re.M)
    assert len(quotes) == 2
    for quote in quotes:
        assert any(
            " ".join(quote.replace("> ", "").split()) in " ".join(one.split()) for one in answers
        )


@pytest.fixture
def run_recipe(tmp_path, monkeypatch):
    """Return a function that goes through a door of the README, given its task, and returns the output.

    The folder contains only the files that the commands name.
    """
    monkeypatch.chdir(tmp_path)
    doors = read_page("README.md").partition("## Five doors")[2].partition("## A scene")[0]
    commands = dict(re.findall(r"^\| \[(.*?)\].* \| `(.*)` \|$", doors, re.M))
    assert len(commands) == 5
    for name in re.findall(r"studies/\S+", " ".join(commands.values())):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)

    def run_commands(task: str) -> str:
        """Run the commands of a door and return the output of the last."""
        for words in commands[task].split("&&"):
            answer = run_successfully(*shlex.split(words)[1:])
        return answer.out

    return run_commands


@pytest.mark.slow
def test_always_tilt_limit_agrees_on_all_pages(tmp_path, monkeypatch):
    """All pages quote the tilt limit of the sweep, and a run at this limit changes the loop area by 5 %."""
    monkeypatch.chdir(tmp_path)
    run_successfully("new", "misalignment", "-o", "tilts.toml")
    verdict = run_successfully("sweep", "tilts.toml").out
    content = read_json("out/tilts-sweep/sweep.json")
    limits = {limit["measure"]: limit["value"] for limit in content["limits"]}
    motion = set(limits) & {
        "relative_displacement_amplitude",
        "absolute_acceleration_peak",
        "slip_amplitude",
        "loop_area",
        "friction_force_peak",
    }
    assert min(motion, key=limits.get) == "loop_area"
    assert "before loop area changes by 5 % (between the cases at 100 urad and 316 urad)" in verdict
    # the pages round the limits down to two digits
    angle = f"{math.floor(1e5 * limits['loop_area']) / 100:g} mrad"
    gap = f"{math.floor(12.7e3 * limits['loop_area'])} um over the patch"
    doubling = f"{math.floor(1e6 * limits['pressure_peak']) / 1000:g} mrad"
    assert_pages_quote_limit(f"{angle} ({gap})", f"the pressure peak doubles at {doubling}")
    with open("out/tilts-sweep/sweep.csv", encoding="utf-8") as file:
        first = float(next(csv.DictReader(file))["loop_area"])
    scene = (
        Path("tilts.toml")
        .read_text("utf-8")
        .replace("[sweep]\n", "")
        .replace('"contact.tilt.angle" =', "#")
    )
    at_limit = pf.run(scene, **{"contact.tilt.angle": angle}).measures["loop_area"].value
    assert at_limit / first - 1 == pytest.approx(-0.05, abs=0.003)


def test_always_doors_of_joint_face_and_mesh_run(run_recipe):
    """The commands for a joint, a worn face and a mesh run without error.

    The interval of the worn depth covers the difference of the mean heights.
    """
    assert "interface nodes" in run_recipe("my mesh")
    joint = run_recipe("my joint")
    assert all(
        text in joint for text in ("equivalent_stiffness", "loop_area", "dissipated per cycle")
    )
    depth, low, high = map(
        float,
        re.search(
            r"Worn depth (\S+) nm \((\S+) to (\S+)\), the mean of the lost material over the common length",
            run_recipe("my worn face"),
        ).groups(),
    )
    before, after = (
        [
            float(row["z [um]"])
            for row in csv.DictReader(read_page(f"studies/wear/{name}.csv").splitlines())
        ]
        for name in ("before", "after")
    )
    assert low < 1e3 * (sum(before) - sum(after)) / len(before) < high and high - low < 0.06 * depth


def assert_pages_quote_limit(limit: str, peak: str) -> None:
    """Assert that answers, notebook and studies quote the same tilt limit and pressure criterion."""
    rows = read_page("studies/answers.md").splitlines()
    book, tilted, moving = (
        next(row for row in rows if f"({name})" in row)
        for name in ("notebooks/misalignment.ipynb", "rig/tilt.py", "misalignment/in_motion.py")
    )
    cells = json.loads(read_page("studies/notebooks/misalignment.ipynb"))["cells"]
    notebook = "".join(
        line for cell in cells if cell["cell_type"] == "markdown" for line in cell["source"]
    )
    study, other = (
        ast.get_docstring(ast.parse(read_page(f"studies/{path}")))
        for path in ("rig/tilt.py", "misalignment/in_motion.py")
    )
    for page in (book, tilted, moving, notebook, study, other):
        assert limit in " ".join(page.split()), page[:80]
    for page in (book, notebook, study):
        assert peak in " ".join(page.split()), page[:80]
