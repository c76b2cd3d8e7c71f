"""Environment variables that limit a numerical library to one thread, read when it is first imported.

Threads that wait for each other over products of a few columns cost ten times the products.
"""

BLAS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
ALL = (*BLAS, "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS")
