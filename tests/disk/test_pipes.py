"""Pipes as scenes: a pipe that begins late is read, and a pipe without a writer is refused."""

import os
import threading
import time

import pytest

from patchfem.campaigns.sweeps.table import read_case_table
from patchfem.core import PatchfemError
from patchfem.disk import open_with_timeout
from patchfem.scene import scene, toml_text
from patchfem.surface import read_surface

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")


@pytest.fixture
def named_pipe(tmp_path):
    """Path of a named pipe."""
    os.mkfifo(tmp_path / "x.toml")
    return tmp_path / "x.toml"


def test_exact_slow_pipe_is_read_completely(named_pipe):
    # more than the capacity of a pipe
    """A pipe whose writer starts late and pauses is read completely."""
    parts = ("[friction]\n", "# " + "x" * 200_000 + "\n", "static = 0.3\n")

    def write():
        time.sleep(0.1)
        with open(named_pipe, "w", encoding="utf-8") as file:
            for part in parts:
                file.write(part)
                file.flush()
                time.sleep(0.1)

    writer = threading.Thread(target=write)
    writer.start()
    assert toml_text.read_text(named_pipe) == "".join(parts)
    writer.join()


def test_refuses_pipe_without_writer(named_pipe, monkeypatch):
    """A pipe without a writer is refused after a timeout."""
    monkeypatch.setattr(open_with_timeout, "PIPE_WAIT_SECONDS", 0.1)
    with pytest.raises(
        scene.SceneError, match=r"x\.toml: cannot be read: this is a pipe, and no data came"
    ):
        toml_text.read_text(named_pipe)
    with pytest.raises(PatchfemError, match=r"x\.toml: the profile cannot be read .*no data came"):
        read_surface(named_pipe)
    assert read_case_table(named_pipe)[1] == [
        f"{named_pipe}: the table of cases cannot be read (this is a pipe, and no data came through it within 0 s)"
    ]
