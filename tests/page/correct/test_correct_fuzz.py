"""Whatever comes, the server of the page to correct gives its own answer in one line, and goes on."""

import json

import httpx
import pytest
from corrected_pad import make_pad, served_pad
from hypothesis import example, given
from hypothesis import strategies as st
from page_requests import FEW, JSON, WAIT, answered, requests

DOES = ["name", "mark", "join", "split", "swap", "delete", "call", "paint"]
LINES = st.sampled_from([0, 1, 7, 40]) | JSON
FIELDS = {
    "at": LINES,
    "to": LINES,
    "whisker": st.integers(-1, 4) | JSON,
    "whiskers": st.lists(st.integers(-1, 4), max_size=3) | JSON,
    "frame": st.integers(-1, 20) | JSON,
    "label": st.text(max_size=50) | JSON,
    "whole": st.booleans() | JSON,
    "alone": st.booleans() | JSON,
}
EDITS = st.fixed_dictionaries({"do": st.sampled_from(DOES)}, optional=FIELDS)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Give a page of a small pad."""
    folder = tmp_path_factory.mktemp("pad")
    with served_pad(make_pad(folder, 20, whiskers=3), folder / "out.nc") as served:
        served.session._save = lambda: "saved"  # what it writes has tests of its own
        served.host, served.secret = served.root.removeprefix("http://").rstrip("/").split("/")
        yield served


@FEW
@given(request=requests())
@example(request=("POST /SECRETedit HTTP/1.1\r\nHost: OWN\r\nOrigin: OWN\r\nContent-Length: 5\r\n\r\n", b"[[[[[", True))
@example(request=(f"GET /SECRETframe/{9 * 10**13} HTTP/1.1\r\nHost: OWN\r\n\r\n", b"", True))
def test_any_request_gets_an_answer_of_the_page_to_correct(page, capfd, request):
    head, body, inside = request
    said = answered(page.host, f"{page.secret}/", head, body)
    if said and (code := said.split()[1]).isdigit():  # HTTP/0.9 has no status
        assert 200 <= int(code) < 600
        assert inside or int(code) >= 400, said[:200]
    assert httpx.get(page.root, timeout=WAIT).status_code == 200
    assert "Traceback" not in capfd.readouterr().err


@FEW
@given(place=st.sampled_from(["edit", "edit", "edit", "undo", "redo", "fly"]), values=EDITS | JSON)
def test_any_edit_is_done_or_refused_in_one_line(page, capfd, place, values):
    origin = {"Origin": f"http://{page.host}"}
    said = httpx.post(page.root + place, content=json.dumps(values).encode(), headers=origin, timeout=WAIT)
    assert said.status_code in (200, 400, 422)
    assert said.status_code == 200 or "\n" not in said.json()["error"]
    assert "Traceback" not in capfd.readouterr().err
