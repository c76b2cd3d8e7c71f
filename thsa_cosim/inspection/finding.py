"""What an inspection of recordings found, as data."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

Severity = Literal["note", "warning", "error"]
Span = tuple[float, float]


@dataclass(frozen=True)
class Finding:
    """One thing to know about a recording.

    Parameters
    ----------
    recording
        Its name in results.
    channel
        The FMU's variable (of a file without a scenario: its column), or ``"time"``.
    kind
        What it is, such as ``"held-samples"``.
    severity
        ``"note"``: good to know; ``"warning"``: results may suffer; ``"error"``: results cannot be trusted.
    text
        One sentence with the figures, without the recording's name.
    where
        Stretches (from, to) in s of the recording's time; none: all of it.
    remedy
        Lines for the scenario that would deal with it; empty if there are none.
    """

    recording: str
    channel: str
    kind: str
    severity: Severity
    text: str
    where: tuple[Span, ...] = ()
    remedy: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return the finding as JSON types."""
        return {
            "recording": self.recording,
            "channel": self.channel,
            "kind": self.kind,
            "severity": self.severity,
            "where": [[float(a), float(b)] for a, b in self.where],
            "text": self.text,
            **({"remedy": self.remedy} if self.remedy else {}),
        }


_ORDER: Mapping[str, int] = {"error": 0, "warning": 1, "note": 2}


@dataclass(frozen=True)
class Inspection:
    """What is to be known about recordings, the gravest first; ``repairs`` says what was left out by consent."""

    findings: tuple[Finding, ...] = ()
    repairs: tuple[str, ...] = ()

    @classmethod
    def of(cls, findings: Iterable[Finding], repairs: tuple[str, ...] = ()) -> "Inspection":
        """Return an inspection with ``findings`` sorted by severity; the order stays within one."""
        return cls(tuple(sorted(findings, key=lambda f: _ORDER[f.severity])), repairs)

    @property
    def verdict(self) -> Literal["good", "usable", "bad"]:
        """``"bad"`` with an error among the findings, ``"usable"`` with a warning, else ``"good"``."""
        worst = min((_ORDER[f.severity] for f in self.findings), default=2)
        return ("bad", "usable", "good")[worst]

    def to_dict(self) -> dict[str, Any]:
        """Return ``data`` of ``result.json``."""
        return {
            "verdict": self.verdict,
            "findings": [f.to_dict() for f in self.findings],
            **({"repairs": list(self.repairs)} if self.repairs else {}),
        }
