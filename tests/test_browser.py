"""Notebook 11 in a real browser, with a real mouse: draw, drag, click, and be told."""

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import time

import numpy as np
import pytest
from places import ROOT

import dollop

pytest.importorskip("selenium", reason="a browser is moved by selenium, and it is missing")
pytest.importorskip("jupyterlab", reason="the notebook needs the extra notebooks")
pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")

BROWSERS = "chromium", "chromium-browser", "google-chrome"
BROWSER = next(filter(None, map(shutil.which, BROWSERS)), None)
DRIVER = shutil.which("chromedriver")
OPTIONS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--window-size=1400,1100"),
    *("--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"),
)
READY = """
const shown = [...window.jupyterapp.shell.widgets("main")].find(each => each.sessionContext);
return shown.sessionContext.isReady && shown.sessionContext.session.kernel.status === "idle";
"""
RUN_ALL = "window.jupyterapp.commands.execute('notebook:run-all-cells')"
TURN = np.linspace(-np.pi / 2, 3 * np.pi / 2, 25)
LOOP = np.column_stack([4.5 + 3.2 * np.cos(TURN), 3.5 + 1.25 * np.sin(TURN)])
PATIENCE = 120  # s

pytestmark = [
    pytest.mark.skipif(not BROWSER, reason=f"no browser: none of {', '.join(BROWSERS)} is installed"),
    pytest.mark.skipif(not DRIVER, reason="no chromedriver: it comes with the package chromium-driver, or with Chrome"),
]


def until(wanted, what):
    """What something comes to, when it does; it may not be there yet."""
    from selenium.common.exceptions import WebDriverException

    end, found = time.monotonic() + PATIENCE, None
    while time.monotonic() < end:
        try:
            found = wanted()
        except (WebDriverException, IndexError):
            found = None
        if found:
            return found
        time.sleep(0.1)
    raise AssertionError(f"waited for {what} in vain")


@pytest.fixture
def server(tmp_path):
    """The address of a JupyterLab that has the first cells of notebook 11, up to the room, and nothing else."""
    notebook = json.loads((ROOT / "notebooks" / "11_teach_it_yourself.ipynb").read_text(encoding="utf-8"))
    last = max(k for k, cell in enumerate(notebook["cells"]) if cell["source"] == ["room.figure.canvas"])
    notebook["cells"] = [cell for cell in notebook["cells"][: last + 1] if cell["cell_type"] == "code"]
    folder = tmp_path / "notebooks"
    folder.mkdir()
    (folder / "teach.ipynb").write_text(json.dumps(notebook), encoding="utf-8")
    (tmp_path / "data").symlink_to(ROOT / "data")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    places = ("JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR", "JUPYTERLAB_SETTINGS_DIR", "JUPYTERLAB_WORKSPACES_DIR")
    environment = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}
    environment |= {name: str(tmp_path / name.lower()) for name in places}
    settings = (
        *("--no-browser", "--allow-root", "--expose-app-in-browser", "--ip=127.0.0.1", f"--port={port}"),
        *("--IdentityProvider.token=", f"--ServerApp.root_dir={tmp_path}"),
        *("--LabApp.extension_manager=readonly", "--LabApp.news_url="),
    )
    with open(tmp_path / "server.log", "w") as log:
        running = subprocess.Popen(
            [sys.executable, "-m", "jupyterlab", *settings], env=environment, stdout=log, stderr=log
        )
    try:
        until(lambda: socket.socket().connect_ex(("127.0.0.1", port)) == 0, "JupyterLab")
        yield f"http://127.0.0.1:{port}/lab/tree/notebooks/teach.ipynb?reset"
    finally:
        running.terminate()
        running.wait(20)


@pytest.fixture
def browser(tmp_path):
    """A browser without a window."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    for each in (*OPTIONS, f"--user-data-dir={tmp_path / 'profile'}"):
        options.add_argument(each)
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    yield driver
    driver.save_screenshot(str(tmp_path / "last.png"))
    driver.quit()


class Hand:
    """A hand on the mouse, that knows where in the picture a place of the room is."""

    def __init__(self, browser):
        from dollop.replication.teaching.classroom import Classroom

        self.browser = browser
        self.canvas = until(lambda: self.found(".jupyter-matplotlib-canvas-div canvas")[-1], "the room")
        twin = Classroom(dollop.OccupancyGrid.load(ROOT / "data" / "lab.yaml"), live=False)
        self.to_pixels, self.size = twin.figure.axes[0].transData, twin.figure.canvas.get_width_height()
        browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", self.canvas)

    def found(self, selector):
        """Elements of the page."""
        return self.browser.find_elements("css selector", selector)

    def said(self):
        """The words over the plan."""
        return self.found(".said")[0].text

    def heard(self, words):
        """Wait for words over the plan, and return all of them."""
        return until(lambda: self.said() if words in self.said() else None, repr(words))

    def kidnap(self, place, tries=3):
        """Click while the robot drives; a hand that is so slow that it has finished lets it drive again."""
        for _ in range(tries):
            self.move(place)
            said = until(lambda: self.said_of("idnapped to", "was kidnapped", "Finished:"), "the end of a run")
            if "idnapped" in said:
                return
            next(each for each in self.found("button") if each.text == "drive again").click()
            self.heard("The robot drives")
        raise AssertionError(f"the robot was never met on its way in {tries} runs")

    def said_of(self, *words):
        """The words over the plan if they have one of some words."""
        said = self.said()
        return said if any(each in said for each in words) else None

    def move(self, *places):
        """Press at the first place in m, move on to the others, let go."""
        from selenium.webdriver import ActionChains

        wide, high = self.size
        pixels = self.to_pixels.transform(np.array(places, dtype=float))
        offsets = [(round(x - wide / 2), round(high / 2 - y)) for x, y in pixels]
        acts = ActionChains(self.browser, duration=15).move_to_element_with_offset(self.canvas, *offsets[0])
        acts.click_and_hold()
        for offset in offsets[1:]:
            acts.move_to_element_with_offset(self.canvas, *offset)
        acts.release().perform()


def test_a_walk_is_drawn_learned_driven_and_the_robot_kidnapped_in_a_browser(server, browser):
    """A loop round two cans: some six subgoals, no touch; a can is dragged, the robot kidnapped; it finishes each time.

    Then a walk through a desk: that is said, and what was learned stays.
    """
    browser.get(server)
    until(lambda: browser.execute_script(READY), "a kernel")
    browser.find_elements("css selector", ".jp-CodeCell .jp-InputPrompt")[0].click()
    browser.execute_script(RUN_ALL)
    hand = Hand(browser)
    hand.move((4.5, 5.2))
    hand.heard("nothing to drive yet")
    hand.move(*LOOP)
    found = int(re.match(r"(\d+) subgoals from one walk", hand.heard("subgoals"))[1])
    assert 4 <= found <= 8
    assert "touched nothing" in hand.heard("Finished")
    hand.move((6.5, 3.6), (6.3, 3.4), (6.1, 3.2), (6.0, 3.0))
    hand.heard("Object 1 has moved")
    hand.kidnap((4.4, 5.2))
    assert "touched nothing" in hand.heard("Finished although it was kidnapped")
    hand.move((2.0, 4.0), (2.0, 5.0), (2.0, 6.8))
    assert "through a wall or furniture" in hand.heard("Not so")
    assert len(hand.found("canvas")) > 0 and "Nothing has changed" in hand.said()
