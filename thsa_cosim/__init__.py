"""FMU-based co-simulation toolkit that identifies and tunes electromechanical actuators.

``identify``, ``tune``, ``diagnose``, ``simulate`` and ``open_study`` are for notebooks and scripts
(``thsa_cosim.api``); each is imported when it is first used. The rooms below say in their ``__init__`` what is in
them.
"""

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from thsa_cosim.api import (
        DiagnoseStudy,
        IdentifyStudy,
        SimulateStudy,
        Study,
        TuneStudy,
        compare,
        diagnose,
        identify,
        init,
        list_studies,
        open_study,
        sensitivity,
        simulate,
        tune,
    )

__version__ = "0.2.0"

__all__ = [
    "DiagnoseStudy",
    "IdentifyStudy",
    "SimulateStudy",
    "Study",
    "TuneStudy",
    "__version__",
    "compare",
    "diagnose",
    "identify",
    "init",
    "list_studies",
    "open_study",
    "sensitivity",
    "simulate",
    "tune",
]


class _Lazy:
    """A name of ``thsa_cosim.api``, imported when it is asked for.

    A data descriptor on the module's class, because importing the submodule ``thsa_cosim.identify`` sets the
    package's attribute of that name, which would hide the function: it is set in vain here.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, module: ModuleType | None, owner: type[ModuleType]) -> Any:
        from thsa_cosim import api

        return getattr(api, self._name)

    def __set__(self, module: ModuleType, value: object) -> None:
        """Leave the name as it is."""


class _Package(ModuleType):
    """This package with its lazy names."""


for _name in __all__:
    if _name != "__version__":
        setattr(_Package, _name, _Lazy(_name))
sys.modules[__name__].__class__ = _Package
