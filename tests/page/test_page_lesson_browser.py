"""What the page teaches, in a browser: presets, names, verdict, tour, glossary, copies, files and a lost program."""

import re
import threading
import time
import urllib.parse

import numpy as np
import pytest
import uvicorn
from matplotlib import colormaps
from PIL import Image
from real_browser import real_browser

from vibrissa.page.application import Page
from vibrissa.page.panel.controls import CONTROLS
from vibrissa.page.panel.presets import CLEAN, PRESETS
from vibrissa.page.panel.state import read_state
from vibrissa.page.server import listening, settings
from vibrissa.page.signals import live_arrays

SHORT = {"a.length": "0.01", "b.length": "0.01"}


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with real_browser(tmp_path_factory.mktemp("home")) as browser:
        yield browser


@pytest.fixture
def view(browser):
    context = browser.new_context(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    yield context.new_page()
    context.close()


def until(view, condition, patience=60):
    stop = time.monotonic() + patience
    while not view.evaluate(condition):
        assert time.monotonic() < stop, f"{condition}; {view.inner_text('#error')}"
        time.sleep(0.02)


def opened(view, root, **state):
    """The page at a state, or, without one, as it first opens."""
    view.goto("about:blank")
    view.goto(f"{root}#{urllib.parse.urlencode(state)}")
    until(view, "globalThis.vibrissa?.shown() > 0 && !vibrissa.busy()")


def at(view):
    return dict(urllib.parse.parse_qsl(urllib.parse.urlparse(view.url).fragment))


def acted(view, do):
    before = view.evaluate("vibrissa.shown()")
    do()
    until(view, f"vibrissa.shown() > {before} && !vibrissa.busy()")


def set_to(view):
    """The state that the address gives, all controls."""
    return read_state(at(view)).values


def test_over_every_picture_a_sentence_says_what_to_see(view, served):
    opened(view, served.root, **SHORT)
    lines = "[...document.querySelectorAll('figure')].map(f => f.querySelector('figcaption .see')?.textContent)"
    said = view.evaluate(lines)
    assert len(said) == 9
    assert all(line.endswith(".") and line.count(".") == 1 for line in said)


def test_the_page_opens_at_the_clean_preset_with_its_caveats_folded_under_a_plain_verdict(view, served):
    opened(view, served.root)
    assert set_to(view) == read_state(CLEAN).values
    assert view.inner_text("#preset-about") == PRESETS[0].about
    until(view, "document.querySelectorAll('#notes li').length > 0")
    assert view.inner_text("#verdict-line") == "The model holds here."
    assert not view.locator("#notes").is_visible()
    view.locator("#verdict-line").press("Enter")
    assert view.inner_text("#notes li >> nth=0").startswith("usable")


def pressed(view):
    return view.locator("#presets [aria-pressed=true]").all_inner_texts()


def test_presets_and_reset_set_their_states(view, served):
    opened(view, served.root)
    for preset in PRESETS[1:]:
        acted(view, lambda one=preset: view.get_by_role("button", name=one.name, exact=True).click())
        assert set_to(view) == read_state(preset.state).values
        assert view.inner_text("#preset-about") == preset.about
        assert pressed(view) == [preset.name]
    acted(view, lambda: view.locator("[id='c-damping-slider']").press("ArrowRight"))
    assert view.inner_text("#preset-about") == ""  # what it says holds of its own state alone
    assert pressed(view) == []
    acted(view, lambda: view.locator("#reset").press("Enter"))
    assert set_to(view) == read_state(CLEAN).values


def test_the_state_of_all_defaults_has_an_address_that_opens_it_again(view, served):
    opened(view, served.root, hold="height")
    assert set_to(view) == read_state({}).values
    view.reload()
    until(view, "globalThis.vibrissa?.shown() > 0 && !vibrissa.busy()")
    assert set_to(view) == read_state({}).values


def test_a_caution_is_said_where_the_model_does_not_hold(view, served):
    opened(view, served.root, **{**CLEAN, **SHORT, "tip": 0.05})
    until(view, "document.querySelectorAll('#notes li').length > 0")
    assert view.inner_text("#verdict-line") == "The model does not hold here: read why."


BANDS = """() => {  // share of the columns of each third of the firing picture that hold the colour of the envelope
  const c = document.getElementById('firing'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
  const probe = document.createElement('i'); probe.style.color = 'var(--two)'; document.body.append(probe);
  const [r, g, b] = getComputedStyle(probe).color.match(/\\d+/g).map(Number); probe.remove();
  const rows = [];
  for (let y = 0; y < c.height; y++) for (let x = 0; x < c.width; x++) {
    const i = 4 * (y * c.width + x); if (d[i] === r && d[i + 1] === g && d[i + 2] === b) {
      rows.push(y / c.height); break;
    }
  }
  return rows;
}"""


def test_envelope_threshold_and_spikes_are_drawn_one_over_the_other(view, served):
    opened(view, served.root, **{**CLEAN, **SHORT})
    state = read_state({**CLEAN, **SHORT})
    arrays = live_arrays(served.page.session.predict(state), state.unit)
    drive = np.array(view.evaluate("Array.from(vibrissa.data().drive)"), np.float32)
    np.testing.assert_array_equal(drive, arrays["drive"])
    assert view.evaluate("vibrissa.data().threshold") == CLEAN["threshold"]
    rows = view.evaluate(BANDS)
    assert rows
    assert max(rows) < 0.34  # the envelope lies in the uppermost third, above rate and raster
    before = view.evaluate("document.getElementById('firing').toDataURL()")
    label = view.get_attribute("#firing", "aria-label")
    acted(view, lambda: view.evaluate("location.hash += '&threshold=0.000003'"))
    assert view.evaluate("document.getElementById('firing').toDataURL()") != before
    assert "threshold 4;" in label
    assert "threshold 3;" in view.get_attribute("#firing", "aria-label")


WRITTEN = """() => {
  globalThis.written = [];
  const old = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
    written.push([this.canvas.id, text, x, y]); return old.call(this, text, x, y);
  };
}"""


def test_pad_taper_direction_contact_and_gaps_are_named_in_the_drawing(view, served):
    opened(view, served.root, **{**CLEAN, **SHORT, "tip": 0.05})
    view.evaluate(WRITTEN)
    acted(view, lambda: view.evaluate("location.hash += '&speed=0.12'"))
    written = view.evaluate("written")
    words = {text for name, text, *_ in written if name == "whole"}
    assert {"whisker pad", "thick base", "thin tip", "free end", "contact ↓"} <= words
    assert "← the surface moves; its gaps are blank" in words
    width = view.evaluate("document.getElementById('whole').clientWidth")
    assert all(0 <= x <= width and y > 0 for name, _, x, y in written if name == "whole")
    assert {"contact", "gap"} <= {text for name, text, *_ in written if name == "close"}


def test_the_scale_of_slow_motion_is_whole_on_a_narrow_screen(view, served):
    view.set_viewport_size({"width": 320, "height": 900})
    opened(view, served.root, **{**CLEAN, **SHORT})
    view.evaluate(WRITTEN)
    acted(view, lambda: view.evaluate("location.hash += '&speed=0.12'"))
    ends = """() => written.filter(([name, text]) => name === "close" && text.startsWith("0.3 mm"))
      .map(([name, text, x]) => {
      const canvas = document.getElementById(name);
      return canvas.clientWidth - x - canvas.getContext("2d").measureText(text).width;
    })"""
    room = view.evaluate(ends)
    assert room
    assert min(room) >= 0


@pytest.mark.parametrize(("button", "name"), [("#copy-command", "command.txt"), ("#copy-python", "script.py")])
def test_what_is_copied_is_the_snippet_of_the_state(view, served, button, name):
    opened(view, served.root, **{**SHORT, "damping": "0.07"})
    view.locator(button).click()
    until(view, "document.getElementById('copied').textContent.startsWith('Copied.')")
    text = view.evaluate("navigator.clipboard.readText()")
    assert "0.07" in text
    assert text == view.evaluate(f"fetch('export/a/{name}?' + location.hash.slice(1)).then(a => a.text())")
    assert view.locator("#snippet").text_content() == text


def test_what_is_copied_at_once_is_of_the_new_state(view, served):
    opened(view, served.root, **SHORT)
    at_once = "document.querySelector('#presets button:nth-of-type(4)').click(); "
    view.evaluate(at_once + "document.getElementById('copy-python').click()")
    until(view, "!document.getElementById('snippet').hidden")
    assert "vb.self_affine" in view.locator("#snippet").text_content()
    assert view.evaluate("document.getElementById('verdict').dataset.level") != "usable"


def test_the_copied_address_opens_the_same_state(view, served):
    opened(view, served.root, **{**SHORT, "damping": "0.07"})
    view.locator("#copy-address").click()
    until(view, "document.getElementById('copied').textContent === 'Copied.'")
    assert view.evaluate("navigator.clipboard.readText()") == view.url


def test_on_a_phone_all_pictures_come_before_the_controls(browser, served):
    context = browser.new_context(viewport={"width": 390, "height": 844}, reduced_motion="reduce")
    view = context.new_page()
    opened(view, served.root, **SHORT)
    tops = "[...document.querySelectorAll('figure')].map(f => f.getBoundingClientRect().top)"
    controls = view.evaluate("document.getElementById('controls').getBoundingClientRect().top")
    assert max(view.evaluate(tops)) < controls
    context.close()


@pytest.mark.parametrize("length", ["0.022", "0.055"])
def test_the_spectrogram_reaches_just_beyond_the_third_mode(view, served, length):
    opened(view, served.root, **{**CLEAN, **SHORT, "length": length})
    top, third = view.evaluate("[vibrissa.data().spectrogram_axes[1], vibrissa.data().frequency[2]]")
    assert 1.15 < top / third <= 1.25


ENGLISH = "a all and are as at by cut end gap go how in is it its map not of on one or pad per the tip to up"
# What is no English word on the page: Greek, single letters, units; and the glossary's word for it.
SYMBOLS = {
    "θ_b": "θ_b", "ε": "ε", "ζ": "ζ", "μ": "μ", "α": "α", "ρ": "E, ρ", "κ": "κ", "d′": "d′", "d": "d", "H": "H",
    "L": "L", "E": "E, ρ", "v": "v", "q": "q", "qi": "q", "i": "q", "q₁": "q", "q₂": "q", "q₃": "q", "Q": "Q(d)",
    "Qi": "Q(d)",
    "A": "A, B", "B": "A, B", "dB": "dB", "re": "dB", "rms": "rms", "env": "Envelope, env.", "mm": "mm, µm",
    "µm": "mm, µm", "µm²": "mm, µm", "nN": "nN m, 1/m", "m": "nN m, 1/m", "m³": "GPa, kg/m³",
    "kg": "GPa, kg/m³", "GPa": "GPa, kg/m³",
    "ms": "ms, Hz", "s": "ms, Hz", "Hz": "ms, Hz", "rad": "rad, mrad",
}  # fmt: skip
FILES = {"nc", "csv", "png", "svg", "wav", "zip", "PNG", "CSV", "x", "z"}  # and axes of a dropped file


def test_every_symbol_that_is_shown_is_explained(view, served):
    opened(view, served.root, **CLEAN, **SHORT)
    view.evaluate("document.querySelectorAll('details').forEach(one => { one.open = true; })")
    view.evaluate(WRITTEN)
    until(view, "Boolean(vibrissa.other())")
    acted(view, lambda: view.evaluate("location.hash += '&speed=0.12'"))
    until(view, "written.some(([id]) => id === 'contrast')")
    drawn = view.evaluate("written.map(([, text]) => text).join(' ')")
    kept = "[...document.querySelectorAll('figcaption, #controls label, #status, #index, button, label')]"
    shown = view.evaluate(f"{kept}.map(e => e.innerText).join(' ')")
    terms = view.evaluate("[...document.querySelectorAll('dt')].map(t => t.textContent)")
    odd = {word for word in re.findall(r"[^\W\d]+[′²³₁₂₃]*", f"{drawn} {shown}") if len(word) < 4 or not word.isascii()}
    unknown = {word for word in odd if word not in {*SYMBOLS, *FILES} and word.lower() not in ENGLISH.split()}
    assert not unknown, " ".join(sorted(unknown))
    assert {"ε", "d", "q₁", "Hz", "µm", "d′", "dB", "A", "B"} <= odd
    assert [SYMBOLS[word] for word in odd & set(SYMBOLS) if SYMBOLS[word] not in terms] == []
    titles = view.evaluate("[...document.querySelectorAll('abbr')].map(a => a.title)")
    assert all(title.endswith(".") for title in titles)
    assert len(titles) >= 6


def test_every_control_has_its_sentence(view, served):
    opened(view, served.root, **SHORT)
    titles = view.evaluate("[...document.querySelectorAll('.control > label')].map(l => l.title)")
    assert len(titles) == len(CONTROLS)
    assert all(title.endswith(".") for title in titles)


def test_a_dropped_file_that_leaves_its_units_open_opens_their_controls(view, served, tmp_path):
    opened(view, served.root, **SHORT)
    bare = tmp_path / "bare.csv"
    bare.write_text("\n".join(f"{0.01 * k:.2f},{k % 7}" for k in range(200)) + "\n")
    view.evaluate("document.querySelectorAll('details').forEach(d => { d.open = false; })")
    drop = """text => { const files = new DataTransfer(); files.items.add(new File([text], 'bare.csv'));
      document.dispatchEvent(new DragEvent('drop', { dataTransfer: files, bubbles: true, cancelable: true })); }"""
    view.evaluate(drop, bare.read_text())
    until(view, "document.activeElement.name === 'x_unit'")
    assert "unit" in view.inner_text("#error")
    row = view.locator("[id='c-a.file'] ~ .open").first
    assert row.locator("select[name=x_unit]").is_visible()
    row.locator("select[name=x_unit]").select_option("mm")
    acted(view, lambda: row.locator("select[name=z_unit]").select_option("um"))
    assert view.inner_text("#error") == ""
    assert at(view)["a.kind"] == "file"


def test_when_the_program_ends_the_page_greys_out_and_says_how_to_start_it(view):
    with listening(0) as listener:
        page = Page(listener.getsockname()[1])
        server = uvicorn.Server(settings(page.application()))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
        thread.start()
        opened(view, f"http://127.0.0.1:{listener.getsockname()[1]}/{page.token}/", **SHORT, damping="0.07")
        server.should_exit = True
        thread.join(10)
    until(view, "document.body.classList.contains('lost')")
    assert "vibrissa explore '" in view.inner_text("#error")
    assert "damping=0.07" in view.inner_text("#error")
    assert view.evaluate("getComputedStyle(document.querySelector('main')).filter") == "grayscale(1)"
    assert view.evaluate("document.getElementById('controls').inert")


def test_the_tour_has_five_steps_by_keyboard_and_gives_the_focus_back(view, served):
    opened(view, served.root, **SHORT)
    view.locator("#tour-start").press("Enter")
    for k in range(1, 6):
        assert view.inner_text("#tour-text").startswith(f"{k} of 5.")
        shown = view.locator(".shown")
        assert shown.count() == 1
        box = shown.bounding_box()
        assert box["y"] < 900
        assert box["y"] + box["height"] > 0
        view.locator("#tour-next").press("Enter")
    assert not view.locator("#tour").is_visible()
    assert view.evaluate("document.activeElement.id") == "tour-start"
    view.locator("#tour-start").press("Enter")
    view.keyboard.press("Escape")
    assert not view.locator("#tour").is_visible()


def rested(view):
    """All answers to a state are there, so that nothing moves any more."""
    until(view, "document.getElementById('index').textContent && !vibrissa.busy()")


@pytest.mark.parametrize("width", [700, 1280, 1600])
def test_no_link_moves_when_late_answers_come(view, served, width):
    view.set_viewport_size({"width": width, "height": 900})
    opened(view, served.root, **SHORT)
    rested(view)
    links = "[...document.querySelectorAll('#exports a, #save')].map(e => e.getBoundingClientRect().top)"
    after = view.evaluate(links)
    view.evaluate("document.getElementById('index').textContent = ''")
    assert view.evaluate(links) == after


def test_texture_b_and_single_pictures_are_taken_away(view, served, tmp_path):
    opened(view, served.root, **SHORT)
    rested(view)
    texts = []
    for letter in "ab":
        view.locator("#letter").select_option(letter)
        with view.expect_download() as waited:
            view.locator("#exports a", has_text="texture.csv").click()
        texts.append(waited.value.path().read_text())
    assert texts[0] != texts[1]
    view.locator("#picture").select_option("firing")
    with view.expect_download() as waited:
        view.locator("#save").click()
    assert waited.value.suggested_filename == "vibrissa-firing.png"
    with Image.open(waited.value.path()) as image:
        assert image.size == tuple(view.evaluate("(c => [c.width, c.height])(document.getElementById('firing'))"))
        assert len(image.getcolors(1 << 20)) > 10


def test_the_colours_of_the_spectrogram_are_cividis(view, served):
    opened(view, served.root, **SHORT)
    colours = view.evaluate("import('./palette.js').then(one => Array.from(one.palette))")
    expected = np.asarray(colormaps["cividis"](np.arange(256), bytes=True))[:, :3]
    np.testing.assert_array_equal(np.reshape(colours, (256, 3)), expected)
