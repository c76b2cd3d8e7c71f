"""One HTML page per study: results, plots and provenance in a file that needs no network.

``summary``   the first section, of any kind
``write``     all sections in order, rendered by ``templates`` into one file
``live``      the page of a running study, again and again
``index``     a page that leads to those of several studies

To add a section: a module beside the others of its kind (``report/identify``, …), with a function that takes a part of
a study and returns a section or None, and its place in ``write.SECTIONS``.
"""

from thsa_cosim.report.page.live import follow
from thsa_cosim.report.page.write import PAGE, Live, write_page

__all__ = ["PAGE", "Live", "follow", "write_page"]
