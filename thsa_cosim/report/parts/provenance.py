"""Where the numbers come from: digests, seed, versions, settings, and the command to repeat the study."""

import datetime

from thsa_cosim import __version__
from thsa_cosim.report.folder import Json, Part, Study
from thsa_cosim.report.parts.content import Block, Facts, Section, Text


def provenance(study: Study) -> Section:
    """The section; what an older study did not keep is left out."""
    whole = study.whole
    about, result = whole.about, whole.result or {}
    facts: list[tuple[str, str]] = []
    if about.get("command"):
        facts.append(("command", str(about["command"])))
    facts.append(("study folder", str(whole.folder)))
    scenario = result.get("scenario") or about.get("scenario")
    if scenario:
        facts.append(("scenario", str(scenario)))
    for part in study.parts:
        facts += _fmu(part, study.in_stages)
    seed = result.get("seed")
    if seed is not None:
        facts.append(("seed", str(seed)))
    for part in study.parts:
        settings = (part.result or {}).get("settings")
        if settings:
            facts.append((_label("search", part, study.in_stages), _flat(settings)))
    facts.append(
        ("thsa-cosim", str(result.get("version") or about.get("versions", {}).get("thsa-cosim", "")))
    )
    others = {k: v for k, v in about.get("versions", {}).items() if k != "thsa-cosim"}
    if others:
        facts.append(("versions", _flat(others)))
    if about.get("system"):
        facts.append(("system", str(about["system"])))
    if about.get("started"):
        facts.append(("started", f"{about['started']} in {about.get('directory', 'an unknown folder')}"))
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    facts.append(("page written", f"{now}, thsa-cosim {__version__}"))
    blocks: list[Block] = [Facts(facts, code=True)]
    if about.get("command"):
        blocks.insert(0, Text("The first line repeats the study, or continues it where it stopped."))
    return Section("provenance", "Provenance", tuple(blocks))


def _fmu(part: Part, labelled: bool) -> list[tuple[str, str]]:
    if not part.fmu.get("path"):
        return []
    digest = f", SHA-256 {part.fmu['sha256']}" if part.fmu.get("sha256") else ""
    return [(_label("FMU", part, labelled), f"{part.fmu['path']}{digest}")]


def _label(text: str, part: Part, labelled: bool) -> str:
    return f"{text} ({part.name})" if labelled else text


def _flat(values: Json) -> str:
    """``population 45, generations 30, …``: what nests is written as key.inner."""
    flat = []
    for key, value in values.items():
        if isinstance(value, dict):
            flat += [f"{key}.{inner} {item}" for inner, item in value.items()]
        elif value not in ([], None):
            flat.append(f"{key} {value}")
    return ", ".join(flat)
