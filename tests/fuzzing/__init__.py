"""A fuzzer of the command line: mutated scenarios, recordings, FMU archives and study folders.

``material``    a small healthy study of every kind, and recordings in every format
``raw``         mutations of bytes, text and single values
``scenarios``   mutations of a scenario's tables
``recordings``  mutations of a recording's samples and of its file
``archives``    mutations of an FMU: its description, entries, binaries
``cases``       one case: a folder, a command line, all drawn from ``(kind, seed, index)``
``sandbox``     runs a case with a deadline and judges what it did

``benchmarks/fuzz.py`` is its command line, ``tests/fuzzing/test_fuzz.py`` a small sample of it.
"""
