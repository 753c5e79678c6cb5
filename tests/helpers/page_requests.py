"""Requests of every kind to the server of a page, and values of JSON of every kind."""

import socket
import urllib.parse

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

FEW = settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
WAIT = 30.0  # [s] for an answer
METHODS = st.sampled_from(["GET", "POST", "PUT", "HEAD", "DELETE", "OPTIONS", "TRACE", "CONNECT", "get", "X" * 300, ""])
PIECES = [
    "",
    "texture",
    "live",
    "export",
    "a",
    "data.nc",
    "controls.json",
    "..",
    "%2e%2e",
    "%00",
    "page.js",
    "save",
    "?",
]
LINE = st.text(st.characters(codec="latin-1", exclude_characters="\r\n"), max_size=60)
NAMES = ["Host", "Origin", "Content-Length", "Transfer-Encoding", "Upgrade", "Connection", "Expect", "Content-Type"]
VALUES = ["OWN", "0", "5", "-1", "1e9", "99999999999", "chunked", "gzip, chunked", "websocket", "close", "100-continue"]
HEADER = st.tuples(st.sampled_from(NAMES) | LINE, st.sampled_from(VALUES) | LINE)
PLACE = st.lists(st.sampled_from(PIECES) | LINE.map(urllib.parse.quote), max_size=4).map("/".join)


@st.composite
def requests(draw):
    """Bytes of a request, with OWN where host or origin of the page stand, and whether it knows the secret."""
    inside, version = draw(st.booleans()), draw(st.sampled_from(["HTTP/1.1", "HTTP/1.0", "HTTP/9", "", "HTTP/1.1 x"]))
    place = ("SECRET" if inside else "") + draw(PLACE)
    headers = draw(st.lists(HEADER, max_size=5)) + ([("Host", "OWN"), ("Origin", "OWN")] if draw(st.booleans()) else [])
    head = [f"{draw(METHODS)} /{place} {version}", *(f"{name}: {value}" for name, value in headers), "", ""]
    return "\r\n".join(head), draw(st.binary(max_size=200)), inside


def answered(host, root, head, body):
    """All that a server says to one request, whose sender then ends its side."""
    own = (
        head.replace("SECRET", root)
        .replace("Host: OWN", f"Host: {host}")
        .replace("Origin: OWN", f"Origin: http://{host}")
    )
    with socket.create_connection(tuple(host.split(":")), timeout=WAIT) as line:
        said = b""
        try:
            line.sendall(own.encode("latin-1") + body)
            line.shutdown(socket.SHUT_WR)
            while part := line.recv(1 << 16):
                said += part
        except ConnectionError:  # it closed without reading all
            pass
    return said


JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.floats()
    | st.integers()
    | st.text(max_size=8)
    | st.sampled_from([10**400, "\ud800"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
