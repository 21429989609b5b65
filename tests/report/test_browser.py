"""The report in a real browser: what it asks for, what its controls do, and whether it can be read by everybody."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest

AUDIT = Path(__file__).with_name("audit.js")
_SCREENSHOTS = Path(__file__).resolve().parents[2] / "out/screenshots"


class Opened:
    """A page and what it said and asked for since it was opened."""

    def __init__(self, browser: Any, report: Path, **how: Any) -> None:
        self.context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **how})
        self.page = self.context.new_page()
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self._hear(message.type, message.text))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(report.as_uri())

    def _hear(self, kind: str, text: str) -> None:
        # The driver of the software's WebGL says how long a screenshot took it; that is none of the page's doing.
        if kind in ("error", "warning") and "GL Driver Message" not in text:
            self.errors.append(text)

    def show_sheet(self) -> None:
        self.page.locator("#stage").scroll_into_view_if_needed()
        self.page.wait_for_selector("#view[data-light]")

    def view(self) -> npt.NDArray[np.int16]:
        """Pixels of the three-dimensional view."""
        data = np.frombuffer(self.page.locator("#view").screenshot(), np.uint8)
        return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.int16)

    def keep(self, name: str) -> None:
        """Keep a screenshot where a build server asks for it."""
        if os.environ.get("CI"):
            _SCREENSHOTS.mkdir(parents=True, exist_ok=True)
            self.page.screenshot(path=_SCREENSHOTS / f"report-{name}.png")


@pytest.fixture(scope="module")
def opened(browser: Any, report: Path) -> Iterator[Opened]:
    """The page in a small window, in light colours and without motion."""
    small = {"width": 900, "height": 700}
    found = Opened(browser, report, viewport=small, color_scheme="light", reduced_motion="reduce")
    yield found
    found.context.close()


@pytest.fixture
def sheet_shown(opened: Opened) -> Opened:
    """The same page with the sheet in view, as it was scanned, under the projector's light."""
    opened.show_sheet()
    opened.page.locator("#way").press("Home")
    opened.page.locator("input[name=shown][value=page]").check(force=True)
    opened.page.locator("input[name=light][value=white]").check(force=True)
    opened.page.wait_for_selector("#view[data-light=white]")
    return opened


def changed(before: npt.NDArray[np.int16], after: npt.NDArray[np.int16]) -> float:
    """Share of pixels that are no longer the same."""
    return float((np.abs(after - before).max(axis=-1) > 12).mean())


def test_opens_from_a_file_and_asks_for_nothing_else(opened: Opened, report: Path) -> None:
    opened.show_sheet()
    opened.keep("light")
    assert opened.requests == [report.as_uri()]
    assert opened.errors == []


def test_nothing_is_loaded_even_where_a_script_asks(browser: Any, short_report: Path) -> None:
    opened = Opened(browser, short_report)
    blocked = opened.page.evaluate(
        "() => fetch('http://127.0.0.1:9/').then(() => 'answered', () => 'refused')"
        ".then((said) => { const s = document.createElement('script'); s.textContent = 'window.ran = 1';"
        " document.body.append(s); return [said, window.ran === undefined] })"
    )
    assert blocked == ["refused", True]
    assert any("Content Security Policy" in error for error in opened.errors)
    opened.context.close()


def test_slider_flattens_the_sheet_by_keyboard(sheet_shown: Opened) -> None:
    page, slider = sheet_shown.page, sheet_shown.page.locator("#way")
    height = lambda: float(page.locator("#view").get_attribute("data-height-mm"))  # noqa: E731
    crumpled, top = sheet_shown.view(), height()
    slider.focus()
    page.keyboard.press("PageUp")
    between = height()
    page.keyboard.press("End")
    flat = sheet_shown.view()
    assert height() == 0.0
    assert 0.0 < between < top
    assert top > 10.0
    assert changed(crumpled, flat) > 0.05
    assert "highest point 0.0 mm" in slider.get_attribute("aria-valuetext")
    assert page.locator("#where").text_content() == slider.get_attribute("aria-valuetext")
    sheet_shown.keep("flat")
    page.keyboard.press("Home")
    assert changed(crumpled, sheet_shown.view()) == 0.0


def test_falls_by_a_button_and_without_motion_where_that_is_asked(sheet_shown: Opened) -> None:
    button, view = sheet_shown.page.locator("#fall"), sheet_shown.page.locator("#view")
    button.press("Enter")
    assert view.get_attribute("data-height-mm") == "0.000"
    button.press("Enter")
    assert float(view.get_attribute("data-height-mm")) > 10.0


def test_light_changes_the_picture_on_the_sheet(sheet_shown: Opened) -> None:
    page = sheet_shown.page
    white = sheet_shown.view()
    page.locator("input[name=light][value=white]").focus()
    seen = [white]
    for name in ("above", "raking", "uv", "backlight"):
        page.keyboard.press("ArrowRight")
        page.wait_for_selector(f"#view[data-light={name}]")
        seen.append(sheet_shown.view())
        assert all(changed(other, seen[-1]) > 0.1 for other in seen[:-1]), name


def test_error_is_coloured_with_a_scale_in_millimetres(sheet_shown: Opened) -> None:
    page, scale = sheet_shown.page, sheet_shown.page.locator("#scale")
    page.locator("#way").press("End")
    assert scale.is_hidden()
    grey = sheet_shown.view()
    page.locator("input[name=shown][value=page]").focus()
    page.keyboard.press("ArrowRight")
    assert scale.is_visible()
    assert "[mm]" in scale.text_content()
    coloured = sheet_shown.view()
    saturation = [float((np.ptp(image, axis=-1) > 40).mean()) for image in (grey, coloured)]
    assert saturation[0] < 0.01
    assert saturation[1] > 0.2
    sheet_shown.keep("error")


def test_view_turns_by_keys_and_buttons(sheet_shown: Opened) -> None:
    page = sheet_shown.page
    first = sheet_shown.view()
    page.locator("#view").press("ArrowLeft")
    turned = sheet_shown.view()
    page.get_by_role("button", name="Turn right").press("Enter")
    assert changed(first, turned) > 0.05
    assert changed(first, sheet_shown.view()) == 0.0
    page.get_by_role("button", name="From above").press("Enter")
    assert changed(first, sheet_shown.view()) > 0.05
    page.get_by_role("button", name="As at first").press("Enter")
    assert changed(first, sheet_shown.view()) == 0.0


def test_theme_can_be_chosen(opened: Opened) -> None:
    page = opened.page
    page.locator(".contents summary").press("Enter")
    ground = "getComputedStyle(document.body).backgroundColor"
    light = page.evaluate(ground)
    page.locator("input[name=theme][value=dark]").check(force=True)
    assert page.evaluate(ground) != light
    page.reload()
    assert page.evaluate(ground) != light
    page.locator(".contents summary").press("Enter")
    page.locator("input[name=theme][value=auto]").check(force=True)
    assert page.evaluate(ground) == light


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_all_text_has_the_contrast_of_wcag_aa(browser: Any, short_report: Path, scheme: str) -> None:
    opened = Opened(browser, short_report, color_scheme=scheme)
    opened.show_sheet()
    opened.keep(f"sheet-{scheme}")
    opened.page.evaluate("document.querySelectorAll('details').forEach((part) => { part.open = true })")
    opened.page.evaluate("document.getElementById('scale').hidden = false")
    opened.page.evaluate(AUDIT.read_text())
    found = opened.page.evaluate("contrasts()")
    opened.context.close()
    assert found["failures"] == []
    assert found["count"] > 20_000


def test_tab_key_reaches_every_control_in_order_and_shows_where_it_is(browser: Any, short_report: Path) -> None:
    opened = Opened(browser, short_report, color_scheme="light", reduced_motion="reduce")
    page = opened.page
    opened.show_sheet()
    page.evaluate(AUDIT.read_text())
    page.evaluate("scrollTo(0, 0)")
    n_stops = page.evaluate("stops().length")
    assert n_stops > 40
    for place in range(n_stops):
        page.keyboard.press("Tab")
        found = page.evaluate("focused()")
        assert found["place"] == place, found
        assert found["outlined"], found
    opened.context.close()


def test_folded_parts_open_by_keyboard_and_by_link(opened: Opened) -> None:
    page = opened.page
    claim = page.locator("details.claim").first
    claim.locator("summary").press("Enter")
    assert claim.locator("table").is_visible()
    claim.locator("summary").press("Enter")
    page.locator(".figures a").first.press("Enter")
    assert page.locator(f"details[id='{page.url.partition('#')[2]}']").get_attribute("open") is not None


def test_phone_scrolls_tables_in_their_box_and_the_page_not_across(browser: Any, report: Path) -> None:
    opened = Opened(browser, report, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    page = opened.page
    opened.show_sheet()
    opened.keep("phone")
    width = "[document.documentElement.scrollWidth, innerWidth]"
    assert page.evaluate(width) == [390, 390]
    page.evaluate("document.querySelectorAll('main details').forEach((part) => { part.open = true })")
    assert page.evaluate(width) == [390, 390]
    stays = page.evaluate(
        "() => { const boxes = [...document.querySelectorAll('.scroll')];"
        " const box = boxes.find((box) => box.scrollWidth > box.clientWidth + 200);"
        " box.scrollLeft = 200; const cell = box.querySelector('tbody th').getBoundingClientRect();"
        " return [box.scrollLeft, Math.abs(cell.left - box.getBoundingClientRect().left) < 2] }"
    )
    assert stays == [200, True]
    contents = page.locator(".contents details")
    assert contents.get_attribute("open") is None
    contents.locator("summary").press("Enter")
    page.locator(".contents a[href='#integrators']").press("Enter")
    assert contents.get_attribute("open") is None
    opened.context.close()


def test_without_scripts_all_but_the_moving_sheet_is_there(browser: Any, short_report: Path) -> None:
    opened = Opened(browser, short_report, java_script_enabled=False)
    page = opened.page
    assert page.locator("#view").is_hidden()
    assert page.get_by_text("Without scripts the sheet stands still").is_visible()
    assert page.locator(".light img").count() == 5
    assert page.locator("input:visible, button:visible").count() == 0
    page.locator("details.claim summary").first.click()
    assert page.locator("details.claim table").first.is_visible()
    assert page.locator("#corner-distance table").first.is_visible()
    opened.context.close()


def test_without_webgl_the_page_says_so(browser: Any, short_report: Path) -> None:
    opened = Opened(browser, short_report)
    page = opened.page
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.reload()
    page.locator("#sheet").scroll_into_view_if_needed()
    page.wait_for_selector("#no-view:visible")
    assert page.locator("#view").is_hidden()
    assert page.locator(".light img").first.is_visible()
    opened.context.close()
