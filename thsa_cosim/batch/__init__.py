"""Batches of simulations: jobs in, outcomes out, whatever an FMU does.

``job``, ``outcome``  what is to be simulated, what became of it
``runner``            what all runners promise
``local``             worker processes on this machine (``process`` and ``worker``: its two ends)
``handling``          how a foreign FMU is given its inputs, found by trial
``repetition``        whether its runs may share a process, likewise
``cluster``           the same jobs on a Dask cluster
``journal``           the durable table of evaluated vectors
"""

from thsa_cosim.batch.job import Experiment, Job, PlantRun, Reducer, Wrapper
from thsa_cosim.batch.journal import Journal, JournalRow, JournalTable, read_journal
from thsa_cosim.batch.local import LocalRunner
from thsa_cosim.batch.outcome import Outcome, Status
from thsa_cosim.batch.runner import Runner, TimeIsOver

__all__ = [
    "Experiment",
    "Job",
    "Journal",
    "JournalRow",
    "JournalTable",
    "LocalRunner",
    "Outcome",
    "PlantRun",
    "Reducer",
    "Runner",
    "Status",
    "TimeIsOver",
    "Wrapper",
    "read_journal",
]
