"""Mutations of an FMU: of its description, its entries, its binaries, and of the archive's own bytes."""

import io
import re
import stat
import warnings
import zipfile
from pathlib import Path
from random import Random

from fuzzing.raw import ODD_NUMBERS, ODD_TEXT, misspell, mutate_bytes

DESCRIPTION = "modelDescription.xml"
BINARY = re.compile(r"^binaries/(linux64|x86_64-linux)/.*\.so$")


def write_mutated(rng: Random, source: Path, target: Path, outside: Path) -> None:
    """Write a mutated copy of the FMU ``source``; entries that try to leave the archive aim at ``outside``."""
    with zipfile.ZipFile(source) as archive:
        entries = {info.filename: archive.read(info) for info in archive.infolist() if not info.is_dir()}
    # Without what does not matter here, an archive is written in milliseconds.
    entries = {n: d for n, d in entries.items() if n == DESCRIPTION or BINARY.match(n)}
    binary = next(name for name in entries if BINARY.match(name))
    way = rng.randrange(10)
    if way < 5:
        entries[DESCRIPTION] = _mutate_description(rng, entries[DESCRIPTION])
    elif way == 5:
        entries[binary] = _mutate_binary(rng, entries[binary])
    content = _pack(rng, entries, outside) if way == 6 else _plain(entries)
    if way == 7:
        content = mutate_bytes(rng, content)
    elif way == 8:  # the directory at the end, by which everything is found
        content = content[:-600] + mutate_bytes(rng, content[-600:], most=3)
    elif way == 9:
        name = rng.choice(tuple(entries))
        entries[rng.choice((name.upper(), misspell(rng, name), "binaries/win64/x.dll"))] = entries.pop(name)
        content = _plain(entries)
    target.write_bytes(content)


def _plain(entries: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, data in entries.items():
            archive.writestr(name, data)
    return buffer.getvalue()


def _pack(rng: Random, entries: dict[str, bytes], outside: Path) -> bytes:
    """Pack with one entry that no FMU should have."""
    buffer = io.BytesIO()
    with (
        zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore", UserWarning)  # a name that comes twice
        for name, data in entries.items():
            archive.writestr(name, data)
        escapes = [f"{'../' * k}evil_{k}" for k in range(1, 7)]
        escapes += [str(outside / "evil"), f"binaries/../{'../' * 3}evil", "..\\evil", "resources/../../evil"]
        match rng.randrange(6):
            case 0 | 1:
                archive.writestr(rng.choice(escapes), b"evil")
            case 2:
                info = zipfile.ZipInfo("resources/link")
                info.external_attr = (stat.S_IFLNK | 0o777) << 16
                archive.writestr(info, str(outside))
                archive.writestr("resources/link/evil", b"evil")
            case 3:
                archive.writestr(DESCRIPTION, rng.choice((b"", b"<x/>", entries[DESCRIPTION])))
            case 4:
                archive.writestr(
                    rng.choice(("con", "a" * 300, "resources", "binaries", "x\0y", "é" * 130)), b"x"
                )
            case 5:
                archive.writestr("resources/zeros", bytes(20_000_000))
    return buffer.getvalue()


def _mutate_binary(rng: Random, data: bytes) -> bytes:
    head = min(len(data), 4096)
    match rng.randrange(4):
        case 0:
            return b""
        case 1:
            return data[: rng.randrange(len(data))]
        case 2:  # the headers by which the loader finds its way
            return mutate_bytes(rng, data[:head], most=2) + data[head:]
    return data[:head] + mutate_bytes(rng, data[head:])


def _mutate_description(rng: Random, data: bytes) -> bytes:
    text = data.decode("utf-8")
    for _ in range(rng.choice((1, 1, 2, 4))):
        text = _mutate_xml(rng, text)
    if rng.random() < 0.1:
        return mutate_bytes(rng, text.encode())
    encoding = rng.choice(("utf-8",) * 12 + ("utf-16", "latin-1", "utf-32"))
    return text.encode(encoding, errors="xmlcharrefreplace")


def _mutate_xml(rng: Random, text: str) -> str:
    """Change one attribute or element of an XML text, or what stands before it."""
    attributes = list(re.finditer(r' ([\w:]+)="([^"]*)"', text))
    elements = list(re.finditer(r"<(\w+)([^<>]*)>", text))
    way = rng.randrange(10)
    if way < 6 and attributes:
        # The first attributes are the model's own; the variables' would drown them.
        found = rng.choice(attributes[:25] if rng.random() < 0.4 else attributes)
        key, value = found.groups()
        match way:
            case 0:
                return text[: found.start()] + text[found.end() :]
            case 1:
                key = misspell(rng, key)
            case 2:
                value = rng.choice(attributes).group(2)
            case _:
                value = str(rng.choice(ODD_NUMBERS if rng.random() < 0.5 else ODD_TEXT))
                value = value.replace("&", "").replace("<", "").replace('"', "")
        return f'{text[: found.start()]} {key}="{value}"{text[found.end() :]}'
    if not elements:
        return rng.choice(ODD_TEXT)
    found = rng.choice(elements[:12] if rng.random() < 0.4 else elements)
    match way:
        case 6:
            return text[: found.start()] + text[found.end() :]
        case 7:
            return text[: found.end()] + found.group() + text[found.end() :]
        case 8:
            line = text[: found.start()].rfind("\n") + 1
            end = text.find("\n", found.end())
            return text[:line] + text[end + 1 :] if end >= 0 else text[:line]
    bomb = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">' + "".join(
        f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True)
    )
    outsider = '<!DOCTYPE x [<!ENTITY i SYSTEM "file:///etc/passwd">'
    start = text.find("<fmiModelDescription")
    described = text[start:].replace('description="', 'description="&i;', 1)
    return text[:start] + rng.choice((bomb, outsider)) + "]>" + described
