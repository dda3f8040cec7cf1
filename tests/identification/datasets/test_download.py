"""Downloads against a server made here: right, wrong, cut off, absent, failing at first."""

from __future__ import annotations

import hashlib
import io
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest

from bondgraph.support.errors import UnknownName, UnusableInput
from identification.datasets import SETS, protocol, public_set, set_available
from identification.datasets.download import fetch
from identification.datasets.listing import details
from identification.datasets.places import CACHE_VARIABLE, FOLDER_VARIABLE, originals_folder

pytest.importorskip("pooch")


@dataclass
class Server:
    """Files by path, and how it misbehaves."""

    address: str = ""
    files: dict[str, bytes] = field(default_factory=dict)
    asked: list[str] = field(default_factory=list)
    failures: int = 0
    cut: bool = False


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Server]:
    state = Server()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            state.asked.append(unquote(self.path))
            body = state.files.get(unquote(self.path))
            if state.failures > 0:
                state.failures -= 1
                self.send_error(503)
            elif body is None:
                self.send_error(404)
            else:
                self.send_response(200)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body[: len(body) // 2] if state.cut else body)

        def log_message(self, format: str, *args: object) -> None:
            pass

    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    monkeypatch.delenv(FOLDER_VARIABLE, raising=False)
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    monkeypatch.setattr("pooch.core.time.sleep", lambda seconds: None)
    running = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=running.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    state.address = f"http://127.0.0.1:{running.server_address[1]}"
    try:
        yield state
    finally:
        running.shutdown()
        running.server_close()
        thread.join()


def drives() -> tuple[bytes, str]:
    """Bytes of a drive.mat and their SHA-256."""
    matlab = pytest.importorskip("scipy.io")
    stream = io.BytesIO()
    v = np.arange(500.0)[:, None]
    matlab.savemat(stream, {f"{k}{i}": i * v for k in "uz" for i in (1, 2, 3)})
    body = stream.getvalue()
    return body, hashlib.sha256(body).hexdigest()


def serve(server: Server, name: str, bodies: dict[str, bytes]) -> None:
    for original in public_set(name).originals:
        server.files[unquote(original.url(""))] = bodies[original.file]


def left(tmp_path: Path) -> list[str]:
    """Files anywhere under the cache."""
    cache = tmp_path / "cache"
    return sorted(p.relative_to(cache).as_posix() for p in cache.rglob("*") if p.is_file())


def test_right_file_is_kept(server: Server, tmp_path: Path) -> None:
    body, digest = drives()
    serve(server, "coupled_drives", {"drive.mat": body})
    given = {"drive.mat": digest.upper()}
    p = fetch("coupled_drives", server=server.address, sha256=given)
    assert p.tests["1V"]["u"][0] == 400.0
    assert p.tests["1V"].sha256 == digest
    assert len(server.asked) == 1
    assert set_available("coupled_drives") == "cache"
    assert "train/1V" in details("coupled_drives")
    # neither the server nor the checksum is needed again
    again = fetch("coupled_drives", server=server.address)
    kept = protocol("coupled_drives")
    assert len(server.asked) == 1
    for other in (again, kept):
        assert other.official == p.official
        pairs = zip(
            (*p.train, *p.tests.values()), (*other.train, *other.tests.values()), strict=True
        )
        for a, b in pairs:
            assert (a.name, a.source, a.sha256, dict(a.meta)) == (
                b.name, b.source, b.sha256, dict(b.meta)
            )  # fmt: skip
            assert a["y"].tobytes() == b["y"].tobytes()
    assert originals_folder() == tmp_path / "cache" / "originals"
    assert left(tmp_path) == ["originals/coupled-electric-drives/drive.mat"]


def test_the_folder_of_the_user_goes_first(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "mine" / "coupled-electric-drives"
    folder.mkdir(parents=True)
    (folder / "drive.mat").write_bytes(drives()[0])
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "mine"))
    assert fetch("coupled_drives", server=server.address).tests["1V"].n == 100
    assert server.asked == []
    assert set_available("coupled_drives") == "folder"


def test_two_files(server: Server) -> None:
    h5py = pytest.importorskip("h5py")
    v = np.arange(50.0)[:, None]
    bodies = {}
    for file, groups in (("train.h5", ["multisine"]), ("test.h5", ["multisine", "sinesweep"])):
        stream = io.BytesIO()
        with h5py.File(stream, "w") as f:
            for g in groups:
                f[f"{g}/u"], f[f"{g}/y"] = v, v
        bodies[file] = stream.getvalue()
    serve(server, "bouc_wen", bodies)
    digests = {k: hashlib.sha256(b).hexdigest() for k, b in bodies.items()}
    p = fetch("bouc_wen", server=server.address, sha256=digests)
    assert p.tests["sinesweep"].n == 50
    assert any(" " in path for path in server.asked)


def refusal(server: Server, name: str = "coupled_drives", **options: object) -> str:
    with pytest.raises(UnusableInput) as info:
        fetch(name, server=server.address, **options)  # type: ignore[arg-type]
    text = str(info.value)
    assert "\n" not in text
    return text


def test_wrong_checksum_leaves_nothing(server: Server, tmp_path: Path) -> None:
    body, _ = drives()
    serve(server, "coupled_drives", {"drive.mat": body})
    text = refusal(server, sha256={"drive.mat": "0" * 64}, retries=1)
    assert "another SHA-256" in text
    assert len(server.asked) == 2
    assert left(tmp_path) == []
    assert set_available("coupled_drives") == ""


@pytest.mark.parametrize("retries", [0, 2])
def test_cut_off_absent_and_failing(server: Server, tmp_path: Path, retries: int) -> None:
    body, digest = drives()
    given = {"drive.mat": digest}
    assert "404" in refusal(server, sha256=given, retries=retries)
    serve(server, "coupled_drives", {"drive.mat": body})
    server.cut = True
    assert "cannot be downloaded" in refusal(server, sha256=given, retries=retries)
    server.cut = False
    assert left(tmp_path) == []
    server.failures = 2
    if retries < 2:
        assert "503" in refusal(server, sha256=given, retries=retries)
    else:
        got = fetch("coupled_drives", server=server.address, sha256=given, retries=retries)
        assert got.tests["1V"].n == 100


def test_no_server_is_one_line(server: Server) -> None:
    given = {"drive.mat": "0" * 64}
    server.address = "http://127.0.0.1:9"
    assert "cannot be downloaded" in refusal(server, sha256=given, retries=0)


@pytest.mark.parametrize("name", SETS)
def test_nothing_is_downloaded_without_a_checksum(name: str, server: Server) -> None:
    text = refusal(server, name)
    assert "no checksum" in text or "of a form that is not read" in text
    assert FOLDER_VARIABLE in text
    assert server.asked == []


def test_bad_checksums(server: Server) -> None:
    assert "is no SHA-256" in refusal(server, sha256={"drive.mat": "12ab"})
    with pytest.raises(UnknownName, match=r"no file 'drve\.mat'.*Did you mean 'drive\.mat'"):
        fetch("coupled_drives", sha256={"drve.mat": "0" * 64}, server=server.address)


def test_a_file_that_is_no_recording_is_refused(server: Server, tmp_path: Path) -> None:
    body = b"a page that says not found"
    serve(server, "coupled_drives", {"drive.mat": body})
    text = refusal(server, sha256={"drive.mat": hashlib.sha256(body).hexdigest()})
    assert "drive.mat" in text
    assert set_available("coupled_drives") == ""
    assert left(tmp_path) == []


def test_damaged_cache_says_what_to_delete(server: Server) -> None:
    body, digest = drives()
    serve(server, "coupled_drives", {"drive.mat": body})
    fetch("coupled_drives", server=server.address, sha256={"drive.mat": digest})
    broken = originals_folder() / "coupled-electric-drives" / "drive.mat"
    broken.write_bytes(broken.read_bytes()[:-40])
    with pytest.raises(UnusableInput, match="delete the folder and fetch again"):
        protocol("coupled_drives")


def test_pooch_absent(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pooch", None)
    text = refusal(server, sha256={"drive.mat": "0" * 64})
    assert "pip install 'bondsight[data]'" in text
