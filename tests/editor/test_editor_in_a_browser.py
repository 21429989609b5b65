"""The editor as its user meets it: a server of its own, and a headless Chromium that paints, changes and saves."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from deskew import io
from deskew.cli import main

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync")  # fmt: skip
SCREENSHOTS = Path("out/screenshots")
PATIENCE_MS = 60_000

# Whether every text of the page stands out against its ground as WCAG's level AA wants it.
CONTRASTS = """root => {
  const channel = v => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const parse = text => (text.match(/[\\d.]+/g) ?? []).map(Number);
  const luminance = ([r, g, b]) => 0.2126 * channel(r) + 0.7152 * channel(g) + 0.0722 * channel(b);
  const ground = element => {
    for (let e = element; e; e = e.parentElement) {
      const colour = parse(getComputedStyle(e).backgroundColor);
      if (colour.length === 3 || colour[3] === 1) return colour;
    }
  };
  const faint = [];
  for (const element of root.querySelectorAll("*")) {
    const own = [...element.childNodes].some(node => node.nodeType === 3 && node.textContent.trim());
    const typed = element.matches("input[type=text], input[type=number]");
    if (!(own || typed) || element.disabled || !element.checkVisibility()) continue;
    const pair = [parse(getComputedStyle(element).color), ground(element)].map(luminance).sort((a, b) => b - a);
    const ratio = (pair[0] + 0.05) / (pair[1] + 0.05);
    if (!(ratio >= 4.5)) faint.push(`${element.className || element.tagName} ${ratio.toFixed(2)}`);
  }
  return faint;
}"""


pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium, chromium-browser or google-chrome here")


@dataclass
class Editor:
    """A running `deskew edit`."""

    address: str
    process: subprocess.Popen[str]
    folder: Path

    @property
    def origin(self) -> str:
        return self.address.split("/?")[0]


def started(folder: Path, scan_file: Path) -> Editor:
    command = [sys.executable, "-m", "deskew", "edit", str(scan_file), "-o", "map.png", "--no-browser", "--port", "0"]
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    process = subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True, env=environment)
    assert process.stderr is not None
    said = ""
    for line in process.stderr:
        said += line
        found = re.search(r"http://127\.0\.0\.1:\d+/\?access_token=\S+", line)
        if found:
            return Editor(found.group(), process, folder)
    raise AssertionError(said)


@pytest.fixture
def editor(tmp_path: Path, scan_file: Path) -> Iterator[Editor]:
    running = started(tmp_path, scan_file)
    with running.process as process:
        yield running
        if process.poll() is None:
            process.kill()


@dataclass
class Window:
    """A browser's window on the editor, and what it complained of or asked elsewhere."""

    page: Any
    complaints: list[str] = field(default_factory=list)
    foreign: list[str] = field(default_factory=list)

    @property
    def bench(self) -> Any:
        return self.page.locator("main.bench")

    def opened(self, editor: Editor) -> None:
        self.page.on("console", lambda m: self.complaints.append(m.text) if m.type == "error" else None)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        own = (editor.origin, editor.origin.replace("http", "ws"), "data:", "blob:")

        def note(asked: Any) -> None:
            if not asked.url.startswith(own):
                self.foreign.append(asked.url)

        self.page.on("request", note)
        self.page.on("websocket", note)
        self.page.goto(editor.address)
        self.answered(0)

    def answers(self) -> int:
        return int(self.bench.get_attribute("data-answers") or 0)

    def answered(self, before: int) -> None:
        """Wait until the page was answered once more than `before`, and shows it."""
        self.page.wait_for_function(
            "([bench, n]) => Number(bench.dataset.answers ?? 0) > n && bench.getAttribute('aria-busy') === 'false'",
            arg=[self.bench.element_handle(timeout=PATIENCE_MS), before],
            timeout=PATIENCE_MS,
        )

    def after(self, act: Callable[[], object]) -> None:
        before = self.answers()
        act()
        self.answered(before)

    def picture(self, selector: str) -> list[float]:
        """Return a picture's pixels, as the browser has decoded them."""
        got: list[float] = self.bench.locator(selector).evaluate(
            """image => {
              const canvas = document.createElement("canvas");
              [canvas.width, canvas.height] = [64, 48];
              const pen = canvas.getContext("2d");
              pen.drawImage(image, 0, 0, 64, 48);
              return [...pen.getImageData(0, 0, 64, 48).data];
            }"""
        )
        return got

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag over the photograph; places are shares of its width and height."""
        box = self.bench.locator("canvas").bounding_box()
        places = [(box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in (start, end)]
        self.page.mouse.move(*places[0])
        self.page.mouse.down()
        self.page.mouse.move(*places[1], steps=8)
        self.page.mouse.up()

    def screenshot(self, name: str) -> None:
        if os.environ.get("CI"):
            SCREENSHOTS.mkdir(parents=True, exist_ok=True)
            self.page.screenshot(path=SCREENSHOTS / f"editor-{name}.png", full_page=True)


@pytest.fixture
def window() -> Iterator[Window]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play, play.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS)) as browser:
        yield Window(browser.new_page(viewport={"width": 1440, "height": 1250}))


def status(address: str, **headers: str) -> tuple[int, str, str]:
    """Ask without a browser; status, where it leads, and the text."""

    class Stay(urllib.request.HTTPRedirectHandler):
        def redirect_request(self, *_: object) -> None:
            return None

    try:
        with urllib.request.build_opener(Stay).open(urllib.request.Request(address, headers=headers)) as answer:
            return answer.status, "", answer.read().decode()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.headers.get("location", ""), error.read().decode()


def refuses_strangers(editor: Editor) -> None:
    from websockets.exceptions import ConnectionClosed, InvalidStatus
    from websockets.sync.client import connect

    assert status(editor.origin)[:2] == (303, "/auth/login?next=%2F")
    assert "bench" not in status(f"{editor.origin}/auth/login")[2]
    assert status(f"{editor.origin}/?access_token=guess")[1].startswith("/auth/login")
    assert status(f"{editor.origin}/api/status")[0] == 401
    assert status(f"{editor.origin}/@file/1-a.js")[0] in (401, 403)
    socket = editor.origin.replace("http", "ws") + "/ws?session_id=s_stranger"
    for origin in (editor.origin, "https://other.example"):
        with pytest.raises((InvalidStatus, ConnectionClosed)), connect(socket, origin=origin) as connection:
            connection.recv(timeout=20)
    # A name of another site that was bound to 127.0.0.1, and another site's page that knows even the token.
    assert status(editor.address, Host="rebound.example")[0] == 403
    assert status(editor.address, Origin="https://other.example")[0] == 403


def test_paint_change_save_and_reload(editor: Editor, window: Window, scan_file: Path, capsys: Any) -> None:
    refuses_strangers(editor)
    window.opened(editor)
    assert "access_token" not in window.page.url
    bench = window.bench
    assert bench.locator(".difference").is_hidden()
    first = window.picture(".restored-image")

    window.after(lambda: bench.locator(".add").click())
    bench.get_by_text("Rectangle", exact=True).click()
    window.after(lambda: window.drag((0.21, 0.26), (0.81, 0.75)))
    stiffness = bench.locator("[data-key=number-1]")

    def soften() -> None:
        stiffness.fill("0.3")
        stiffness.press("Enter")

    window.after(soften)
    changed = window.picture(".restored-image")
    assert np.abs(np.subtract(changed, first)).max() > 20
    assert bench.locator(".difference").is_visible()
    assert "mm" in bench.locator(".figures").inner_text()
    window.screenshot("light")
    assert bench.evaluate(CONTRASTS) == []

    window.page.emulate_media(color_scheme="dark")
    assert bench.evaluate(CONTRASTS) == []
    window.screenshot("dark")
    window.page.set_viewport_size({"width": 390, "height": 844})
    assert window.page.evaluate("document.querySelector('#App').scrollWidth") <= 390
    window.screenshot("phone")
    window.page.set_viewport_size({"width": 1440, "height": 1250})

    painted = window.picture(".overlay")
    window.page.reload()
    window.answered(0)
    assert window.picture(".overlay") == painted
    assert bench.locator("[data-key=number-1]").input_value() == "0.3"
    assert window.picture(".restored-image") == changed

    window.after(lambda: bench.locator(".save-map").click())
    window.after(lambda: bench.locator(".save-restored").click())
    assert "map-restored.png" in bench.locator(".said").inner_text()
    assert (window.complaints, window.foreign) == ([], [])

    editor.process.send_signal(signal.SIGINT)
    assert editor.process.wait(timeout=60) == 0
    assert editor.process.stderr.read() == ""
    found = io.read_stiffness(editor.folder / "map.png")
    assert dict(found.constants) == {0: 30.0, 1: 0.3}
    assert (found.labels == 1).mean() == pytest.approx(0.60 * 0.49, abs=0.01)
    assert main(f"restore {scan_file} -o {editor.folder}/own.png --stiffness {editor.folder}/map.png".split()) == 0
    capsys.readouterr()
    assert (editor.folder / "own.png").read_bytes() == (editor.folder / "map-restored.png").read_bytes()


def test_everything_is_done_by_keyboard(editor: Editor, window: Window) -> None:
    window.opened(editor)
    bench, keyboard = window.bench, window.page.keyboard

    def reached(selector: str) -> None:
        """Walk by Tab until the focus is there, and can be seen."""
        wanted = bench.locator(selector).element_handle()
        for _ in range(60):
            keyboard.press("Tab")
            if wanted.evaluate("element => element.getRootNode().activeElement === element"):
                assert wanted.evaluate("element => element.matches(':focus-visible')")
                return
        raise AssertionError(selector)

    reached("[name=tool]:checked")
    keyboard.press("ArrowRight")  # from the brush to the rectangle
    reached("canvas")
    for _ in range(12):
        keyboard.press("ArrowLeft")
    keyboard.press("Space")
    for _ in range(20):
        keyboard.press("ArrowRight")
    keyboard.press("Shift+ArrowDown")
    reached("summary")
    keyboard.press("Shift+Tab")
    assert bench.locator(".place").inner_text() == "Cross at x 504, y 289 px"
    window.after(lambda: (bench.locator(".add").focus(), keyboard.press("Enter")))
    bench.locator("[data-key=use-1]").focus()
    reached("[data-key=number-1]")
    keyboard.press("Control+a")
    keyboard.type("0.3")
    window.after(lambda: keyboard.press("Enter"))
    assert bench.locator("[data-key=number-1]").evaluate("element => element.getRootNode().activeElement === element")

    name = bench.locator("[data-key=name-1]")
    name.focus()
    keyboard.press("Control+a")
    keyboard.type("vell")
    window.after(lambda: bench.locator(".undo").evaluate("undo => undo.click()"))
    assert name.input_value() == "vell"  # an answer that comes while somebody types takes nothing away
    keyboard.type("um")
    window.after(lambda: keyboard.press("Tab"))
    assert bench.locator("[data-key=name-1]").input_value() == "vellum"
    window.after(lambda: bench.locator("[data-key=number-1]").fill("0.3") or keyboard.press("Enter"))

    bench.locator("summary").focus()
    keyboard.press("Enter")
    reached(".points")
    keyboard.type("160,150 620,430")
    window.after(lambda: keyboard.press("Enter"))
    assert io.read_arrays(editor.folder / "map.draft.npz")["labels"].sum() == 461 * 281
    bench.locator("canvas").focus()
    window.after(lambda: keyboard.press("Control+z"))
    assert not io.read_arrays(editor.folder / "map.draft.npz")["labels"].any()
    window.after(lambda: keyboard.press("Control+Shift+Z"))
    window.after(lambda: keyboard.press("Control+s"))
    assert (io.read_stiffness(editor.folder / "map.png").labels == 1).sum() == 461 * 281
    assert (window.complaints, window.foreign) == ([], [])
