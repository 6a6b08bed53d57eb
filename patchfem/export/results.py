"""The results folder: everything is written into DIR.partial and renamed to DIR when whole."""

import os
import shutil
from pathlib import Path

from ..core import Missing


class Folder:
    """Context of a results folder. `path` is the partial folder to write into; leaving without an error renames it."""

    def __init__(self, target: Path):
        self.target = Path(target)
        self.path = self.target.with_name(self.target.name + ".partial")

    def __enter__(self) -> "Folder":
        try:
            if self.path.exists():
                shutil.rmtree(self.path)
            self.path.mkdir(parents=True)
        except OSError as error:
            raise Missing(f"{self.target}: the results folder cannot be made ({error.strerror})") from None
        return self

    def __exit__(self, kind, value, trace) -> None:
        if kind is not None:
            return
        try:
            if self.target.exists():
                old = self.target.with_name(f".{self.target.name}.old{os.getpid()}")
                os.replace(self.target, old)
                os.replace(self.path, self.target)
                shutil.rmtree(old) if old.is_dir() else old.unlink()
            else:
                os.replace(self.path, self.target)
        except OSError as error:
            raise Missing(f"{self.target}: the results cannot be put in place ({error.strerror}); they are in "
                          f"{self.path}") from None
