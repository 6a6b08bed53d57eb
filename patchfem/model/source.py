"""Where a model comes from: the scene's path, text and effects, and the place of a key for messages."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path

from ..core import NotConverged, PatchfemError
from ..scene.lines import counted, place_of


@dataclass(frozen=True, eq=False, slots=True)
class Source:
    """Origin of a model: path and text of the scene, with what messages need.

    text: as read; write() -> the TOML of `resolved`, a partial function whose last argument is the model; effects: what
    the scene names; remarks: sentences on keys that nothing uses; sets: `key=value` given beside the text; notes:
    sentences on what defaults leave out.
    """

    path: Path
    title: str
    text: str
    write: Callable
    effects: tuple
    remarks: tuple
    sets: tuple = ()
    notes: tuple = ()

    def describes(self, model) -> bool:
        """Return whether the scene still describes a model: no part was replaced since the model was built."""
        built = self.write.args[-1]
        return all(
            getattr(model, part.name) is getattr(built, part.name)
            for part in fields(built)
            if part.name != "source"
        )

    @property
    def resolved(self) -> str:
        """The scene as TOML in SI with every default written out; written when it is asked for."""
        return self.write()

    def where(self, key: str) -> str:
        """``FILE:LINE: key`` for a message about a key."""
        return place_of(self.path, self.text, key)


@contextmanager
def placed(source: Source) -> Iterator[None]:
    """Put file and line before every PatchfemError that names the key at fault, as it leaves the block."""
    try:
        yield
    except PatchfemError as error:
        if error.key is None:
            raise
        where = source.where(error.key) if error.key else str(source.path)
        told = type(error)(f"{where}: {counted(str(error))}")
        if isinstance(error, NotConverged):
            told.so_far = error.so_far
        raise told from None
