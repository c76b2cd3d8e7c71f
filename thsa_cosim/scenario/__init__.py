"""A scenario: one TOML file that says what to run and what to compare it with, checked in one place.

``schema`` holds the file's tables (one pydantic class each, one class per kind), ``model`` the frozen objects
that the use cases get, ``load`` turns the one into the other, ``check`` holds a scenario against its FMU and
``sentences`` turns a wrong key or value into one sentence; ``stages`` runs several scenarios in order,
``executor`` opens the processes that ``[simulation]`` asks for.
The ``tune_`` modules are the same for tunings, which need no recordings.
"""

from thsa_cosim.scenario.diagnose_schema import BalanceTable
from thsa_cosim.scenario.executor import Executor, Opening, OpenRunner
from thsa_cosim.scenario.loading import AnyScenario, load
from thsa_cosim.scenario.model import (
    BlackBoxSpec,
    DiagnoseSpec,
    ForceSpec,
    Scenario,
    TemperaturePoint,
)
from thsa_cosim.scenario.schema import (
    KINDS,
    ChannelTable,
    LawTable,
    SearchTable,
    SimulationTable,
)
from thsa_cosim.scenario.source import Source
from thsa_cosim.scenario.stages import Stage, StagedScenario, hand_on
from thsa_cosim.scenario.table import Table
from thsa_cosim.scenario.tune_model import TuneScenario

__all__ = [
    "KINDS",
    "AnyScenario",
    "BalanceTable",
    "BlackBoxSpec",
    "ChannelTable",
    "DiagnoseSpec",
    "Executor",
    "ForceSpec",
    "LawTable",
    "OpenRunner",
    "Opening",
    "Scenario",
    "SearchTable",
    "SimulationTable",
    "Source",
    "Stage",
    "StagedScenario",
    "Table",
    "TemperaturePoint",
    "TuneScenario",
    "hand_on",
    "load",
]
