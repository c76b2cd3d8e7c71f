"""One HTML page per study: results, plots and provenance in a file that needs no network.

``summary``   the first section, of any kind
``write``     all sections in order, rendered by ``templates`` into one file
``index``     a page that leads to those of several studies

To add a section: a module beside the others of its kind (``report/identify``, …), with a function that takes a part of
a study and returns a section or None, and its place in ``write.SECTIONS``.
"""

from thsa_cosim.report.page.write import PAGE, write_page

__all__ = ["PAGE", "write_page"]
