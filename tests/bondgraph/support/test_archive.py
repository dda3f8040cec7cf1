"""Archives: equal after reopening, equal bytes, whole or absent, and safe to open."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from bondgraph.signals.files import checks
from bondgraph.support import archive
from bondgraph.support import whole_file as atomic
from bondgraph.support.archive import archive_schema, read_archive, write_archive
from bondgraph.support.errors import BondsightError, UnusableInput

shared = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
leaves = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8)
keys = st.text(max_size=6).filter(lambda k: not k.startswith("$"))
documents = st.dictionaries(
    keys,
    st.recursive(
        leaves,
        lambda s: (
            st.lists(s, max_size=3)
            | st.lists(s, max_size=3).map(tuple)
            | st.dictionaries(keys, s, max_size=3)
        ),
        max_leaves=12,
    ),
    max_size=4,
)
kinds = st.sampled_from(["<f8", ">f8", "<f4", "<i8", "|u1", "|b1", "<c16", "<U3"])
tables = st.dictionaries(
    st.text(min_size=1, max_size=6),
    kinds.flatmap(lambda k: hnp.arrays(k, hnp.array_shapes(min_dims=0, min_side=0, max_dims=3))),
    max_size=4,
)


def same(a: Any, b: Any) -> bool:
    """Equal with types, order, signs of zero and NaN."""
    if type(a) is not type(b):
        return False
    if isinstance(a, float):
        return (math.isnan(a) and math.isnan(b)) or (a == b and repr(a) == repr(b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return bool(a == b)


@shared
@given(document=documents, arrays=tables)
def test_round_trip_is_exact(
    tmp_path: Path, document: dict[str, Any], arrays: dict[str, Any]
) -> None:
    file = tmp_path / "a.npz"
    first = write_archive(file, "demo/1", document, arrays)
    body = file.read_bytes()
    back, values = read_archive(file, "demo/1")
    assert same(back, document)
    assert list(values) == list(arrays)
    for name, a in arrays.items():
        assert values[name].dtype == a.dtype
        assert values[name].shape == a.shape
        assert values[name].tobytes() == a.tobytes()
    # equal content, equal bytes; another name of the file changes nothing
    assert write_archive(tmp_path / "b.npz", "demo/1", back, values) == first
    assert (tmp_path / "b.npz").read_bytes() == body
    assert archive_schema(file) == "demo/1"


def test_numpy_alone_opens_it(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    x = np.arange(6.0).reshape(2, 3)
    write_archive(file, "demo/1", {"unit": "m"}, {"x": x, "X": 2 * x, "a/b c": x, "...": x})
    with np.load(file, allow_pickle=False) as stored:
        assert np.array_equal(stored["x"], x)
        assert json.loads(stored["document.json"])["document"] == {"unit": "m"}
        assert "a_b_c" in stored.files
    _, back = read_archive(file, "demo/1")
    assert np.array_equal(back["X"], 2 * x)
    assert list(back) == ["x", "X", "a/b c", "..."]


def test_fortran_order_and_views_keep_their_values(tmp_path: Path) -> None:
    x = np.asfortranarray(np.arange(12.0).reshape(3, 4))
    write_archive(tmp_path / "a.npz", "demo/1", {}, {"x": x, "v": x[::2, 1]})
    _, back = read_archive(tmp_path / "a.npz", "demo/1")
    assert np.array_equal(back["x"], x)
    assert np.array_equal(back["v"], x[::2, 1])


@pytest.mark.parametrize(
    ("document", "arrays", "expected"),
    [
        ({"a": {1}}, {}, r"\['a'\]: is a set"),
        ({"a": [np.zeros(2)]}, {}, r"\['a'\]\[0\]: is an array"),
        ({"$a": 1}, {}, "does not begin with"),
        ({1: 1}, {}, "the key 1"),
        ({}, {"x": np.array([None])}, "object"),
        ({}, {"x": np.zeros(2, dtype=[("a", "f8")])}, "store numbers"),
        ({"a": 1 << 9000}, {}, "bits"),
    ],
)
def test_what_cannot_be_stored(tmp_path: Path, document: Any, arrays: Any, expected: str) -> None:
    with pytest.raises(UnusableInput, match=expected):
        write_archive(tmp_path / "a.npz", "demo/1", document, arrays)
    assert list(tmp_path.iterdir()) == []
    deep: list[Any] = []
    for _ in range(100):
        deep = [deep]
    with pytest.raises(UnusableInput, match="levels"):
        write_archive(tmp_path / "a.npz", "demo/1", {"a": deep}, {})
    with pytest.raises(UnusableInput, match="is no schema"):
        write_archive(tmp_path / "a.npz", "demo", {}, {})


def opened(file: Path, schema: str = "demo/1") -> str:
    """Return the one line of the refusal."""
    with pytest.raises(UnusableInput) as info:
        read_archive(file, schema)
    text = str(info.value)
    assert "\n" not in text
    assert file.name in text
    return text


def test_other_and_newer_schemas(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    write_archive(file, "demo/2", {}, {})
    assert "this version reads demo/1; update Bondsight" in opened(file)
    assert "saved as demo/2 by bondsight" in opened(file)
    assert "open it with the version that wrote it" in opened(file, "demo/3")
    assert "holds 'demo', not 'fit'" in opened(file, "fit/1")
    np.savez(file, x=np.zeros(2))
    assert "Bondsight did not save it" in opened(file)
    assert archive_schema(file) is None
    file.write_bytes(b"not a zip")
    assert "damaged" in opened(file)
    assert archive_schema(file) is None
    assert "no such file" in opened(tmp_path / "none.npz")


def rewritten(file: Path, change: Any) -> Path:
    """Write the archive again with other entries."""
    with zipfile.ZipFile(file) as old:
        entries = {n: old.read(n) for n in old.namelist()}
    change(entries)
    out = file.with_name("changed.npz")
    with zipfile.ZipFile(out, "w") as new:
        for n, body in entries.items():
            new.writestr(n, body)
    return out


def edit(key: str, value: Any) -> Any:
    def change(entries: dict[str, bytes]) -> None:
        head = json.loads(entries["document.json"])
        head[key] = value
        entries["document.json"] = json.dumps(head).encode()

    return change


def test_changed_content_is_noticed(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    write_archive(file, "demo/1", {"k": 1.0}, {"x": np.arange(4.0)})

    def other_values(entries: dict[str, bytes]) -> None:
        entries["x.npy"] = entries["x.npy"][:-1] + b"\x01"

    def bomb(entries: dict[str, bytes]) -> None:
        head = json.loads(entries["document.json"])
        head["arrays"]["x"]["shape"] = [1 << 40]
        digest = archive._content_digest({k: head[k] for k in ("schema", "document", "arrays")})
        entries["document.json"] = json.dumps({**head, "sha256": digest}).encode()

    assert "does not match its checksum" in opened(rewritten(file, other_values))
    assert "does not match its checksum" in opened(rewritten(file, edit("document", {"k": 2.0})))
    assert "GiB" in opened(rewritten(file, bomb))
    assert "format 'bondsight-archive/9'" in opened(
        rewritten(file, edit("format", "bondsight-archive/9"))
    )
    assert "'sha256' is missing" in opened(rewritten(file, edit("sha256", None)))
    assert "damaged" in opened(rewritten(file, lambda e: e.pop("x.npy")))


@shared
@given(at=st.integers(0, 10_000), value=st.integers(0, 255), cut=st.integers(0, 10_000))
def test_damage_is_one_line_or_harmless(tmp_path: Path, at: int, value: int, cut: int) -> None:
    file = tmp_path / "a.npz"
    x = np.arange(40.0)
    write_archive(file, "demo/1", {"k": [1.0, "text"]}, {"x": x})
    body = bytearray(file.read_bytes())
    body[at % len(body)] = value
    file.write_bytes(bytes(body))
    try:
        document, arrays = read_archive(file, "demo/1")
    except BondsightError as error:
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert document == {"k": [1.0, "text"]}
        assert np.array_equal(arrays["x"], x)
    file.write_bytes(bytes(body)[: cut % len(body)])
    with pytest.raises(BondsightError):
        read_archive(file, "demo/1")


def test_unpacking_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "a.npz"
    write_archive(file, "demo/1", {}, {"x": np.zeros(1000)})
    monkeypatch.setattr(checks, "MAX_BYTES", 12_000)
    read_archive(file, "demo/1")
    out = file.with_name("bomb.npz")
    with zipfile.ZipFile(file) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for n in old.namelist():
            new.writestr(n, old.read(n))
        new.writestr("more", b"\0" * 20_000)
    assert out.stat().st_size < 12_000
    assert "unpacks to" in opened(out)


def test_an_error_leaves_the_old_file(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_text("old")

    def half() -> None:
        with atomic.replacing(file) as stream:
            stream.write(b"new, but only ")
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half"):
        half()
    assert file.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    with pytest.raises(UnusableInput, match="no regular file"), atomic.replacing(tmp_path):
        pass
    with pytest.raises(UnusableInput, match="cannot be written") as refused:
        write_archive(tmp_path / "none" / "a.npz", "demo/1", {}, {})
    assert str(tmp_path / "none" / "a.npz") in str(refused.value)


def test_a_link_is_followed(tmp_path: Path) -> None:
    real, link = tmp_path / "real.npz", tmp_path / "link.npz"
    real.write_bytes(b"")
    link.symlink_to(real)
    write_archive(link, "demo/1", {"a": 1}, {})
    assert link.is_symlink()
    assert read_archive(real, "demo/1")[0] == {"a": 1}


KILLED = """
import sys
from pathlib import Path
import numpy as np
from bondgraph.support.archive import write_archive
i = 0
while True:
    i += 1
    write_archive(Path(sys.argv[1]), "demo/1", {"i": i}, {"x": np.full(200_000, float(i))})
    if i == 1:
        print("ready", flush=True)
"""


def test_a_killed_writer_leaves_a_whole_file(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    for pause in (0.0, 0.013):
        process = subprocess.Popen(
            [sys.executable, "-c", KILLED, str(file)], stdout=subprocess.PIPE, cwd=os.getcwd()
        )
        assert process.stdout is not None
        assert process.stdout.readline().strip() == b"ready"
        time.sleep(pause)
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        document, arrays = read_archive(file, "demo/1")
        assert np.all(arrays["x"] == document["i"])
