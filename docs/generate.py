"""Write the reference pages that follow from the code: the scenario file, the commands, the effects.

    python docs/generate.py [--check]

``--check`` changes nothing and ends with exit code 1 if a page is stale. What the pages say stands in the code: in the
docstrings of the tables' classes and keys (``thsa_cosim/scenario``), in the commands' help (``thsa_cosim/cli``) and in
the effects (``thsa_cosim/diagnosis/catalogue/effects``).
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

from cli_page import cli_page
from effects_page import effects_page
from scenario_page import scenario_page

DOCS = Path(__file__).parent
PAGES = {"scenario.md": scenario_page, "cli.md": cli_page, "effects.md": effects_page}


def main() -> int:
    """Write, or compare, every page."""
    stale = []
    for name, make in PAGES.items():
        path, text = DOCS / name, make()
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            stale.append(name)
            if "--check" not in sys.argv:
                path.write_text(text, encoding="utf-8")
    if stale:
        print(f"{'stale' if '--check' in sys.argv else 'written'}: {', '.join(stale)}")
    return 1 if stale and "--check" in sys.argv else 0


if __name__ == "__main__":
    sys.exit(main())
