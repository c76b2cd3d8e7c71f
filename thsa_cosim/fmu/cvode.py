"""CVODE (variable-order BDF, Newton, root finding) through the SUNDIALS libraries that come with fmpy.

fmpy's own ``CVodeSolver`` does not apply inputs inside the right-hand side, which makes its results depend
on the output interval; this one leaves inputs to the right-hand side that it is given, returns after every
internal step, never steps over a stop time, and takes an exact Jacobian if there is one.

Source: Hindmarsh et al., "SUNDIALS: Suite of nonlinear and differential/algebraic equation solvers",
ACM TOMS 31 (2005) 363-396; CVODE user guide 7.x.
"""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np

from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.signals import FloatArray

Rhs = Callable[[float, FloatArray, FloatArray], None]
"""f(t, x, dx): writes dx/dt (n,) into dx."""
Roots = Callable[[float, FloatArray, FloatArray], None]
"""g(t, x, z): writes the event indicators (nz,) into z."""
Jacobian = Callable[[float, FloatArray, FloatArray], None]
"""J(t, x, A): writes df/dx (n, n) into A."""

_ONE_STEP = 2
_ROOT_RETURN = 2
_REASONS = {
    -1: "too much work",
    -2: "the tolerance is below rounding",
    -3: "error test failures",
    -4: "no convergence",
    -5: "the linear solver failed to start",
    -6: "the linear solver failed",
    -7: "the linear solver failed",
    -8: "the right-hand side failed",
    -9: "the right-hand side failed at the first call",
    -10: "the right-hand side failed again and again",
    -12: "the event indicators failed",
    -27: "the stop time is too close",
}


class Cvode:
    """A stiff integrator over n states; call ``close`` when done."""

    def __init__(
        self,
        time: float,
        states: FloatArray,
        rhs: Rhs,
        *,
        rtol: float,
        atol: FloatArray,
        roots: Roots | None = None,
        root_count: int = 0,
        jacobian: Jacobian | None = None,
    ) -> None:
        """``states`` (n,) at ``time`` [s]; ``rtol`` and ``atol`` (n,) bound the local error."""
        import fmpy.sundials as sun  # only Model Exchange needs it
        from fmpy.sundials.libraries import sundials_core, sundials_cvode

        self._sun, self._library, self._core = sun, sundials_cvode, sundials_core
        n = len(states)
        self._n, self._root_count = n, root_count
        self.failure: SimulationFailure | None = None
        """What the right-hand side last refused, also if the step was then repeated with success."""
        self._error: BaseException | None = None
        self._rhs, self._roots, self._jacobian = rhs, roots, jacobian
        self._views: dict[int, FloatArray] = {}
        pointer, real = ctypes.c_void_p, ctypes.c_double
        context = sun.SUNContext()
        self._require(sun.SUNContext_Create(sun.SUN_COMM_NULL, ctypes.byref(context)))
        self._context = context
        self._call(sundials_core, "SUNContext_ClearErrHandlers", (pointer,), context)
        self._x, self._atol = sun.N_VNew_Serial(n, context), sun.N_VNew_Serial(n, context)
        self._dky = sun.N_VNew_Serial(n, context)
        self.states = self._view(self._x)
        self._memory = sun.CVodeCreate(sun.CV_BDF, context)
        self._f, self._g = sun.CVRhsFn(self._on_rhs), sun.CVRootFn(self._on_roots)
        self.states[:] = states
        self._view(self._atol)[:] = atol
        self._require(sun.CVodeInit(self._memory, self._f, time, self._x))
        self._require(sun.CVodeSVtolerances(self._memory, rtol, self._atol))
        if root_count:
            self._require(sun.CVodeRootInit(self._memory, root_count, self._g))
            self._require(sun.CVodeSetNoInactiveRootWarn(self._memory))
        self._matrix = sun.SUNDenseMatrix(n, n, context)
        self._solver = sun.SUNLinSol_Dense(self._x, self._matrix, context)
        self._require(sun.CVodeSetLinearSolver(self._memory, self._solver, self._matrix))
        if jacobian is not None:
            prototype = ctypes.CFUNCTYPE(ctypes.c_int, real, *(pointer,) * 7)
            self._j = prototype(self._on_jacobian)
            sundials_cvode.CVodeSetJacFn.argtypes = [pointer, prototype]
            self._require(sundials_cvode.CVodeSetJacFn(self._memory, self._j))
            data = self._core_function("SUNDenseMatrix_Data")
            data.argtypes, data.restype = [pointer], ctypes.POINTER(real)
            # Column-major in SUNDIALS.
            address = ctypes.cast(self._matrix, pointer)
            self._dense = np.ctypeslib.as_array(data(address), (n, n)).T
        self._time = real(time)

    def _core_function(self, name: str) -> Any:
        from fmpy.sundials.libraries import sundials_sunmatrixdense

        return getattr(sundials_sunmatrixdense, name)

    @staticmethod
    def _call(library: Any, name: str, argtypes: tuple[Any, ...], *arguments: Any) -> int:
        function = getattr(library, name)
        function.argtypes, function.restype = list(argtypes), ctypes.c_int
        return int(function(*arguments))

    def _view(self, vector: Any) -> FloatArray:
        """Return an N_Vector's data (n,) as an array; SUNDIALS keeps a few vectors and passes them around."""
        if not isinstance(vector, self._sun.N_Vector):
            vector = ctypes.cast(vector, self._sun.N_Vector)
        key = ctypes.addressof(vector.contents)
        view = self._views.get(key)
        if view is None:
            view = np.ctypeslib.as_array(self._sun.NV_DATA_S(vector), (self._n,))
            self._views[key] = view
        return view

    @staticmethod
    def _require(flag: int) -> None:
        if flag != 0:
            raise SimulationFailure(Status.INCOMPLETE, f"the integrator CVODE cannot be set up (code {flag})")

    # -- callbacks: exceptions must not cross C code --------------------------------------------------
    def _guard(self, function: Callable[[], None]) -> int:
        try:
            function()
        except SimulationFailure as failure:
            self.failure = failure
            recoverable = failure.status in (Status.FMI_DISCARD, Status.NOT_FINITE)
            return 1 if recoverable else -1
        except BaseException as error:
            self._error = error
            return -1
        return 0

    def _on_rhs(self, time: float, x: Any, dx: Any, _data: Any) -> int:
        return self._guard(lambda: self._rhs(time, self._view(x), self._view(dx)))

    def _on_roots(self, time: float, x: Any, z: Any, _data: Any) -> int:
        assert self._roots is not None
        values = np.ctypeslib.as_array(z, (self._root_count,))
        roots = self._roots
        # CVODE has no recoverable failure here.
        return -1 if self._guard(lambda: roots(time, self._view(x), values)) else 0

    def _on_jacobian(self, time: float, x: int, *_rest: Any) -> int:
        assert self._jacobian is not None
        jacobian = self._jacobian
        return self._guard(lambda: jacobian(time, self._view(x), self._dense))

    # -- stepping -------------------------------------------------------------------------------------
    def step(self, stop: float) -> tuple[float, bool]:
        """Do one internal step, at most to ``stop`` [s]; return the time reached and whether a root was met.

        ``states`` then holds the solution there. SimulationFailure if no step can be done.
        """
        pointer, real = ctypes.c_void_p, ctypes.c_double
        self._call(self._library, "CVodeSetStopTime", (pointer, real), self._memory, stop)
        flag = self._sun.CVode(self._memory, stop, self._x, ctypes.byref(self._time), _ONE_STEP)
        if self._error is not None:
            raise self._error
        if flag < 0:
            if self.failure is not None:
                raise self.failure
            why = _REASONS.get(flag, f"code {flag}")
            reason = f"the integrator CVODE gave up at t = {self._time.value:.9g} s: {why}"
            raise SimulationFailure(Status.INCOMPLETE, reason)
        return self._time.value, flag == _ROOT_RETURN

    def at(self, time: float) -> FloatArray:
        """Return the states (n,) at a time within the last step (the solver's own interpolation)."""
        types = (ctypes.c_void_p, ctypes.c_double, ctypes.c_int, self._sun.N_Vector)
        self._require(self._call(self._library, "CVodeGetDky", types, self._memory, time, 0, self._dky))
        return self._view(self._dky).copy()

    def restart(self, time: float, states: FloatArray, atol: FloatArray) -> None:
        """Begin anew after a discontinuity."""
        self.states[:] = states
        self._view(self._atol)[:] = atol
        self._time.value = time
        self._require(self._sun.CVodeReInit(self._memory, time, self._x))

    def close(self) -> None:
        """Free the solver."""
        if not self._memory:
            return
        pointer = ctypes.c_void_p
        self._sun.CVodeFree(ctypes.byref(pointer(self._memory)))
        self._memory = None
        for vector in (self._x, self._atol, self._dky):
            self._sun.N_VDestroy_Serial(vector)
        for name, thing in (("SUNLinSolFree", self._solver), ("SUNMatDestroy", self._matrix)):
            function = getattr(self._core, name)
            function.argtypes, function.restype = [pointer], ctypes.c_int
            function(ctypes.cast(thing, pointer))
        free = self._core.SUNContext_Free
        free.argtypes = [pointer]
        free(ctypes.byref(self._context))
