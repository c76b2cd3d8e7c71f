"""What laws do that their material does not, as sentences for the terminal and the page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from thsa_cosim.report.folder import Json

Row = tuple[str, str, str]
"""Kind, severity, text."""


@dataclass(frozen=True)
class LawDoubts:
    """Doubts about an identified law and about the published one."""

    identified: Sequence[Row]
    published: Sequence[Row]

    @classmethod
    def read(cls, law: Json) -> "LawDoubts":
        """The doubts of a law as ``result.json`` holds it."""
        return cls(_rows(law), _rows(law.get("published") or {}))


def doubt_sentences(laws: Mapping[str, LawDoubts]) -> list[str]:
    """One sentence per doubt; where the published law has the same one, it is named with it."""
    sentences = []
    for name, doubts in laws.items():
        kinds = {kind for kind, _, _ in doubts.identified}
        shared = {kind for kind, _, _ in doubts.published}
        for kind, severity, text in doubts.identified:
            too = " The published law does so, too." if kind in shared else ""
            sentences.append(f"{severity}: {text}{too}")
        sentences += [
            f"{severity}: the published law of {name}: {text}"
            for kind, severity, text in doubts.published
            if kind not in kinds
        ]
    return sentences


def _rows(law: Json) -> list[Row]:
    return [(str(d["kind"]), str(d["severity"]), str(d["text"])) for d in law.get("doubts", [])]
