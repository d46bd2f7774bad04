"""The buttons of a page, clicked in a real headless Chromium: zoom of the curves, and a table copied as CSV."""

import asyncio

import pytest
from browser import CHROMIUM, opened
from made_diagnoses import diagnosis, prediction

from identify.report.diagnosis import diagnosis_report
from identify.report.page import render_report

pytestmark = [
    pytest.mark.slow,
    pytest.mark.usefixtures("sketched"),
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed"),
]

BAND = "document.querySelector('.band').offsetWidth / document.querySelector('.pane').clientWidth"
OVERFLOW = "document.documentElement.scrollWidth - innerWidth"


@pytest.mark.parametrize("width", [1400, 400])
def test_the_buttons_zoom_the_curves_and_a_click_selects_a_table_as_csv(tmp_path, width):
    page = tmp_path / "page.html"
    page.write_text(
        render_report(diagnosis_report(diagnosis(prediction=prediction("lap-4")))), encoding="utf-8"
    )

    async def clicks():
        async with opened(page.as_uri(), tmp_path / "browser", width) as browser:
            await browser.until_true("document.readyState == 'complete'")

            async def click(element):
                at = await browser.evaluate(
                    f"(() => {{ const e = {element}; e.scrollIntoView({{block: 'center'}});"
                    " const r = e.getBoundingClientRect(); return `${r.x + 9} ${r.y + r.height / 2}`; })()"
                )
                x, y = map(float, at.split())
                for kind in ("mousePressed", "mouseReleased"):
                    await browser.call(
                        "Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1
                    )

            assert await browser.evaluate(BAND) == pytest.approx(1.0, abs=0.01)
            for by in (4, 16):
                await click(f"document.querySelector('label[for$=\"-{by}\"]')")
                await browser.until_true(f"{BAND} >= {by}")
                assert await browser.evaluate(OVERFLOW) <= 0
            await click("document.querySelector('.csv summary')")
            await browser.until_true("document.querySelector('.csv').open")
            await click("document.querySelector('.csv pre')")
            saved = "document.querySelector('.csv a[download]').href"
            table = "document.querySelector('.csv pre').textContent"
            assert await browser.evaluate(f"decodeURIComponent({saved}.split(',')[1]) == {table}")
            copied = await browser.evaluate("getSelection().toString()")
            assert copied.startswith("Degree of freedom,")
            assert (
                copied.strip()
                == (await browser.evaluate("document.querySelector('.csv pre').innerText")).strip()
            )

    asyncio.run(clicks())
