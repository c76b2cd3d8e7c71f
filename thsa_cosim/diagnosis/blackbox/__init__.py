"""Effects around an FMU whose inside cannot be changed (decision 005).

``places`` says where an effect can act and through which of the FMU's variables, ``drive`` measures on the FMU itself
what that takes, ``wrapper`` runs the FMU with effects, ``prepare`` offers them to the search, ``saved`` keeps what was
found.
"""

from thsa_cosim.diagnosis.blackbox.saved import WrappedPlant

__all__ = ["WrappedPlant"]
