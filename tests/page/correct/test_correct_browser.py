"""The page to correct tracks in a real browser: every edit by keyboard, by mouse, in either width; what it shows."""

import time

import numpy as np
import pytest
from corrected_pad import make_pad, served_pad
from real_browser import real_browser

from vibrissa.netcdf import load
from vibrissa.video.correct.edit_file import read_edits, write_edits
from vibrissa.video.correct.edits import Edit

FRAMES, PATIENCE = 120, 60  # [s] of a loaded machine


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with real_browser(tmp_path_factory.mktemp("home")) as browser:
        yield browser


@pytest.fixture(scope="module")
def pad(tmp_path_factory):
    return make_pad(tmp_path_factory.mktemp("pad"), FRAMES)


class Hands:
    """A page, and what hands and eyes do with it."""

    def __init__(self, browser, served, width=1280, **more):
        self.served, self.wrong, self.asked = served, [], []
        self.context = browser.new_context(viewport={"width": width, "height": 900}, **more)
        self.page = self.context.new_page()
        self.page.on("console", lambda told: told.type == "error" and self.wrong.append(told.text))
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(served.root)
        self.until("Boolean(globalThis.correct) && !correct.busy()")

    def until(self, condition):
        stop = time.monotonic() + PATIENCE
        while not self.page.evaluate(condition):
            assert time.monotonic() < stop, f"{condition}; {self.page.inner_text('#message')}; {self.wrong}"
            time.sleep(0.02)

    def keys(self, *keys):
        for key in keys:
            self.page.keyboard.press(key)
        self.until("!correct.busy()")

    def answer(self, key, text):
        """Press a key that asks for a number, and give it."""
        self.page.keyboard.press(key)
        self.page.keyboard.type(text)
        self.keys("Enter")

    def ask(self, expression, given=None):
        return self.page.evaluate(expression, given)

    def select(self, whisker, frame):
        """A line of a whisker by keys alone: to a frame, then line by line."""
        self.answer("g", str(frame))
        for _ in range(30):
            self.keys("ArrowDown")
            if self.ask("correct.tracks.whisker[correct.selected()]") == whisker:
                return self.ask("correct.selected()")
        raise AssertionError(f"whisker {whisker} has no line in frame {frame}")

    def whisker(self, line):
        return self.ask(f"correct.tracks.whisker[{line}]")

    def names(self):
        return self.ask("Array.from(correct.tracks.whisker)")

    def edits(self):
        return read_edits(self.served.edits, self.served.opened.movie)


@pytest.fixture
def served(pad, tmp_path):
    with served_pad(pad, tmp_path / "out.nc") as served:
        yield served
    served.edits.unlink(missing_ok=True)


@pytest.fixture
def hands(browser, served):
    made = Hands(browser, served)
    yield made
    made.context.close()


def full_frame(pad):
    """A frame in the middle in which every whisker has a line."""
    owner, frame = pad.owner, load(pad.segments).segment_frame.values
    return next(f for f in range(40, FRAMES) if len(set(owner[(frame == f) & (owner >= 0)])) == 6)


def test_the_page_opens_with_both_pictures_and_asks_nobody_else(hands, pad):
    assert hands.wrong == []
    assert all(url.startswith(hands.served.root) for url in hands.asked)
    ink = "(id => { const c = document.getElementById(id), d = c.getContext('2d').getImageData(0, 0, c.width, c.height)"
    ink += ".data, seen = new Set(); for (let i = 0; i < d.length; i += 4) seen.add(`${d.slice(i, i + 3)}`);"
    ink += " return seen.size; })"
    for name in ("view", "overview"):
        assert hands.ask(f"{ink}('{name}')") > 50, name
    np.testing.assert_array_equal(hands.names(), hands.served.opened.correction.named.whisker)
    assert "6 whiskers, 0 edits" in hands.page.inner_text("#counts")


def test_a_join_that_is_refused_waits_for_another_piece(hands, pad):
    frame = full_frame(pad)
    first = hands.select(2, frame)
    hands.keys("j")
    hands.select(1, frame)
    hands.keys("j")
    assert "do not lie beside one another" in hands.page.inner_text("#message")
    assert "Select another piece" in hands.page.inner_text("#message")
    assert hands.ask("correct.anchor()") == first
    hands.keys("Escape")
    assert hands.ask("correct.anchor()") is None
    assert "0 edits" in hands.page.inner_text("#counts")


def test_with_shift_the_arrows_select_lines_that_have_a_name(hands, pad):
    hands.answer("g", str(full_frame(pad)))
    row = hands.ask("correct.tracks.byAngle(correct.frame()).map(s => correct.tracks.whisker[s])")
    named = [one for one in row if one >= 0]
    assert len(named) == 6
    for key, order in (("Shift+ArrowDown", named), ("Shift+ArrowUp", named[::-1])):
        hands.keys("Escape")
        reached = []
        for _ in range(7):  # and round to the first again
            hands.keys(key)
            reached.append(hands.ask("correct.tracks.whisker[correct.selected()]"))
        assert reached == [*order, order[0]]
    bare = row.index(-1)
    hands.keys("Escape", *["ArrowDown"] * (bare + 1), "x")
    assert "select a line that has a name: Shift+↑ ↓" in hands.page.inner_text("#message")


LIT = """(([canvas, down, beside]) => {
  const o = correct.overview, { x, y, w } = o.box, [a, b] = o.span.map(Math.round), lit = [];
  const d = (canvas === 'base' ? o.base : o.canvas).getContext('2d').getImageData(x, y + down, w, 1).data;
  for (let f = a; f <= b; f++) {
    const at = 4 * (Math.floor(o.X(f) - x) + (f > a ? -beside : beside)), [red, green, blue] = d.slice(at, at + 3);
    if (%s) lit.push(f);
  }
  return lit;
})"""
GROUND = LIT % "red === 0x2f && green === 0x3b && blue === 0x4f"
BAR = LIT % "red === 0x8a && green === 0xb8 && blue === 0xff"
CURSOR = LIT % "red > 0x80 && green > 0x80"


def ground(hands):
    """Shown frames on the ground that marks what an edit changed, beside the lines of the axes.

    Lines and numbers of whiskers may hide it in one row of the picture.
    """
    rows = hands.ask("[1, 0.25, 0.5, 0.75].map(at => at < 1 ? Math.round(at * correct.overview.box.h) : at)")
    return sorted({frame for row in rows for frame in hands.ask(GROUND, ["base", row, 3])})


def changes(before, after, frame):
    """Frames in which names changed, and what a message of them begins with."""
    frames = np.unique(frame[before != after])
    ways, count = np.unique([(before, after)], axis=-1, return_counts=True)
    label = {-1: "no name", -2: "no whisker"}
    lines = {
        f"{label.get(a, a)} → {label.get(b, b)}: {n} line{'s' * (n > 1)}"
        for (a, b), n in zip(ways[0].T.tolist(), count.tolist(), strict=True)
        if a != b
    }
    several = f"{frames.size} frames from {frames[0]} to {frames[-1]}"
    return frames.tolist(), f"Names changed in {several if frames.size > 1 else f'frame {frames[0]}'}. ", lines


@pytest.mark.parametrize("key", ["m3", "wd"])
def test_an_edit_its_undo_and_redo_report_frames_and_lines_by_name(hands, pad, key):
    """Also where the frames have gaps: those of a whole whisker that is not seen in all of them."""
    frame, before = load(pad.segments).segment_frame.values, np.array(hands.names())
    assert ground(hands) == []
    hands.select(2, full_frame(pad))
    edit = (lambda: hands.keys(*key)) if key == "wd" else (lambda: hands.answer(*key))
    for step in (edit, lambda: hands.keys("u"), lambda: hands.keys("r")):
        step()
        after = np.array(hands.names())
        frames, begin, ways = changes(before, after, frame)
        said, before = hands.page.inner_text("#message"), after
        assert said.startswith(begin)
        assert set(said.removeprefix(begin).split(". ")[0].split("; ")) == ways
        assert ground(hands) == frames
    assert key == "m3" or len(frames) < frames[-1] - frames[0] + 1


def test_an_edit_without_a_change_says_no_names_changed(hands, pad):
    hands.select(2, full_frame(pad))
    hands.answer("m", "3")
    before = hands.names()
    for step in (lambda: hands.answer("m", "3"), lambda: hands.keys("u"), lambda: hands.keys("r")):
        step()
        assert hands.names() == before
        assert hands.page.inner_text("#message").startswith("No names changed. ")
        assert ground(hands) == []


def test_an_arrow_and_a_key_lead_to_changed_frames_out_of_view(hands, pad):
    hands.select(2, full_frame(pad))
    hands.answer("m", "3")
    first, last = (lambda all: (all[0], all[-1]))(ground(hands))
    arrows = "(({ base, box: { x, y, w, ratio } }) => [x - 3 * ratio, x + w + 3 * ratio].map(at =>"
    arrows += " base.getContext('2d').getImageData(at, y - 5 * ratio, 1, 1).data[2] === 0xff))(correct.overview)"
    assert hands.ask(arrows) == [False, False]
    for span, seen in (([0, first - 1], [False, True]), ([last + 1, FRAMES - 1], [True, False])):
        hands.ask("span => { correct.overview.span = span; correct.overview.redraw(); }", span)
        assert hands.ask(arrows) == seen
        assert ground(hands) == []
    hands.keys("End", "e")
    assert hands.ask("correct.frame()") == first
    assert first in ground(hands)
    hands.keys("u", "Home", "u", "e")  # the last undo is refused; the one before changed the same frames
    assert hands.ask("correct.frame()") == first
    assert hands.page.locator("#keys dd", has_text="first frame in which the last edit changed names").count() == 1


def test_the_caption_says_what_the_brighter_ground_is(hands):
    assert "brighter ground: frames in which the last edit changed names" in hands.page.inner_text(".caption")


def test_the_cursor_leaves_a_single_changed_frame_in_view(hands, pad):
    frame = full_frame(pad)
    hands.select(3, frame)
    hands.keys("Shift+D", "Escape")
    assert ground(hands) == [frame]
    assert hands.ask(BAR, ["canvas", -4, 0]) == [frame]
    assert hands.ask(CURSOR, ["canvas", 1, 0]) == [frame]


@pytest.mark.parametrize("changed", [0, 7777, 19999])
def test_one_changed_frame_of_a_long_movie_is_three_pixels_wide(hands, changed):
    lit = "changed => { const o = correct.overview; o.axes = () => {}; o.tracks.changed = [changed];"
    lit += " o.span = [0, 19999]; o.redraw();"
    lit += " const d = o.base.getContext('2d').getImageData(0, o.box.y - 5 * o.box.ratio, o.base.width, 1).data;"
    lit += " return d.filter((v, i) => i % 4 === 0 && v === 0x8a && d[i + 2] === 0xff).length / o.ratio; }"
    assert hands.ask(lit, changed) == 3


def test_the_range_is_seen_in_a_narrow_window_without_scrolling(hands, pad):
    hands.page.set_viewport_size({"width": 390, "height": 800})
    hands.select(2, full_frame(pad))
    hands.ask("scrollTo(0, 0)")
    hands.answer("m", "3")
    box = hands.page.locator("#message").bounding_box()
    at = [box["x"] + 5, box["y"] + 10]
    assert hands.ask("scrollY") == 0
    assert hands.page.inner_text("#message").startswith("Names changed in ")
    assert hands.ask("([x, y]) => document.elementFromPoint(x, y)?.id", at) == "message"


def test_every_edit_by_keyboard_with_undo_and_redo(hands, pad):
    """Name, mark, split, join, swap, delete; the file beside the profile follows; all undone is as it was."""
    start, frame = hands.names(), full_frame(pad)
    line = hands.select(2, frame)
    hands.answer("n", "4")
    assert hands.whisker(line) == 4
    hands.select(1, frame)
    hands.keys("s")
    rest = hands.ask("correct.selected()")
    assert hands.whisker(rest) == -1
    hands.keys("j")
    hands.select(
        1,
        frame - 1
        if hands.ask(f"correct.tracks.inFrame({frame - 1}).some(s => correct.tracks.whisker[s] === 1)")
        else frame - 2,
    )
    hands.keys("j")
    assert hands.whisker(rest) == 1
    five = hands.select(5, frame)
    hands.answer("x", "0")
    assert hands.whisker(five) == 0
    zero = hands.select(5, frame)
    hands.answer("m", "5")
    assert hands.whisker(zero) == 5
    three = hands.select(3, frame)
    hands.keys("Delete")
    assert hands.whisker(three) == -2
    assert [one.do for one in hands.edits()] == ["name", "split", "join", "swap", "mark", "delete"]
    end = hands.names()
    for _ in range(6):
        hands.keys("u")
    assert hands.names() == start
    assert hands.edits() == []
    hands.keys("u")
    assert "undo must follow an edit" in hands.page.inner_text("#message")
    for _ in range(6):
        hands.keys("Control+y")
    assert hands.names() == end
    assert hands.wrong == [one for one in hands.wrong if "422" in one]  # the browser's own word on the refusal


def test_what_was_done_is_saved_and_found_again(hands, pad, browser, tmp_path):
    frame = full_frame(pad)
    hands.select(3, frame)
    hands.keys("w", "d")
    names = hands.names()
    hands.keys("Control+s")
    hands.until("document.getElementById('message').textContent.includes('out.nc')")
    assert load(hands.served.out).sizes["whisker"] == 5
    with served_pad(pad, tmp_path / "again.nc") as again:
        later = Hands(browser, again)
        assert later.names() == names
        assert "1 edit in" in later.page.inner_text("#counts")
        later.context.close()


def test_a_new_whisker_and_refusals_of_numbers(hands, pad):
    line = hands.select(2, full_frame(pad))
    hands.answer("n", "9")
    assert "from 0 to 5, or +" in hands.page.inner_text("#message")
    hands.page.keyboard.press("Escape")
    hands.answer("n", "+")
    assert hands.whisker(line) == 6
    assert "7 whiskers" in hands.page.inner_text("#counts")


def test_a_name_that_a_mark_gave_and_the_part_that_was_tracked_are_shown(browser, served, pad):
    served.session.tracked |= {"numbers": [1, 2, 0, 3, 4, 5], "part": [20, 79]}
    served.session.correction.apply(Edit(do="call", whisker=2, label="C1"))
    hands = Hands(browser, served)
    assert hands.ask("correct.frame()") == 20
    assert hands.ask("correct.overview.span") == [20, 79]
    wide = "[...document.querySelectorAll('#whiskers button')].filter(e => e.scrollWidth > e.clientWidth).length"
    assert hands.ask(wide) == 0
    assert hands.page.inner_text("#whiskers").startswith("C1 (0): ")
    line = hands.select(3, full_frame(pad))
    hands.answer("n", "C1")
    assert hands.whisker(line) == 2
    hands.until("document.getElementById('where').textContent.includes('whisker C1 (0), ')")
    assert "is whisker C1 (0)" in hands.page.inner_text("#message")
    line = hands.select(4, full_frame(pad))
    hands.answer("n", "2")  # as the profile counts
    assert hands.page.inner_text("#message").count("is whisker 2") == 1
    assert hands.whisker(line) == 1
    hands.answer("x", "0")
    assert "hiskers 2 and C1 (0) exchange names" in hands.page.inner_text("#message")
    hands.context.close()


def test_a_whisker_is_called_by_hand_and_a_line_alone_deleted(hands, pad):
    frame = full_frame(pad)
    line = hands.select(3, frame)
    hands.answer("c", "C2")
    assert hands.page.inner_text("#message") == "Whisker 3 is called C2"
    assert "C2 (3): " in hands.page.inner_text("#whiskers")
    hands.until("document.getElementById('where').textContent.includes('whisker C2 (3), ')")
    hands.select(4, frame)
    hands.answer("c", "c2")
    assert "name must not be that of whisker C2 (3), got c2" in hands.page.inner_text("#message")
    assert hands.page.input_value("#number") == "c2"  # to be changed
    hands.page.keyboard.type("C1")
    hands.keys("Enter")
    assert "C1 (4): " in hands.page.inner_text("#whiskers")
    hands.page.keyboard.press("c")
    assert hands.page.inner_text("#asked").startswith("Whisker C1 (4) is called")
    hands.ask(f"correct.select({line})")  # the question was about another whisker
    assert hands.page.is_hidden("#ask")
    hands.keys("w", "Shift+D")  # the line alone, whatever delete concerns
    assert hands.whisker(line) == -2
    assert hands.ask("Array.from(correct.tracks.whisker).filter(k => k === -2).length") == 1
    assert [one.do for one in hands.edits()] == ["call", "call", "delete"]
    hands.keys("u", "u")
    assert hands.whisker(line) == 3
    assert "C1" not in hands.page.inner_text("#whiskers")
    assert hands.page.inner_text("#message") == "Undone: whisker 4 is called 4 again"
    hands.keys("r")
    assert hands.page.inner_text("#message") == "Redone: whisker 4 is called C1"
    hands.keys("u")
    hands.page.keyboard.press("c")
    hands.keys("Delete", "Enter")
    assert hands.page.inner_text("#message") == "Whisker 3 is called 3"
    assert "C2" not in hands.page.inner_text("#whiskers")
    hands.page.locator("#end").click()
    hands.until("document.getElementById('message').textContent.includes('the profile was not saved with them')")


def test_a_long_name_leaves_the_list_as_wide_as_it_is(hands, pad):
    hands.select(3, full_frame(pad))
    name = "W" * 40
    hands.answer("c", name)
    listed = hands.page.locator("#whiskers button", has_text=name)
    assert listed.get_attribute("title") == f"{name} (3)"
    assert hands.ask("(list => list.scrollWidth - list.clientWidth)(document.getElementById('whiskers'))") <= 0
    assert hands.ask("correct.tracks.name(3)") == "W" * 11 + "…"


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1024, 500), (390, 700)])
@pytest.mark.parametrize("size", [15, 24])
def test_a_question_what_is_said_of_its_answer_and_the_save_are_in_view_together(hands, pad, width, height, size):
    hands.select(3, full_frame(pad))
    hands.answer("c", "W" * 40)
    hands.page.set_viewport_size({"width": width, "height": height})
    hands.ask(f"document.body.style.fontSize = '{size}px'")
    seen = "([x, y, part]) => document.elementFromPoint(x, y)?.matches(part) ?? false"
    hands.answer("n", "99")
    for part in ("#message", "#number", "#cancel", "#asked", "[data-key=save]"):
        box = hands.page.locator(part).bounding_box()
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] - 2
        assert hands.ask(seen, [*middle, part]), part
        assert box["x"] + box["width"] <= width


@pytest.mark.parametrize("height", [720, 900])
def test_a_long_message_and_a_question_move_nothing(hands, pad, height):
    hands.page.set_viewport_size({"width": 1280, "height": height})
    hands.select(3, full_frame(pad))
    parts = "['#whiskers button', '#whiskers li:last-child button', '#whole', '#overview', '#message'].map(part => {"
    parts += " const one = document.querySelector(part), { x, y, width, height } = one.getBoundingClientRect();"
    parts += " return [y, height, document.elementFromPoint(x + width / 2, y + height / 2) === one]; })"
    before = hands.ask(parts)
    hands.ask("document.getElementById('message').textContent = 'Names changed; '.repeat(80)")
    hands.page.keyboard.press("n")
    assert hands.page.is_visible("#ask")
    after = hands.ask(parts)
    assert after[:4] == before[:4]
    assert all(seen for _, _, seen in after)
    scrolled = "(said => [said.clientHeight, said.scrollHeight, said.scrollTop = 999, said.scrollTop])"
    height, whole, _, down = hands.ask(scrolled + "(document.getElementById('message'))")
    assert down == whole - height > 0


def test_what_is_typed_after_a_refused_question_is_no_key(hands, pad):
    line = next(s for s in hands.ask(f"correct.tracks.inFrame({full_frame(pad)})") if hands.whisker(s) < 0)
    hands.ask(f"correct.select({line})")
    hands.page.keyboard.type("cD1sx")
    assert "select a line that has a name" in hands.page.inner_text("#message")
    assert not hands.served.edits.exists()
    assert hands.whisker(line) == -1


def test_while_the_movie_plays_the_frame_is_told_and_a_question_stops_it(hands, pad):
    hands.select(3, full_frame(pad))
    hands.keys("Home")
    hands.page.keyboard.press(" ")
    hands.until("/Frame ([5-9]|[1-9][0-9]) of/.test(document.getElementById('where').textContent)")
    assert hands.page.get_attribute("#play", "aria-pressed") == "true"
    hands.page.keyboard.press("c")
    assert hands.page.get_attribute("#play", "aria-pressed") == "false"


def test_a_click_selects_a_line_in_the_frame_and_a_piece_in_the_picture_of_angles(hands, pad):
    line = hands.select(4, full_frame(pad))
    hands.keys("Escape")
    assert hands.ask("correct.selected()") is None
    box = hands.page.locator("#overview").bounding_box()
    x, y = hands.ask(f"[correct.X({full_frame(pad)}), correct.Y(correct.tracks.angle[{line}])]")
    hands.page.mouse.click(box["x"] + x, box["y"] + y)
    hands.until("correct.selected() !== null")
    assert hands.whisker(hands.ask("correct.selected()")) == 4
    hands.keys("Escape")
    column, row = hands.ask(
        f"(([a, b]) => [correct.tracks.column[b - 1], correct.tracks.row[b - 1]])(correct.tracks.points({line}))"
    )
    hands.ask(f"correct.go({full_frame(pad)})")
    hands.until("!correct.busy()")
    left, top, zoom = hands.ask("(v => [v.left, v.top, v.zoom])(correct.view)")
    box = hands.page.locator("#view").bounding_box()
    hands.page.mouse.click(box["x"] + (column + 0.5 - left) * zoom, box["y"] + (row + 0.5 - top) * zoom)
    assert hands.ask("correct.selected()") == line


def test_frames_are_followed_by_keys_and_slider(hands):
    hands.keys("ArrowRight", "Shift+ArrowRight", "PageDown")
    assert hands.ask("correct.frame()") == 61
    hands.keys("End", "ArrowRight")
    assert hands.ask("correct.frame()") == FRAMES - 1
    hands.keys("Home")
    hands.page.locator("#slider").press("ArrowRight")
    hands.until("!correct.busy()")
    assert hands.ask("correct.frame()") == 1
    hands.page.locator("#frame").fill("77")
    hands.page.locator("#frame").press("Enter")
    hands.until("correct.frame() === 77")
    hands.page.locator("#view").focus()
    hands.keys(".")
    line = hands.ask("correct.selected()")
    assert hands.ask(f"correct.tracks.doubts.includes({line})")
    assert hands.ask("correct.frame()") >= 77


def test_what_is_selected_is_said_once_hands_rest(hands, pad):
    hands.select(4, full_frame(pad))
    hands.until("document.getElementById('where').textContent.includes('whisker 4')")
    assert hands.page.get_attribute("#where", "aria-live") == "polite"
    assert hands.page.get_attribute("#message", "aria-live") == "polite"


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 800, 390])
def test_nothing_is_cut_off_and_everything_has_a_name(browser, served, width, scheme):
    hands = Hands(browser, served, width, color_scheme=scheme)
    assert hands.ask("document.documentElement.scrollWidth") <= width
    nameless = "[...document.querySelectorAll('input, button')].filter(e => !e.labels?.length && "
    nameless += "!e.getAttribute('aria-label') && !e.textContent.trim()).map(e => e.outerHTML)"
    assert hands.ask(nameless) == []
    for name in ("view", "overview"):
        box = hands.page.locator(f"#{name}").bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width
        assert hands.page.get_attribute(f"#{name}", "aria-label")
    assert hands.ask("(side => side.scrollHeight - side.clientHeight)(document.getElementById('side'))") <= 1
    hands.context.close()


def test_the_end_stops_the_program_and_the_page_says_so(hands):
    hands.page.locator("#end").click()
    hands.until("document.getElementById('message').textContent.startsWith('Ended')")
    stop = time.monotonic() + PATIENCE
    while hands.served.alive():
        assert time.monotonic() < stop
        time.sleep(0.02)


@pytest.mark.parametrize("saved", [False, True])
def test_the_end_says_after_a_reload_whether_the_profile_has_the_edits(hands, saved):
    hands.select(2, 20)
    hands.keys("d")
    if saved:
        hands.page.locator("[data-key=save]").click()
        hands.until("document.getElementById('message').textContent.startsWith('The corrected profile')")
    hands.page.reload()
    hands.until("Boolean(globalThis.correct) && !correct.busy()")
    hands.page.locator("#end").click()
    hands.until("document.getElementById('message').textContent.startsWith('Ended')")
    assert ("the profile was not saved with them" in hands.page.inner_text("#message")) == (not saved)


def test_edits_of_another_program_are_refused_in_a_line_and_the_page_stays_usable(hands, served):
    write_edits(served.edits, served.opened.movie, [Edit(do="call", whisker=1, label="A1")])
    line = hands.select(2, 20)
    hands.keys("d")
    said = hands.page.inner_text("#message")
    assert "must hold the edits that this page last read or wrote, 0 edits, got 1" in said
    assert hands.whisker(line) == 2
    served.edits.unlink()
    hands.keys("d")
    assert hands.whisker(line) == -2


def test_every_axis_has_a_scale(hands):
    """Two ticks at least, all within the range, at even steps; frames at whole ones."""
    ask = "a => import('./overview.js').then(it => it.ticks(...a))"
    for low in (-170.3, -58.7, 0.0, 61.5):
        for size in (0.7, 1.7, 2.1, 7.0, 38.0, 59.0, 95.0, 300.0):
            for most in (0.5, 1.2, 2.0, 9.0):
                found = hands.ask(ask, [low, low + size, most])
                assert len(found) >= 2, (low, size, most)
                assert low <= found[0]
                assert found[-1] <= low + size + 1e-9
                assert np.diff(found) == pytest.approx(np.diff(found)[0])
    assert hands.ask(ask, [0, 2.5, 9, 1]) == [0, 1, 2]


def test_the_end_waits_for_a_save(hands):
    session, save = hands.served.session, hands.served.session.save

    def slowly():
        time.sleep(1.0)
        return save()

    session.save = slowly
    hands.ask("(document.querySelector('.save').click(), document.getElementById('end').click())")
    hands.until("document.getElementById('message').textContent.startsWith('Ended')")
    assert load(hands.served.out).sizes["whisker"] == 6


def test_hostile_names_are_shown_as_text(browser, served):
    served.session.movie = served.session.movie._replace(name="<img src=x onerror=alert(1)>.mkv")
    hands = Hands(browser, served)
    assert hands.ask("document.querySelectorAll('img').length") == 0
    assert "<img" in hands.page.inner_text("#title")
    assert hands.wrong == []
    hands.context.close()
