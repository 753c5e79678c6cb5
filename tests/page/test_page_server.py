"""The page's server answers its own pages alone; whatever else comes changes and crashes nothing."""

import json
import signal
import subprocess
import sys
import urllib.parse

import httpx
import pytest
from page_messages import unpacked
from refusals import refusal
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from vibrissa.errors import install
from vibrissa.page.application import STATIC
from vibrissa.page.server import LARGEST_MESSAGE, serve

SHORT = {"a.length": 0.01, "b.length": 0.01}


@pytest.fixture
def line(served):
    """A connection as the page's own."""
    with connect(served.root.replace("http", "ws") + "live", origin=served.origin, max_size=None) as socket:
        yield socket


def ask(socket, want="live", state=None, **more):
    socket.send(json.dumps({"id": 7, "want": want, "state": {**SHORT, **(state or {})}, **more}))
    return heard(socket)


def heard(socket):
    told = socket.recv(timeout=60)
    return json.loads(told) if isinstance(told, str) else unpacked(told)[0]


def fine(socket):
    told = ask(socket)
    return told["id"] == 7 and "error" not in told and told["contact"] == pytest.approx(0.2894, abs=1e-4)


def test_what_takes_long_is_given_up_for_the_next_question(line):
    rough = {"a.kind": "rough", "a.length": 0.03, "b.kind": "rough", "b.length": 0.03}
    assert ask(line, "live", rough)["id"] == 7
    line.send(json.dumps({"id": 1, "want": "contrast", "state": {**SHORT, **rough}}))
    line.send(json.dumps({"id": 2, "want": "live", "state": SHORT}))
    told = [heard(line), heard(line)]
    assert [one["id"] for one in told] == [1, 2]
    assert told[0] == {"id": 1, "want": "contrast", "given_up": True}
    assert "error" not in told[1]


def test_page_and_scripts_are_its_own_and_forbid_all_else(served):
    for name in STATIC:
        reply = httpx.get(served.root + name)
        assert reply.status_code == 200
        assert "default-src 'none'" in reply.headers["content-security-policy"]
        assert "unsafe" not in reply.headers["content-security-policy"]
        for outer in ("http://", "https://", "//cdn"):
            assert outer not in reply.text.replace("http://www.w3.org/2000/svg", "")


def test_both_pictures_of_the_model_come_over_the_line(line):
    assert fine(line)
    assert ask(line, "notes")["notes"]
    assert ask(line, "contrast")["by_course"] > 0


@pytest.mark.parametrize(
    "headers",
    [{"host": "evil.example"}, {"host": "127.0.0.1"}, {"origin": "http://evil.example"}, {"origin": "null"}],
    ids=str,
)
def test_strangers_get_nothing(served, headers):
    for place in ("", "controls.json", "export/a/study.zip"):
        assert httpx.get(served.root + place, headers=headers).status_code == 404
    assert httpx.post(served.root + "texture?name=x.csv", content=b"x", headers=headers).status_code == 403
    with pytest.raises(InvalidStatus) as refused:
        connect(served.root.replace("http", "ws") + "live", origin=headers.get("origin"), additional_headers=headers)
    assert refused.value.response.status_code in (400, 403)


def test_without_the_secret_or_an_origin_there_is_nothing(served):
    assert httpx.get(served.origin + "/").status_code == 404
    assert httpx.get(served.origin + "/wrong/").status_code == 404
    assert httpx.post(served.root + "texture?name=x.csv", content=b"x").status_code == 403
    with pytest.raises(InvalidStatus):
        connect(served.root.replace("http", "ws") + "live")


@pytest.mark.parametrize(
    "place",
    [
        "../secret",
        "..%2f..%2fetc%2fpasswd",
        "%2e%2e/server.py",
        "export/a/..%2f..",
        "export/c/data.nc",
        "export/a/x.exe",
    ],
)
def test_no_path_leads_out(served, place):
    assert httpx.get(served.root + place).status_code in (404, 405)


@pytest.mark.parametrize(
    "message",
    [
        "",
        "no JSON",
        "[" * 50_000,
        "null",
        '{"id": 1}',
        '{"want": "live", "state": []}',
        '{"want": "__class__", "state": {}}',
        '{"want": ["live"], "state": {}}',
        '{"want": "live", "state": {}, "id": 1e999, "coarse": "yes", "more": 1, "state": {"speed": NaN}}',
        "1" * 10_000,
        b"\x00\x01",
        "x" * 10_000_000,
        json.dumps({"want": "live", "state": {"speed": "9" * 10_000_000}}),
        json.dumps({"want": "live", "state": {"height": 1e308}}),
        json.dumps({"want": "live", "state": {"a.file": "../../etc/passwd", "a.kind": "file"}}),
        json.dumps({"want": "live", "state": {"__proto__": {}}}),
    ],
    ids=lambda message: str(message[:24]),
)
def test_a_hostile_message_gets_one_line_and_the_next_one_its_answer(line, message):
    line.send(message)
    told = heard(line)
    assert told["error"]
    assert "\n" not in told["error"]
    assert len(told["error"]) < 400
    assert fine(line)


def test_a_message_beyond_all_bounds_ends_its_own_connection_only(served, line):
    def drown():
        with connect(served.root.replace("http", "ws") + "live", origin=served.origin) as other:
            other.send("x" * (LARGEST_MESSAGE + 1))
            other.recv(timeout=20)

    with pytest.raises((ConnectionClosed, OSError)):
        drown()
    assert fine(line)


def test_a_file_is_dropped_and_scanned(served, line):
    mine = {"origin": served.origin}
    gaps = b"position_mm,width_um\n1,300\n2,250\n"
    told = httpx.post(served.root + "texture?name=gaps.csv", content=gaps, headers=mine).json()
    assert ask(line, state={"a.kind": "file", "a.file": told["key"]})["gaps"] == 2
    bad = httpx.post(served.root + "texture?name=gaps.csv", content=b"position_mm,width_um\n1,-3\n", headers=mine)
    assert bad.status_code == 422
    assert bad.text == "gaps.csv, line 2, width must be positive, got -3e-06 m"
    assert "must be dropped" in ask(line, state={"a.kind": "file", "a.file": "0" * 16})["error"]
    chunked = httpx.post(served.root + "texture?name=gaps.csv", content=iter([gaps]), headers=mine)
    assert chunked.json() == told


def test_exports_come_as_files_and_bad_states_as_a_line(served):
    good = httpx.get(served.root + "export/b/texture.csv?" + urllib.parse.urlencode(SHORT))
    assert good.status_code == 200
    assert "attachment" in good.headers["content-disposition"]
    bad = httpx.get(served.root + "export/a/data.nc?height=nan")
    assert bad.status_code == 422
    assert bad.text.count("\n") == 0


def test_the_verb_refuses_a_bad_start_in_one_line(vibrissa):
    for words, line in (
        (["explore", "http://127.0.0.1:1/x/#speed=nan"], "Scanning speed"),
        (["explore", "nonsense"], "is unknown"),
        (["explore", "--port", "99999"], "--port must be free"),
    ):
        code, out, said = vibrissa(*words, "--no-browser")
        assert (code, out) == (2, "")
        assert line in said
        assert said.count("\n") == 1


def test_a_taken_port_is_told(served):
    with refusal("conflict", "port"):
        serve({}, port=int(served.host.rpartition(":")[2]), tell=print)


def test_ctrl_c_closes_the_page_with_a_word():
    command = [sys.executable, "-m", "vibrissa", "explore", "speed=0.15", "--no-browser"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as running:
        try:
            address = next(word for word in running.stderr.readline().split() if word.startswith("http"))
            assert address.endswith("/#speed=0.15")
            assert httpx.get(address.partition("#")[0], timeout=30).status_code == 200
            running.send_signal(signal.SIGINT)
            assert running.wait(30) == 0
            assert running.stderr.read() == "vibrissa: the page is closed\n"
        finally:
            running.kill()


def test_without_the_extra_the_remedy_is_told(vibrissa, monkeypatch):
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    code, _, said = vibrissa("explore", "--no-browser")
    assert code == 2
    assert said == f"vibrissa: explore needs the extra page; {install('page')}\n"
