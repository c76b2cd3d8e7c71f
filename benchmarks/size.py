"""Size of an installation: a wheel of this checkout in fresh environments, without extras and with each that is named.

``python benchmarks/size.py`` prints MB (10^6 bytes of all files, links not counted twice) by extra, and the largest
packages of each; ``--demo`` runs ``thsa-cosim demo`` in the last one, in an empty folder with empty caches. It needs a
package index.

``python benchmarks/size.py --code REVISION`` installs nothing and prints lines, files, rooms and arrows of the package
at that revision and in this checkout: a room is a subpackage, an arrow leads from a room or a single module to one that
it imports.
"""

import argparse
import ast
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = "thsa_cosim"
EXTRAS = ("", "export-host", "export", "export,fast,notebook")


def main(extras: list[str], demo: bool) -> None:
    with tempfile.TemporaryDirectory(prefix="size") as temporary:
        folder = Path(temporary)
        wheel = built(folder)
        environment = folder
        for extra in extras:
            environment = folder / (extra.replace(",", "-") or "bare")
            run(sys.executable, "-m", "venv", environment)
            wanted = f"{wheel}[{extra}]" if extra else str(wheel)
            run(environment / "bin" / "python", "-m", "pip", "install", "--quiet", "--no-cache-dir", wanted)
            sizes = by_package(environment)
            largest = ", ".join(f"{name} {size:.0f}" for name, size in sizes.most_common(9))
            print(f"{extra or 'no extras':24} {sum(sizes.values()):6.0f} MB: {largest}", flush=True)
        if demo:
            timed_demo(environment, folder)


def built(folder: Path) -> Path:
    """The wheel of this checkout; ``setup.py`` writes into ``build``, so that a copy is built."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout
    for name in filter(None, listed.decode().split("\0")):
        if (source := ROOT / name).is_file():
            target = folder / "source" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(source.read_bytes())
    run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", folder, folder / "source")
    return next(folder.glob("*.whl"))


def by_package(environment: Path) -> Counter[str]:
    """10^6 bytes by the first folder in ``site-packages``; what else is in the environment counts as "other"."""
    sizes: Counter[str] = Counter()
    inside = next((environment / "lib").glob("python3*")) / "site-packages"
    for path in environment.rglob("*"):
        if path.is_file() and not path.is_symlink():
            name = path.relative_to(inside).parts[0].split(".")[0] if inside in path.parents else "other"
            sizes[name] += path.stat().st_size * 1e-6
    return sizes


def timed_demo(environment: Path, folder: Path) -> None:
    empty = folder / "empty"
    empty.mkdir()
    variables = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    variables |= {"XDG_CACHE_HOME": str(folder / "cache"), "HOME": str(folder / "home")}
    begin, before = time.monotonic(), os.times()
    run(environment / "bin" / "thsa-cosim", "demo", folder=empty, variables=variables)
    used = os.times()
    cpu = used.children_user + used.children_system - before.children_user - before.children_system
    print(f"demo: {time.monotonic() - begin:.1f} s, {cpu:.1f} CPU s")


def compare_code(revision: str) -> None:
    """Print what the package holds at ``revision`` and here."""
    with tempfile.TemporaryDirectory(prefix="size") as temporary:
        before = Path(temporary)
        archive = subprocess.run(
            ["git", "archive", revision, PACKAGE], cwd=ROOT, stdout=subprocess.PIPE, check=True
        )
        subprocess.run(["tar", "-x", "-C", before], input=archive.stdout, check=True)
        columns = code(before), code(ROOT)
    print(f"{'':36} {revision[:12]:>12} {'here':>12}")
    for name in columns[0]:
        print(f"{name:36} {columns[0][name]:12,d} {columns[1][name]:12,d}")


def code(root: Path) -> dict[str, int]:
    """Counts of the package in ``root``."""
    package = root / PACKAGE
    texts = {path.relative_to(root): path.read_text(encoding="utf-8") for path in package.rglob("*.py")}
    c = [path for path in package.rglob("*") if path.suffix in (".c", ".h")]
    trees = {_module(path): ast.parse(text) for path, text in texts.items()}
    lengths = [len(text.splitlines()) for text in texts.values()]
    functions = [
        (node.end_lineno or node.lineno) - node.lineno + 1
        for tree in trees.values()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]
    inside = {name.split(".")[2] for name in trees if name.startswith(f"{PACKAGE}.diagnosis.")}
    return {
        "lines of Python": sum(lengths),
        "lines of C": sum(len(path.read_text(encoding="utf-8").splitlines()) for path in c),
        "files of Python": len(lengths),
        "files above 400 lines": sum(length > 400 for length in lengths),
        "functions": len(functions),
        "functions of 70 lines and more": sum(length >= 70 for length in functions),
        "rooms": sum(path.is_dir() and any(path.glob("*.py")) for path in package.iterdir()),
        "arrows": len(_arrows(trees, PACKAGE)),
        "rooms and modules in diagnosis": len(inside),
        "arrows in diagnosis": len(_arrows(trees, f"{PACKAGE}.diagnosis")),
    }


def _module(path: Path) -> str:
    return ".".join(path.with_suffix("").parts).removesuffix(".__init__")


def _arrows(trees: dict[str, ast.Module], parent: str) -> set[tuple[str, str]]:
    """Pairs of children of ``parent`` of which the first imports from the second."""
    found = set()
    for name, tree in trees.items():
        for node in ast.walk(tree):
            imported: list[str] = []
            if isinstance(node, ast.ImportFrom) and node.module:
                whole = [f"{node.module}.{alias.name}" for alias in node.names]
                imported = [full if full in trees else node.module for full in whole]
            elif isinstance(node, ast.Import):
                imported = [alias.name for alias in node.names]
            ends = [(_child(name, parent), _child(other, parent)) for other in imported]
            found |= {(one, other) for one, other in ends if one and other and one != other}
    return found


def _child(name: str, parent: str) -> str:
    """The child of ``parent`` that holds the module; "" for none."""
    return name.removeprefix(f"{parent}.").split(".")[0] if name.startswith(f"{parent}.") else ""


def run(*words: object, folder: Path = ROOT, variables: dict[str, str] | None = None) -> None:
    variables = variables or {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    subprocess.run([str(word) for word in words], cwd=folder, env=variables, check=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("extras", nargs="*", default=EXTRAS, help="Extras, such as export or export,fast.")
    parser.add_argument("--demo", action="store_true")
    parser.add_argument("--code", metavar="REVISION", help="Count the code there and here, install nothing.")
    asked = parser.parse_args()
    if asked.code:
        compare_code(asked.code)
    else:
        main(list(asked.extras), asked.demo)
