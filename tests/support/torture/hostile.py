"""Malicious files: they would run code, unpack without end, block forever, or write outside their folder."""

import io
import os
import pickle
import stat
import zipfile
from pathlib import Path

import numpy as np

from .toml import to_toml
from .trial import Trial, TrialFailure

MARK = "was-run"  # File that exists only if code was executed.
BOMB = (
    b"<?xml version='1.0'?><!DOCTYPE l [<!ENTITY a 'aaaaaaaaaa'>"
    + b"".join(b"<!ENTITY %c '%s'>" % (98 + k, b"&%c;" % (97 + k) * 10) for k in range(9))
    + b"]><VTKFile>&j;</VTKFile>"
)
OUTSIDE = b"<?xml version='1.0'?><!DOCTYPE x [<!ENTITY y SYSTEM 'file:///etc/passwd'>]><VTKFile>&y;</VTKFile>"


RUBS = {
    "normal": {"load": "20 N"},
    "friction": {"law": "coulomb", "static": 0.3},
    "accuracy": {"tolerance": 1e-2},
}
RIG = RUBS | {
    "structure": {
        "moving_mass": "1 kg",
        "mode": [{"name": "m", "frequency": "100 Hz", "damping": 0.01, "slide": 1.0}],
    }
}


class MaliciousPickle:
    """Object whose unpickling would run a command."""

    def __reduce__(self):
        """Return the command that unpickling would run."""
        return os.system, (f"touch {MARK}",)


def run_trial(trial: Trial) -> None:
    """Read a malicious file with a command that accepts its suffix, and check that it did no harm."""
    kind = KINDS[int(trial.r.integers(len(KINDS)))]
    words = kind(trial)
    trial.run(*words)
    written = [
        path
        for path in (Path(MARK), trial.folder.parent / "escaped", trial.folder.parent / MARK)
        if path.exists()
    ]
    if written:
        raise TrialFailure(f"{kind.__name__}: {written[0].name} was written")


def make_pickle(trial: Trial) -> list:
    """Make a pickle with any suffix that a command reads."""
    name = trial.draw(*"x.npy x.npz x.mat x.csv x.uff x.sdf x.x3p x.plu x.toml x.npy".split())
    if name.endswith(".npy") and trial.chance(0.5):
        np.save(name, np.array([MaliciousPickle()], object), allow_pickle=True)
    elif name.endswith(".npz") and trial.chance(0.5):
        np.savez(name, M=np.array([MaliciousPickle()], object), K=np.eye(1))
    else:
        Path(name).write_bytes(pickle.dumps(MaliciousPickle()))
    return make_command(trial, name)


def make_command(trial: Trial, name: str) -> list:
    """Return a command that reads a file: as a surface, as records, as a rig, or as a scene."""
    ending = Path(name).suffix
    if ending == ".toml":
        return [trial.draw("check", "plan", "run", "cite"), name]
    if ending in (".npz", ".mat", ".uff") and trial.chance(0.6):
        Path("rig.toml").write_text(
            to_toml(
                RIG
                | {
                    "structure": {"file": name, "slide_at": "1"},
                    "drive": {
                        "kind": "base",
                        "frequency": "9 Hz",
                        "acceleration": "1 g",
                        "cycles": 2,
                    },
                }
            ),
            "utf-8",
        )
        return [trial.draw("check", "run"), "rig.toml"]
    if ending in (".uff", ".csv") and trial.chance(0.5):
        return ["import", name, "-o", "out.csv"]
    if ending in (".msh", ".vtu", ".inp", ".med"):
        Path("mesh.toml").write_text(
            to_toml(
                {
                    "contact": {
                        "length": "2 mm",
                        "width": "2 mm",
                        "height": "1 mm",
                        "load": "5 N",
                        "substrate": "steel",
                        "mesh": name,
                    }
                }
            )
        )
        return [trial.draw("check", "run"), "mesh.toml"]
    return ["profile", name, "--units", "um,um"]


def make_zip_bomb(trial: Trial) -> list:
    """Make a small archive that unpacks to 620 MB."""
    name = trial.draw("x.npz", "x.x3p", "x.npz")
    with zipfile.ZipFile(name, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        head = io.BytesIO()
        np.lib.format.write_array_header_1_0(
            head, {"descr": "<f8", "fortran_order": False, "shape": (8800, 8800)}
        )
        with archive.open(
            "M.npy" if name == "x.npz" else "main.xml", "w", force_zip64=True
        ) as file:
            file.write(head.getvalue() if name == "x.npz" else b"<a>")
            for _ in range(62):
                file.write(bytes(10**7))
    return make_command(trial, name)


def make_zip_slip(trial: Trial) -> list:
    """Make an archive whose members lie outside its folder."""
    name = trial.draw("x.x3p", "x.npz")
    with zipfile.ZipFile(name, "w") as archive:
        for member in ("../escaped", "/tmp/escaped", "main.xml", "../../escaped/main.xml"):
            archive.writestr(member, "<a/>")
    return make_command(trial, name)


def make_xml_bomb(trial: Trial) -> list:
    """Make XML with nested entities, or with the entity of a system file."""
    name = trial.draw("x.vtu", "x.x3p")
    text = trial.draw(BOMB, OUTSIDE)
    if name == "x.x3p":
        with zipfile.ZipFile(name, "w") as archive:
            archive.writestr("main.xml", text)
    else:
        Path(name).write_bytes(text)
    return make_command(trial, name)


def make_blocking_file(trial: Trial) -> list:
    """Make a pipe without a writer, an endless device, a folder, or a circular link."""
    name = "x" + trial.draw(*".toml .csv .npy .npz .mat .uff .msh .vtu .inp .x3p".split())
    form = trial.draw("pipe", "zero", "folder", "circle", "random")
    if form == "pipe":
        os.mkfifo(name)
    elif form == "folder":
        os.mkdir(name)
    else:
        os.symlink({"zero": "/dev/zero", "circle": name, "random": "/dev/urandom"}[form], name)
    return make_command(trial, name)


def make_huge_file(trial: Trial) -> list:
    """Make a file with one line, number or name of megabytes, or a sparse file of gigabytes."""
    name = "x" + trial.draw(*".toml .csv .inp .med .msh .uff .csv .npy .mat .sdf".split())
    form = trial.draw("line", "number", "quote", "hole", "commas", "lines")
    if form == "hole":
        with open(name, "wb") as file:
            file.write(b"x [um],z [um]\n")
            file.truncate(8 * 2**30)
    else:
        Path(name).write_text(
            {
                "line": "x" * 10**7,
                "number": "9" * 10**7,
                "quote": '"' + "a\n" * 10**6,
                "commas": "," * 10**7,
                "lines": "\n" * 10**7,
            }[form]
        )
    return make_command(trial, name)


def make_wrong_header(trial: Trial) -> list:
    """Make an array whose header states sizes or types that the file does not contain."""
    shape = trial.draw(
        "(1000000000000, 2)",
        "(-1, 2)",
        "(2, 99999999999999999999)",
        "()",
        "(" * 300,
        "(2, 2)",
        "__import__('os').system('touch was-run')",
    )
    descr = trial.draw("'<f8'", "'|O'", "'<U9'", "[('x', '<f8')]", "'|V8'", "exec('1')")
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    Path("x.npy").write_bytes(
        b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(64)
    )
    return make_command(trial, "x.npy")


def make_device(name: str, number: int) -> None:
    """Make a device in the working folder (3: null, 7: full), or a pipe if devices are not permitted.

    The devices of the system must not be put at risk.
    """
    try:
        os.mknod(name, 0o666 | stat.S_IFCHR, os.makedev(1, number))
    except OSError:
        os.mkfifo(name)


def try_outputs(trial: Trial) -> list:
    """Write results to a place that is not suitable, and check that no file of others is lost."""
    Path("scene.toml").write_text(
        to_toml(RUBS | {"slide": {"kind": "sine", "amplitude": "9 um", "frequency": "1 Hz"}})
    )
    os.mkdir("mine")
    Path("mine/thesis.txt").write_text("years")
    os.symlink("mine", "link")
    os.symlink("nowhere", "dangling")
    Path("file").write_text("mine")
    make_device("null", 3)
    names = (
        "mine link dangling file / . .. mine/.. file/x null /proc/self ~ mine/thesis.txt".split()
    )
    target = trial.draw(*names, "", "x" * 300, "a/" * 900, "a\nb", " ")
    result = trial.run("run", "scene.toml", "-o", target, "--no-page")
    if Path("mine/thesis.txt").read_text() != "years" or (
        target == "file" and Path("file").read_text() != "mine"
    ):
        raise TrialFailure(
            f"-o {target}: a file of somebody else is gone (exit code {result.code})"
        )
    return ["check", "scene.toml"]


KINDS = (
    make_pickle,
    make_zip_bomb,
    make_zip_slip,
    make_xml_bomb,
    make_blocking_file,
    make_huge_file,
    make_wrong_header,
    try_outputs,
    make_pickle,
    make_blocking_file,
)
