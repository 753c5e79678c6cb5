"""Whatever comes, the page's server gives its own answer, raises nothing and goes on; so does that of `pick`."""

import json
import threading

import httpx
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from page_messages import unpacked
from page_requests import FEW, JSON, LINE, WAIT, answered, requests

from vibrissa.page.answer.answers import ANSWERS, answer
from vibrissa.page.incoming.upload_cache import SETTLED
from vibrissa.page.panel.controls import CONTROLS
from vibrissa.page.session import PageSession
from vibrissa.study.pick import pick_page


class Recorded:
    """An application, and what it raises, but for what it hears of a connection that the server has closed."""

    def __init__(self, application):
        self.application, self.raised = application, []

    async def __call__(self, scope, receive, send):
        closed = []

        async def sent(message):
            try:
                await send(message)
            except Exception as error:
                closed.append(error)
                raise

        try:
            await self.application(scope, receive, sent)
        except Exception as error:
            self.raised += [error] if error not in closed else []
            raise


@pytest.fixture(scope="module")
def recorded():
    """Give a page of its own whose every exception is kept."""
    import uvicorn

    from vibrissa.page.application import Page
    from vibrissa.page.server import listening
    from vibrissa.page.server import settings as server_settings

    with listening(0) as listener:
        page = Page(listener.getsockname()[1])
        application = Recorded(page.application())
        server = uvicorn.Server(server_settings(application))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
        thread.start()
        yield f"127.0.0.1:{listener.getsockname()[1]}", f"{page.token}/", application
        server.should_exit = True
        thread.join(10)


@FEW
@given(request=requests())
@example(
    request=(
        "POST /SECRETtexture?name=x.csv HTTP/1.1\r\nHost: OWN\r\nOrigin: OWN\r\nContent-Length: 5\r\n\r\n",
        b"",
        True,
    )
)
@example(
    request=(
        "POST /SECRETexport/a/data.nc HTTP/1.1\r\nHost: OWN\r\nTransfer-Encoding: chunked\r\n\r\n",
        b"zz\r\n",
        True,
    )
)
def test_any_request_gets_an_answer_of_the_page(recorded, capfd, request):
    host, root, application = recorded
    head, body, inside = request
    said = answered(host, root, head, body)
    if said:
        code = int(said.split()[1])
        assert 200 <= code < 600
        assert inside or code >= 400, said[:200]
        assert b"Traceback" not in said
    assert application.raised == []
    assert httpx.get(f"http://{host}/{root}", timeout=WAIT).status_code == 200
    assert "Traceback" not in capfd.readouterr().err


STATES = st.dictionaries(st.sampled_from([*CONTROLS, "x"]), JSON, max_size=4) | JSON
SHORT = {"a.length": 0.01, "b.length": 0.01}


@FEW
@given(want=st.sampled_from([*ANSWERS, "x"]) | JSON, state=STATES, number=JSON)
def test_any_message_gets_an_answer(want, state, number):
    given_state = {**SHORT, **state} if isinstance(state, dict) else state
    said = answer(
        PageSession(lambda _: pytest.fail("no file was dropped")),
        json.dumps({"want": want, "state": given_state, "id": number}),
    )
    facts = json.loads(said) if isinstance(said, str) else unpacked(said)[0]
    assert "fault of vibrissa" not in facts.get("error", "")
    assert facts.keys() >= {"id", "want"}


@FEW
@given(values=st.dictionaries(st.sampled_from([*CONTROLS, *SETTLED]), LINE, max_size=4))
def test_any_query_is_an_answer(recorded, values):
    host, root, application = recorded
    said = httpx.get(f"http://{host}/{root}export/a/texture.csv", params={**SHORT, **values}, timeout=WAIT)
    assert said.status_code in (200, 422)
    assert application.raised == []


@pytest.fixture(scope="module")
def picking():
    """Give host and secret of a page of `pick` that saves nothing."""
    saved = []
    with pick_page._Server(np.zeros((9, 9), np.uint8), {"movie": "m", "study": "s"}, saved.append) as server:
        server.end = lambda: None
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"127.0.0.1:{server.server_address[1]}", f"{server.token}/"
        server.shutdown()


@FEW
@given(request=requests())
@example(request=("POST /SECRETsave HTTP/1.1\r\nHost: OWN\r\nOrigin: OWN\r\nContent-Length: 5\r\n\r\n", b"[[[[[", True))
def test_any_request_gets_an_answer_of_pick(picking, capfd, request):
    host, root = picking
    head, body, inside = request
    said = answered(host, root, head, body)
    if said and (code := said.split()[1]).isdigit():  # HTTP/0.9 has no status
        assert 200 <= int(code) < 600
        assert inside or int(code) >= 400, said[:200]
    assert httpx.get(f"http://{host}/{root}", timeout=WAIT).status_code == 200
    assert "Traceback" not in capfd.readouterr().err
