"""The page in a real browser: what is set is drawn and heard, by hand and by keyboard, in either width and light."""

import json
import threading
import time
import urllib.parse
import zipfile
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest
from real_browser import real_browser

from vibrissa.page.panel.state import read_state
from vibrissa.page.signals import live_arrays

VIEWS = ("whole", "close", "excursion", "modes", "moment-view", "spectrogram", "resonance", "firing")
SHORT = {"a.length": "0.01", "b.length": "0.01"}
PATIENCE = 60  # [s] of a loaded machine


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    flags = ("--autoplay-policy=no-user-gesture-required", "--mute-audio")
    with real_browser(tmp_path_factory.mktemp("home"), *flags) as browser:
        yield browser


class Hands:
    """A page, and what hands and eyes do with it."""

    def __init__(self, page, root):
        self.page, self.root, self.wrong = page, root, []
        page.on("console", lambda told: told.type == "error" and self.wrong.append(told.text))
        page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.asked = []
        page.on("request", lambda request: self.asked.append(request.url))

    def open(self, **state):
        self.page.goto("about:blank")
        self.page.goto(f"{self.root}#{urllib.parse.urlencode({**SHORT, **state})}")
        self.until("globalThis.vibrissa?.shown() > 0 && !vibrissa.busy()")
        return self

    def until(self, condition):
        stop = time.monotonic() + PATIENCE
        while not self.page.evaluate(condition):
            assert time.monotonic() < stop, f"{condition}; {self.error()}; {self.wrong}"
            time.sleep(0.02)

    def act(self, do):
        """Do something, and wait for what it changes to be drawn."""
        before = self.page.evaluate("vibrissa.shown()")
        do()
        self.until(f"vibrissa.shown() > {before} && !vibrissa.busy()")

    def error(self):
        return self.page.inner_text("#error")

    def told(self, name):
        return np.array(self.page.evaluate(f"Array.from(vibrissa.data().{name})"), np.float32)

    def pictures(self, names=VIEWS):
        return {name: self.page.evaluate(f"document.getElementById('{name}').toDataURL()") for name in names}

    def control(self, name):
        return self.page.locator(f"[id='c-{name}']")


@pytest.fixture
def hands(browser, served):
    context = browser.new_context(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
    made = Hands(context.new_page(), served.root)
    yield made
    context.close()


def expected(served, **state):
    state = read_state({**SHORT, **state})
    return live_arrays(served.page.session.predict(state), state.unit)


def test_the_page_opens_with_every_picture_drawn_and_asks_nobody_else(hands, served):
    hands.open()
    assert hands.wrong == []
    assert all(url.startswith((served.root, "about:blank")) for url in hands.asked)
    ink = "(id => { const c = document.getElementById(id), d = c.getContext('2d').getImageData(0, 0, c.width, c.height)"
    ink += ".data; let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n / (d.length / 4); })"
    for name in VIEWS:
        assert hands.page.evaluate(f"{ink}('{name}')") > 0.01, name
    arrays = expected(served)
    for name in ("excursion", "modes", "moment", "firing"):
        np.testing.assert_array_equal(hands.told(name), arrays[name].ravel())
    hands.until("Boolean(vibrissa.other())")
    assert "d′ =" in hands.page.inner_text("#index")
    assert "second contact" in hands.page.inner_text("body") or hands.page.locator("#notes li").count() > 0


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("height", VIEWS),
        ("base_angle", VIEWS),
        ("friction", ("whole", "modes", "moment-view")),
        ("speed", ("excursion", "modes", "spectrogram", "firing")),
        ("damping", ("modes", "moment-view", "spectrogram")),
        ("a.period", ("excursion", "modes")),
    ],
)
def test_a_slider_moved_by_an_arrow_changes_what_is_drawn(hands, served, name, changed):
    hands.open()
    before, resonances = hands.pictures(), hands.told("resonance")
    hands.act(lambda: hands.page.locator(f"[id='c-{name}-slider']").press("ArrowRight"))
    after = hands.pictures()
    for view in changed:
        assert before[view] != after[view], view
    np.testing.assert_array_equal(hands.told("resonance"), resonances)  # of the whisker, whatever its posture
    state = dict(urllib.parse.parse_qsl(urllib.parse.urlparse(hands.page.url).fragment))
    assert float(state[name]) > read_state({}).number(name)
    np.testing.assert_allclose(hands.told("modes"), expected(served, **state)["modes"].ravel(), rtol=1e-5, atol=1e-12)


TRACED = """async () => {
  const { trace } = await import("./plots.js"), values = Float32Array.from({ length: 3000 }, (_, i) => Math.sin(i * i));
  values[1234] = 2;
  return [1, -1].map(scale => {
    const canvas = new OffscreenCanvas(100, 200), ctx = canvas.getContext("2d");
    trace({ ctx, ratio: 1 }, { X: t => t / 30, Y: v => 100 - 45 * v }, values, 1, "#000", { scale });
    return Array.from(ctx.getImageData(0, 0, 100, 200).data).filter((_, i) => i % 4 === 3);
  });
}"""


def test_dense_lines_keep_their_peaks_either_way_up(hands):
    up, down = np.reshape(hands.open().page.evaluate(TRACED), (2, 200, 100))
    np.testing.assert_array_equal(up, down[::-1])
    tops = (up > 0).argmax(axis=0)
    assert tops[41] == 9  # the one peak of 2, in its column
    assert np.all(np.delete(tops, 41) >= 54)  # the others are 1 at most


def test_numbers_and_choices_set_the_same(hands, served):
    hands.open()
    hands.act(lambda: hands.control("damping").fill("0.05"))
    hands.page.locator("summary", has_text="Whisker").first.click()
    hands.act(lambda: hands.control("whisker").select_option("beta"))
    arrays = expected(served, damping="0.05", whisker="beta")
    np.testing.assert_array_equal(hands.told("modes"), arrays["modes"].ravel())
    assert not hands.control("length").is_visible()


def test_the_address_holds_the_state(hands):
    hands.open(damping="0.07", hold="contact", contact="0.4")
    assert hands.control("damping").input_value() == "0.07"
    modes = hands.told("modes")
    hands.act(lambda: hands.control("speed").fill("130"))
    address = hands.page.url
    assert "speed=0.13" in address
    hands.page.goto("about:blank")
    hands.page.goto(address)
    hands.until("Boolean(globalThis.vibrissa?.data())")
    assert hands.control("speed").input_value() == "130"
    hands.act(lambda: hands.control("speed").fill("100"))
    np.testing.assert_array_equal(hands.told("modes"), modes)


def test_play_gives_the_resonance_at_true_pitch_and_octaves(hands, served):
    ringing = {"a.kind": "periodic", "a.period": "0.01", "a.duty": "0.05", "damping": "0.005"}
    hands.open(**ringing)
    state = read_state({**SHORT, **ringing})
    resonance = served.page.session.predict(state).omega[0] / (2 * np.pi)
    for octave in (0, 1, -1):
        seconds = 0.5
        heard = hands.page.evaluate(
            f"(async () => Array.from(await vibrissa.rendered(vibrissa.data().displacement.subarray(2000), "
            f"vibrissa.data().rate, {octave}, {seconds})))()"
        )
        power = np.abs(np.fft.rfft(np.array(heard) * np.hanning(len(heard)), 4 * len(heard)))
        pitch = np.argmax(power) / (4 * seconds)
        assert pitch == pytest.approx(resonance * 2.0**octave, abs=1.0)
        assert 0.1 < np.abs(heard).max() <= 1


def test_both_textures_play_and_end(hands):
    hands.open()
    hands.until("Boolean(vibrissa.other())")
    hands.page.locator("#loop").uncheck()
    hands.page.keyboard.press("a")
    hands.until("vibrissa.ended === 1")
    hands.page.locator("#play-b").click()
    hands.until("vibrissa.started === 2 && vibrissa.ended === 2")
    assert hands.page.get_attribute("#play-b", "aria-pressed") == "false"
    assert hands.wrong == []


def test_a_bad_file_shows_its_one_line_and_a_good_one_is_drawn(hands, tmp_path):
    hands.open()
    hands.act(lambda: hands.control("a.kind").select_option("periodic"))
    before = hands.pictures()
    bad, good = tmp_path / "bad.csv", tmp_path / "good.csv"
    bad.write_text("position_mm,width_um\n1,-300\n")
    good.write_text("position_mm,width_um\n1,300\n3,250\n")
    hands.page.locator("summary", has_text="Texture B").click()
    hands.page.evaluate("document.getElementById('c-a.file').closest('.control').hidden = false")
    hands.control("a.file").set_input_files(bad)
    hands.until("!document.getElementById('error').hidden")
    assert hands.error() == "bad.csv, line 2, width must be positive, got -0.0003 m"
    assert hands.pictures() == before
    hands.act(lambda: hands.control("a.file").set_input_files(good))
    assert hands.error() == ""
    assert len(hands.told("surface")) == 16
    assert hands.pictures() != before


HOSTILE = [
    {"height": "nan"},
    {"speed": "1e308"},
    {"a.kind": "file", "a.file": "../../etc/passwd"},
    {"<img src=x onerror=alert(1)>": "1"},
    {"__proto__": "1"},
    {"whisker": "<script>"},
    {"damping": "9" * 5000},
    {"height": "0.09"},
]


@pytest.mark.parametrize("state", HOSTILE, ids=lambda state: next(iter(state))[:12])
def test_a_hostile_address_shows_one_line_and_the_page_lives_on(hands, state):
    hands.page.goto(f"{hands.root}#{urllib.parse.urlencode(state)}")
    hands.until("globalThis.vibrissa && !document.getElementById('error').hidden")
    assert "\n" not in hands.error()
    assert len(hands.error()) < 400
    assert hands.page.evaluate("document.querySelectorAll('#error *, img').length") == 0
    hands.page.evaluate("location.hash = '#a.length=0.01'")
    hands.until("Boolean(vibrissa.data()) && document.getElementById('error').hidden")
    assert hands.wrong == []


def test_an_address_typed_while_the_page_writes_its_own_is_read(hands):
    hands.open()
    written = "history.replaceState(null, '', '#speed=0.05')"  # as the page does at rest, before the event has come
    hands.act(lambda: hands.page.evaluate(f"location.hash = '#speed=0.15'; {written}"))
    assert hands.control("speed").input_value() == "150"


def test_an_endless_address_starts_from_the_defaults_with_a_line(hands):
    hands.open()
    hands.page.evaluate("location.hash = '#speed=' + '1'.repeat(1_000_000)")
    hands.until("document.getElementById('error').textContent.includes('at most 8000 characters')")
    hands.until("vibrissa.data().excursion.length > 4000")  # the default texture
    hands.act(lambda: hands.control("speed").fill("150"))
    assert hands.error() == ""


def test_a_foreign_page_can_neither_ask_nor_read_nor_drop(hands, served):
    class Foreign(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()
            self.wfile.write(b"<!doctype html><title>foreign</title>")

        def log_message(self, *_):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Foreign) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        hands.page.goto(f"http://127.0.0.1:{server.server_address[1]}/")
        root = json.dumps(served.root)
        asked = hands.page.evaluate(
            f"new Promise(done => {{ const s = new WebSocket({root}.replace('http', 'ws') + 'live'); "
            "s.onopen = () => done('open'); s.onerror = () => done('refused'); })"
        )
        read = hands.page.evaluate(f"fetch({root} + 'controls.json').then(() => 'read', () => 'refused')")
        drop = (
            f"fetch({root} + 'texture?name=x.csv', {{method: 'POST', body: 'x'}}).then(() => 'sent', () => 'refused')"
        )
        dropped = hands.page.evaluate(drop)
        server.shutdown()
    assert (asked, read, dropped) == ("refused", "refused", "refused")
    hands.open()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_nothing_is_cut_off_in_either_width_and_light(browser, served, width, scheme):
    context = browser.new_context(viewport={"width": width, "height": 844}, color_scheme=scheme)
    hands = Hands(context.new_page(), served.root).open()
    assert hands.page.evaluate("document.documentElement.scrollWidth") <= width
    dark = hands.page.evaluate("getComputedStyle(document.body).backgroundColor").startswith("rgb(2")
    assert dark == (scheme == "dark") or scheme == "light"
    for name in VIEWS:
        box = hands.page.locator(f"#{name}").bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width
    context.close()


def test_every_control_and_picture_has_a_name_and_is_reached_by_tab(hands):
    hands.open()
    nameless = "[...document.querySelectorAll('input, select, button')].filter(e => !e.labels?.length && "
    nameless += "!e.getAttribute('aria-label') && !e.textContent.trim()).map(e => e.outerHTML)"
    assert hands.page.evaluate(nameless) == []
    unnamed = "[...document.querySelectorAll('canvas')].filter(c => !c.getAttribute('aria-label')).map(c => c.id)"
    hands.until("Boolean(vibrissa.other())")
    assert hands.page.evaluate(unnamed) == []
    reached = set()
    for _ in range(80):
        hands.page.keyboard.press("Tab")
        reached.add(hands.page.evaluate("document.activeElement.id || document.activeElement.textContent"))
    visible = "[...document.querySelectorAll('input, select, button, summary, #exports a')]"
    visible += ".filter(e => e.checkVisibility() && !e.disabled).map(e => e.id || e.textContent)"
    assert set(hands.page.evaluate(visible)) <= reached


def test_keys_step_the_texture_and_stop_the_motion(hands):
    hands.open()
    before = hands.told("excursion")
    hands.act(lambda: hands.page.keyboard.press("]"))
    assert "a.seed=2" in hands.page.url
    assert not np.array_equal(hands.told("excursion"), before)
    hands.page.keyboard.press("p")  # at rest at first for those who want less motion
    at = hands.page.evaluate("vibrissa.at()")
    hands.until(f"vibrissa.at() > {at}")
    hands.page.keyboard.press("p")
    at = hands.page.evaluate("vibrissa.at()")
    time.sleep(0.1)
    assert hands.page.evaluate("vibrissa.at()") == at
    close = hands.pictures(["close"])
    hands.page.locator("#moment").press("ArrowRight")
    hands.until(f"vibrissa.at() != {at}")
    for _ in range(30):
        hands.page.locator("#moment").press("ArrowRight")
    assert hands.pictures(["close"]) != close


def test_what_is_taken_away_is_of_the_state_that_is_set(hands):
    hands.open()
    hands.act(lambda: hands.control("damping").fill("0.06"))
    with hands.page.expect_download() as waited:
        hands.page.locator("#exports a", has_text="study.zip").click()
    with zipfile.ZipFile(waited.value.path()) as archive:
        text = archive.read("vibrissa-study/study.toml").decode()
    assert waited.value.suggested_filename == "vibrissa-study.zip"
    assert "damping = 0.06" in text
    assert "length = 0.01" in text
