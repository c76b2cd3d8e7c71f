"""Build the test FMUs: compile a C source, write its modelDescription.xml, zip both."""

import importlib.util
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path

SOURCES = Path(__file__).parent

FAULTS = {
    name: number
    for number, name in enumerate(
        [
            "none",
            "segfault",
            "abort",
            "exit",
            "hang",
            "init_hang",
            "error",
            "fatal",
            "discard",
            "nan",
            "inf",
            "short",
            "memory",
            "flood",
            "files",
            "pending",
            "free_crash",
            "init_crash",
            "init_error",
            "child",
            "slow",
            "term_error",
            "leak",
            "chdir",
        ]
    )
}
"""Values of the parameter ``fault`` of lag2.c."""


def compiler() -> list[str] | None:
    """Return a C compiler's command, or None if there is none."""
    for name in ("gcc", "cc", "clang"):
        if shutil.which(name):
            return [name]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    return None


def headers() -> Path:
    """Folder of the FMI headers that fmpy ships."""
    found = importlib.util.find_spec("fmpy")
    assert found is not None
    assert found.origin is not None
    return Path(found.origin).parent / "c-code"


LAG2_VARIABLES = """
  <ScalarVariable name="tau" valueReference="1" causality="parameter" variability="fixed" initial="exact"
    description="Time constant"><Real start="0.1" unit="s" min="1e-6"/></ScalarVariable>
  <ScalarVariable name="k" valueReference="2" causality="parameter" variability="tunable" initial="exact">
    <Real start="1"/></ScalarVariable>
  <ScalarVariable name="y" valueReference="3" causality="output" variability="continuous" initial="exact">
    <Real start="0" unit="m/s"/></ScalarVariable>
  <ScalarVariable name="u" valueReference="4" causality="input" variability="continuous">
    <Real start="0" unit="m/s"/></ScalarVariable>
  <ScalarVariable name="feed" valueReference="5" causality="output" variability="continuous" initial="calculated">
    <Real unit="m/s"/></ScalarVariable>
  <ScalarVariable name="fault" valueReference="6" causality="parameter" variability="fixed" initial="exact">
    <Real start="0"/></ScalarVariable>
  <ScalarVariable name="at" valueReference="7" causality="parameter" variability="fixed" initial="exact">
    <Real start="0.5" unit="s"/></ScalarVariable>
  <ScalarVariable name="der(y)" valueReference="8" causality="local" variability="continuous" initial="calculated">
    <Real derivative="3"/></ScalarVariable>
  <ScalarVariable name="steps" valueReference="1" causality="output" variability="discrete" initial="calculated">
    <Integer/></ScalarVariable>
  <ScalarVariable name="offset" valueReference="2" causality="input" variability="discrete">
    <Integer start="0"/></ScalarVariable>
  <ScalarVariable name="above" valueReference="1" causality="output" variability="discrete" initial="calculated">
    <Boolean/></ScalarVariable>
  <ScalarVariable name="invert" valueReference="2" causality="input" variability="discrete">
    <Boolean start="false"/></ScalarVariable>
"""


def lag2_xml(*, interpolates: bool = True, model_exchange: bool = True, guid: str = "{lag}") -> str:
    """Model description of lag2.c."""
    exchange = '<ModelExchange modelIdentifier="lag2" canBeInstantiatedOnlyOncePerProcess="false"/>'
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Lag" guid="{guid}" generationTool="thsa-cosim tests"
  numberOfEventIndicators="0">
 {exchange if model_exchange else ""}
 <CoSimulation modelIdentifier="lag2" canHandleVariableCommunicationStepSize="true"
   canInterpolateInputs="{str(interpolates).lower()}"/>
 <UnitDefinitions><Unit name="s"><BaseUnit s="1"/></Unit>
   <Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit></UnitDefinitions>
 <DefaultExperiment startTime="0" stopTime="1" tolerance="1e-6" stepSize="0.01"/>
 <ModelVariables>{LAG2_VARIABLES}</ModelVariables>
 <ModelStructure>
  <Outputs><Unknown index="3"/><Unknown index="5"/><Unknown index="9"/><Unknown index="11"/></Outputs>
  <Derivatives><Unknown index="8"/></Derivatives>
  <InitialUnknowns><Unknown index="5"/><Unknown index="8"/><Unknown index="9"/><Unknown index="11"/>
  </InitialUnknowns>
 </ModelStructure>
</fmiModelDescription>
"""


def build_library(source: str, folder: Path, *defines: str) -> Path:
    """Compile one source of this folder to a shared library in ``folder``."""
    command = compiler()
    assert command is not None
    library = folder / f"{Path(source).stem}{'_'.join(['', *defines])}.so"
    if not library.exists():
        folder.mkdir(parents=True, exist_ok=True)
        subprocess.run(
            [
                *command,
                "-std=gnu11",
                "-O2",
                "-shared",
                "-fPIC",
                f"-I{headers()}",
                *(f"-D{d}" for d in defines),
                str(SOURCES / source),
                "-o",
                str(library),
                "-lm",
            ],
            check=True,
            capture_output=True,
            timeout=120,
        )
    return library


def write_fmu(
    path: Path,
    xml: str,
    library: Path,
    identifier: str,
    *,
    platform: str = "linux64",
    extra: Mapping[str, bytes] = {},
) -> Path:
    """Zip a model description and a library to an FMU; ``extra`` adds entries under any name."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", xml)
        archive.write(library, f"binaries/{platform}/{identifier}.so")
        for name, content in extra.items():
            archive.writestr(name, content)
    return path
