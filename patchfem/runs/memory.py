"""Memory that this process may use, and the refusal of runs that need more.

In: the memory contributions of a plan. Out: the available memory, and the reason for a refusal with
the scene key to change.
"""

import os
from pathlib import Path

from ..core import Missing

# Address space [bytes] that packages and the compiler map in addition to the memory in use.
MAPPED_BYTES = 210e6
KEY_ADVICE = {
    "contact.element_size": "make contact.element_size larger",
    "contact.mesh": "give contact.mesh fewer nodes on the interface",
    "accuracy.tail": "raise accuracy.tail or accuracy.merge",
    "structure": "give fewer modes",
    "slide.file": "give fewer rows in slide.file",
    "drive.file": "give fewer rows in drive.file",
}


def free_bytes() -> float:
    """Return the total memory [bytes] that this process may use; inf if none is known.

    The system, its control group and the limits of the process are considered.
    """
    used, mapped = read_process_bytes()
    return min(
        _read_available_bytes() + used,
        free_in_control_group(used),
        _read_process_limit() - MAPPED_BYTES + used - mapped,
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


def _read_process_limit() -> float:
    """Return the limit on the address space of this process [bytes]; inf if it has none."""
    try:
        import resource
    except ImportError:
        return float("inf")
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return float("inf") if limit == resource.RLIM_INFINITY else float(limit)


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
    # The only hierarchy of version 2 has the number 0 and no names of controllers.
    for path in (line[2] for line in lines if line[:2] == ["0", ""]):
        group_folder = root / path.strip("/")
        for folder in (group_folder, *group_folder.parents):
            free = min(free, _remaining_bytes(folder) + used)
            if folder == root:
                break
    return free


def _remaining_bytes(folder: Path) -> float:
    """Return the memory [bytes] that a control group still allows; inf if unlimited.

    Inactive cached files count as free memory.
    """
    try:
        max_bytes = int((folder / "memory.max").read_text("ascii"))
        used_bytes = int((folder / "memory.current").read_text("ascii"))
        lines = (folder / "memory.stat").read_text("ascii").splitlines()
    # The limit is "max", which means unlimited, or a file is missing.
    except (OSError, ValueError):
        return float("inf")
    inactive = dict(line.split() for line in lines).get("inactive_file", 0)
    return float(max_bytes - used_bytes + int(inactive))


def reason_for_refusal(parts: tuple) -> str:
    """Return why a run needs more memory than is free, or "" if it does not.

    The reason gives the required and the free memory, and the largest contribution with its scene
    key.
    """
    free = free_bytes()
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
