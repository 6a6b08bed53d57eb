"""Memory that this process may use, and the refusal of runs that need more.

In: the memory contributions of a plan. Out: the available memory, and the reason for a refusal with
the scene key to change.
"""

import os
from functools import lru_cache
from pathlib import Path
from time import monotonic

from ..core import Missing
from .sizes import COMPILED_CODE_LABEL

MAPPED_BYTES = 60e6  # Address space [bytes] that the packages map in addition to the memory in use.
COMPILER_BYTES = 150e6  # Address space [bytes] of the compiler library.
READING_PERIOD = 0.5  # Time [s] for which the files of the system are not read again.
# Smallest fraction of the total memory at which a plan names the largest contribution.
MIN_NAMED_FRACTION = 0.3
KEY_ADVICE = {
    "contact.element_size": "make contact.element_size larger",
    "contact.mesh": "give contact.mesh fewer nodes on the interface",
    "accuracy.tail": "raise accuracy.tail or accuracy.merge",
    "structure": "give fewer modes",
    "slide.file": "give fewer rows in slide.file",
    "drive.file": "give fewer rows in drive.file",
}


def describe_largest_part(parts: tuple) -> str:
    """Describe the largest memory contribution of a run and the scene key that determines it.

    The result is "" if the contribution is small, or if no scene key determines it.
    """
    largest = next((part for part in parts if part.key), None)
    if largest is None or largest.bytes < MIN_NAMED_FRACTION * sum(part.bytes for part in parts):
        return ""
    return f"{largest.bytes / 1e6:.0f} MB of the memory are for {largest.what}; {largest.key} sets their size"


def free_bytes(*, needs_compiler: bool = False) -> float:
    """Return the total memory [bytes] that this process may use.

    The system, its control group and the limits of the process are considered; inf if none is
    known. needs_compiler: whether the compiler library is needed, which affects the address space
    only.
    """
    return _read_free_bytes(needs_compiler, int(monotonic() / READING_PERIOD))


@lru_cache(maxsize=2)
def _read_free_bytes(needs_compiler: bool, period: int) -> float:
    """Return `free_bytes`; `period` counts the readings, since cases of a sweep follow each other within milliseconds."""
    used, mapped = read_process_bytes()
    other_address_space = mapped - used + MAPPED_BYTES + (COMPILER_BYTES if needs_compiler else 0.0)
    return min(
        _read_available_bytes() + used,
        free_in_control_group(used),
        *(limit - other_address_space for limit in _read_process_limits()),
    )


def read_process_bytes(status: Path = Path("/proc/self/statm")) -> tuple:
    """Return the memory in use and the address space of this process [bytes]."""
    try:
        size, resident = map(int, status.read_text("ascii").split()[:2])
    except (OSError, ValueError):
        return 0.0, 0.0
    page = os.sysconf("SC_PAGE_SIZE")
    return float(resident * page), float(size * page)


def _read_available_bytes() -> float:
    """Return the available memory of the system [bytes]; inf if unknown."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            known = dict(line.split(":", 1) for line in file)
        return 1024.0 * int(known["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return float("inf")


def _read_process_limits() -> list:
    """Return the limits on address space and data of this process [bytes]; inf if unlimited."""
    try:
        import resource
    except ImportError:
        return [float("inf")]
    limits = (resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA))
    return [float("inf") if limit == resource.RLIM_INFINITY else float(limit) for limit in limits]


def free_in_control_group(
    used: float, groups: Path = Path("/proc/self/cgroup"), root: Path = Path("/sys/fs/cgroup")
) -> float:
    """Return the memory [bytes] that the control groups of this process allow.

    Memory that the process already uses is included.

    Parameters
    ----------
    used : float
        Memory in use by the process [bytes].
    groups : Path
        File that lists the control groups of the process.
    root : Path
        Root folder of the control group file system.

    Returns
    -------
    float
        Infinite if no group has a limit.
    """
    try:
        lines = [line.split(":", 2) for line in groups.read_text("utf-8", "replace").splitlines()]
    except OSError:
        return float("inf")
    free = float("inf")
    for _, kinds, path in (line for line in lines if len(line) == 3):
        is_version_1 = "memory" in kinds.split(",")
        if not is_version_1 and kinds:
            continue
        base = root
        names = ("memory.max", "memory.current")
        if is_version_1:
            base = root / "memory"
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes")
        group_folder = base / path.strip("/")
        for folder in (group_folder, *group_folder.parents):
            free = min(free, _remaining_bytes(folder, *names) + used)
            if folder == base:
                break
    return free


def _remaining_bytes(folder: Path, limit: str, usage: str) -> float:
    """Return the memory [bytes] that a control group still allows; inf if unlimited.

    Inactive cached files count as free memory.
    """
    try:
        max_bytes = int((folder / limit).read_text("ascii"))
        used_bytes = int((folder / usage).read_text("ascii"))
        lines = (folder / "memory.stat").read_text("ascii").splitlines()
        known = dict(line.split() for line in lines)
    # The limit is "max", which means unlimited, or a file is missing.
    except (OSError, ValueError):
        return float("inf")
    return float(
        max_bytes
        - used_bytes
        + int(known.get("total_inactive_file", known.get("inactive_file", 0)))
    )


def reason_for_refusal(parts: tuple, free: float | None = None) -> str:
    """Return why a run needs more memory than is free, or "" if it does not.

    The reason gives the required and the free memory, and the largest contribution with its scene
    key.
    """
    if free is None:
        free = free_bytes(needs_compiler=any(part.what == COMPILED_CODE_LABEL for part in parts))
    total = sum(part.bytes for part in parts)
    if total <= free:
        return ""
    largest = next((part for part in parts if part.key), None)
    text = f"about {total / 1e9:.3g} GB of memory are needed, but only {max(free, 0.0) / 1e9:.2g} GB are free"
    if largest is None or largest.bytes < 0.1 * total:
        return f"{text}; free some memory, or run on a machine with more memory"
    advice = KEY_ADVICE.get(largest.key, f"lower {largest.key}")
    return f"{text}; {largest.bytes / 1e9:.3g} GB of these are for {largest.what}: {advice}"


def refuse_insufficient_memory(parts: tuple) -> None:
    """Raise Missing if a run would need more memory than is free."""
    if text := reason_for_refusal(parts):
        raise Missing(text, "")
