"""Reports, opened in a headless Chromium."""

from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import pytest
import xarray as xr

import sweeps
from tests.support.browser import Browser, browser
from tests.support.reports import SCENE, alike, any_archive, hostile

pytestmark = [pytest.mark.compiled, pytest.mark.slow]


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with browser() as found:
        yield found


def opened(chromium: Browser, archive: xr.Dataset, folder: Path, **options: Any) -> None:
    """Write a report and open it: nothing is wrong, and nothing was asked for."""
    path = folder / "report.html"
    sweeps.report(archive, path, **options)
    chromium.open(path)
    assert chromium.messages() == []
    assert chromium.requests() == []


ALL_ELEMENTS = (
    "const all = (node) => [...node.querySelectorAll('*')]"
    ".flatMap(e => [e, ...(e.shadowRoot ? all(e.shadowRoot) : [])]);"
)
"""JavaScript that gives the elements below one, with those in the shadow roots of Bokeh."""


def moved(chromium: Browser, place: int, value: int) -> None:
    """Move the slider in a place, or choose there."""
    chromium.run(
        "const c = document.querySelectorAll('.control input, .control select')[arguments[0]];"
        "c.value = arguments[1];"
        "c.dispatchEvent(new Event(c.type === 'range' ? 'input' : 'change'))",
        place, value,
    )  # fmt: skip
    chromium.settled()


def card(title: str) -> str:
    """Selector of the card of the explorer with a title."""
    return f"#explorer .card[data-title='{title}']"


def test_sliders_redraw_the_explorer(chromium: Browser, tmp_path: Path) -> None:
    archive = sweeps.run(SCENE)
    opened(chromium, archive, tmp_path)
    count = chromium.run("return document.querySelectorAll('.control input').length")
    assert count == 2
    titles = (
        "Numbers of this design", "Curves of this design", "Numbers over an axis",
        "Map over two axes", "One quantity over the crank angle, several designs",
    )  # fmt: skip
    before = {title: chromium.picture(card(title)) for title in titles}
    assert chromium.picture(card(titles[1])) == before[titles[1]]  # nothing moves by itself
    moved(chromium, 0, 0)
    moved(chromium, 1, 3)
    for title in titles:
        if title != "Numbers over an axis":  # it has a line for each load, and goes over inertia
            assert chromium.picture(card(title)) != before[title], title
    numbers = chromium.run("return document.querySelector('#explorer table').innerText")
    assert f"{float(archive.delta[0, 3]):.5g}" in numbers
    assert chromium.messages() == []


def test_legends_hide_lines_and_selectors_draw_anew(chromium: Browser, tmp_path: Path) -> None:
    opened(chromium, sweeps.run(SCENE), tmp_path)
    where = card("Curves of this design")
    before = chromium.picture(where)
    names = chromium.run(
        ALL_ELEMENTS + "const items = all(document.querySelector(arguments[0]))"
        ".filter(e => e.classList.contains('bk-item'));"
        "items[0].dispatchEvent(new PointerEvent('pointerdown', {bubbles: true}));"
        "return items.map(e => e.textContent)",
        where,
    )
    assert names == ["torque", "gas_torque"]
    assert chromium.picture(where) != before
    titles = chromium.run(
        "return [...document.querySelectorAll('#explorer .card')].map(c => c.dataset.title)"
    )
    for title in titles:  # every choice of every selector
        chromium.run(
            "for (const s of document.querySelectorAll(arguments[0] + ' select'))"
            "for (const o of s.options) {"
            "s.value = o.value; s.dispatchEvent(new Event('change')); }",
            card(title),
        )
    chromium.settled()
    assert chromium.messages() == []


def test_maps_end_at_the_outermost_designs(chromium: Browser, tmp_path: Path) -> None:
    archive = sweeps.run(SCENE).isel(load=slice(None, None, -1))
    opened(chromium, archive, tmp_path)
    found = chromium.run(
        "const found = [];"
        "for (const figure of Bokeh.documents.flatMap((one) => one.roots())) {"
        "  const { renderers, x_range, y_range } = figure;"
        "  for (const { glyph, data_source } of renderers || [])"
        "    if (glyph.type === 'Quad') found.push([['left', 'right', 'bottom', 'top']"
        "      .map((side) => [...data_source.data[side]]), [x_range, y_range]"
        "      .map(({ start, end }) => [start, end])]); }"
        "return found"
    )
    assert found
    for (left, right, bottom, top), ((first, last), (low, high)) in found:
        assert (min(left), max(right), min(bottom), max(top)) == (0.05, 5.0, 20.0, 80.0)
        assert set(bottom) == {20.0, 35.0, 65.0} and set(top) == {35.0, 65.0, 80.0}
        assert first < 0.05 and last > 5.0 and low < 20.0 and high > 80.0


def test_misfires_that_are_alike_are_one_line(chromium: Browser, tmp_path: Path) -> None:
    opened(chromium, alike(20), tmp_path)
    found = chromium.run(
        "return Bokeh.documents.flatMap((one) => one.roots()).filter((figure) => figure.renderers)"
        ".map(({ renderers, below }) => [renderers.filter((one) => one.visible)"
        "  .map((one) => one.name), below.filter((one) => one.items)"
        "  .flatMap((one) => one.items.map((item) => item.label.value))])"
    )
    lines = [one for one in found if one[1]]
    assert lines
    for names, legend in lines:
        assert legend == ["none", "1 to 12"] and set(names) == {*legend}


def test_hostile_texts_do_nothing(chromium: Browser, tmp_path: Path) -> None:
    opened(chromium, hostile(), tmp_path)
    assert chromium.run("return window.broken === undefined")
    moved(chromium, 0, 3)
    assert chromium.messages() == []


def test_any_archive_can_be_explored(chromium: Browser, tmp_path: Path) -> None:
    for seed in range(12):
        opened(chromium, any_archive(Random(seed)), tmp_path, overwrite=True)
        chromium.run(
            "for (const c of document.querySelectorAll('.control input')) {"
            "c.value = c.max; c.dispatchEvent(new Event('input')); }"
            "for (const s of document.querySelectorAll('select')) {"
            "s.value = s.options[s.options.length - 1].value;"
            "s.dispatchEvent(new Event('change')); }"
        )
        chromium.settled()
        assert chromium.messages() == [], seed
        assert chromium.run("return window.broken === undefined")


@pytest.mark.parametrize("width", [400, 1280])
def test_nothing_is_wider_than_the_window(width: int, tmp_path: Path) -> None:
    with browser(width) as narrow:
        screen = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": width < 600}
        narrow.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
        opened(narrow, sweeps.run(SCENE), tmp_path)
        assert narrow.run("return document.documentElement.scrollWidth") <= width


def test_a_finger_scrolls_the_page_over_figures(tmp_path: Path) -> None:
    with browser(400) as phone:
        screen = {"width": 400, "height": 800, "deviceScaleFactor": 1, "mobile": True}
        phone.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
        touch = {"enabled": True, "maxTouchPoints": 1}
        phone.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", touch)
        opened(phone, sweeps.run(SCENE), tmp_path)
        for place in (0, 3):
            top = phone.run(
                "document.documentElement.style.scrollBehavior = 'auto';"
                "const plot = document.querySelectorAll('.plot')[arguments[0]];"
                "plot.scrollIntoView({block: 'center'});"
                "const box = plot.getBoundingClientRect(); return box.top + box.height / 2",
                place,
            )
            phone.settled()
            before = phone.run("return window.scrollY")
            finger(phone, "touchStart", [{"x": 200, "y": top}])
            for step in range(1, 13):
                finger(phone, "touchMove", [{"x": 200, "y": top - 20 * step}])
            finger(phone, "touchEnd", [])
            phone.settled()
            assert phone.run("return window.scrollY") > before + 100


def finger(phone: Browser, kind: str, points: list[dict[str, Any]]) -> None:
    event = {"type": kind, "touchPoints": points}
    phone.driver.execute_cdp_cmd("Input.dispatchTouchEvent", event)


def test_pointing_at_a_cell_tells_the_values_of_all_axes(chromium: Browser, tmp_path: Path) -> None:
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.by import By

    opened(chromium, sweeps.run(SCENE), tmp_path)
    place = chromium.driver.find_element(By.CSS_SELECTOR, card("Map over two axes") + " .plot")
    chromium.run("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", place)
    chromium.settled()
    ActionChains(chromium.driver).move_to_element_with_offset(place, 20, 20).perform()
    chromium.settled()
    told = chromium.run(
        ALL_ELEMENTS + "const kinds = ['bk-tooltip-row-value', 'bk-tooltip-row-label'];"
        "return all(document).filter(e => kinds.some(k => e.classList.contains(k)))"
        ".map(e => e.textContent).join('')"
    )
    assert "delta" in told and "inertia" in told and "load" in told and "%" in told
