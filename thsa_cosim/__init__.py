"""FMU-based co-simulation toolkit that identifies and tunes electromechanical actuators."""

__version__ = "0.1.0"
