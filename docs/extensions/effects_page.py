"""The catalogue of effects, from the effects themselves."""

from thsa_cosim.diagnosis.catalogue.effect import Effect
from thsa_cosim.diagnosis.catalogue.known import known_effects

HEAD = """\
<!-- Written by docs/generate.py from thsa_cosim/diagnosis/catalogue/effects: change the effects there. -->

# The catalogue of effects

Effects that `thsa-cosim diagnose` tries. A name is followed by the place where a friction pair has several:
`stribeck:screw`. [An effect of your own](howto/own-effect.md) needs two small files.
"""


def effects_page() -> str:
    """Return the page's Markdown."""
    return "\n".join([HEAD, *(_section(effect) for _, effect in sorted(known_effects().items()))])


def _section(effect: Effect) -> str:
    places = dict.fromkeys(
        f"{variant.interface} ({', '.join(variant.slots)})" if variant.slots else variant.interface
        for variant in effect.variants
    )
    parameters = {p.name: p for variant in effect.variants for p in variant.parameters}
    return (
        f"## {effect.name}\n\n{effect.title}.\n\n"
        f"| | |\n|---|---|\n| equation | `{_cell(effect.physics)}` |\n"
        f"| shows as | {_cell(effect.signature)} |\n"
        f"| slots | {'; '.join(places)} |\n"
        f"| Modelica | {', '.join(dict.fromkeys(f'`{v.block}`' for v in effect.variants))} |\n"
        f"| parameters | {'; '.join(f'`{p.name}`: {_cell(p.description)}' for p in parameters.values())} |\n"
        f"| source | {_cell(effect.source)} |\n"
    )


def _cell(text: str) -> str:
    return text.replace("|", r"\|")
