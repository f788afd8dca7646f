"""Maps and atlases: a zip of a JSON header and of .npy arrays, damaged in each of these, with right checksums."""

import hashlib
import io
import json
import random
import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from refseq.logs.beliefs import read_beliefs
from tests.robustness.attack import attack
from tests.robustness.attacks.cases import replays
from tests.robustness.damage import ODD_FLOATS, ODD_NUMBERS, damaged_bytes, damaged_text, damaged_tree
from tests.robustness.fuzzing import judged, run
from tests.robustness.samples import DRIVE, MAPS, samples

Members = dict[str, bytes]


@attack(
    family="files",
    promise="A damaged map is refused in one line, or answers with probabilities",
    tries=10_000,
    short=12,
)
def damaged_map(seed: int, folder: Path) -> str | None:
    rng = random.Random(seed)
    content = (samples() / rng.choice(MAPS)).read_bytes()
    (folder / "input.refseq").write_bytes(_damaged(rng, content))
    return _tried(folder / "input.refseq", folder, localised=rng.random() < 0.05)


@replays("map")
def try_map(case: Path, folder: Path) -> str | None:
    shutil.copy(case, folder / "input.refseq")
    return _tried(folder / "input.refseq", folder, localised=True)


def _tried(file: Path, folder: Path, localised: bool) -> str | None:
    if not localised:
        return judged(run(["view", file.name, "-o", "map.rrd"], folder))
    shutil.copy(samples() / DRIVE, folder)
    found = run(["localise", file.name, DRIVE, "-o", "beliefs.parquet"], folder)
    if found.code == 0:
        for answers in read_beliefs(folder / "beliefs.parquet").values():  # which sums and bounds them
            if not all(0 <= belief.lost <= 1 and np.isfinite(belief.places).all() for belief in answers):
                return "answers with what is no probability"
    return judged(found)


def _damaged(rng: random.Random, content: bytes) -> bytes:
    """A map that is damaged in its bytes, its header, an array, or in how arrays are packed."""
    if rng.random() < 0.15:
        return damaged_bytes(rng, content)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    header = json.loads(members.pop("map.json"))
    for _ in range(rng.choice((1, 1, 2))):
        name = rng.choice(sorted(members)) if members else ""
        match rng.randrange(8):
            case 0 | 1:
                header = damaged_tree(rng, header)
            case 2 | 3 | 4 if name:
                members[name] = _damaged_array(rng, members[name])
            case 5 if name:
                members[name] = _damaged_npy(rng, members[name])
            case 6 if name:
                members[name] = members[rng.choice(sorted(members))]
            case 7 if name:
                _moved(rng, members, name)
    return _packed(rng, header, members)


def _damaged_array(rng: random.Random, content: bytes) -> bytes:
    """Numbers, type or shape of an array are others; its header is right."""
    try:
        array = np.array(np.load(io.BytesIO(content), allow_pickle=False))
    except Exception:  # it was damaged before
        return damaged_bytes(rng, content)
    flat = array.reshape(-1)
    match rng.randrange(6):
        case 0 | 1 if len(flat):
            odd = ODD_FLOATS if array.dtype.kind == "f" else ODD_NUMBERS
            for _ in range(rng.choice((1, 1, 3, 100))):
                with np.errstate(all="ignore"):
                    flat[rng.randrange(len(flat))] = np.array(rng.choice(odd)).astype(array.dtype)
        case 2 if len(flat):
            flat[:] = np.roll(flat, 1) if rng.random() < 0.5 else flat[::-1].copy()
        case 3:
            types = ("f8", "f4", "f2", "i8", "i4", "u1", "u8", "?", "c16", "U3", "S5", ">f8", ">i4")
            array = array.astype(rng.choice(types))
        case 4:
            array = array[: rng.randrange(len(array) + 1)] if array.ndim else array
        case _:
            array = rng.choice((array[None], array.T, flat, np.concatenate([array, array]), np.float64(3)))
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def _damaged_npy(rng: random.Random, content: bytes) -> bytes:
    """The header of an array is another; or its bytes are."""
    if rng.random() < 0.3:
        return damaged_bytes(rng, content)
    header, rest = content[10:].split(b"\n", 1)
    text = damaged_text(rng, header.decode(), ("'<f8'", "'|O'", "True", "(10000000000,)", "()", "1e9", "(" * 300, "L"))
    made = text.encode() + b"\n"
    return content[:8] + (len(made) % 2**16).to_bytes(2, "little") + made + rest


def _moved(rng: random.Random, members: Members, name: str) -> None:
    """An array is called otherwise, or is not there."""
    content = members.pop(name)
    if rng.random() < 0.5:
        members[damaged_text(rng, name)[:200].replace("\0", "") or "a"] = content


def _packed(rng: random.Random, header: Any, members: Members) -> bytes:
    """An archive with right checksums, mostly."""
    if isinstance(header, dict) and rng.random() < 0.95:
        header["sha256"] = {name.removesuffix(".npy"): hashlib.sha256(one).hexdigest() for name, one in members.items()}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", rng.choice((zipfile.ZIP_DEFLATED, zipfile.ZIP_STORED))) as archive:
        archive.writestr("map.json", json.dumps(header).encode("utf-8", "surrogatepass"))
        for name, content in members.items():
            archive.writestr(name, content)
    packed = buffer.getvalue()
    return damaged_bytes(rng, packed) if rng.random() < 0.05 else packed


@attack(
    family="files",
    promise="A map that declares or unpacks to gigabytes is refused before they are allocated",
    tries=30,
    short=1,
)
def map_bomb(seed: int, folder: Path) -> str | None:
    rng = random.Random(seed)
    with zipfile.ZipFile(samples() / "thesis.refseq") as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    header = json.loads(members.pop("map.json"))
    name = rng.choice(sorted(members))
    size = rng.choice((600, 1000, 2000)) << 20
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({size // 8},), }}".ljust(117) + "\n"
    start = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode()
    with zipfile.ZipFile(folder / "input.refseq", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("map.json", json.dumps(header))
        for other in members.keys() - {name}:
            archive.writestr(other, members[other])
        with archive.open(name, "w", force_zip64=False) as file:
            file.write(start)
            for _ in range(size >> 20):
                file.write(bytes(1 << 20))
    return judged(run(["view", "input.refseq", "-o", "map.rrd"], folder))
