"""Starts nbgrader, nbconvert and IPython so that they import nothing from the folder in which they are called.

They put that folder before the installed packages on `sys.path`.  It may be a submission, and a file there with the
name of a module that is loaded later, such as `argcomplete.py`, would run with the rights of the command's user.  In
IPython the folder comes last, as in a kernel.
environment/install writes the programs that run this module, with `python -P -m`.
"""

import sys
from importlib import metadata

APPLICATIONS = (("nbgrader.apps.baseapp", "NbGrader"), ("nbconvert.nbconvertapp", "NbConvertApp"))


def keep_path() -> None:
    """Keep `sys.path` as it is now whenever one of the applications starts, of those whose module is loaded."""
    path = [*sys.path]

    def init_syspath(_: object) -> None:
        sys.path[:] = path  # nbgrader's zip_collect has put the folder there before

    for module, name in APPLICATIONS:
        if module in sys.modules:
            getattr(sys.modules[module], name).init_syspath = init_syspath


def main() -> None:
    """Run the program that the first argument names, with the other arguments."""
    sys.argv = sys.argv[1:]
    (program,) = metadata.entry_points(group="console_scripts", name=sys.argv[0])
    start = program.load()
    keep_path()
    sys.exit(start())


if __name__ == "__main__":
    main()
