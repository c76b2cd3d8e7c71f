"""FMI 1.0 Co-Simulation through fmpy; linear inputs are held over each step."""

import ctypes
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.errors import FmuError, ParameterError
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.inputs import communication_grid, input_variables, is_linear, sampled
from thsa_cosim.fmu.instance import Phase
from thsa_cosim.fmu.variable import Variable
from thsa_cosim.signals import FloatArray, Signals

_TYPES = {"Real": "Real", "Integer": "Integer", "Enumeration": "Integer", "Boolean": "Boolean"}
_STATUS = {2: Status.FMI_DISCARD, 4: Status.FMI_FATAL}


def run_fmi1(
    folder: Path,
    description: FmuDescription,
    values: Mapping[str, float | str],
    inputs: Signals | None,
    outputs: Sequence[str],
    time: FloatArray,
    progress: FloatArray,
    mode: str = "mean",
) -> Signals:
    """Simulate once with a new instance; as ``Plant.run``. ``mode``: how linear inputs are given."""
    from fmpy.fmi1 import FMICallException, FMU1Slave

    grid = communication_grid(time)
    driven = input_variables(description, inputs)
    recorded = [description.variable(name) for name in outputs]
    start = [description.variable(name) for name in values]
    texts = [name for name, value in values.items() if isinstance(value, str)]
    for variable in (*driven, *recorded, *(v for v in start if v.name not in texts)):
        if variable.type not in _TYPES:
            raise ParameterError(
                f"{description.path}: {variable.name} is of type {variable.type}, no number."
            )
    table = sampled(inputs, driven, grid.times)
    linear = np.array([is_linear(inputs, v) for v in driven], dtype=bool)
    rows = np.full((len(grid.times), len(recorded)), np.nan)
    progress[:2] = Phase.LOAD, grid.times[0]
    try:
        slave = FMU1Slave(
            guid=description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=description.co_simulation_identifier,
            instanceName="plant",
        )
    except Exception as error:
        reason = f"{description.path.name} cannot be loaded: {' '.join(str(error).split())}"
        raise SimulationFailure(Status.LOAD_ERROR, reason) from None
    # fmpy 0.3.32 declares that doStep and others return strings: an error code would be read as an address.
    for name, function in slave._functions.items():
        if function.restype is ctypes.c_char_p and name not in ("fmi1GetVersion", "fmi1GetTypesPlatform"):
            function.restype = ctypes.c_int
    try:
        progress[0] = Phase.INSTANTIATE
        slave.instantiate(loggingOn=False)
        if not slave.component:
            raise SimulationFailure(Status.LOAD_ERROR, "fmiInstantiateSlave returned NULL")
        try:
            progress[0] = Phase.INITIALIZE
            _set(slave, start, list(values.values()))
            _set(slave, driven, table[0] if driven else ())
            slave.initialize(tStart=float(grid.times[0]), stopTime=grid.stop)
            progress[0] = Phase.STEP
            for k in range(len(grid.times)):
                if k:
                    held = table[k - 1].copy()
                    if mode == "mean":
                        held[linear] = 0.5 * (table[k - 1] + table[k])[linear]
                    _set(slave, driven, held)
                    progress[1] = grid.times[k - 1]
                    slave.doStep(float(grid.times[k - 1]), float(grid.steps[k - 1]))
                    _set(slave, driven, table[k])
                rows[k] = [_get(slave, v) for v in recorded]
                if not np.isfinite(rows[k]).all():
                    i = int(np.argmin(np.isfinite(rows[k])))
                    reason = f"{outputs[i]} became {rows[k, i]} at t = {grid.times[k]:.9g} s"
                    raise SimulationFailure(Status.NOT_FINITE, reason)
            progress[0] = Phase.TERMINATE
            slave.terminate()
        except FMICallException as error:
            status = _STATUS.get(error.status, Status.FMI_ERROR)
            reason = f"{error.function} failed with status {error.status} at t = {progress[1]:.9g} s"
            raise SimulationFailure(status, reason) from None
        finally:
            progress[0] = Phase.FREE
            # Not freeInstance, which also unloads the library: see native.Library.
            slave.fmi1FreeSlaveInstance(slave.component)
    except FmuError as error:
        raise SimulationFailure(Status.LOAD_ERROR, str(error)) from None
    progress[0] = Phase.IDLE
    units = {v.name: v.unit or "1" for v in recorded}
    return Signals(
        grid.times, {name: np.ascontiguousarray(rows[:, i]) for i, name in enumerate(outputs)}, units
    )


def _set(slave: Any, variables: Sequence[Variable], values: Any) -> None:
    for variable, value in zip(variables, values, strict=True):
        if isinstance(value, str):
            slave.setString([variable.value_reference], [value])
            continue
        kind = _TYPES[variable.type]
        value = -value if _is_negated(variable) else value
        number: Any = float(value) if kind == "Real" else bool(value) if kind == "Boolean" else int(value)
        getattr(slave, f"set{kind}")([variable.value_reference], [number])


def _get(slave: Any, variable: Variable) -> float:
    (value,) = getattr(slave, f"get{_TYPES[variable.type]}")([variable.value_reference])
    # fmpy hands Booleans over as bytes.
    if isinstance(value, bytes):
        return float(value != b"\0")
    return -float(value) if _is_negated(variable) else float(value)


def _is_negated(variable: Variable) -> bool:
    return variable.is_negated and variable.type != "Boolean"
