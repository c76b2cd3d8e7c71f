"""FMI 3.0 arrays, seen as their elements: the FMI sets and gets an array only as a whole (clause 2.2.6.2)."""

import ctypes
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from thsa_cosim.fmu.instance import Instance

_SIZE = ctypes.c_size_t
_ACCESS = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, _SIZE, ctypes.c_void_p, _SIZE)


class ArrayAccess:
    """Functions with the prototype of fmi3SetFloat64 whose value references are numbers of elements.

    What is not set keeps its value: the start value that is declared, or what was set last.
    """

    def __init__(self, instance: "Instance") -> None:
        self._instance = instance
        variables = instance.description.variables.values()
        self._elements = {v.value_reference: v.element for v in variables if v.element is not None}
        self._functions: dict[tuple[str, str], Any] = {}
        self._written: dict[int, NDArray[np.float64]] = {}

    def forget(self) -> None:
        """Start over with the declared start values: for a new instance."""
        self._written.clear()

    def function(self, verb: str, suffix: str) -> Any:
        """Return the function that sets or gets (``verb``) elements of one data type."""
        key = verb, suffix
        if key not in self._functions:
            types = {name: np.dtype(dtype) for name, dtype in self._instance.types.values()}
            self._functions[key] = _ACCESS(self._bind(verb, suffix, types[suffix]))
        return self._functions[key]

    def _bind(self, verb: str, suffix: str, dtype: np.dtype[Any]) -> Any:
        inner = self._instance.value_function(verb, suffix)

        def call(handle: int, reference: int, array: NDArray[Any]) -> int:
            vr = ctypes.c_uint32(reference)
            return int(inner(handle, ctypes.addressof(vr), 1, array.ctypes.data, len(array)))

        def access(handle: int, references: int, count: int, values: int, _count: int) -> int:
            numbers: Any = (ctypes.c_uint32 * count).from_address(references)
            buffer: Any = (ctypes.c_char * (count * dtype.itemsize)).from_address(values)
            wanted = np.frombuffer(numbers, dtype=np.uint32)
            data = np.frombuffer(buffer, dtype=dtype)
            worst = 0
            for reference, places in self._by_array(wanted).items():
                size = places[0][2]
                if verb == "Get":
                    whole = np.empty(size, dtype)
                    worst = max(worst, call(handle, reference, whole))
                    for position, index, _ in places:
                        data[position] = whole[index]
                    continue
                whole = self._start(reference, size).astype(dtype)
                for position, index, _ in places:
                    whole[index] = data[position]
                self._written[reference] = whole.astype(np.float64)
                worst = max(worst, call(handle, reference, whole))
            return worst

        return access

    def _by_array(self, wanted: NDArray[np.uint32]) -> dict[int, list[tuple[int, int, int]]]:
        """Array -> (position in the call, index in the array, length of the array)."""
        arrays: dict[int, list[tuple[int, int, int]]] = {}
        for position, number in enumerate(wanted.tolist()):
            reference, index, size = self._elements[number]
            arrays.setdefault(reference, []).append((position, index, size))
        return arrays

    def _start(self, reference: int, size: int) -> NDArray[np.float64]:
        if reference not in self._written:
            whole = np.zeros(size)
            for variable in self._instance.description.variables.values():
                if variable.element is not None and variable.element[0] == reference:
                    whole[variable.element[1]] = variable.start or 0.0
            self._written[reference] = whole
        return self._written[reference]
