"""Hide from an interpreter, and from those that it starts, what Windows or macOS lack, and log what Windows refuses.

Python imports this module at its start from a folder on PYTHONPATH. The file that PATCHFEM_REFUSALS names gets a line for
each name that Windows refuses or takes for that of another file, and for each open file that is renamed or removed.
"""

import os
import re
import signal
import sys
from pathlib import Path

MODULES = ("fcntl", "grp", "pwd", "resource", "termios")
SIGNALS = ("SIGALRM", "SIGHUP", "SIGPIPE", "SIGQUIT", "SIGUSR1", "SIGUSR2")
FUNCTIONS = ("fork", "geteuid", "getloadavg", "mkfifo", "sched_getaffinity", "sysconf")
FLAGS = ("O_NOFOLLOW", "O_NONBLOCK")
LINUX_FOLDERS = ("/proc/", "/sys/")
OTHER_USERS = ("/proc/self/maps",)  # of threadpoolctl, which has other ways on Windows and macOS
REFUSED_NAME = re.compile(
    r'.*[<>:"|?*\\\x00-\x1f].*|.*[. ]|(con|prn|aux|nul|com\d|lpt\d)(\..*)?', re.IGNORECASE
)
OPEN_FILES = Path("/proc/self/fd")

refusals = os.open(os.environ["PATCHFEM_REFUSALS"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
watched = os.path.dirname(os.path.abspath(os.environ["PATCHFEM_REFUSALS"]))


def log(kind: str, path) -> None:
    """Log a refusal."""
    os.write(refusals, f"{kind}: {path}\n".encode())


def check_name(path) -> None:
    """Log the name of a new file or folder that Windows refuses, or that differs from another one in case only."""
    path = Path(os.path.abspath(os.fsdecode(path)))
    if watched not in map(str, path.parents):
        return
    if REFUSED_NAME.fullmatch(path.name):
        log("name", path)
    if path.parent.is_dir():
        for other in os.listdir(path.parent):
            if other.lower() == path.name.lower() and other != path.name:
                log("case", path)


def check_closed(path) -> None:
    """Log a file or folder that this process renames or removes while it, or a file in it, is open."""
    path = os.path.abspath(os.fsdecode(path))
    for number in os.listdir(OPEN_FILES):
        try:
            opened = os.readlink(OPEN_FILES / number)
        except OSError:  # the list itself
            continue
        if f"{opened}/".startswith(f"{path}/"):
            log("open", path)


def watch(event: str, arguments) -> None:
    """Refuse files of Linux, and check what happens to other files."""
    if event == "open" and isinstance(arguments[0], str | bytes):
        path, mode, flags = arguments
        if os.fsdecode(path).startswith(LINUX_FOLDERS) and path not in OTHER_USERS:
            raise FileNotFoundError(2, "hidden", path)
        if flags & os.O_CREAT or set(mode or "") & set("wax"):
            check_name(path)
    elif event == "os.mkdir":
        check_name(arguments[0])
    elif event == "os.rename":
        check_name(arguments[1])
        check_closed(arguments[0])
        check_closed(arguments[1])
    elif event in ("os.remove", "shutil.rmtree") and isinstance(arguments[0], str | Path):
        check_closed(arguments[0])


for name in MODULES:
    sys.modules[name] = None
for name in SIGNALS:
    delattr(signal, name)
for name in (*FUNCTIONS, *FLAGS):
    delattr(os, name)
sys.addaudithook(watch)
