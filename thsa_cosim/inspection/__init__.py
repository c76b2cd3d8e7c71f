"""What is wrong with recordings, before anything is fitted to them.

``finding``  a finding, and all of them with their verdict
``file``     a recording's file without a scenario
"""

from thsa_cosim.inspection.file import FileReport, inspect_file
from thsa_cosim.inspection.finding import Finding, Inspection

__all__ = ["FileReport", "Finding", "Inspection", "inspect_file"]
