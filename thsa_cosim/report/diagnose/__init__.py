"""A diagnosis: ``result`` that it leaves, ``tables`` it prints, a section of its page per file."""
