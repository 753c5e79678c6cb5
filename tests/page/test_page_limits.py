"""What is sent to the page is limited in length, time and memory; meanwhile the page answers."""

import json
import socket
import threading
import time
from contextlib import suppress

import httpx
import pytest
from bombs import x3p_bomb
from refusals import refusal
from websockets.sync.client import connect

from vibrissa.errors import InputError
from vibrissa.page.incoming import bodies, dropped
from vibrissa.page.incoming.upload_cache import LARGEST, UploadCache

GAPS = b"position_mm,width_um\n1,300\n2,250\n"
CHUNK = 1 << 20


class Raw:
    """A connection on which a test writes what it likes."""

    def __init__(self, served):
        self.served, (host, port) = served, served.host.split(":")
        self.line = socket.create_connection((host, int(port)), timeout=30)

    def head(self, *headers, place="texture?name=gaps.csv"):
        where = f"POST /{self.served.page.token}/{place} HTTP/1.1"
        own = f"Host: {self.served.host}", f"Origin: {self.served.origin}"
        self.line.sendall("\r\n".join([where, *own, *headers, "", ""]).encode())

    def chunk(self, content):
        self.line.sendall(b"%x\r\n%s\r\n" % (len(content), content))

    def code(self):
        return int(self.line.recv(200).split()[1])


@pytest.fixture
def raw(served):
    made = Raw(served)
    yield made
    made.line.close()


def alive(served):
    return httpx.get(served.root, timeout=30).status_code == 200


def test_a_length_that_lies_about_chunks_is_refused_unread(raw, served):
    raw.head("Content-Length: 5", "Transfer-Encoding: chunked")
    assert raw.code() == 400  # before any of the body is sent
    assert alive(served)


def test_chunks_are_counted_while_they_come(raw, served):
    raw.head("Transfer-Encoding: chunked")
    sent = 0
    with suppress(ConnectionError):  # it ends at the limit, long before 600 MB
        for _ in range(600):
            raw.chunk(bytes(CHUNK))
            sent += CHUNK
    assert LARGEST <= sent + CHUNK < LARGEST + 32 * CHUNK  # buffers of the system hold some
    assert alive(served)


@pytest.mark.parametrize("length", ["-1", "٣", "1_0", "9" * 5000, "1e3", str(LARGEST + 1), ""])
def test_an_odd_length_is_refused(raw, served, length):
    raw.head("Content-Length: " + length)
    assert raw.code() in (400, 413)
    assert alive(served)


def test_a_slow_body_is_given_up(raw, served, monkeypatch):
    monkeypatch.setattr(bodies, "PATIENCE", 0.5)
    raw.head(f"Content-Length: {len(GAPS)}")
    raw.line.sendall(GAPS[:5])
    assert raw.code() == 408
    assert alive(served)


def test_a_body_that_breaks_off_disturbs_nobody(raw, served):
    raw.head(f"Content-Length: {len(GAPS)}")
    raw.line.sendall(GAPS[:5])
    raw.line.close()
    assert alive(served)


def test_a_bomb_is_one_line_and_the_page_answers_meanwhile(served, tmp_path, monkeypatch):
    pytest.importorskip("SurfaceTopography", reason="the extra surface is not installed")
    monkeypatch.setattr(served.page, "uploads", UploadCache())  # with a process that knows these limits
    monkeypatch.setattr(dropped, "MEMORY", 250 << 20)
    bomb, told, answered = x3p_bomb(tmp_path / "bomb.x3p", 6000).read_bytes(), [], []

    def drop():
        where = served.root + "texture?name=bomb.x3p&line=x:1"
        told.append(httpx.post(where, content=bomb, headers={"origin": served.origin}, timeout=120))

    thread = threading.Thread(target=drop)
    with connect(served.root.replace("http", "ws") + "live", origin=served.origin, max_size=None) as line:
        thread.start()
        while thread.is_alive():
            line.send(json.dumps({"id": 1, "want": "live", "state": {"a.length": 0.01, "b.length": 0.01}}))
            line.recv(timeout=60)
            answered.append(thread.is_alive())
            time.sleep(0.05)
    assert sum(answered) >= 3
    assert told[0].status_code == 422
    assert told[0].text.startswith("bomb.x3p ")
    assert told[0].text.count("\n") == 0
    assert UploadCache().put("gaps.csv", GAPS, {})
    served.page.uploads._reader.end()


def test_memory_of_a_reader_is_limited_and_the_next_file_is_read(tmp_path, monkeypatch):
    pytest.importorskip("SurfaceTopography", reason="the extra surface is not installed")
    bomb = x3p_bomb(tmp_path / "bomb.x3p", 3500).read_bytes()
    monkeypatch.setattr(dropped, "PATIENCE", 300.0)
    for memory, enough in ((200 << 20, False), (2 << 30, True)):
        monkeypatch.setattr(dropped, "MEMORY", memory)
        uploads = UploadCache()
        with pytest.raises(InputError) as caught:
            uploads.put("bomb.x3p", bomb, {"line": "x:9999"})
        assert ("must be x:0 to x:3499" in str(caught.value)) == enough, caught.value
        assert uploads.put("gaps.csv", GAPS, {})


def test_a_file_that_keeps_its_reader_busy_is_given_up(monkeypatch):
    uploads = UploadCache()
    uploads.put("gaps.csv", GAPS, {})
    monkeypatch.setattr(dropped, "PATIENCE", 0.0)
    monkeypatch.setattr(dropped, "PACE", 1e12)
    with refusal("range", "gaps.csv") as told:
        uploads.put("gaps.csv", GAPS * 100_000, {})
    assert told.value.rule == "must be readable within 0 s"
    monkeypatch.undo()
    assert uploads.put("gaps.csv", GAPS, {})


def test_the_death_of_the_reader_costs_one_file(monkeypatch):
    uploads = UploadCache()
    uploads.put("gaps.csv", GAPS, {})
    if uploads._reader._process is None:  # it ends by itself where it has taken much memory
        uploads._reader._start()
    uploads._reader._process.kill()
    with refusal("range", "gaps.csv"):
        uploads.put("gaps.csv", GAPS, {})
    assert uploads.put("gaps.csv", GAPS, {})


def test_a_surface_too_large_to_hand_over_is_refused(monkeypatch):
    monkeypatch.setattr(dropped, "LARGEST_SURFACE", 100)
    with refusal("range", "gaps.csv"):
        UploadCache().put("gaps.csv", GAPS, {})
