"""One HTML page per study: results, plots and provenance in a file that needs no network.

``folder``        what a study folder holds, finished or running
``content``       what a page is made of: sections, tables, figures, texts
``chart``         plotly figures as dictionaries; text escaped, arrays packed
``populations``   the search's population by generation, from the journal
``summary``, ``parameters``, ``friction``, ``comparison``, ``convergence``, ``correlation``, ``gains``, ``responses``,
``plane``, ``schedule``, ``pareto``, ``diagnosis``, ``structure``, ``failures``, ``provenance``: a section each
``write``         all of them in order, rendered by ``templates`` into one file

To add a section: a module with a function that takes a part of a study and returns a section or None, and its place
in ``write.SECTIONS``.
"""

from thsa_cosim.report.page.write import PAGE, write_page

__all__ = ["PAGE", "write_page"]
