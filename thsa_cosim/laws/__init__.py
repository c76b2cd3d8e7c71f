"""Laws over temperature: their forms, a weighted fit, the choice between them, and whether a material can do this."""

from thsa_cosim.laws.fit import fit_law, select_law
from thsa_cosim.laws.law import (
    CANDIDATES,
    COPPER,
    FORMS,
    PHYSICAL,
    POLYNOMIALS,
    Law,
    largest_deviation,
    published_law,
)
from thsa_cosim.laws.plausibility import Doubt, doubts_about
from thsa_cosim.laws.quantity import QUANTITIES, Quantity, candidates_for, quantity_of
from thsa_cosim.laws.searched import SEARCHABLE, SearchedLaw

__all__ = [
    "CANDIDATES",
    "COPPER",
    "FORMS",
    "PHYSICAL",
    "POLYNOMIALS",
    "QUANTITIES",
    "SEARCHABLE",
    "Doubt",
    "Law",
    "Quantity",
    "SearchedLaw",
    "candidates_for",
    "doubts_about",
    "fit_law",
    "largest_deviation",
    "published_law",
    "quantity_of",
    "select_law",
]
