"""How an FMU is excited in a check: what the user says, and what its description says where the user does not."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from thsa_cosim.fmu import FmuDescription, probe
from thsa_cosim.fmu.plant import Kind
from thsa_cosim.signals import FloatArray, Signals


@dataclass(frozen=True)
class Excitation:
    """What the user says about how the FMU is to be tried; what is left out comes from its description."""

    values: Mapping[str, float] = field(default_factory=dict)
    """Start values, in the FMU's units."""
    texts: Mapping[str, str] = field(default_factory=dict)
    """Start values of String parameters and inputs."""
    inputs: Signals | None = None
    time: FloatArray | None = None
    """(n,) s, communication points."""
    ends: Mapping[str, float] = field(default_factory=dict)
    """Value that an input runs to, by name, where ``inputs`` does not say it."""
    duration: float | None = None
    step: float | None = None
    parameters: tuple[str, ...] = ()
    """Parameters that have to change something; default: all that can."""
    alternatives: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """Values to try such a parameter with, one after the other; default: 1 % off what it declares."""
    tolerance: float | None = None
    kind: Kind | None = None
    input_mode: str | None = None

    def communication_points(self, description: FmuDescription, *, cut: bool = False) -> FloatArray:
        """Return the communication points, (n,) s."""
        if self.time is not None:
            return self.time
        return probe.trial_time(description, duration=self.duration, step=self.step, cut=cut)
