"""Sources, libraries and model description → an ``.fmu`` archive."""

import hashlib
import shutil
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import gmtime, strftime

from thsa_cosim.export.codegen import config_header, identifier, model_source, start_source
from thsa_cosim.export.compile import PLATFORMS, Platform, compile_library
from thsa_cosim.export.description import build_description, fmi2_description, fmi3_description
from thsa_cosim.export.model import CausalModel

RUNTIME = Path(__file__).parent / "runtime"
_HEADERS = {
    2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}


@dataclass(frozen=True)
class Sources:
    """All C files of one FMU by name; ``compiled`` are those to pass to a compiler; ``digest`` is over all of them."""

    files: dict[str, bytes]
    compiled: tuple[str, ...]
    digest: str
    token: str
    identifier: str


def make_sources(model: CausalModel, fmi: int) -> Sources:
    """The C sources of a model for FMI version 2 or 3. The token (guid) follows from the digest."""
    import fmpy

    name, tolerance = identifier(model.flat.name), model.flat.experiment.tolerance
    source = model_source(model)
    config = config_header(model, name, tolerance, source.cache).encode()
    files = {"model.c": source.text.encode(), "model_start.c": start_source(model, "").encode()}
    other = "fmi3" if fmi == 2 else "fmi2"
    for path in sorted(RUNTIME.glob("*.[ch]")):
        if not path.name.startswith(other):
            files[path.name] = path.read_bytes()
    headers = Path(fmpy.__file__).parent / "c-code"
    files |= {header: (headers / header).read_bytes() for header in _HEADERS[fmi]}
    describe = fmi2_description if fmi == 2 else fmi3_description
    digest = hashlib.sha256()
    compiled = tuple(sorted(file for file in files if file.endswith(".c")))
    described = (model, name, "", "") if fmi == 3 else (model, name, "", "", compiled)
    for text in (describe(*described), config):
        digest.update(text)
    for file in sorted(files):
        digest.update(file.encode() + b"\0" + files[file].replace(b"\r\n", b"\n") + b"\0")
    code = digest.hexdigest()
    token = f"{{{code[:8]}-{code[8:12]}-{code[12:16]}-{code[16:20]}-{code[20:32]}}}"
    files |= {"model_config.h": config, "model_start.c": start_source(model, token).encode()}
    return Sources(files, compiled, code, token, name)


def write_fmu(
    model: CausalModel, fmi: int, output: Path, *, date: float, platforms: Sequence[Platform] = PLATFORMS
) -> Sources:
    """Compile and pack an FMU; the archive appears at ``output`` only when it is complete."""
    sources = make_sources(model, fmi)
    stamp = strftime("%Y-%m-%dT%H:%M:%SZ", gmtime(date))
    entries: dict[str, bytes] = {}
    if fmi == 2:
        entries["modelDescription.xml"] = fmi2_description(
            model, sources.identifier, sources.token, stamp, sources.compiled
        )
    else:
        entries["modelDescription.xml"] = fmi3_description(model, sources.identifier, sources.token, stamp)
        entries["sources/buildDescription.xml"] = build_description(sources.identifier, sources.compiled)
    entries |= {f"sources/{name}": content for name, content in sources.files.items()}
    with tempfile.TemporaryDirectory(prefix="thsa-cosim-export-") as scratch:
        folder = Path(scratch) / "sources"
        folder.mkdir()
        for name, content in sources.files.items():
            (folder / name).write_bytes(content)
        for platform in platforms:
            place = platform.fmi2 if fmi == 2 else platform.fmi3
            if place is None:
                continue
            library = Path(scratch) / place / f"{sources.identifier}{platform.suffix}"
            library.parent.mkdir()
            compile_library(folder, sources.compiled, platform, library)
            entries[f"binaries/{place}/{library.name}"] = library.read_bytes()
        packed = Path(scratch) / "packed.fmu"
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for name in sorted(entries):
                entry = zipfile.ZipInfo(name, date_time=gmtime(max(date, 315532800))[:6])
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
                archive.writestr(entry, entries[name])
        output.parent.mkdir(parents=True, exist_ok=True)
        partial = output.with_name(output.name + ".part")
        shutil.copyfile(packed, partial)
        partial.replace(output)
    return sources
