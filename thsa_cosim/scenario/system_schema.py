"""What is simulated: one FMU or system archive by its path, or a system that the scenario describes itself."""

from typing import Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from thsa_cosim.scenario.table import Moderate, Name, NotNegative, Positive, Table


class ComponentTable(Table):
    """``[[components]]``: one FMU of a system. Its variables are named ``<component>.<variable>``."""

    name: Name
    """Unique within the system."""
    fmu: Name
    """Path of the FMU; several components may name the same one."""
    execution: Literal["continuous", "coupled", "sampled"] | None = None
    """``continuous``: integrated together with the others (Model Exchange); ``coupled``: by its own solver, in
    communication steps (Co-Simulation); ``sampled``: a controller that acts at its ticks only. Default: continuous
    where the FMU offers Model Exchange and ``step`` is not given, else coupled."""
    step: Positive | None = None
    """Communication step or sampling interval, s. Default for a coupled component: what its FMU suggests."""
    delay: NotNegative = 0.0
    """Time from a tick of a sampled component until its outputs change, s; at most one step."""
    jitter: NotNegative = 0.0
    """Each tick of a sampled component comes up to so much later than due, s (uniformly distributed, the same in
    every run); ``delay`` + ``jitter`` at most one step."""
    process: Literal["shared", "own"] = "shared"
    """``own``: run this FMU in a separate process (Linux, macOS), which costs some 0.1 ms a call. That happens anyway
    where an FMU allows one instance per process, refuses a second one, or brings libraries that another brings too."""
    start: dict[Name, float | bool] = Field(default_factory=dict)
    """Start values by variable of this FMU, in its units."""


class ConnectionTable(Table):
    """``[[connections]]``: an output of one component to an input of another; units are converted."""

    source: Name = Field(alias="from")
    """``<component>.<output>``."""
    target: Name = Field(alias="to")
    """``<component>.<input>``; one writer for each."""
    factor: Moderate = 1.0
    """input = factor * output + offset, before units are converted."""
    offset: Moderate = 0.0
    """In the output's unit."""
    disturbance: Name | None = None
    """Name of an input of the system that is added to the target, in its unit: a fault of a sensor, or the signal that
    the loop's margins are measured with."""
    convert: bool = True
    """Convert units; false: ``factor`` and ``offset`` do it."""


class ModelTable(Table):
    """What every kind runs."""

    fmu: Name = ""
    """Path of the FMU, or of a system of FMUs (SSP archive, ``.ssp``). ``--fmu`` replaces it."""
    components: list[ComponentTable] = Field(default_factory=list)
    """The FMUs of a system, in place of ``fmu``."""
    connections: list[ConnectionTable] = Field(default_factory=list)
    """How they are connected. Inputs that nothing is connected to are inputs of the system."""
    connectors: dict[Name, Name | list[Name]] = Field(default_factory=dict)
    """Short names for variables of components: ``v = "plant.v"``; one name may drive several inputs."""

    coupling_tolerance: Positive | None = None
    """Error that communication steps may leave in any output of a component over a run, as a share of its largest size:
    ``step`` is then the longest step, and steps are repeated shorter where it is exceeded. All components have to be
    ``coupled`` by the same step, and able to go back to a former state (``canGetAndSetFMUstate``)."""

    merge: bool = True
    """Compile a system whose components are all FMUs of ``thsa-cosim export`` into one FMU, which runs some ten
    times faster; false: couple them at run time, as a system with other FMUs always is."""

    @model_validator(mode="after")
    def _one_of_both(self) -> "ModelTable":
        if self.fmu and self.components:
            raise PydanticCustomError("model", "fmu and components exclude each other; remove one")
        if not self.fmu and not self.components:
            raise PydanticCustomError("model", "fmu: is missing; add it, or [[components]] of a system")
        if not self.components and (self.connections or self.connectors or self.coupling_tolerance):
            what = "connections, connectors and coupling_tolerance need [[components]]; add them"
            raise PydanticCustomError("model", what)
        return self
