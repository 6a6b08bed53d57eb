"""Cache of what is read from files, because the cases of a sweep name the same files."""

from collections.abc import Callable
from functools import lru_cache, wraps
from pathlib import Path
from typing import TypeVar

# Number of cached results of each function; results for large traces and modes take much memory.
MAX_CACHED_FILES = 8

Content = TypeVar("Content")  # what a function reads from a file


def cache_by_file(function: Callable[..., Content]) -> Callable[..., Content]:
    """Cache the results of a function whose first argument is a path or a tuple of paths.

    A file that has changed its size or its time of modification is read again. Further arguments must
    be hashable, and are passed by position.
    """

    @lru_cache(MAX_CACHED_FILES)
    def call_cached(paths, _versions, *arguments):
        """Call the function, unless its result is cached for these paths, versions of files and arguments."""
        return function(paths, *arguments)

    @wraps(function)
    def read_cached(paths, *arguments):
        """Return the result for a path or a tuple of `paths`, computed again if a file has changed."""
        versions = map(_find_version, paths if isinstance(paths, tuple) else (paths,))
        return call_cached(paths, tuple(versions), *arguments)

    return read_cached


def _find_version(path: Path) -> tuple[int, int] | None:
    """Return time of modification [ns] and size [bytes] of the file `path`, or None if there is none."""
    if not path.exists():
        return None
    stat = path.stat()
    return stat.st_mtime_ns, stat.st_size
