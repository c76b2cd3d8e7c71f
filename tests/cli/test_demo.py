"""``thsa-cosim demo``: every step in order on a checkout whose searches were made short, and the index of its pages."""

import re
from pathlib import Path

import pytest

from thsa_cosim import cli
from thsa_cosim.cli import demo as demo_module
from thsa_cosim.fmu import sources
from thsa_cosim.report.page.index import Entry, write_index

ROOT = Path(__file__).parents[2]


@pytest.fixture
def short_checkout(tmp_path: Path) -> Path:
    """A folder like a checkout, with scenarios that search as little as they can."""
    root = tmp_path / "checkout"
    (root / "scenarios").mkdir(parents=True)
    for name in ("modelica", "fmus"):
        (root / name).symlink_to(ROOT / name)
    (root / "scenarios" / "recordings").symlink_to(ROOT / "scenarios" / "recordings")
    changes = {
        "population = 45": "population = 6",
        "generations = 30": "generations = 3",
        "points = 25": "points = 3",
        "[diagnose]\n": '[diagnose]\neffects = ["windage"]\n',
    }
    for name in ("motor", "table4", "driven"):
        text = (ROOT / "scenarios" / f"{name}.toml").read_text()
        for old, new in changes.items():
            text = text.replace(old, new)
        if name == "motor":
            text = text.replace("[recordings.time]\n", "[recordings.time]\nstop = 2.0\n")
        (root / "scenarios" / f"{name}.toml").write_text(text)
    return root


@pytest.mark.nightly
def test_the_whole_loop(
    short_checkout: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(short_checkout)
    code = cli.run_command(["demo", "--quick", "-o", "out"])
    printed = capsys.readouterr()
    assert code == 0, printed.err
    for sentence in (
        "1/5 Export",
        "$ thsa-cosim check out/THSA.fmu",
        "→ verdict: ok, ",
        "→ laws from 4 temperatures",
        "→ gains: K_p 0.12 → ",
        "→ verdict: missing-effect",
        "→ windage:motor: b_q = 6",
        "Open out/index.html",
    ):
        assert sentence in printed.out
    index = Path("out/index.html").read_text()
    links = set(re.findall(r'href="([^"]+\.html)"', index))
    assert links == {"identify/report.html", "tune/report.html", "diagnose/report.html"}
    assert all((Path("out") / link).stat().st_size > 100_000 for link in links)
    assert "windage:motor: b_q = 6" in index


def test_without_the_exporter_its_steps_are_left_out(
    short_checkout: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    ran: list[tuple[str, ...]] = []
    monkeypatch.chdir(short_checkout)
    monkeypatch.setattr(sources, "has_compiler", lambda: False)
    monkeypatch.setattr(demo_module, "_run", lambda step: ran.append(step.words))
    for name in ("_checked", "_identified", "_tuned"):
        monkeypatch.setattr(demo_module, name, lambda _: ["<done>"])
    assert cli.run_command(["demo", "-o", "out"]) == 0
    assert [words[0] for words in ran] == ["check", "identify", "tune"]
    assert Path(ran[0][1]) == Path("fmus/THSA.fmu")
    assert capsys.readouterr().out.count("left out, it needs pip install 'thsa-cosim[export]'") == 2
    assert "&lt;done&gt;" in Path("out/index.html").read_text()


def test_a_step_that_fails_ends_the_demo_with_its_name(
    short_checkout: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(short_checkout)
    monkeypatch.setattr(sources, "has_compiler", lambda: False)
    (short_checkout / "fmus").unlink()
    assert cli.run_command(["demo", "-o", "out"]) == 3
    err = capsys.readouterr().err
    assert "THSA.fmu does not exist" in err
    assert "The step 'Check what the FMU can be trusted with' failed (exit code 2)" in err


def test_in_an_empty_folder_the_demo_brings_its_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[tuple[str, ...]] = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(demo_module, "_run", lambda step: ran.append(step.words))
    for name in ("_checked", "_identified", "_tuned", "_diagnosed"):
        monkeypatch.setattr(demo_module, name, lambda _: ["<done>"])
    monkeypatch.setattr(sources, "has_compiler", lambda: False)
    assert cli.run_command(["demo", "-o", "out"]) == 0
    paths = [Path(word) for words in ran for word in words if "scenarios" in word or "fmus" in word]
    assert len(paths) >= 7
    assert all(path.is_relative_to("out") and path.is_file() for path in paths)


def test_an_index_shows_where_an_effect_sits_and_what_each_step_found(tmp_path: Path) -> None:
    picture = tmp_path / "a.png"
    picture.write_bytes(b"\x89PNG")
    entry = Entry(
        "A", "why", ("diagnose",), (), 1.0, None, picture, ("windage:motor", "stribeck:gearbox", "mine")
    )
    html = write_index(tmp_path / "index.html", "Title", [entry]).read_text()
    assert html.count('class="found"') == 2
    assert 'src="data:image/png;base64,iVBORw=="' in html
    blocks = re.findall(r'class="(found|block)".*?<text[^>]*>([^<]+)<', html, flags=re.S)
    assert [name for kind, name in blocks if kind == "found"] == ["Motor", "Gearbox"]


def test_an_index_links_only_pages_that_exist(tmp_path: Path) -> None:
    page = tmp_path / "a study" / "report.html"
    page.parent.mkdir()
    page.write_text("")
    missing = tmp_path / "b" / "report.html"
    entries = [
        Entry("A <b>", "why", ("tune", "a b.toml"), (), 1.4, page),
        Entry("B", "", (), (), 2.0, missing),
    ]
    html = write_index(tmp_path / "index.html", "Title & more", entries).read_text()
    assert re.findall(r'href="([^"]+\.html)"', html) == ["a%20study/report.html"] * 2
    assert "A &lt;b&gt;" in html
    assert "Title &amp; more" in html
    assert "thsa-cosim tune &#39;a b.toml&#39;" in html
