"""Results → files and tables. Nothing in the core imports this room.

``result_json``
    the study folder's ``result.json`` and CSV files.
``tables``
    what the command line prints (rich).
``plots``
    figures as PNG files (matplotlib).
``study``
    all of them for a finished or interrupted identification.
"""
