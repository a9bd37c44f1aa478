"""Imports of the files of a kernel's folder, for whom they are meant: a cell, or another file of the folder.

Whatever completes, colours or explains a notebook looks for many modules that need not be installed.  If each of these
imports found the files of the folder, then a file `colorama.py` beside a notebook that was handed in would run as soon
as somebody pressed Tab.
"""

import os
import sys
import sysconfig
from importlib.machinery import (
    BYTECODE_SUFFIXES,
    EXTENSION_SUFFIXES,
    SOURCE_SUFFIXES,
    ExtensionFileLoader,
    FileFinder,
    ModuleSpec,
    SourceFileLoader,
    SourcelessFileLoader,
)
from types import FrameType, ModuleType

import IPython

from course.explaining.source import is_cell

# What imports for whoever calls it: `importlib` and the like, and the magics of IPython.
PYTHON, MAGICS = sysconfig.get_path("stdlib") + os.sep, os.path.dirname(IPython.__file__) + os.sep
KINDS = (
    (ExtensionFileLoader, EXTENSION_SUFFIXES),
    (SourceFileLoader, SOURCE_SUFFIXES),
    (SourcelessFileLoader, BYTECODE_SUFFIXES),
)


class FolderFinder(FileFinder):
    """Finds the modules of a folder for its own code alone."""

    def find_spec(self, fullname: str, target: ModuleType | None = None) -> ModuleSpec | None:
        """Return the specification of a module if a cell, or a file of the folder, imports it; else None."""
        return super().find_spec(fullname, target) if _is_meant(sys._getframe(1), self.path) else None


def add_folder(*names: str) -> None:
    """Put the current folder last on `sys.path`: its files must not hide installed modules.

    Code with one of the file names `names` is taken for a cell's.
    """

    def finder(path: str) -> FolderFinder:
        if path != os.getcwd():
            raise ImportError("only the current folder")
        return FolderFinder(path, *KINDS)

    _cells.update(names)
    sys.path_hooks.insert(0, finder)
    sys.path_importer_cache.pop(os.getcwd(), None)
    sys.path.append("")


_cells: set[str] = set()  # further names of the code of cells


def _is_meant(frame: FrameType | None, folder: str) -> bool:
    while frame is not None:
        file = frame.f_code.co_filename
        installed = "site-packages" in file or "dist-packages" in file
        if is_cell(file) or file in _cells or (file.startswith(folder + os.sep) and not installed):
            return True
        if not file.startswith(("<frozen ", MAGICS)) and (installed or not file.startswith(PYTHON)):
            return False
        frame = frame.f_back
    return False
