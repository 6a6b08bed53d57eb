"""Pipes as scenes: one that begins late is read, one that nobody writes to is refused."""

import os
import threading
import time

import pytest

from patchfem.campaigns.sweeps.table import read_case_table
from patchfem.disk import open_with_timeout
from patchfem.scene import scene, toml_text

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")


@pytest.fixture
def pipe(tmp_path):
    os.mkfifo(tmp_path / "x.toml")
    return tmp_path / "x.toml"


def test_exact_a_pipe_that_begins_late_and_pauses_is_read_whole(pipe):
    # more than a pipe holds at once
    parts = ("[friction]\n", "# " + "x" * 200_000 + "\n", "static = 0.3\n")

    def write():
        time.sleep(0.1)
        with open(pipe, "w", encoding="utf-8") as file:
            for part in parts:
                file.write(part)
                file.flush()
                time.sleep(0.1)

    writer = threading.Thread(target=write)
    writer.start()
    assert toml_text.read_text(pipe) == "".join(parts)
    writer.join()


def test_refuses_a_pipe_that_nobody_writes_to(pipe, monkeypatch):
    """It once held `check` and every other verb for ever."""
    monkeypatch.setattr(open_with_timeout, "PIPE_TIMEOUT", 0.1)
    with pytest.raises(
        scene.SceneError, match=r"x\.toml: cannot be read: this is a pipe, and no data came"
    ):
        toml_text.read_text(pipe)
    assert read_case_table(pipe)[1] == [
        f"{pipe}: cannot be read: this is a pipe, and no data came through it within 0 s"
    ]


def test_always_a_system_without_such_pipes_reads_its_files(tmp_path, monkeypatch):
    """On Windows set_blocking, there from Python 3.12 on, refuses whatever is no pipe."""

    def refused(*given):
        raise OSError(1, "not a pipe")

    monkeypatch.delattr(os, "O_NONBLOCK")
    monkeypatch.setattr(os, "set_blocking", refused)
    (tmp_path / "x.toml").write_bytes(b"a = 1\r\n\x1a")
    with open_with_timeout.open_for_reading(tmp_path / "x.toml") as file:
        assert file.read() == b"a = 1\r\n\x1a"


def test_exact_what_cannot_be_read_is_closed(tmp_path):
    before = len(os.listdir("/dev/fd"))
    for _ in range(3):
        with pytest.raises(IsADirectoryError):
            open_with_timeout.open_for_reading(tmp_path)
    assert len(os.listdir("/dev/fd")) == before
