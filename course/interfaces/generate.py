"""Run rosidl's generators for one package: python -m course.interfaces.generate PACKAGE SOURCE IDL OUTPUT.

SOURCE holds msg/, srv/ and action/; OUTPUT/PACKAGE receives the C and Python code with the type supports that Fast DDS
uses.  The generators are called directly because the wheels' `rosidl generate` finds each of them twice and stops.
"""

import sys
from pathlib import Path

from ament_index_python import get_search_paths
from rosidl_adapter.cli import TranslateActionToIDL, TranslateMsgToIDL, TranslateSrvToIDL
from rosidl_generator_c.cli import GenerateC
from rosidl_generator_py.cli import GeneratePython
from rosidl_generator_type_description.cli import HashTypeDescription
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


if __name__ == "__main__":
    generate(sys.argv[1], *map(Path, sys.argv[2:]))
