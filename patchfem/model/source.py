"""Origin of a model: path, content and effects of the scene, line numbers for messages, and cached content of files."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache, wraps
from pathlib import Path
from typing import NamedTuple, TypeVar

from ..core import NotConverged, PatchfemError, array_dataclass
from ..scene.keys.lines import locate_key, number_items_from_one
from ..scene.sets import format_values

Content = TypeVar("Content")  # what a function reads from a file


class SceneWriter(NamedTuple):
    """Writer of the resolved scene.

    - write: function of `joint`, and of the folder to which file names are relative (None: that of the scene), that
      returns the text.
    - joint: keys of the scene, with their values in SI, that state the joint which was subtracted from bolted modes.
    """

    write: Callable[[dict[str, float], Path | None], str]
    joint: dict[str, float]


@array_dataclass
class Source:
    """Scene file or text from which a model was built.

    - path: scene file.
    - text: text of the scene as it was read.
    - writer: writer of `resolved`.
    - effects: effects that the scene names.
    - remarks: sentences about keys without effect.
    - sets: ``key=value`` strings that were given in addition to the text.
    - notes: sentences about what the defaults neglect.
    - title: title of the scene.
    """

    path: Path
    title: str
    text: str
    writer: SceneWriter
    effects: tuple[str, ...]
    remarks: tuple[str, ...]
    sets: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def resolved(self) -> str:
        """Scene as TOML in SI units with all defaults; it is written on demand."""
        return self.write_resolved()

    def write_resolved(self, folder: Path | None = None) -> str:
        """Return the scene as `resolved`, with file names relative to another folder."""
        return self.writer.write(self.writer.joint, folder)

    @property
    def repeating_sets(self) -> tuple[str, ...]:
        """The `sets` that repeat a run, and if there are any also those of the joint that was subtracted."""
        if not self.sets:
            return ()
        changed = {text.partition("=")[0].strip() for text in self.sets}
        stated = {key: value for key, value in self.writer.joint.items() if key not in changed}
        return (*self.sets, *(f"{key}={format_values(key, stated[key])}" for key in stated))

    def where(self, key: str) -> str:
        """Return file, line and key as text for a message."""
        return locate_key(self.path, self.text, key)


@contextmanager
def name_key(key: str) -> Iterator[None]:
    """Give a key of the scene to each PatchfemError that is raised in the block and names none.

    Functions of this folder do not know the lines of a scene; `locate_errors` of `build` adds them.
    """
    try:
        yield
    except PatchfemError as error:
        error.key = error.key or key
        raise


@contextmanager
def locate_errors(source: Source) -> Iterator[None]:
    """Add file and line to each PatchfemError that is raised in the block and names a key.

    `source` is the source of the model, which knows the line of each key.
    """
    try:
        yield
    except PatchfemError as error:
        if error.key is None:
            raise
        where = source.where(error.key) if error.key else str(source.path)
        located = type(error)(f"{where}: {number_items_from_one(str(error))}")
        if isinstance(error, NotConverged):
            located.partial_result = error.partial_result
        raise located from None


def cache_by_file(function: Callable[..., Content]) -> Callable[..., Content]:
    """Cache the results of a function whose first argument is a path or a tuple of paths.

    A file that has changed its size or its time of modification is read again. Further arguments must
    be hashable, and are passed by position.
    """

    # Results for large traces and modes take much memory
    @lru_cache(8)
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
