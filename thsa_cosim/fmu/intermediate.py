"""FMI 3.0 intermediate update: the FMU asks for its inputs inside a communication step (clause 4.2.2)."""

import ctypes

import numpy as np

from thsa_cosim.fmu.fmi3 import Fmi3Instance
from thsa_cosim.fmu.instance import Phase
from thsa_cosim.fmu.plan import Plan
from thsa_cosim.signals import FloatArray

_DOUBLE, _SIZE = ctypes.c_double, ctypes.c_int64
_SET = ctypes.CFUNCTYPE(ctypes.c_int, _SIZE, _SIZE, _SIZE, _SIZE, _SIZE)
_UPDATE = ctypes.CFUNCTYPE(
    None,
    ctypes.c_void_p,
    _DOUBLE,
    ctypes.c_bool,
    ctypes.c_bool,
    ctypes.c_bool,
    ctypes.c_bool,
    _SIZE,
    _SIZE,
)


class IntermediateUpdate:
    """The block of addresses that an FMI 3 intermediate update callback reads, and the callback."""

    def __init__(self, instance: Fmi3Instance, progress: FloatArray, compiled: bool) -> None:
        self.block = np.zeros(9, dtype=np.int64)
        self.block[7] = progress.ctypes.data
        self._progress = progress
        self._python = _UPDATE(self._update)
        if compiled:
            from thsa_cosim.fmu.compiled import intermediate_update

            instance.intermediate_update = intermediate_update.address
        else:
            instance.intermediate_update = instance.library.address(self._python)
        instance.environment = self.block.ctypes.data

    def prepare(self, plan: Plan, instance: Fmi3Instance) -> None:
        """Point the block at the tables of ``plan``; before instantiation."""
        assert plan.smooth is not None
        channel, values, slopes, _ = plan.smooth
        setter = instance.library.address(instance.value_function("Set", channel.suffix))
        references = channel.references
        self.block[:7] = (
            setter,
            0,
            references.ctypes.data,
            len(references),
            values.ctypes.data,
            slopes.ctypes.data,
            values.strides[0],
        )
        self.block[8] = plan.grid.times.ctypes.data
        self._plan = plan
        instance.intermediate_references = references.tolist()

    def _update(
        self, _environment: int, time: float, wanted: bool, _g: bool, _f: bool, _c: bool, early: int, _t: int
    ) -> None:
        if early:
            ctypes.c_bool.from_address(early).value = False
        if not wanted or self._progress[0] != Phase.STEP:
            return
        assert self._plan.smooth is not None
        k = int(self._progress[2])
        _, values, slopes, _ = self._plan.smooth
        now = values[k] + slopes[k] * (time - self._plan.grid.times[k])
        setter, handle, references, count = self.block[:4].tolist()
        _SET(setter)(handle, references, count, now.ctypes.data, count)
