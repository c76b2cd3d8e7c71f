"""What the pages of all kinds of study are made of.

``content``       sections, tables, figures, texts
``chart``         plotly figures as dictionaries; text escaped, arrays packed
``text``          numbers as text
``populations``   the search's population by generation, from the journal
``comparison``, ``convergence``, ``failures``, ``provenance``: a section each
"""
