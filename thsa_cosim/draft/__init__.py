"""A first scenario for an FMU and a recording: what ``thsa-cosim init`` writes.

``columns``  what a recording holds, with the units that its names suggest
``match``    which column is which variable, by name, description and unit
``text``     the commented TOML file
"""

from thsa_cosim.draft.match import Match, match_columns
from thsa_cosim.draft.text import Draft, draft_from_columns, draft_scenario
from thsa_cosim.recordings.columns import FoundColumn, find_columns, time_column

__all__ = [
    "Draft",
    "FoundColumn",
    "Match",
    "draft_from_columns",
    "draft_scenario",
    "find_columns",
    "match_columns",
    "time_column",
]
