"""Size of an installation: a wheel of this checkout in fresh environments, without extras and with each that is named.

``python benchmarks/size.py`` prints MB (10^6 bytes of all files, links not counted twice) by extra, and the largest
packages of each; ``--demo`` runs ``thsa-cosim demo`` in the last one, in an empty folder with empty caches. It needs a
package index.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
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


def run(*words: object, folder: Path = ROOT, variables: dict[str, str] | None = None) -> None:
    variables = variables or {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    subprocess.run([str(word) for word in words], cwd=folder, env=variables, check=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("extras", nargs="*", default=EXTRAS, help="Extras, such as export or export,fast.")
    parser.add_argument("--demo", action="store_true")
    asked = parser.parse_args()
    main(list(asked.extras), asked.demo)
