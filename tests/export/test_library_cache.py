"""Compiled libraries are kept by their sources: the next export of the same model starts no compiler."""

import ctypes
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from thsa_cosim.errors import MissingExtraError, ThsaCosimError
from thsa_cosim.export import compile as compiling
from thsa_cosim.export.compile import PLATFORMS, compile_library
from thsa_cosim.fmu.sources import host_compiler


@pytest.fixture
def compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[list[str]]:
    """A compiler that writes what it is called with; the commands that it got."""
    commands: list[list[str]] = []

    def run(command: list[str], *, cwd: Path, **_: object) -> subprocess.CompletedProcess[str]:
        commands.append(command)
        content = b"".join(sorted(path.read_bytes() for path in cwd.glob("*.c")))
        if b"#error" in content:
            return subprocess.CompletedProcess(command, 1, "", "model.c:1: error: no")
        Path(command[command.index("-o") + 1]).write_bytes(content)
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(compiling.subprocess, "run", run)
    monkeypatch.setattr(compiling, "ziglang_version", lambda: "1.0")
    monkeypatch.setenv("THSA_COSIM_CACHE", str(tmp_path / "cache"))
    return commands


def sources(folder: Path, **files: str) -> Path:
    folder.mkdir(exist_ok=True)
    for name, text in files.items():
        (folder / name.replace("_", ".")).write_text(text)
    return folder


def test_the_same_sources_are_compiled_once(compiler: list[list[str]], tmp_path: Path) -> None:
    first = sources(tmp_path / "first", model_c="int a;", model_h="int h;")
    second = sources(tmp_path / "second", model_c="int a;", model_h="int h;")
    for number, folder in enumerate((first, second, first)):
        compile_library(folder, ["model.c"], PLATFORMS[0], tmp_path / f"{number}.so")
        assert (tmp_path / f"{number}.so").read_bytes() == b"int a;"
    assert len(compiler) == 1


def test_a_changed_header_platform_or_compiler_is_compiled_anew(
    compiler: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = sources(tmp_path / "model", model_c="int a;", model_h="int h;")
    compile_library(folder, ["model.c"], PLATFORMS[0], tmp_path / "0.so")
    compile_library(folder, ["model.c"], PLATFORMS[1], tmp_path / "1.dll")
    sources(folder, model_h="int g;")
    compile_library(folder, ["model.c"], PLATFORMS[0], tmp_path / "2.so")
    monkeypatch.setattr(compiling, "ziglang_version", lambda: "1.1")
    compile_library(folder, ["model.c"], PLATFORMS[0], tmp_path / "3.so")
    assert len(compiler) == 4


def test_what_failed_is_not_kept(compiler: list[list[str]], tmp_path: Path) -> None:
    folder = sources(tmp_path / "model", model_c="#error")
    for _ in range(2):
        with pytest.raises(ThsaCosimError, match=r"failed for x86_64-linux-gnu.2.17: model\.c:1"):
            compile_library(folder, ["model.c"], PLATFORMS[0], tmp_path / "0.so")
    assert len(compiler) == 2


def test_a_cache_that_cannot_be_written_is_none(
    compiler: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("THSA_COSIM_CACHE", str(tmp_path / "file"))
    folder = sources(tmp_path / "model", model_c="int a;")
    for number in range(2):
        compile_library(folder, ["model.c"], PLATFORMS[0], tmp_path / f"{number}.so")
    assert len(compiler) == 2


def test_the_oldest_go_first(
    compiler: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiling, "KEPT", 2)
    for number in range(4):
        folder = sources(tmp_path / "model", model_c=f"int a{number};")
        compile_library(folder, ["model.c"], PLATFORMS[0], tmp_path / "0.so")
    assert len(list((tmp_path / "cache" / "libraries").iterdir())) == 2


def test_without_ziglang_the_machines_compiler_builds_for_this_machine_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if host_compiler() is None:
        pytest.skip("no C compiler (gcc, cc or clang)")
    monkeypatch.setattr(compiling, "ziglang_version", lambda: None)
    monkeypatch.setenv("THSA_COSIM_CACHE", "")
    folder = sources(
        tmp_path / "model", model_c='__attribute__((visibility("default"))) int seven(void){return 7;}'
    )
    (own,) = compiling.available_platforms()
    library = tmp_path / f"model{own.suffix}"
    compile_library(folder, ["model.c"], own, library)
    assert ctypes.CDLL(str(library)).seven() == 7
    other = next(platform for platform in PLATFORMS if platform != own)
    with pytest.raises(MissingExtraError, match=rf"for {other.fmi3} needs an optional part.*\[export\]"):
        compile_library(folder, ["model.c"], other, library)


def together(folders: list[Path], tmp_path: Path) -> None:
    """Compile the model of each folder, all at once."""
    with ThreadPoolExecutor(len(folders)) as pool:
        begun = [
            pool.submit(compile_library, folder, ["model.c"], PLATFORMS[0], tmp_path / f"{folder.name}.so")
            for folder in folders
        ]
        for one in begun:
            one.result()


@pytest.mark.skipif(sys.platform == "win32", reason="needs flock")
def test_zig_runs_one_at_a_time(
    compiler: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two that share a cache may deadlock (ziglang/zig, issue 22453)."""
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", str(tmp_path / "zig"))
    busy, most, run = threading.Semaphore(1), [], compiling.subprocess.run

    def slow(*args: object, **options: object) -> object:
        most.append(busy.acquire(blocking=False))
        time.sleep(0.1)
        busy.release()
        return run(*args, **options)  # type: ignore[call-overload]

    monkeypatch.setattr(compiling.subprocess, "run", slow)
    together([sources(tmp_path / str(n), model_c=f"int a{n};") for n in range(3)], tmp_path)
    assert most == [True] * 3
    together([sources(tmp_path / f"same{n}", model_c="int same;") for n in range(3)], tmp_path)
    assert len(compiler) == 4  # who waited takes what the first one has kept
    assert (tmp_path / "same2.so").read_bytes() == b"int same;"


@pytest.mark.skipif(sys.platform == "win32", reason="needs flock")
def test_zig_waits_for_that_of_another_process(
    compiler: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", str(tmp_path / "zig"))
    script = (
        "import sys; from thsa_cosim.fmu.zig import one_at_a_time\n"
        "with one_at_a_time(['ziglang']): print('holds', flush=True); sys.stdin.read()"
    )
    holder = subprocess.Popen([sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    with holder, ThreadPoolExecutor(1) as pool:
        assert holder.stdin is not None
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"holds\n"
        folder = sources(tmp_path / "model", model_c="int a;")
        begun = pool.submit(compile_library, folder, ["model.c"], PLATFORMS[0], tmp_path / "model.so")
        time.sleep(0.2)
        assert compiler == []
        holder.stdin.close()
        begun.result(timeout=10.0)
    assert len(compiler) == 1


def test_the_machines_own_compiler_waits_for_nobody(
    compiler: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiling, "ziglang_version", lambda: None)
    monkeypatch.setattr(compiling, "native_platform", lambda: PLATFORMS[0])
    monkeypatch.setattr(compiling, "host_compiler", lambda: "cc")
    monkeypatch.setattr(compiling, "_version", lambda _: "1.0")
    both, run = threading.Barrier(2), compiling.subprocess.run

    def met(*args: object, **options: object) -> object:
        both.wait(timeout=10.0)
        return run(*args, **options)  # type: ignore[call-overload]

    monkeypatch.setattr(compiling.subprocess, "run", met)
    together([sources(tmp_path / str(n), model_c=f"int a{n};") for n in range(2)], tmp_path)
    assert len(compiler) == 2
