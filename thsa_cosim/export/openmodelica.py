"""Modelica class → FMU by OpenModelica's ``omc``, where it is on the PATH."""

import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from thsa_cosim.errors import ModelicaError


def export_with_openmodelica(
    model: str, package: Path, fmi: int, output: Path | None, libraries: Sequence[Path] = ()
) -> Path:
    """Hand a class to ``omc`` (``buildModelFMU``); raises ModelicaError when omc is missing or refuses it."""
    omc = shutil.which("omc")
    if omc is None:
        raise ModelicaError(
            "--compiler omc needs OpenModelica's omc on the PATH; install OpenModelica or leave the option out."
        )
    if fmi != 2:
        raise ModelicaError("--compiler omc exports FMI 2 only; use --fmi 2 or leave --compiler out.")
    from thsa_cosim.export.flatten import locate

    file, name = locate(model, package, libraries)
    target = (output or Path(name.rsplit(".", 1)[-1] + ".fmu")).resolve()
    loads = (
        [f'loadFile("{(package / "package.mo").resolve()}");'] if (package / "package.mo").is_file() else []
    )
    for library in libraries:
        top = library / "package.mo" if library.is_dir() else library
        if top.is_file():
            loads.append(f'loadFile("{top.resolve()}");')
    if not name.startswith(package.name + "."):
        loads.append(f'loadFile("{file.resolve()}");')
    lines = [
        *loads,
        f'buildModelFMU({name}, version="2.0", fmuType="me_cs", fileNamePrefix="model"); getErrorString();',
    ]
    with tempfile.TemporaryDirectory(prefix="thsa-cosim-omc-") as scratch:
        script = Path(scratch) / "export.mos"
        script.write_text("\n".join(lines), encoding="utf-8")
        done = subprocess.run([omc, str(script)], cwd=scratch, capture_output=True, text=True)
        made = Path(scratch) / "model.fmu"
        if done.returncode or not made.is_file():
            said = " ".join((done.stdout + done.stderr).split())[-400:]
            raise ModelicaError(f"{file}: OpenModelica did not export {name}: {said}")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(made, target)
    return target
