"""An HTML page that leads to the pages of several studies."""

import base64
import os
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from thsa_cosim import __version__
from thsa_cosim.report.page.diagram import boxes


@dataclass(frozen=True)
class Entry:
    """One step: what it was for, the ``words`` of its command, its result, how long it took [s], its page.

    ``picture`` is a PNG file that shows what came out; ``effects`` what a diagnosis found, by name.
    """

    title: str
    why: str
    words: tuple[str, ...]
    outcome: tuple[str, ...]
    seconds: float
    page: Path | None
    picture: Path | None = None
    effects: tuple[str, ...] = ()

    @property
    def image(self) -> str:
        """The picture as a data URI, so that the page needs no other file; nothing where there is none."""
        if self.picture is None or not self.picture.is_file():
            return ""
        return "data:image/png;base64," + base64.b64encode(self.picture.read_bytes()).decode("ascii")

    @property
    def command(self) -> str:
        """The command line."""
        return shlex.join(["thsa-cosim", *self.words])


def write_index(path: Path, title: str, entries: Sequence[Entry]) -> Path:
    """Write the page to ``path``; pages that are not there are not linked."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader("thsa_cosim.report.page"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    style = (Path(__file__).parent / "templates" / "page.css").read_text(encoding="utf-8")
    links = [
        quote(Path(os.path.relpath(entry.page, path.parent)).as_posix())
        if entry.page is not None and entry.page.exists()
        else ""
        for entry in entries
    ]
    effects = [effect for entry in entries for effect in entry.effects]
    html = environment.get_template("index.html").render(
        title=title,
        boxes=boxes(effects),
        effects=effects,
        entries=list(zip(entries, links, strict=True)),
        style=Markup(style),
        version=__version__,
    )
    path.write_text(html, encoding="utf-8")
    return path
