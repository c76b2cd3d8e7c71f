"""The catalogue: one effect a file, each with its ``EFFECT``."""
