"""A study folder → one HTML file that needs nothing else: style, script, plotly and data are inside."""

import base64
import contextlib
import hashlib
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import groupby
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from thsa_cosim import __version__
from thsa_cosim.errors import InputError, MissingExtraError
from thsa_cosim.report.diagnose.structure import attribution, structure
from thsa_cosim.report.diagnose.verdict import before_after, candidates, recordings
from thsa_cosim.report.folder import Part, Study, read_study
from thsa_cosim.report.identify.correlation import correlation
from thsa_cosim.report.identify.friction import friction
from thsa_cosim.report.identify.parameters import parameters
from thsa_cosim.report.page.summary import details, summary
from thsa_cosim.report.parts.comparison import comparison
from thsa_cosim.report.parts.content import Block, Figure, Fold, Section
from thsa_cosim.report.parts.convergence import convergence
from thsa_cosim.report.parts.data import data
from thsa_cosim.report.parts.evaluations import evaluated
from thsa_cosim.report.parts.failures import failures
from thsa_cosim.report.parts.provenance import provenance
from thsa_cosim.report.tune.gains import gains
from thsa_cosim.report.tune.pareto import pareto
from thsa_cosim.report.tune.plane import plane
from thsa_cosim.report.tune.responses import responses
from thsa_cosim.report.tune.schedule import schedule
from thsa_cosim.report.tune.start import start

PAGE = "report.html"

SectionOf = Callable[[Part], Section | None]

#: Sections of a part by kind of study, in the order of the page.
SECTIONS: dict[str, tuple[SectionOf, ...]] = {
    "identify": (data, comparison, convergence, evaluated, correlation),
    "simulate": (data, comparison),
    "diagnose": (data, attribution, before_after, structure, recordings, candidates, convergence, evaluated),
    "tune": (data, gains, responses, start, plane, schedule, pareto, convergence, evaluated),
}


@dataclass(frozen=True)
class Live:
    """A page that is written again: ``every`` s, while the study makes ``rate`` evaluations a second (0: unknown)."""

    every: float
    rate: float = 0.0


def write_page(folder: Path, output: Path | None = None, live: Live | None = None) -> Path:
    """Write the page of the study in ``folder``, finished or running; return its path.

    ``output``: the file to write; default ``report.html`` in the folder. ``live``: the browser loads the page anew.

    Raises
    ------
    InputError
        If the folder is no study, a file in it is damaged, or the page cannot be written.
    """
    study = read_study(folder)
    target = output or folder / PAGE
    heading = Heading(study.whole.kind, study.whole.title, study.status, 0.0 if live is None else live.every)
    write_html(target, render(heading, sections(study, live.rate if live else 0.0)))
    return target


def write_html(target: Path, html: str) -> None:
    """Write a page whole or not at all; InputError if it cannot be written."""
    partial = target.with_name(f"{target.name}.{os.getpid()}.part")
    try:
        partial.write_text(html, encoding="utf-8", errors="replace")
        partial.replace(target)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError(
            f"The page {target} cannot be written ({reason}); choose another file with -o."
        ) from None
    finally:
        partial.unlink(missing_ok=True)


def sections(study: Study, rate: float = 0.0) -> list[Section]:
    """All sections of a study's page that have something to show; ``rate``: evaluations a second, if it runs.

    Raises InputError if the result does not have the form that this version writes.
    """
    try:
        return list(_sections(study, rate))
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        what = " ".join(f"{type(error).__name__}: {error}".split())[:120]
        raise InputError(
            f"{study.whole.folder} holds a result that this version cannot read ({what}); "
            "repeat the study's command to write it anew."
        ) from error


def _sections(study: Study, rate: float) -> list[Section]:
    found: list[Section | None] = [summary(study, rate)]
    if study.whole.result is not None:
        found += [parameters(study.whole.result), friction(study.whole.result)]
    for part in study.parts:
        own = [section for build in SECTIONS.get(part.kind, ()) if (section := build(part)) is not None]
        if study.in_stages and own:
            own.insert(0, Section(f"{part.prefix}part", part.title, (), is_part=True))
        found += [replace(section, group=part.name) for section in own]
    found += [details(study), failures(study.parts), provenance(study)]
    return [section for section in found if section is not None]


@dataclass(frozen=True)
class Heading:
    """What stands above a page: the command that made it, a title, and how far it is."""

    kind: str
    title: str
    status: str
    again: float = 0.0
    """s, after which the browser loads the page anew; 0: never."""


def render(heading: Heading, shown: Sequence[Section]) -> str:
    """The sections as one HTML document; what comes from files is escaped by the templates."""
    environment = Environment(
        loader=PackageLoader("thsa_cosim.report.page"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    scripts = [_plotly(), _template("page.js")]
    return environment.get_template("page.html").render(
        heading=heading,
        sections=shown,
        groups=[list(members) for _, members in groupby(shown, key=lambda section: section.group)],
        figures={name: _figure_data(figure) for name, figure in figures_of(shown).items()},
        style=Markup(_template("page.css")),
        scripts=[Markup(text) for text in scripts],
        # Only these scripts may run, and nothing may be fetched: a name that slipped through could do nothing.
        script_digests=[_digest(text) for text in scripts],
        version=__version__,
    )


def figures_of(shown: Sequence[Section], details: bool = True) -> dict[str, Figure]:
    """The figures of the sections by name, in their order, with or without those of ``details``."""
    return {figure.name: figure for section in shown for figure in _figures(section.blocks, details)}


def _figure_data(figure: Figure) -> dict[str, object]:
    content = asdict(figure)
    return {"data": content["data"], "layout": content["layout"]}


def _figures(blocks: Sequence[Block], details: bool) -> list[Figure]:
    found: list[Figure] = []
    for block in blocks:
        if isinstance(block, Figure):
            found.append(block)
        elif isinstance(block, Fold) and (details or not block.details):
            found += _figures(block.blocks, details)
    return found


def _plotly() -> str:
    """Plotly's script: a wheel carries it; a checkout takes it from plotly itself."""
    with contextlib.suppress(FileNotFoundError):
        return _template("plotly.min.js")
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise MissingExtraError("A page of an editable installation", "test") from error
    script: str = get_plotlyjs()
    return script


def _template(name: str) -> str:
    return (Path(__file__).parent / "templates" / name).read_text(encoding="utf-8")


def _digest(script: str) -> str:
    """A script's digest as the Content Security Policy wants it."""
    return "sha256-" + base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
