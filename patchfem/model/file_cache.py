"""Cache of what is read from files, because the cases of a sweep name the same files."""

from collections.abc import Callable
from functools import lru_cache, wraps

# Number of cached results of each function; results for large traces and modes take much memory.
MAX_CACHED_RESULTS = 8


def cache_by_file(function: Callable) -> Callable:
    """Cache the results of a function whose first argument is a path.

    A file that has changed its size or its time of modification is read again. Further arguments must
    be hashable, and are passed by position.
    """

    @lru_cache(MAX_CACHED_RESULTS)
    def call_cached(path, _version, *arguments):
        return function(path, *arguments)

    @wraps(function)
    def read_cached(path, *arguments):
        version = None
        if path.exists():
            stat = path.stat()
            version = (stat.st_mtime_ns, stat.st_size)
        return call_cached(path, version, *arguments)

    return read_cached
