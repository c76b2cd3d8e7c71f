"""FMUs: the only room that knows fmpy and the FMI.

``description``  what an FMU says about itself
``plant``        an opened FMU: run it with start values and inputs
``inputs``       how sampled inputs reach an FMU; ``plan`` the tables made of them
``segments``     where inputs bend and jump
``trajectory``   a whole run in one call, for FMUs that offer it
``stepping``     the Co-Simulation loop; ``compiled`` the same in machine code
``exchange``     the integrator for Model Exchange
``fmi1`` ...     the versions of the FMI; ``instance`` what 2.0 and 3.0 have in common
"""

from thsa_cosim.fmu.description import DefaultExperiment, FmuDescription, read_description
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.plant import Plant
from thsa_cosim.fmu.variable import Variable

__all__ = [
    "DefaultExperiment",
    "FmuDescription",
    "Plant",
    "SimulationFailure",
    "Status",
    "Variable",
    "read_description",
]
