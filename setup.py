"""What pyproject.toml cannot say: the folders beside the package go into the wheel, and so does plotly's script."""

import shutil
from pathlib import Path

from plotly.offline import get_plotlyjs
from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
SHIPPED = ("modelica", "fmus", "scenarios")
"""Folders that ``thsa_cosim.shipped`` finds in the package ``_shipped``."""
SCRIPT = Path("thsa_cosim", "report", "page", "templates", "plotly.min.js")
"""Where ``thsa_cosim.report.page.write`` looks for the script: 5 MB, instead of 70 MB for plotly itself."""


class BuildWithData(build_py):
    """Copies the shipped folders and the script; an editable installation finds both where they are."""

    def run(self) -> None:
        """Build, then copy into the build folder."""
        super().run()
        self._copied: list[str] = []
        if self.editable_mode:
            return
        target = Path(self.build_lib, "thsa_cosim", "_shipped")
        shutil.rmtree(target, ignore_errors=True)
        for name in SHIPPED:
            shutil.copytree(ROOT / name, target / name, ignore=shutil.ignore_patterns("__pycache__", ".*"))
        script = Path(self.build_lib, SCRIPT)
        script.write_text(get_plotlyjs(), encoding="utf-8")
        self._copied = [str(path) for path in (*target.rglob("*"), script) if path.is_file()]

    def get_outputs(self, include_bytecode: bool = True) -> list[str]:
        """List what was written, the copies too."""
        return [*super().get_outputs(include_bytecode), *getattr(self, "_copied", [])]


setup(cmdclass={"build_py": BuildWithData})
