"""The effects that a diagnosis knows: those of this package and those of a user's folder."""

import importlib.util
import pkgutil
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from thsa_cosim.diagnosis.catalogue import effects
from thsa_cosim.diagnosis.catalogue.effect import Effect
from thsa_cosim.errors import ScenarioError, did_you_mean


def known_effects(folder: Path | None = None) -> dict[str, Effect]:
    """All effects by name; those of ``folder`` (one ``.py`` file each, with an ``EFFECT``) win.

    Raises ScenarioError for a file that holds no effect.
    """
    found = [
        import_module(f"{effects.__name__}.{m.name}").EFFECT for m in pkgutil.iter_modules(effects.__path__)
    ]
    if folder is not None:
        found += [_load(file) for file in sorted(folder.glob("*.py"))]
    return {effect.name: effect for effect in found}


def choose(known: dict[str, Effect], names: Sequence[str], where: str) -> dict[str, Effect]:
    """The named effects, or all of them; ScenarioError names ``where`` for one that is unknown."""
    for name in names:
        if name not in known:
            hint = did_you_mean(name, known) or f" Known: {', '.join(known)}."
            raise ScenarioError(f"{where}: there is no effect {name!r}.{hint}")
    return {name: known[name] for name in names} if names else known


def _load(file: Path) -> Effect:
    spec = importlib.util.spec_from_file_location(f"thsa_cosim_effect_{file.stem}", file)
    if spec is None or spec.loader is None:
        raise ScenarioError(f"{file}: cannot be loaded as a Python file.")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise ScenarioError(f"{file}: cannot be loaded ({type(error).__name__}: {error}).") from error
    effect = getattr(module, "EFFECT", None)
    if not isinstance(effect, Effect):
        raise ScenarioError(
            f"{file}: holds no EFFECT of type thsa_cosim.diagnosis.Effect; see docs/diagnose.md."
        )
    return effect
