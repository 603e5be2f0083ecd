"""Every page in a real browser: nothing fails, nothing is loaded, and a reader gets about."""

import base64
import json
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.validation.commands import Make
from tests.validation.studies.calibration.test_calibration import rows as calibrated
from tests.validation.sweep.test_page import swept
from tests.validation.validate.test_page import ladder_of, validated
from validation.compare.claims import read_claims
from validation.compare.figures import overlay_figure
from validation.harness.figures import panels
from validation.harness.page import write_page
from validation.render.interactive import write_interactive
from validation.studies.bench import files as bench
from validation.studies.calibration.report import write_report as write_calibration
from validation.studies.evidence.report import Shown, write_evidence
from validation.studies.evidence.rows import EvidenceRow, Piece
from validation.studies.paper.ledger import Finding, by_place, counts, ledger
from validation.studies.stress.report import write_stress_page
from validation.studies.stress.stability_map import Answer
from validation.sweep.page import write_report as write_sweep

__all__ = ["validated"]  # a fixture

LAPTOP, PHONE = (1280, 800), (390, 844)
LEAST_TEXT = 11.5  # CSS pixels
PAPER = 980, 740  # CSS pixels within a margin of 1 cm: letter, landscape
Build = Callable[[Path, pytest.FixtureRequest], Path]


def figure(path: Path) -> Path:
    with panels(path, 2) as axes:
        axes[0, 0].plot([0, 1], [0, 1])
    return path


def validate_page(folder: Path, request: pytest.FixtureRequest) -> Path:
    make: Make = request.getfixturevalue("make_record")
    return request.getfixturevalue("validated")(ladder=ladder_of(make)) / "index.html"


def paper_page(folder: Path, request: pytest.FixtureRequest) -> Path:
    make: Make = request.getfixturevalue("make_record")
    claims = read_claims()
    found = {name: Finding(None, "not run in tests") for name in claims}
    found |= {name: Finding(c.number) for name, c in claims.items() if c.kind == "value"}
    rows = ledger(claims.values(), found)
    forces = folder / "fig-09.png"
    overlay_figure(forces, [make("hard"), make("soft")], (), ("hard", "soft"))
    factor = SimpleNamespace(factor=7e-5, uncertainty=1e-6, computed={"driven-1": 0.1},
                             printed={"driven-1": 0.1})  # fmt: skip
    context = {
        "rows": rows, "counts": counts(rows), "places": by_place(rows), "settled": 48, "total": 60,
        "found": SimpleNamespace(common=factor, by_case={}), "lasting": (1.0, 2.0),
        "figures": [(forces, "Fig. 9: reduced model against the reference")],
        "with_reference": False,
    }  # fmt: skip
    write_page(folder / "index.html", "paper.html.j2", context)
    return folder / "index.html"


def sweep_page(folder: Path, request: pytest.FixtureRequest) -> Path:
    return write_sweep(folder, *swept(folder))


def stress_page(folder: Path, request: pytest.FixtureRequest) -> Path:
    figure(folder / "plane.png")
    row = {"map": "plane", "solver": "hcm", "cells": 2, **dict.fromkeys(Answer, 0), Answer.RIGHT: 2,
           "what limits it": "every cell is right"}  # fmt: skip
    write_stress_page(folder, [row], [{"cell": "a hard one", "hcm": "completed"}], [])
    return folder / "index.html"


def bench_page(folder: Path, request: pytest.FixtureRequest) -> Path:
    many = [{"setting": f"step {n}", "time_s": 0.1 * n, "error": 1e-3 / n} for n in range(1, 20)]
    with bench.measured_part(folder, True, "work-precision"):
        bench.save(folder, "work-precision", many, "Every setting", show=False)
    with bench.measured_part(folder, True, "skips"):
        bench.save(folder, "skips", many[:3], "Shortcuts", show=False)
        figure(folder / "skips.png")
    return bench.page(folder)


def calibration_page(folder: Path, request: pytest.FixtureRequest) -> Path:
    write_calibration(folder, "hcm", calibrated((1.0, 5.0), (1.0, 0.5)), {"peak": "peak force"})
    return folder / "hcm.html"


def evidence_page(folder: Path, request: pytest.FixtureRequest) -> Path:
    for name in ("taps", "tap-soft", "tap-hard"):
        figure(folder / f"{name}.png")
    ball = Piece("ball", "A ball on a wall", "contact", "a book", "Hertz", (), lambda *given: [])
    rows = (EvidenceRow("peak force", "N", "fem3d", 10.0, 0.1, 10.5, 0.2, 30 * "stiffer "),)
    write_evidence(folder, [Shown(ball, rows), Shown(replace(ball, name="b"), (), "left out")])
    return folder / "index.html"


PAGES: dict[str, Build] = {
    "validate": validate_page, "paper": paper_page, "sweep": sweep_page, "stress": stress_page,
    "bench": bench_page, "calibration": calibration_page, "evidence": evidence_page,
}  # fmt: skip


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    webdriver = pytest.importorskip("selenium.webdriver", reason="pip install -e '.[dev]'")
    paths = [shutil.which(name) for name in ("chromium", "chromedriver")]
    if None in paths:
        pytest.skip("no Chromium: apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = paths[0]
    for flag in ("headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage",
                 "disable-background-networking", "no-first-run", "use-angle=swiftshader",
                 "enable-unsafe-swiftshader"):  # fmt: skip
        options.add_argument(f"--{flag}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options, webdriver.ChromeService(paths[1]))
    yield driver
    driver.quit()


def opened(browser: Any, page: Path, size: tuple[int, int]) -> None:
    """The page in a viewport of that size, all its pictures there."""
    width, height = size
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": size == PHONE}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    browser.get(page.as_uri())
    broken = browser.execute_async_script("""
        const done = arguments[0], images = [...document.images];
        images.forEach(image => image.loading = "eager");
        Promise.allSettled(images.map(image => image.decode()))
            .then(() => done(images.filter(image => !image.naturalWidth).map(i => i.alt)));""")
    assert broken == []


@pytest.mark.parametrize("name", PAGES)
def test_a_page_in_a_browser(
    name: str, browser: Any, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    page = PAGES[name](tmp_path, request)
    script = browser.execute_script

    opened(browser, page, PHONE)
    assert script("return document.documentElement.scrollWidth") <= PHONE[0]
    smallest = script("""
        const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), sizes = [99];
        while (walk.nextNode()) if (walk.currentNode.data.trim())
            sizes.push(parseFloat(getComputedStyle(walk.currentNode.parentElement).fontSize));
        return Math.min(...sizes);""")
    assert smallest >= LEAST_TEXT
    check_print(browser)  # before anything is unfolded

    opened(browser, page, LAPTOP)
    assert script("return document.querySelectorAll('h1').length") == 1
    bottom = "return document.querySelector('.verdict').getBoundingClientRect().bottom"
    assert 0 < script(bottom) <= LAPTOP[1]

    wide = script("""
        const wide = [...document.querySelectorAll("table")].filter(
            t => t.closest(".scroll").scrollWidth > t.closest(".scroll").clientWidth);
        return wide.map(t => getComputedStyle(t.querySelector("td")).position);""")
    assert set(wide) <= (set() if name == "evidence" else {"sticky"})  # its remarks stand below

    alts = script("return [...document.images].map(image => image.alt)")
    assert alts
    assert min(map(len, alts)) >= 10
    assert len(set(alts)) == len(alts)
    targets = script("return [...document.querySelectorAll('a')].map(a => a.getAttribute('href'))")
    for target in targets:
        inside = target.startswith("#") and script(f"return !!document.querySelector('{target}')")
        assert inside or target.startswith("https://doi.org/") or (page.parent / target).is_file()

    summaries = script("return document.querySelectorAll('summary').length")
    reached, opening = set(), webdriver_keys()
    for _ in range(3 * summaries + 60):
        browser.switch_to.active_element.send_keys(opening.TAB)
        place = script("return [...document.querySelectorAll('summary')]"
                       ".indexOf(document.activeElement)")  # fmt: skip
        if place >= 0 and place not in reached:
            reached.add(place)
            before = script("return document.activeElement.parentElement.open")
            browser.switch_to.active_element.send_keys(opening.ENTER)
            assert script("return document.activeElement.parentElement.open") != before
    assert len(reached) == summaries

    assert [line for line in browser.get_log("browser") if line["level"] != "INFO"] == []
    check_requests(browser)


class Plate(SimpleNamespace):
    """The surface of a body as PyVista gives it: two quadrilaterals."""

    def __getitem__(self, field: str) -> Any:
        return np.array([1.0, 2.0])


def test_a_tap_to_turn_and_step_through_loads_nothing(browser: Any, tmp_path: Path) -> None:
    pytest.importorskip("plotly", reason="pip install -e '.[interactive]'")
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 1], [2, 1, 1]]) * 1e-3
    faces = np.array([[0, 1, 2, 3], [1, 4, 5, 2]])
    up = np.array([0.0, 0.0, 1.0])
    steps = [(t, Plate(points=points + t * up, regular_faces=faces)) for t in (0.0, 1e-4, 2e-4)]
    time = np.linspace(0.0, 2e-4, 50)
    curves = {
        "hcm": np.array([time, 10.0 * time, -time]),
        "data": np.array([time, 20.0 * time, np.full(50, np.nan)]),
    }
    page = tmp_path / "tap.html"
    moments = ("0", "100", "200")
    write_interactive(page, "soft finger", steps, moments, "stress", (0.0, 2.0), 1e-3, curves)
    opened(browser, page, LAPTOP)
    read = """
        const [body, now] = document.querySelector(".js-plotly-plot")._fullData;
        return [[...body.z], [...body.intensity], [...body.i], now.x[0],
                document.querySelectorAll("canvas").length];"""
    z, shown, corners, now, canvases = browser.execute_script(read)
    assert z == pytest.approx(1e3 * (points[:, 2] + 1e-4))  # mm, of the middle step
    assert (shown, corners, now) == ([1.0, 2.0, 1.0, 2.0], [0, 1, 0, 1], pytest.approx(0.1))
    assert canvases
    browser.execute_async_script("""
        const plot = document.querySelector(".js-plotly-plot"), done = arguments[0];
        const step = plot._fullLayout.sliders[0].steps[2];
        Plotly[step.method](plot, ...step.args).then(() => done());""")
    z, _, _, now, _ = browser.execute_script(read)
    assert (z, now) == (pytest.approx(1e3 * (points[:, 2] + 2e-4)), pytest.approx(0.2))
    assert [line for line in browser.get_log("browser") if line["level"] == "SEVERE"] == []
    check_requests(browser)
    assert 'name="viewport"' in page.read_text(encoding="utf-8").split("</head>")[0]


def check_requests(browser: Any) -> None:
    """Nothing was asked of any other machine."""
    asked = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    urls = [message["params"]["request"]["url"] for message in asked
            if message["method"] == "Network.requestWillBeSent"]  # fmt: skip
    assert urls
    assert all(url.startswith(("data:", "file:", "about:", "blob:file:")) for url in urls), urls


def check_print(browser: Any) -> None:
    """On paper nothing reaches beyond the margin, what is folded is there, and all has its page."""
    metrics = {"width": PAPER[0], "height": PAPER[1], "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    beyond, hidden, whole = browser.execute_script("""
        const all = [...document.querySelectorAll("body *")], width = arguments[0];
        const right = one => one.getBoundingClientRect().right;
        return [all.filter(one => right(one) > width + 1).map(one => one.outerHTML.slice(0, 200)),
                all.filter(one => !one.checkVisibility()).map(one => one.tagName),
                document.documentElement.scrollHeight];""", PAPER[0])  # fmt: skip
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    assert beyond == []
    assert hidden == []
    printed = browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"]
    pages = len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(printed)))
    # a figure or a row that does not fit moves to the next page, and leaves half a page at most
    assert whole / PAPER[1] <= pages <= 1 + 2.0 * whole / PAPER[1]


def webdriver_keys() -> Any:
    from selenium.webdriver.common.keys import Keys

    return Keys
