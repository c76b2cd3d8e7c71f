"""An identification: ``result`` and ``files`` it leaves, ``tables`` it prints, a section of its page per file."""
