"""Several studies: ``listing`` of a folder, ``difference`` between them, its ``tables`` and ``page``."""

from thsa_cosim.report.compare.difference import Comparison, compare
from thsa_cosim.report.compare.listing import Entry, list_studies

__all__ = ["Comparison", "Entry", "compare", "list_studies"]
