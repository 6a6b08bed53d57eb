"""`check` reads every file that a scene names and says each fault at the scene's line, beside all other mistakes."""

import json
import os
import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest
import surfaces as write
from command_line import cli
from scene_texts import BENCH, COATED, COULOMB, POINT, STRUCTURE, line_of

from patchfem import SceneError, load

PROFILE = COATED + '[contact.profile]\nfile = "{}"\n'
SLIDE = POINT + COULOMB + '[slide]\nkind = "file"\nfile = "{}"\n'
DRIVE = (
    STRUCTURE[: STRUCTURE.index("[drive]")]
    + '[drive]\nkind = "base"\nwaveform = "file"\nfile = "{}"\n'
)
ARRAYS = '[structure]\nfile = "{}"\n[drive]\nkind = "base"\nfrequency = "5 Hz"\nacceleration = "1 g"\ncycles = 3\n'
MEASURED = BENCH + '[measured]\nfile = "{}"\n'


def checked(folder, text: str, name: str, content, *words) -> tuple:
    """(exit code, lines on stderr) of `check` of a scene that names a file of this content, None: no such file."""
    (folder / "scene.toml").write_text(text.format(name))
    if content is not None:
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    answer = cli("check", folder / "scene.toml", *words)
    return answer.code, answer.err.splitlines()


def mesh_text(name="{}") -> str:
    head, table, rest = COATED.replace('element_size = "0.5 mm"\n', "").partition(
        "[contact.coating]"
    )
    return f'{head}mesh = "{name}"\n{table}{rest}'


FAULTS = {
    "profile": (PROFILE, "a.csv", "0,1\n1,2\n", "contact.profile.file", "a.csv:1: there is no header, and units"),
    "profile, short": (PROFILE, "a.csv", "x [mm],z [um]\n0,1\n2,2\n4,1\n", "contact.profile.file",
                       "the profile is 4 mm long, but the patch is 12.7 mm"),
    "profile, areal": (PROFILE, "a.x3p", write.x3p_of(write.scan()), "contact.profile.file",
                       "an areal scan of 4 x 6 heights, but a single trace is needed"),
    "slide": (SLIDE, "p.csv", "time [s],displacement [um]\n0,0\n1,x\n", "slide.file",
              "p.csv:3: displacement: 'x' is not a finite number"),
    "drive": (DRIVE, "d.csv", "time [s],acceleration [g]\n0,0\n0,1\n", "drive.file",
              "d.csv:3: time 0 s is not later than"),
    "structure": (ARRAYS, "a.npz", b"PK\x03\x04 no archive", "structure.file", "a.npz cannot be read"),
    "measured": (MEASURED, "m.csv", "frequency [Hz],output [g]\n1,1\n", "measured.file",
                 "not 'frequency [Hz],output [g]' (columns with a unit: frequency, input"),
    "mesh": (mesh_text(), "a.msh", "$MeshFormat\nnonsense\n", "contact.mesh", "a.msh: not a readable .msh file"),
    "mesh, lying": (mesh_text(), "a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n9999999\n1 0 0 0\n$EndNodes\n",
                    "contact.mesh", "a.msh: Nodes announces 9999999 entries"),
    "mesh, .inp": (mesh_text(), "a.inp", "*NODE\n1,0,0\n", "contact.mesh", "a.inp: no cells or nodes are tagged "
                                                                           "lower_far"),
    "mesh, .vtu": (mesh_text(), "a.vtu", "<?xml version='1.0'?>", "contact.mesh", "a.vtu: not a readable .vtu file"),
}  # fmt: skip


@pytest.mark.parametrize("text, name, content, key, said", FAULTS.values(), ids=FAULTS)
def test_refuses_each_faulty_file_with_the_line_of_the_scene(
    tmp_path, text, name, content, key, said
):
    code, lines = checked(tmp_path, text, name, content)
    assert code == 2 and len(lines) == 1, lines
    number = line_of(text, "mesh = " if key == "contact.mesh" else "file = ")
    assert lines[0].startswith(f"{tmp_path / 'scene.toml'}:{number}: {key}: ") and said in lines[0]
    answer = cli("run", tmp_path / "scene.toml", "-o", tmp_path / "out")
    assert answer.code == 2 and answer.err.splitlines() == lines


@pytest.mark.parametrize("text, name, content, key, said", FAULTS.values(), ids=FAULTS)
def test_refuses_missing_and_faulty_files_together_with_other_mistakes(
    tmp_path, text, name, content, key, said
):
    """One list in the order of the file, whatever else is wrong."""
    wrong = "colour = 1\n" + text
    code, lines = checked(tmp_path, wrong, name, None)
    assert code == 2 and len(lines) == 2 and f": {key}: there is no file" in lines[1], lines
    assert ":1: colour: unknown key" in lines[0]
    code, lines = checked(tmp_path, wrong, name, content)
    kept = "the profile is 4 mm long" not in said  # the patch that it is held against may be wrong
    assert code == 2 and len(lines) == (2 if kept else 1) and (not kept or said in lines[1]), lines
    with pytest.raises(SceneError) as caught:
        load(tmp_path / "scene.toml")  # a run names what is not there, and reads the files later
    assert len(caught.value.mistakes) == 1


def test_refuses_every_file_of_a_scene_at_once(tmp_path):
    text = SLIDE.replace(
        "[slide]",
        COATED[COATED.index("[contact]") :] + '[contact.profile]\nfile = "z.csv"\n[slide]',
    )
    text = text.replace(POINT, "") + '[measured]\nfile = "m.csv"\n'
    (tmp_path / "z.csv").write_text("x,z\n0,1\n")
    (tmp_path / "m.csv").write_text("nothing\n")
    code, lines = checked(tmp_path, text, "p.csv", "time,displacement\n0,0\n")
    assert code == 2 and [line.split(": ")[1] for line in lines] == [
        "contact.profile.file",
        "slide.file",
        "measured.file",
    ]
    (tmp_path / "p.csv").unlink()
    code, lines = checked(tmp_path, text, "p.csv", None, "--set", "measured.file=none.csv")
    assert (
        code == 2
        and "z.csv:1: column 'x' has no unit" in lines[0]
        and "there is no file" in lines[1]
    )
    assert lines[2].startswith("--set: measured.file: there is no file")


def test_exact_right_files_pass(tmp_path):
    """A Dektak export, as the instrument writes it, over the whole patch; and what a run reads of it."""
    z = 0.2 * np.cos(np.arange(3200) / 400)
    code, lines = checked(
        tmp_path, PROFILE + 'heights = "surface"\n', "scan.csv", write.dektak(z, 13000.0)
    )
    assert code == 0 and all(line.startswith("note: scan.csv: ") for line in lines), lines
    answer = cli("check", tmp_path / "scene.toml", "--json")
    assert json.loads(answer.out)["kind"] == "patch"
    M = np.eye(2)
    K = np.array([[200.0, -100.0], [-100.0, 100.0]])
    np.savez(tmp_path / "a.npz", M=M, K=K, output=[0, 1])
    assert checked(tmp_path, ARRAYS, "a.npz", None) == (0, [])


def test_exact_check_says_of_a_profile_what_the_run_warns_of(tmp_path):
    """The scene was without a mistake to `check`, and `run` warned of a trace that it moved and levelled."""
    x = np.linspace(0, 13e-3, 131)
    rows = "".join(f"{1e3 * a},{1e6 * (1e-4 * a + 2e-7 * np.cos(900 * a))}\n" for a in x)
    code, lines = checked(tmp_path, PROFILE, "p.csv", f"x [mm],z [um]\n{rows}")
    assert (
        code == 0
        and "adds -6.5 mm to x" in lines[0]
        and "from the heights; to include a tilt" in lines[1]
    ), lines
    answer = json.loads(
        cli("run", tmp_path / "scene.toml", "-o", tmp_path / "out", "--no-page", "--json").out
    )
    told = [text for text in (*answer["notes"], *answer["warnings"]) if "p.csv" in text]
    assert lines == [f"note: {text}" for text in told]
    assert json.loads(cli("check", tmp_path / "scene.toml", "--json").out)["notes"] == told


# ------------------------------------------------------------------------------------------------------- hostile files
def bomb() -> bytes:
    """An X3P whose heights are 64 MiB of zeros: 65 KB packed."""
    data = bytes(64 * 2**20)
    axes = (
        write.axis("CX", increment=1e-6) + write.axis("CY", increment=1e-6) + write.axis("CZ", "A")
    )
    return write.x3p(write.main_xml(axes, write.matrix(4096, 2048) + write.link(data)), data)


def gzip_bomb() -> bytes:
    """A gzip file of 400 MiB of blanks: 2 MB packed."""
    pack = zlib.compressobj(1, zlib.DEFLATED, 31)  # fast: a gzip of 2 MB
    return b"".join([*(pack.compress(b" " * 2**20) for _ in range(400)), pack.flush()])


def with_entities(inside: str) -> bytes:
    xml = f'<?xml version="1.0"?><!DOCTYPE a [{inside}]><ISO5436_2><Record1>&b9;</Record1></ISO5436_2>'
    return write.x3p(xml.encode())


def laughs() -> bytes:
    """Ten to the ninth entities."""
    lines = ['<!ENTITY b0 "lol">'] + [
        f'<!ENTITY b{k} "{f"&b{k - 1};" * 10}">' for k in range(1, 10)
    ]
    return with_entities("".join(lines))


def npy_of(shape: str, kind="<f8") -> bytes:
    head = f"{{'descr': {kind!r}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    head += b" " * (53 - len(head) % 64 + 10) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + bytes(64)


class Evil:
    """Unpickled, it would make a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def pickled(folder) -> bytes:
    return write.npy(np.array([Evil(folder / "made")], object))


HOSTILE = {
    "zip bomb": ("a.x3p", lambda _: bomb(), "unpacks to more than 200 times its packed size"),
    "gzip bomb": ("a.csv.gz", lambda _: gzip_bomb(), "more than 64 MiB of text"),
    "bomb in zip": ("a.zip", lambda _: write.zipped({"a.csv": bytes(64 * 2**20)}), "more than 200 times its packed"),
    "zip in zip": ("a.zip", lambda _: write.zipped({"a.zip": write.zipped({"a.csv": b"x"})}), "packed twice"),
    "entities": ("a.x3p", lambda _: laughs(), "main.xml declares entities or a document type"),
    "external entity": ("a.x3p", lambda _: with_entities('<!ENTITY b9 SYSTEM "file:///etc/passwd">'),
                        "main.xml declares entities or a document type"),
    "deep xml": ("a.x3p", lambda _: write.x3p(b"<a>" * 10**5), "nested deeper than 50"),
    "path traversal": ("a.x3p", lambda _: write.x3p(write.main_xml(
        write.axis("CX", increment=1e-6) + write.axis("CY", increment=1e-6) + write.axis("CZ", "A"),
        write.matrix(6, 4) + write.link(b"", name="../../etc/passwd"))), "names a place outside the file"),
    "29 TiB": ("a.npy", lambda _: npy_of("(2000000000000, 2)"), "4000000000000 numbers are announced in"),
    "pickle": ("a.npy", pickled, "contains Python objects, which are not loaded"),
}  # fmt: skip

RUN = """\
import os, sys
from patchfem.__main__ import main
try:
    main(["check", sys.argv[1]])
except SystemExit as end:
    with open("/proc/self/status") as file:  # ru_maxrss would count the process that started this one
        peak = next(int(line.split()[1]) / 1024 for line in file if line.startswith("VmHWM"))
    print(end.code, peak, sum(os.times()[:2]), flush=True)
"""


@pytest.mark.share(1, 7)
@pytest.mark.skipif(
    not sys.platform.startswith("linux"),
    reason="reads the peak of the memory in KiB, as Linux counts",
)
@pytest.mark.parametrize("name, made, said", HOSTILE.values(), ids=HOSTILE)
def test_refuses_hostile_files_within_a_second_and_300_megabytes(tmp_path, name, made, said):
    """The whole of `patchfem check`, measured by its own process: exit code 2, one line, no traceback."""
    (tmp_path / name).write_bytes(made(tmp_path))
    (tmp_path / "scene.toml").write_text(PROFILE.format(name))
    for _ in range(
        3
    ):  # the least of three: neither a busy machine nor a first import is a fault here
        done = subprocess.run(
            [sys.executable, "-c", RUN, str(tmp_path / "scene.toml")],
            capture_output=True,
            text=True,
            timeout=60,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        )
        lines = done.stderr.splitlines()
        assert (
            len(lines) == 1
            and "contact.profile.file: " in lines[0]
            and "Traceback" not in done.stderr
        ), done.stderr
        assert said in lines[0], lines[0]
        code, megabytes, seconds = map(float, done.stdout.split())
        assert code == 2 and megabytes < 300, done.stdout
        if seconds < 1.0:  # of the processor; .23 s on a quiet machine, most of it Python starting
            break
    assert seconds < 1.0, done.stdout
    assert not (tmp_path / "made").exists()
