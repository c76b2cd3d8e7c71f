"""Counts of the code: lines, files, rooms, and arrows between what imports and what is imported."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
from size import code

FILES = {
    "__init__.py": "from thsa_cosim.errors import Error\n",  # the package itself is no room
    "errors.py": "class Error(Exception):\n    pass\n",
    "a/__init__.py": "",
    "a/one.py": "from thsa_cosim.b import two\nfrom thsa_cosim.b.two import f\nimport thsa_cosim.errors\nimport json\n",
    "a/three.py": "from thsa_cosim.a.one import two\n",  # inside a room: no arrow
    "b/__init__.py": "",
    "b/two.py": "def f():\n" + "    pass\n" * 69 + "\n\ndef g():\n" + "    pass\n" * 68,
    "diagnosis/__init__.py": "",
    "diagnosis/run.py": "def h():\n    from thsa_cosim.diagnosis.x.y import z\n",
    "diagnosis/x/__init__.py": "",
    "diagnosis/x/y.py": "z = 1\n" * 401,
    "c/runtime.c": "int x;\nint y;\n",
    "c/data.txt": "no code\n",
}


def test_what_a_package_holds_is_counted(tmp_path: Path):
    for name, text in FILES.items():
        path = tmp_path / "thsa_cosim" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    assert code(tmp_path) == {
        "lines of Python": sum(len(t.splitlines()) for n, t in FILES.items() if n.endswith(".py")),
        "lines of C": 2,
        "files of Python": 11,
        "files above 400 lines": 1,
        "functions": 3,
        "functions of 70 lines and more": 1,
        "rooms": 3,  # a, b, diagnosis; c holds no Python
        "arrows": 2,  # a to b, a to errors
        "rooms and modules in diagnosis": 2,
        "arrows in diagnosis": 1,
    }
