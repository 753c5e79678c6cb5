"""axe-core, the common checker of accessibility, finds no fault on the pages, in either light and width."""

import json

import pytest
from corrected_pad import make_pad, served_pad
from real_browser import real_browser

from vibrissa.study.pick.pick_page import render_page

axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with real_browser(tmp_path_factory.mktemp("home")) as browser:
        yield browser


def faults(page):
    """What axe finds: the rule, and the elements that break it with the reason."""
    found = axe.Axe().run(page).response
    assert len(json.dumps(found["passes"])) > 1000  # it has looked
    return [
        (one["id"], [(node["html"][:100], node["failureSummary"][:200]) for node in one["nodes"]])
        for one in found["violations"]
    ]


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_has_no_fault(browser, served, width, scheme):
    context = browser.new_context(
        viewport={"width": width, "height": 844}, color_scheme=scheme, reduced_motion="reduce", bypass_csp=True
    )
    page = context.new_page()
    page.goto(f"{served.root}#a.length=0.01&b.length=0.01")
    page.wait_for_function(
        "globalThis.vibrissa?.shown() > 0 && !vibrissa.busy() && Boolean(vibrissa.other())", timeout=60_000
    )
    page.evaluate("document.querySelectorAll('details').forEach(one => { one.open = true; })")
    page.locator("#copy-python").click()
    page.wait_for_function("!document.getElementById('snippet').hidden")
    page.locator("#tour-start").click()
    assert faults(page) == []
    context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_of_pick_has_no_fault(browser, scheme):
    context = browser.new_context(color_scheme=scheme, bypass_csp=True)
    page = context.new_page()
    points = {"seeds": [[5, 5]], "names": [], "skin": [], "substrate": [], "base": "left", "polarity": "dark"}
    page.set_content(render_page({"movie": "m", "study": "s", "width": 90, "height": 90, **points}, "n0"))
    assert faults(page) == []
    context.close()


def test_axe_finds_a_fault_where_there_is_one(browser):
    page = browser.new_page()
    page.set_content("<html lang=en><title>x</title><main><h1>x</h1><input type=text></main>")
    assert [rule for rule, _ in faults(page)] == ["label"]


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 400])
def test_the_whole_whisker_its_progress_and_a_bad_state_have_no_fault(browser, served, width, scheme):
    context = browser.new_context(
        viewport={"width": width, "height": 844}, color_scheme=scheme, reduced_motion="reduce", bypass_csp=True
    )
    page = context.new_page()
    long = "hold=contact&contact=0.29&tip=0.05&base_angle=0.6&model=rod&a.length=0.01&b.length=0.01"
    slow = 0.02 + 1e-4 * (width == 400) + 2e-4 * (scheme == "dark")  # what was once computed is not computed again
    page.goto(f"{served.root}#{long}&speed={slow:.4f}")
    page.wait_for_function("!document.getElementById('computing').hidden", timeout=60_000)
    assert faults(page) == []
    page.goto("about:blank")
    page.goto(f"{served.root}#{long}")
    page.wait_for_function("globalThis.vibrissa?.shown() > 0 && !vibrissa.busy()", timeout=120_000)
    assert page.locator("#bridge").is_visible()
    assert faults(page) == []
    page.evaluate("location.hash += '&tip=0.29'")
    page.wait_for_function("!document.getElementById('error').hidden", timeout=60_000)
    assert faults(page) == []
    context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 400])
def test_the_page_to_correct_has_no_fault(browser, tmp_path, width, scheme):
    context = browser.new_context(viewport={"width": width, "height": 844}, color_scheme=scheme, bypass_csp=True)
    page = context.new_page()
    with served_pad(make_pad(tmp_path, 40, 3), tmp_path / "out.nc") as pad:
        page.goto(pad.root)
        page.wait_for_function("Boolean(globalThis.correct) && !correct.busy()", timeout=60_000)
        page.evaluate("document.getElementById('help').open = true")
        page.keyboard.press("ArrowDown")
        page.keyboard.press("n")
        page.wait_for_function("!document.getElementById('ask').hidden")
        assert faults(page) == []
    context.close()
