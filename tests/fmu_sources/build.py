"""Build the test FMUs: compile a C source, write its modelDescription.xml, zip both."""

import atexit
import importlib.util
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import pytest

SOURCES = Path(__file__).parent

FAULTS = {
    "none": 0,
    "segfault": 1,
    "abort": 2,
    "exit": 3,
    "hang": 4,
    "init_hang": 5,
    "error": 6,
    "fatal": 7,
    "discard": 8,
    "nan": 9,
    "inf": 10,
    "short": 11,
    "memory": 12,
    "flood": 13,
    "files": 14,
    "pending": 15,
    "free_crash": 16,
    "init_crash": 17,
    "init_error": 18,
    "child": 19,
    "slow": 20,
    "term_error": 21,
    "leak": 22,
    "chdir": 23,
    "shutdown": 24,
}
"""Values of the parameter ``fault`` of lag2.c."""

HOSTILE = (
    "write to low descriptors",
    "write to all descriptors",
    "close low descriptors",
    "close all descriptors",
    "fork and return twice",
    "child that runs on",
    "child in a session of its own",
    "thread that crashes later",
    "thread that exits later",
    "rounding mode",
    "floating-point traps",
    "environment",
    "no environment",
    "change directory",
    "remove directory",
    "file mask",
    "locale",
    "signal handlers",
    "alarm later",
    "close standard descriptors",
    "replace standard descriptors",
    "flood",
    "kill itself",
    "stop itself",
    "kill its parent",
    "delete its library",
    "truncate its library",
    "delete the worker's folder",
    "exit",
    "exit at once",
    "stack overflow",
    "floating-point exception",
    "illegal instruction",
    "end the main thread",
    "sleep for ever",
    "30 GB",
    "block signals",
    "few descriptors",
    "terminate its group",
    "read from all descriptors",
    "abort at exit",
    "leave files open",
    "thread that burns",
)
"""What ``fault`` 100, 101, ... of lag2.c do; see hostile.h."""

LAG2 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Lag" guid="{guid}" generationTool="thsa-cosim tests"
  numberOfEventIndicators="0">
 <ModelExchange modelIdentifier="lag2"/>
 <CoSimulation modelIdentifier="lag2" canHandleVariableCommunicationStepSize="true"
   canInterpolateInputs="{interpolates}"/>
 <UnitDefinitions><Unit name="s"><BaseUnit s="1"/></Unit>
   <Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit></UnitDefinitions>
 <DefaultExperiment startTime="0" stopTime="1" tolerance="1e-6" stepSize="0.01"/>
 <ModelVariables>
  <ScalarVariable name="tau" valueReference="1" causality="parameter" variability="fixed" initial="exact"
    description="Time constant"><Real start="0.1" unit="s" min="1e-6"/></ScalarVariable>
  <ScalarVariable name="k" valueReference="2" causality="parameter" variability="tunable" initial="exact">
    <Real start="1"/></ScalarVariable>
  <ScalarVariable name="y" valueReference="3" causality="output" variability="continuous" initial="exact">
    <Real start="0" unit="m/s"/></ScalarVariable>
  <ScalarVariable name="u" valueReference="4" causality="input" variability="continuous">
    <Real start="0" unit="m/s"/></ScalarVariable>
  <ScalarVariable name="feed" valueReference="5" causality="output" variability="continuous"
    initial="calculated"><Real unit="m/s"/></ScalarVariable>
  <ScalarVariable name="fault" valueReference="6" causality="parameter" variability="fixed" initial="exact">
    <Real start="0"/></ScalarVariable>
  <ScalarVariable name="at" valueReference="7" causality="parameter" variability="fixed" initial="exact">
    <Real start="0.5" unit="s"/></ScalarVariable>
  <ScalarVariable name="der(y)" valueReference="8" causality="local" variability="continuous"
    initial="calculated"><Real derivative="3"/></ScalarVariable>
  <ScalarVariable name="steps" valueReference="1" causality="output" variability="discrete"
    initial="calculated"><Integer/></ScalarVariable>
  <ScalarVariable name="offset" valueReference="2" causality="input" variability="discrete">
    <Integer start="0"/></ScalarVariable>
  <ScalarVariable name="above" valueReference="1" causality="output" variability="discrete"
    initial="calculated"><Boolean/></ScalarVariable>
  <ScalarVariable name="invert" valueReference="2" causality="input" variability="discrete">
    <Boolean start="false"/></ScalarVariable>
 </ModelVariables>
 <ModelStructure>
  <Outputs><Unknown index="3"/><Unknown index="5"/><Unknown index="9"/><Unknown index="11"/></Outputs>
  <Derivatives><Unknown index="8"/></Derivatives>
  <InitialUnknowns><Unknown index="5"/><Unknown index="8"/><Unknown index="9"/><Unknown index="11"/>
  </InitialUnknowns>
 </ModelStructure>
</fmiModelDescription>
"""

LAG3 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Lag3" instantiationToken="{{lag3}}"
  generationTool="thsa-cosim tests">
 <ModelExchange modelIdentifier="lag3" providesDirectionalDerivatives="true"/>
 <CoSimulation modelIdentifier="lag3" canHandleVariableCommunicationStepSize="true"
   providesIntermediateUpdate="{updates}"/>
 <DefaultExperiment startTime="0" stopTime="1" tolerance="1e-6"/>
 <ModelVariables>
  <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
  <Float64 name="tau" valueReference="1" causality="parameter" variability="fixed" start="0.1"/>
  <Float64 name="k" valueReference="2" causality="parameter" variability="tunable" start="1"/>
  <Float64 name="y" valueReference="3" causality="output" variability="continuous" initial="exact" start="0">
   <Alias name="alias of y"/></Float64>
  <Float64 name="u" valueReference="4" causality="input" variability="continuous" start="0"
    intermediateUpdate="{updates}"/>
  <Float64 name="feed" valueReference="5" causality="output" variability="continuous"/>
  <Float64 name="der(y)" valueReference="6" causality="local" variability="continuous" derivative="3"/>
  <Float64 name="stop_at" valueReference="7" causality="parameter" variability="fixed" start="1e300"/>
  <Int32 name="count" valueReference="8" causality="output" variability="discrete"/>
  <Boolean name="flag" valueReference="9" causality="input" variability="discrete" start="false"/>
  <Float32 name="single" valueReference="10" causality="input" variability="continuous" start="0"/>
  <Float64 name="z" valueReference="11" causality="local" variability="continuous"/>
  <Int32 name="fault" valueReference="12" causality="parameter" variability="fixed" start="0"/>
  <Float64 name="vector" valueReference="13" causality="parameter" variability="fixed" start="0 0">
   <Dimension start="2"/></Float64>
 </ModelVariables>
 <ModelStructure>
  <Output valueReference="3"/><Output valueReference="5"/><Output valueReference="8"/>
  <ContinuousStateDerivative valueReference="6"/>
  <InitialUnknown valueReference="5"/><InitialUnknown valueReference="6"/><InitialUnknown valueReference="8"/>
  <EventIndicator valueReference="11"/>
 </ModelStructure>
</fmiModelDescription>
"""

CLOCK3 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Clock3" instantiationToken="{clock3}" generationTool="a tool">
 <ModelExchange modelIdentifier="clock3"/>
 <CoSimulation modelIdentifier="clock3" canHandleVariableCommunicationStepSize="true" hasEventMode="true"
   mightReturnEarlyFromDoStep="true"/>
 <DefaultExperiment startTime="0" stopTime="1" tolerance="1e-6" stepSize="0.01"/>
 <ModelVariables>
  <Float64 name="x" valueReference="1" causality="output" initial="exact" start="0"/>
  <Float64 name="s" valueReference="2" causality="output" variability="discrete" initial="exact" start="0"/>
  <Float64 name="u" valueReference="3" causality="input" start="0"/>
  <Float64 name="gain" valueReference="4" causality="parameter" variability="fixed" start="1"/>
  <Float64 name="der(x)" valueReference="5" derivative="1"/>
  <Int32 name="n" valueReference="6" causality="output" variability="discrete"/>
  <Boolean name="turn" valueReference="7" causality="input" variability="discrete" start="false"/>
  <UInt64 name="order" valueReference="8" causality="structuralParameter" variability="fixed" start="1"/>
  <Clock name="sample" valueReference="9" causality="input" intervalVariability="constant" intervalDecimal="0.2"
    shiftDecimal="0.1"/>
  <Clock name="wait" valueReference="10" causality="input" intervalVariability="countdown"/>
  <Int32 name="early" valueReference="11" causality="output" variability="discrete"/>
 </ModelVariables>
 <ModelStructure>
  <Output valueReference="1"/><Output valueReference="2"/><Output valueReference="6"/><Output valueReference="11"/>
  <ContinuousStateDerivative valueReference="5"/><InitialUnknown valueReference="5"/>
  <InitialUnknown valueReference="6"/><InitialUnknown valueReference="11"/>
 </ModelStructure>
</fmiModelDescription>
"""

EVENTS2 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Ball" guid="{events}" numberOfEventIndicators="1">
 <ModelExchange modelIdentifier="events2"/>
 <ModelVariables>
  <ScalarVariable name="h" valueReference="1" causality="output" initial="exact"><Real start="1"/>
  </ScalarVariable>
  <ScalarVariable name="v" valueReference="2" causality="output" initial="exact"><Real start="0" reinit="true"/>
  </ScalarVariable>
  <ScalarVariable name="a" valueReference="3"><Real derivative="2"/></ScalarVariable>
  <ScalarVariable name="e" valueReference="4" causality="parameter" variability="fixed"><Real start="0.7"/>
  </ScalarVariable>
  <ScalarVariable name="kick" valueReference="5" causality="parameter" variability="fixed">
   <Real start="1e300"/></ScalarVariable>
  <ScalarVariable name="dv" valueReference="6" causality="parameter" variability="fixed"><Real start="0"/>
  </ScalarVariable>
  <ScalarVariable name="ceiling" valueReference="7" causality="parameter" variability="fixed">
   <Real start="1e300"/></ScalarVariable>
  <ScalarVariable name="end" valueReference="8" causality="parameter" variability="fixed">
   <Real start="1e300"/></ScalarVariable>
  <ScalarVariable name="dh" valueReference="9"><Real derivative="1"/></ScalarVariable>
  <ScalarVariable name="bounces" valueReference="1" causality="output" variability="discrete"><Integer/>
  </ScalarVariable>
  <ScalarVariable name="steps" valueReference="2" causality="output" variability="discrete"><Integer/>
  </ScalarVariable>
  <ScalarVariable name="off" valueReference="1" causality="input" variability="discrete">
   <Boolean start="false"/></ScalarVariable>
 </ModelVariables>
 <ModelStructure>
  <Outputs><Unknown index="1"/><Unknown index="2"/><Unknown index="10"/><Unknown index="11"/></Outputs>
  <Derivatives><Unknown index="9"/><Unknown index="3"/></Derivatives>
 </ModelStructure>
</fmiModelDescription>
"""

LAG1 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="Lag1" modelIdentifier="lag1" guid="{lag1}"
  numberOfContinuousStates="0" numberOfEventIndicators="0">
 <ModelVariables>
  <ScalarVariable name="tau" valueReference="1" variability="parameter"><Real start="0.1"/></ScalarVariable>
  <ScalarVariable name="y" valueReference="2" causality="output"><Real/></ScalarVariable>
  <ScalarVariable name="minus_y" valueReference="2" causality="output" alias="negatedAlias"><Real/></ScalarVariable>
  <ScalarVariable name="u" valueReference="3" causality="input"><Real start="0"/></ScalarVariable>
  <ScalarVariable name="steps" valueReference="1" causality="output" variability="discrete"><Integer/>
  </ScalarVariable>
 </ModelVariables>
 <Implementation><CoSimulation_StandAlone><Capabilities canHandleVariableCommunicationStepSize="true"/>
 </CoSimulation_StandAlone></Implementation>
</fmiModelDescription>
"""

EXCHANGE1 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="Exchange1" modelIdentifier="exchange1" guid="{guid}"
  numberOfContinuousStates="3" numberOfEventIndicators="1">
 <UnitDefinitions><BaseUnit unit="m"><DisplayUnitDefinition displayUnit="mm" gain="1000"/></BaseUnit></UnitDefinitions>
 <DefaultExperiment startTime="0" stopTime="2" tolerance="1e-6"/>
 <ModelVariables>
  <ScalarVariable name="tau" valueReference="0" variability="parameter"><Real start="0.1"/></ScalarVariable>
  <ScalarVariable name="k" valueReference="1" variability="parameter"><Real start="1"/></ScalarVariable>
  <ScalarVariable name="u" valueReference="2" causality="input"><Real start="0"/></ScalarVariable>
  <ScalarVariable name="at" valueReference="3" variability="parameter"><Real start="1e9"/></ScalarVariable>
  <ScalarVariable name="y" valueReference="4" causality="output"><Real/></ScalarVariable>
  <ScalarVariable name="minus_y" valueReference="4" alias="negatedAlias"><Real/></ScalarVariable>
  <ScalarVariable name="minus_k" valueReference="1" variability="parameter" alias="negatedAlias"><Real start="-1"/>
  </ScalarVariable>
  <ScalarVariable name="h" valueReference="5" causality="output"><Real unit="m" displayUnit="mm"/></ScalarVariable>
  <ScalarVariable name="v" valueReference="6"><Real/></ScalarVariable>
  <ScalarVariable name="bounces" valueReference="0" causality="output" variability="discrete"><Integer/>
  </ScalarVariable>
  <ScalarVariable name="late" valueReference="0" causality="output" variability="discrete"><Boolean/></ScalarVariable>
 </ModelVariables>
</fmiModelDescription>
"""

STRICT2 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Strict" guid="{strict}" generationTool="a stickler">
 <CoSimulation modelIdentifier="strict2" canBeInstantiatedOnlyOncePerProcess="true"/>
 <TypeDefinitions><SimpleType name="Order"><Enumeration><Item name="one" value="1"/><Item name="two" value="2"/>
   <Item name="three" value="3"/></Enumeration></SimpleType></TypeDefinitions>
 <DefaultExperiment startTime="0" stopTime="1" stepSize="0.01"/>
 <ModelVariables>
  <ScalarVariable name="x" valueReference="0" causality="output" variability="continuous" initial="exact">
    <Real start="0" unit="m"/></ScalarVariable>
  <ScalarVariable name="u" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
  <ScalarVariable name="tau" valueReference="2" causality="parameter" variability="fixed"><Real start="0.5"/>
  </ScalarVariable>
  <ScalarVariable name="gain" valueReference="3" causality="parameter" variability="tunable"><Real start="1"/>
  </ScalarVariable>
  <ScalarVariable name="time" valueReference="4" causality="independent" variability="continuous"><Real/>
  </ScalarVariable>
  <ScalarVariable name="order" valueReference="0" causality="parameter" variability="fixed">
    <Enumeration declaredType="Order" start="1"/></ScalarVariable>
  <ScalarVariable name="on" valueReference="0" causality="parameter" variability="fixed"><Boolean start="false"/>
  </ScalarVariable>
  <ScalarVariable name="text" valueReference="0" causality="output" variability="discrete" initial="calculated">
    <String/></ScalarVariable>
 </ModelVariables>
 <ModelStructure/>
</fmiModelDescription>
"""

HABITS2 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Habits" guid="{habits}" generationTool="a tool">
 <CoSimulation modelIdentifier="habits2" {flags}/>
 <DefaultExperiment startTime="0" stopTime="1" stepSize="0.01"/>
 <ModelVariables>
  <ScalarVariable name="y" valueReference="0" causality="output"><Real/></ScalarVariable>
  <ScalarVariable name="u" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
  <ScalarVariable name="tau" valueReference="2" causality="parameter" variability="fixed"><Real start="0.1"/>
  </ScalarVariable>
  <ScalarVariable name="gain" valueReference="3" causality="parameter" variability="fixed"><Real start="1"/>
  </ScalarVariable>
 </ModelVariables>
 <ModelStructure><Outputs><Unknown index="1"/></Outputs><InitialUnknowns><Unknown index="1"/></InitialUnknowns>
 </ModelStructure>
</fmiModelDescription>
"""


TEXTS1 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="Texts" modelIdentifier="texts" guid="{texts}"
  numberOfContinuousStates="0" numberOfEventIndicators="0">
 <ModelVariables>
  <ScalarVariable name="y" valueReference="0" causality="output"><Real/></ScalarVariable>
  <ScalarVariable name="u" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
  <ScalarVariable name="curve" valueReference="0" variability="parameter"><String start="flat"/></ScalarVariable>
  <ScalarVariable name="mode" valueReference="1" causality="input" variability="discrete"><String start="once"/>
  </ScalarVariable>
 </ModelVariables>
 {interface}
</fmiModelDescription>
"""

TEXTS2 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Texts" guid="{texts}" generationTool="a tool">
 <CoSimulation modelIdentifier="texts" canHandleVariableCommunicationStepSize="true"/>
 <DefaultExperiment startTime="0" stopTime="1" stepSize="0.01"/>
 <ModelVariables>
  <ScalarVariable name="y" valueReference="0" causality="output"><Real/></ScalarVariable>
  <ScalarVariable name="u" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
  <ScalarVariable name="curve" valueReference="0" causality="parameter" variability="fixed"><String start="flat"/>
  </ScalarVariable>
  <ScalarVariable name="mode" valueReference="1" causality="input" variability="discrete"><String start="once"/>
  </ScalarVariable>
  <ScalarVariable name="gain" valueReference="2" causality="parameter" variability="fixed"><Real start="1"/>
  </ScalarVariable>
 </ModelVariables>
 <ModelStructure><Outputs><Unknown index="1"/></Outputs><InitialUnknowns><Unknown index="1"/></InitialUnknowns>
 </ModelStructure>
</fmiModelDescription>
"""

TEXTS3 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Texts" instantiationToken="{texts}" generationTool="a tool">
 <CoSimulation modelIdentifier="texts" canHandleVariableCommunicationStepSize="true"/>
 <DefaultExperiment startTime="0" stopTime="1" stepSize="0.01"/>
 <ModelVariables>
  <Float64 name="time" valueReference="9" causality="independent" variability="continuous"/>
  <Float64 name="y" valueReference="0" causality="output"/>
  <Float64 name="u" valueReference="1" causality="input" start="0"/>
  <String name="curve" valueReference="2" causality="parameter" variability="fixed"><Start value="flat"/></String>
  <String name="mode" valueReference="3" causality="input" variability="discrete"><Start value="once"/></String>
 </ModelVariables>
 <ModelStructure><Output valueReference="0"/><InitialUnknown valueReference="0"/></ModelStructure>
</fmiModelDescription>
"""


DRIVE2 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Drive" guid="{drive}" generationTool="a tool">
 <CoSimulation modelIdentifier="drive2" canHandleVariableCommunicationStepSize="true"/>
 <UnitDefinitions><Unit name="rad/s"><BaseUnit rad="1" s="-1"/></Unit><Unit name="rad"><BaseUnit rad="1"/></Unit>
  <Unit name="A"><BaseUnit A="1"/></Unit><Unit name="N.m"><BaseUnit kg="1" m="2" s="-2"/></Unit>
  <Unit name="kg.m2"><BaseUnit kg="1" m="2"/></Unit><Unit name="N.m/A"><BaseUnit kg="1" m="2" s="-2" A="-1"/></Unit>
  <Unit name="A.s/rad"><BaseUnit A="1" s="1" rad="-1"/></Unit><Unit name="A/rad"><BaseUnit A="1" rad="-1"/></Unit>
  <Unit name="N.m.s/rad"><BaseUnit kg="1" m="2" s="-1" rad="-1"/></Unit></UnitDefinitions>
 <DefaultExperiment startTime="0" stopTime="4" stepSize="0.002"/>
 <ModelVariables>
  <ScalarVariable name="w" valueReference="0" causality="output"><Real unit="rad/s"/></ScalarVariable>
  <ScalarVariable name="phi" valueReference="1" causality="output"><Real unit="rad"/></ScalarVariable>
  <ScalarVariable name="i" valueReference="2" causality="output"><Real unit="A"/></ScalarVariable>
  <ScalarVariable name="w_cmd" valueReference="3" causality="input"><Real start="0" unit="rad/s"/></ScalarVariable>
  <ScalarVariable name="tau_load" valueReference="4" causality="input"><Real start="0" unit="N.m"/></ScalarVariable>
  <ScalarVariable name="J" valueReference="5" causality="parameter" variability="fixed">
   <Real start="0.02" min="1e-6" unit="kg.m2"/></ScalarVariable>
  <ScalarVariable name="k_t" valueReference="6" causality="parameter" variability="fixed">
   <Real start="0.5" unit="N.m/A"/></ScalarVariable>
  <ScalarVariable name="K_p" valueReference="7" causality="parameter" variability="tunable">
   <Real start="1" unit="A.s/rad"/></ScalarVariable>
  <ScalarVariable name="K_i" valueReference="8" causality="parameter" variability="tunable">
   <Real start="10" unit="A/rad"/></ScalarVariable>
  <ScalarVariable name="tau_c" valueReference="9" causality="parameter" variability="fixed">
   <Real start="0" unit="N.m"/></ScalarVariable>
  <ScalarVariable name="b" valueReference="10" causality="parameter" variability="fixed">
   <Real start="0" unit="N.m.s/rad"/></ScalarVariable>
 </ModelVariables>
 <ModelStructure><Outputs><Unknown index="1"/><Unknown index="2"/><Unknown index="3"/></Outputs>
  <InitialUnknowns><Unknown index="1"/><Unknown index="2"/><Unknown index="3"/></InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""


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


@cache
def _folder() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="test-fmus-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@cache
def library(source: str, *defines: str) -> Path:
    """Compile a source of this folder; the calling test is skipped where there is no compiler."""
    command = compiler()
    if command is None:
        pytest.skip("no C compiler (gcc, cc, clang or the ziglang package)")
    if sys.platform != "linux":
        pytest.skip("the test FMUs are built for Linux only")
    target = _folder() / f"{Path(source).stem}{'_'.join(['', *defines])}.so"
    options = ["-std=gnu11", "-O2", "-shared", "-fPIC", f"-I{headers()}", *(f"-D{d}" for d in defines)]
    subprocess.run(
        [*command, *options, str(SOURCES / source), "-o", str(target), "-lm"],
        check=True,
        capture_output=True,
        timeout=120,
    )
    return target


def write_fmu(
    path: Path, xml: str, binary: Path, identifier: str, extra: Mapping[str, bytes] | None = None
) -> Path:
    """Zip a model description and a library to an FMU; ``extra`` adds entries under any name."""
    platform = "x86_64-linux" if 'fmiVersion="3.0"' in xml else "linux64"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", xml)
        archive.write(binary, f"binaries/{platform}/{identifier}.so")
        for name, content in (extra or {}).items():
            archive.writestr(name, content)
    return path


@cache
def lag2(
    *defines: str, interpolates: bool = True, guid: str = "{lag}", tool: str = "thsa-cosim tests"
) -> Path:
    """The first-order lag of lag2.c, FMI 2.0; another ``tool`` makes it a foreign FMU."""
    name = (
        "lag2"
        + "_".join(["", *defines])
        + ("" if interpolates else "_held")
        + ("" if guid == "{lag}" else "_bad")
        + ("" if tool == "thsa-cosim tests" else "_foreign")
    )
    xml = LAG2.format(guid=guid, interpolates=str(interpolates).lower()).replace("thsa-cosim tests", tool)
    return write_fmu(_folder() / f"{name}.fmu", xml, library("lag2.c", *defines), "lag2")


@cache
def lag3(*, updates: bool = True) -> Path:
    """The first-order lag of lag3.c, FMI 3.0."""
    name = "lag3" if updates else "lag3_held"
    xml = LAG3.format(updates=str(updates).lower())
    return write_fmu(_folder() / f"{name}.fmu", xml, library("lag3.c"), "lag3")


@cache
def clock3() -> Path:
    """The sampled integrator of clock3.c, FMI 3.0: clocks that tick by time, Event Mode in Co-Simulation."""
    return write_fmu(_folder() / "clock3.fmu", CLOCK3, library("clock3.c"), "clock3")


@cache
def events2() -> Path:
    """The bouncing ball of events2.c, FMI 2.0 Model Exchange."""
    return write_fmu(_folder() / "events2.fmu", EVENTS2, library("events2.c"), "events2")


@cache
def lag1() -> Path:
    """The first-order lag of lag1.c, FMI 1.0 Co-Simulation."""
    return write_fmu(_folder() / "lag1.fmu", LAG1, library("lag1.c"), "lag1")


@cache
def drive2(*defines: str) -> Path:
    """The speed-controlled drive of drive2.c, FMI 2.0 Co-Simulation of a foreign tool."""
    name = "_".join(["drive2", *defines])
    return write_fmu(_folder() / f"{name}.fmu", DRIVE2, library("drive2.c", *defines), "drive2")


@cache
def texts(version: str) -> Path:
    """The FMU with texts of texts.c: FMI "1" (Co-Simulation), "1 exchange", "2" or "3"."""
    simulation = (
        '<Implementation><CoSimulation_StandAlone><Capabilities canHandleVariableCommunicationStepSize="true"/>'
        "</CoSimulation_StandAlone></Implementation>"
    )
    exchange = "exchange" in version
    first = TEXTS1.replace("{interface}", "" if exchange else simulation)
    xml = {"1": first, "2": TEXTS2, "3": TEXTS3}[version[0]]
    curves = {"resources/steep.txt": b"7", "resources/Steigung für μ.txt": b"11"}
    return write_fmu(
        _folder() / f"texts{version}.fmu", xml, library("texts.c", f"FMI={version[0]}"), "texts", curves
    )


@cache
def exchange1(guid: str = "{exchange1}") -> Path:
    """The lag and the ball of exchange1.c, FMI 1.0 Model Exchange."""
    name = "exchange1" + ("" if guid == "{exchange1}" else "_bad")
    xml = EXCHANGE1.replace("{guid}", guid)
    return write_fmu(_folder() / f"{name}.fmu", xml, library("exchange1.c"), "exchange1")


@cache
def strict2() -> Path:
    """The lag of strict2.c, FMI 2.0 Co-Simulation: an FMU that refuses all that the standard does not allow."""
    resources = {"resources/factor.txt": b"1.5"}
    return write_fmu(_folder() / "strict2.fmu", STRICT2, library("strict2.c"), "strict2", resources)


@cache
def habits2(*defines: str, flags: str = 'canHandleVariableCommunicationStepSize="true"') -> Path:
    """The lag of habits2.c, FMI 2.0 Co-Simulation, with the habits that ``defines`` name."""
    name = "_".join(["habits2", *defines]).replace("=", "") + ("" if flags else "_plain")
    xml = HABITS2.replace("{flags}", flags)
    return write_fmu(_folder() / f"{name}.fmu", xml, library("habits2.c", *defines), "habits2")
