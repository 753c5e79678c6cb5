"""The whole whisker in a browser: progress, the old pictures meanwhile, and the cut whisker beside the whole one."""

import time
import urllib.parse

import pytest
from real_browser import real_browser

from vibrissa.page.panel.presets import CLEAN, PRESETS

SHORT = {"a.length": "0.01", "b.length": "0.01"}
LONG = next(one.state for one in PRESETS if one.name == "Long free end")


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with real_browser(tmp_path_factory.mktemp("home")) as browser:
        yield browser


@pytest.fixture
def view(browser):
    context = browser.new_context(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
    yield context.new_page()
    context.close()


def until(view, condition, patience=120):
    stop = time.monotonic() + patience
    while not view.evaluate(condition):
        assert time.monotonic() < stop, f"{condition}; {view.inner_text('#error')}"
        time.sleep(0.01)


def opened(view, root, **state):
    view.goto("about:blank")
    view.goto(f"{root}#{urllib.parse.urlencode({**SHORT, **state})}")
    until(view, "globalThis.vibrissa?.shown() > 0 && !vibrissa.busy()")


def test_the_old_pictures_pale_and_stay_while_the_whole_whisker_is_computed(view, served):
    opened(view, served.root, **CLEAN)
    served.page.whole.end()  # so that it takes a moment
    shown = view.evaluate("vibrissa.shown()")
    view.evaluate(f"location.hash = '#{urllib.parse.urlencode({**SHORT, **LONG, 'friction': 0.37})}'")
    until(view, "!document.getElementById('computing').hidden")
    assert view.evaluate("document.getElementById('views').classList.contains('stale')")
    assert view.evaluate("vibrissa.data().model") is None
    assert view.evaluate("vibrissa.shown()") == shown
    until(view, "document.getElementById('share').value > 0")
    until(view, f"vibrissa.shown() > {shown} && !vibrissa.busy()")
    assert view.evaluate("vibrissa.data().model") == "rod"
    assert not view.evaluate("document.getElementById('views').classList.contains('stale')")
    until(view, "document.getElementById('computing').hidden")
    assert view.inner_text("#error") == ""


def test_a_move_made_meanwhile_is_answered_at_once(view, served):
    opened(view, served.root, **CLEAN)
    slow = urllib.parse.urlencode({**SHORT, **LONG, "speed": 0.01})
    view.evaluate(f"location.hash = '#{slow}'")
    until(view, "!document.getElementById('computing').hidden")
    before = view.evaluate("vibrissa.shown()")
    view.locator("#reset").click()
    until(view, f"vibrissa.shown() > {before}")
    assert view.evaluate("vibrissa.data().model") is None
    assert view.evaluate("document.getElementById('computing').hidden")


def test_both_whiskers_are_drawn_named_and_compared(view, served):
    opened(view, served.root, **CLEAN)
    assert not view.locator("#bridge").is_visible()
    opened(view, served.root, **LONG)
    assert view.locator("#bridge").is_visible()
    less = view.evaluate("vibrissa.data().less")
    assert less > 5
    about = view.inner_text("#bridge-about")
    assert "0.04 mm" in about
    assert "9.6 mm" in about
    assert f"{float(f'{less:.2g}'):g} times less" in about
    ink = """id => { const c = document.getElementById(id);
      return new Set(c.getContext('2d').getImageData(0, 0, c.width, c.height).data).size > 20; }"""
    assert all(view.evaluate(ink, name) for name in ("cut-close", "free-close", "bridge-trace"))
    assert view.get_attribute("#bridge-trace", "aria-label").endswith("times less")
    assert not view.locator("#exports a", has_text="study.zip").is_visible()
    until(view, "document.querySelectorAll('#notes li').length > 0")
    assert view.inner_text("#verdict-line") == "The model holds here."


def test_the_next_jump_is_one(view, served):
    opened(view, served.root, **CLEAN)
    times = []
    for _ in range(3):
        view.keyboard.press("j")
        times.append(view.evaluate("vibrissa.at()"))
    assert times == sorted(set(times))
    step = "Math.abs(vibrissa.data().excursion[i] - vibrissa.data().excursion[i - 1])"
    for moment in times:
        assert view.evaluate(f"(i => {step})(Math.round({moment} * 1e4))") > 20e-6
    before = view.evaluate("document.getElementById('close').toDataURL()")
    view.locator("#jump").press("Enter")
    assert view.evaluate("document.getElementById('close').toDataURL()") != before


def test_on_a_phone_nothing_is_cut_off(browser, served):
    context = browser.new_context(viewport={"width": 400, "height": 800}, reduced_motion="reduce")
    view = context.new_page()
    opened(view, served.root, **LONG)
    assert view.evaluate("document.documentElement.scrollWidth") <= 400
    for name in ("cut-close", "free-close", "bridge-trace"):
        box = view.locator(f"#{name}").bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 400
    context.close()
