"""What a check found, as data."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from thsa_cosim.fmu.plant import Reuse
from thsa_cosim.fmu.probe import Facts


class Verdict(StrEnum):
    """How a trial came out."""

    OK = "ok"
    WARNING = "warning"
    FAILED = "failed"
    NOT_TRIED = "not tried"


@dataclass(frozen=True)
class Finding:
    """One line of the report."""

    name: str
    verdict: Verdict
    text: str
    values: Mapping[str, float] = field(default_factory=dict)
    """The numbers behind the text, by name with unit."""

    def to_dict(self) -> dict[str, Any]:
        """Return the line as JSON types."""
        return {
            "name": self.name,
            "verdict": str(self.verdict),
            "text": self.text,
            "values": dict(self.values),
        }


@dataclass(frozen=True)
class CheckReport:
    """What an FMU is and what it can be trusted with."""

    path: Path
    sha256: str
    facts: Facts
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """The worst verdict among the lines that were tried; a wrong reset is a warning, as nobody has to use it.

        An FMU that could not be run is not "ok".
        """
        found = {
            Verdict.WARNING if f.verdict is Verdict.FAILED and "reset" in f.name else f.verdict
            for f in self.findings
        } | {Verdict.WARNING for f in self.findings if f.name == "runs" and f.verdict is Verdict.NOT_TRIED}
        return next((v for v in (Verdict.FAILED, Verdict.WARNING) if v in found), Verdict.OK)

    @property
    def reuse(self) -> Reuse:
        """How a runner may use instances: "reset" only where every trial of the reset came out ok.

        And where something moved until the stop time: a run that shows nothing proves nothing.
        """
        needed = [f.verdict for f in self.findings if f.name in ("runs", "whole run")]
        resets = [f.verdict for f in self.findings if f.name.startswith("reset")]
        return "reset" if resets and set(resets + needed) == {Verdict.OK} else "fresh"

    def to_dict(self) -> dict[str, Any]:
        """Return the report as JSON types."""
        return {
            "fmu": {"path": str(self.path), "sha256": self.sha256},
            "facts": self.facts.to_dict(),
            "findings": [finding.to_dict() for finding in self.findings],
            "verdict": str(self.verdict),
            "reuse": self.reuse,
        }
