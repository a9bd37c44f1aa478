"""Run rosidl's generators for one package: python -m course.interfaces.generate PACKAGE SOURCE IDL OUTPUT.

SOURCE holds msg/, srv/ and action/; OUTPUT/PACKAGE receives the C and Python code with the type supports that Fast DDS
uses.  The generators are called directly because the wheels' `rosidl generate` finds each of them twice and stops.
"""

import functools
import sys
from collections.abc import Callable
from pathlib import Path

import em
from ament_index_python import get_search_paths
from rosidl_adapter.cli import TranslateActionToIDL, TranslateMsgToIDL, TranslateSrvToIDL
from rosidl_cli.command import helpers
from rosidl_generator_c.cli import GenerateC
from rosidl_generator_py.cli import GeneratePython
from rosidl_generator_type_description.cli import HashTypeDescription
from rosidl_parser import parser
from rosidl_typesupport_c.cli import GenerateCTypesupport
from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

TRANSLATORS = {"msg": TranslateMsgToIDL, "srv": TranslateSrvToIDL, "action": TranslateActionToIDL}

# rmw_fastrtps_cpp serialises with the first and describes topics to the discovery with the second.
TYPE_SUPPORTS = ["rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"]


def generate(package: str, source: Path, idl_folder: Path, output: Path) -> None:
    """Write the IDL of each definition under `idl_folder`, and the generated sources under `output`/`package`."""
    output = output / package
    include = [str(Path(prefix) / "share") for prefix in get_search_paths()]
    idl = []
    for kind, translator in TRANSLATORS.items():
        files = [f"{source}:{file.relative_to(source)}" for file in sorted(source.glob(f"{kind}/*.{kind}"))]
        if files:
            idl += translator(kind).translate(package, files, include, idl_folder)
    descriptions = HashTypeDescription("hash").generate_type_hashes(package, idl, include, idl_folder)
    GenerateC("c").generate(package, idl, include, output, type_description_files=descriptions)
    GenerateCTypesupport("c", typesupport_implementations=TYPE_SUPPORTS).generate(package, idl, include, output)
    GenerateFastRTPSCTypesupport("fastrtps_c").generate(package, idl, include, output)
    GenerateIntrospectionCTypesupport("introspection_c").generate(
        package, idl, include, output / "introspection" / package
    )  # some of its file names are the generator's too
    GeneratePython("py", typesupport_implementations=["rosidl_typesupport_c"]).generate(package, idl, include, output)


def spare_what_is_repeated() -> None:
    """Make the generators quicker: two fifths of their time is work that was done already, or that a look spares.

    Seen in rosidl 4.6 and empy 4.2: each generator parses each definition again, and looks for the definitions of all
    packages again; and the scanner of templates asks of each letter whether it begins a quotation, in a long way.
    """
    parser.get_ast_from_idl_string = functools.cache(parser.get_ast_from_idl_string)
    find = functools.cache(lambda paths, found=helpers.dependencies_from_include_paths: tuple(found(paths)))
    helpers.dependencies_from_include_paths = lambda paths: list(find(tuple(paths)))
    if em.__version__.startswith("4.2."):  # a sourced ROS 2 may bring another one
        em.Scanner.check = _looking_first(em.Scanner.check)


def _looking_first(check: Callable[..., str | None]) -> Callable[..., str | None]:
    """Return a replacement of `Scanner.check` that asks it only about a letter that may begin a quotation."""

    def look(scanner: em.Scanner, start: int = 0, archetype: str | None = None) -> str | None:
        place, text = scanner.head + scanner.pointer + start, scanner.buffer
        if place + 1 < len(text) and text[place] not in em.QUOTE_CHARS:
            return None
        return check(scanner, start, archetype)

    return look


if __name__ == "__main__":
    spare_what_is_repeated()
    generate(sys.argv[1], *map(Path, sys.argv[2:]))
