"""Modelica class → FMU: flatten, order the equations, generate C, compile, pack.

``flatten`` (by ``thsa_cosim.modelica``) → ``causal`` (with ``discrete``, ``expression``, ``structure``, ``solve``) →
``codegen`` (with ``implicit``) and ``description`` → ``compile`` → ``archive``; the C that is the same for every
model is in ``runtime/``.
"""

import dataclasses
import os
import time
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from thsa_cosim.errors import MissingExtraError, ModelicaError, ParameterError, did_you_mean
from thsa_cosim.export.flatten import flatten, holders, list_models
from thsa_cosim.shipped import modelica_package

if TYPE_CHECKING:
    from thsa_cosim.export.causal import CausalModel

__all__ = ["export_fmu", "list_models"]

_HOLDERS = 3
"""How many models a message names at most that hold what cannot be exported alone."""


def export_fmu(
    model: str,
    *,
    package: Path | None = None,
    fmi: int = 2,
    output: Path | None = None,
    compiler: str = "native",
    start_values: Mapping[str, float] | None = None,
    platforms: Sequence[str] | None = None,
    libraries: Sequence[Path] = (),
) -> Path:
    """Export a Modelica class as an FMU with Co-Simulation and Model Exchange; returns the archive's path.

    Parameters
    ----------
    model:
        Class name (``THSA.Actuator`` or ``Actuator``) or the path of a ``.mo`` file.
    package:
        Folder of the Modelica package; default ``modelica/THSA`` here, else the one that is shipped.
    fmi:
        FMI version, 2 or 3.
    output:
        The archive to write; default ``<last part of the class name>.fmu`` in the working directory.
    compiler:
        "native" for the exporter of this package, "omc" to hand the class to OpenModelica.
    start_values:
        Start values of parameters that replace those of the model, in the model's units.
    platforms:
        What to compile for, by the names of FMI 2.0 or 3.0 (``win64``, ``x86_64-linux``, …); default all, or this
        machine's where its own compiler is the only one.
    libraries:
        Further Modelica libraries: packages' folders, folders of packages (such as a Modelica tool's library folder) or
        ``.mo`` files; those of the environment variable MODELICAPATH follow. Only what the class uses is read.

    Raises
    ------
    ModelicaError
        The class does not compile or is outside the supported subset; the message names the equation or variable.
    ParameterError
        A start value names no parameter of the model, or a platform is unknown.
    MissingExtraError
        CasADi is not installed, or there is no C compiler for a platform.
    """
    if fmi not in (2, 3):
        raise ModelicaError(f"FMI version {fmi} is not supported; choose 2 or 3.")
    package = package or modelica_package()
    if compiler == "omc":
        from thsa_cosim.export.openmodelica import export_with_openmodelica

        return export_with_openmodelica(model, package, fmi, output, libraries)
    try:
        import casadi  # noqa: F401
    except ImportError as error:
        raise MissingExtraError("Exporting a Modelica model", "export") from error
    from thsa_cosim.export.archive import write_fmu
    from thsa_cosim.export.compile import PLATFORMS, available_platforms

    causal = causal_model(model, package, libraries)
    if start_values:
        settable = {v.name for v in causal.variables if v.start is not None}
        for name in start_values:
            if name not in settable:
                raise ParameterError(
                    f"{causal.flat.name}: has no start value {name!r} to set.{did_you_mean(name, settable)}"
                )
        variables = tuple(
            dataclasses.replace(v, start=float(start_values[v.name])) if v.name in start_values else v
            for v in causal.variables
        )
        causal = dataclasses.replace(causal, variables=variables)
    chosen = list(available_platforms())
    if platforms is not None:
        names = {name: p for p in PLATFORMS for name in (p.fmi2, p.fmi3) if name}
        for name in platforms:
            if name not in names:
                listed = ", ".join(names)
                raise ParameterError(
                    f"Platform {name!r} is unknown; choose from {listed}.{did_you_mean(name, names)}"
                )
        chosen = [p for p in PLATFORMS if p in [names[name] for name in platforms]]
    if platforms is None and len(chosen) == 1:
        warnings.warn(
            f"The FMU is for {chosen[0].fmi3} only, built by this machine's C compiler; the other platforms need an "
            "optional part: pip install 'thsa-cosim[export]'.",
            stacklevel=2,
        )
    if output is None:
        output = Path(causal.flat.name.rsplit(".", 1)[-1] + ".fmu")
    date = float(os.environ.get("SOURCE_DATE_EPOCH", time.time()))
    write_fmu(causal, fmi, output, date=date, platforms=chosen)
    return output


def causal_model(model: str, package: Path, libraries: Sequence[Path] = ()) -> "CausalModel":
    """The equations of a class, solved; Boolean and Integer parameters are fixed where they shape the equations.

    Raises ModelicaError as `export_fmu` does.
    """
    from thsa_cosim.export.causal import make_causal

    flat = None
    try:
        flat = flatten(model, package, libraries)
        return make_causal(flat)
    except ModelicaError as error:
        try:
            return make_causal(flatten(model, package, libraries, folded=True))
        except ModelicaError:
            # What its flanges and inputs are connected to may be all that a part of a library lacks.
            if flat is None or not (whole := holders(model, package, libraries)):
                raise error from None
            listed = ", ".join(whole[:_HOLDERS])
            raise ModelicaError(
                f"{error} To use it as a part, export a model that holds it: {listed}."
            ) from None
