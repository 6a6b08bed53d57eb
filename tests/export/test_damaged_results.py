"""Results folders that were damaged or made by others: code 2 with the file and what is wrong, no word of Python's."""

import json
import shutil
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest
from command_line import cli
from scene_texts import BENCH, COATED, COULOMB

OTHER = {
    "bytes": np.array([b"a"]),
    "scalar": np.float64(1.0),
    "three": np.zeros((2, 2, 2)),
    "short": np.zeros(1),
    "empty": np.zeros(0),
    "huge": np.full(3, 1e300),
    "complex": np.zeros(3, complex),
    "none": np.full(5, np.nan),
}
SLIDE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"\ncycles = 2\n'
SHARE = 571  # one of so many is always tried


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folders of a run with fields, of another, and of a sweep."""
    place = tmp_path_factory.mktemp("made")
    (place / "a.toml").write_text(COATED + COULOMB + SLIDE)
    (place / "b.toml").write_text(BENCH)
    assert cli("run", place / "a.toml", "-o", place / "a", "-q", "--no-page").code == 0
    assert cli("run", place / "b.toml", "-o", place / "b", "-q", "--no-page").code == 0
    assert (
        cli(
            "sweep",
            place / "b.toml",
            "--over",
            "friction.static=0.2,0.3,0.4",
            "-o",
            place / "s",
            "-q",
        ).code
        == 0
    )
    return place


def datasets(path: Path) -> list:
    found = []
    with h5py.File(path, "r") as file:
        file.visititems(
            lambda name, one: (
                found.append(name) if isinstance(one, h5py.Dataset) and one.ndim else None
            )
        )
    return found


def swapped(path: Path, name: str, what: str) -> None:
    with h5py.File(path, "r+") as file:
        old = file[name][()] if what in ("cut", "beyond") else None
        del file[name]
        if what == "ring":
            file[name] = h5py.SoftLink(f"/{name}")
        elif what == "cut":
            file[name] = old[:-1]
        elif what == "beyond":
            file[name] = old * 1e7 if old.dtype.kind == "f" else old[::-1]
        elif what != "gone":
            file[name] = OTHER[what]


def damages(made: Path) -> list:
    """(folder, file, name of a dataset, what stands in its place) of everything that is tried."""
    out = []
    for folder, file in ("a", "result.nc"), ("a", "fields.vtkhdf"), ("s", "sweep.nc"):
        for name in datasets(made / folder / file):
            if not name.startswith("VTKHDF/Steps/") and "FieldData" not in name:
                out += [
                    (folder, file, name, what) for what in ("gone", "ring", "cut", "beyond", *OTHER)
                ]
    return out


def judged(place: Path, folder: Path) -> list:
    """What is wrong with what the program says of a damaged folder: another code than 2 or 0, or words of Python's."""
    other = place / "b" if folder.name == "a" else folder
    asked = [("report", folder, other, "-o", place / "p.html")]
    if folder.name == "a":
        asked += [
            ("export", folder, "-o", place / "h.csv"),
            ("view", folder, "-o", place / "v.svg"),
            ("export", folder, "-o", place / "play.html"),
        ]
    out = []
    for words in asked:
        with warnings.catch_warnings(record=True) as raw:
            warnings.simplefilter("always")
            answer = cli(*words)
        if (
            answer.code not in (0, 2)
            or "Warning" in answer.err
            or "internal fault" in answer.err
            or raw
        ):
            out.append(
                (
                    words[0],
                    answer.code,
                    answer.err.strip()[-160:],
                    [str(one.message)[:60] for one in raw][:2],
                )
            )
        elif answer.code == 2 and folder.name not in answer.err:
            out.append((words[0], "names no file", answer.err.strip()[-160:]))
    return out


@pytest.mark.parametrize(
    "share", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["share", "all"]
)
def test_always_arrays_of_another_shape_are_refused_in_words(made, tmp_path, share):
    wrong = []
    tried = damages(made)
    shutil.copytree(made / "b", tmp_path / "b")
    for number, (folder, file, name, what) in enumerate(tried):
        if share and number % SHARE:
            continue
        shutil.rmtree(tmp_path / folder, ignore_errors=True)
        shutil.copytree(made / folder, tmp_path / folder)
        swapped(tmp_path / folder / file, name, what)
        wrong += [(file, name, what, *one) for one in judged(tmp_path, tmp_path / folder)]
    assert len(tried) > 300 and not wrong, "\n".join(map(str, wrong[:40]))


def summary_of(folder: Path, change) -> None:
    data = json.loads((folder / "summary.json").read_text())
    change(data)
    (folder / "summary.json").write_text(json.dumps(data))


@pytest.mark.parametrize("value", [10**400, 1e308, "a", [], None])
def test_refuses_a_summary_with_other_than_numbers(made, tmp_path, value):
    for name in "a", "b":
        shutil.copytree(made / name, tmp_path / name)
    summary_of(tmp_path / "a", lambda data: data["measures"]["normal_load"].update(value=value))
    answer = cli("report", tmp_path / "a", tmp_path / "b", "-o", tmp_path / "p.html")
    assert answer.code == (0 if value in (1e308, None) else 2), answer
    assert (
        answer.code == 0
        or "summary.json" in answer.err
        or "its results cannot be read" in answer.err
    )


def lines(folder: Path, change) -> None:
    path = folder / "sweep.csv"
    path.write_text("\n".join(change(path.read_text().splitlines())) + "\n")


@pytest.mark.parametrize(
    "change",
    [
        lambda rows: [*rows[:2], rows[2].rpartition(",")[0], *rows[3:]],
        lambda rows: rows[:1],
        lambda rows: [],
        lambda rows: rows[:-1],
        lambda rows: [rows[0].replace("outcome", "x"), *rows[1:]],
        lambda rows: [*rows[:-1], '"' + "x" * 200_000 + '"' + rows[-1]],
        lambda rows: [*rows, rows[-1]],
    ],
    ids=["short", "header", "empty", "one_less", "no_outcome", "long", "one_more"],
)
def test_refuses_a_table_of_a_sweep_that_is_not_whole(made, tmp_path, change):
    shutil.copytree(made / "s", tmp_path / "s")
    lines(tmp_path / "s", change)
    answer = cli("report", tmp_path / "s", "-o", tmp_path / "p.html")
    assert answer.code == 2 and "the sweep in this folder cannot be read" in answer.err, answer


@pytest.mark.parametrize(
    "name, value",
    [
        ("sets", "5"),
        ("sets", "[5]"),
        ("scene", 'title = ["a"]'),
        ("scene", "title ="),
        ("tolerance", "x"),
        ("source", 5),
    ],
)
def test_refuses_a_sweep_whose_attributes_are_none(made, tmp_path, name, value):
    shutil.copytree(made / "s", tmp_path / "s")
    with h5py.File(tmp_path / "s" / "sweep.nc", "r+") as file:
        file.attrs[name] = value
    answer = cli("report", tmp_path / "s", "-o", tmp_path / "p.html")
    assert answer.code == (0 if name == "source" else 2), answer
    assert "Traceback" not in answer.err and "internal" not in answer.err
