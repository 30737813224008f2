"""The window under fingers, on a phone of 360 pixels: turned, zoomed, a point pulled, two points pinched."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from tests.unit.browsers import needs_browser
from tests.unit.studio_visits import Visit

pytestmark = needs_browser
Place = tuple[float, float]


class Phone(Visit):
    """A window on a phone, and fingers on it."""

    def __init__(self, chromium: Any, address: str) -> None:
        """Fold it, and look at the folded sheet."""
        super().__init__(chromium, address, 360, has_touch=True, is_mobile=True, device_scale_factor=2)
        self.driver = self.context.new_cdp_session(self.page)
        self.page.locator("#percent").fill("30")
        self.rests("Object.values(head.asked)[0] > 0.5")
        self.page.locator("#stage").scroll_into_view_if_needed()

    def touch(self, kind: str, *places: Place) -> None:
        points = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(places)]
        self.driver.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def stroke(self, start: list[Place], end: list[Place], steps: int = 5) -> None:
        """Fingers laid down one after the other, moved and lifted."""
        for k in range(len(start)):
            self.touch("touchStart", *start[: k + 1])
        for part in np.linspace(0.0, 1.0, steps + 1)[1:]:
            at = np.array(start) + part * (np.array(end) - np.array(start))
            self.touch("touchMove", *((float(x), float(y)) for x, y in at))
        self.touch("touchEnd")

    def seen(self, node: int) -> np.ndarray[Any, Any]:
        return np.array(self.page.evaluate(f"studio.place({node})"))

    def apart(self, a: int, b: int) -> float:
        return float(np.linalg.norm(self.seen(a) - self.seen(b)))


@pytest.fixture
def phone(chromium: Any, address: str) -> Iterator[Phone]:
    found = Phone(chromium, address)
    yield found
    found.context.close()


def test_a_finger_turns_and_two_zoom_wherever_they_lie(phone: Phone) -> None:
    box = phone.page.locator("#folded").bounding_box()
    left, top = box["x"] + 12.0, box["y"] + 12.0
    before = phone.seen(0), phone.apart(0, 165)
    phone.stroke([(left, top)], [(left + 60.0, top + 10.0)])
    assert np.linalg.norm(phone.seen(0) - before[0]) > 5.0
    wide = phone.apart(0, 165)
    x, y = phone.seen(150)  # a finger on the sheet, one beside it
    phone.stroke([(x, y), (left, top)], [(x, y), (2.0 * left - x, 2.0 * top - y)])
    np.testing.assert_allclose(phone.apart(0, 165), 2.0 * wide, rtol=0.25)  # perspective takes its part
    assert not phone.page.evaluate("Object.keys(studio.head.grips).length")
    turned = phone.seen(0)  # one finger turns it again
    phone.stroke([(left, top)], [(left + 60.0, top)])
    assert np.linalg.norm(phone.seen(0) - turned) > 5.0
    assert phone.told == []


def test_a_point_is_pulled_by_a_finger_and_the_page_stays(phone: Phone) -> None:
    down = phone.page.evaluate("scrollY")
    (x, y), (u, v) = phone.seen(12), phone.seen(150)
    start = (x + 0.04 * (u - x), y + 0.04 * (v - y))
    phone.stroke([start], [(start[0], start[1] - 40.0)])
    phone.rests("Object.keys(head.forces).length === 1")
    assert phone.page.locator("#force").inner_text().endswith(" N")
    assert phone.page.evaluate("scrollY") == down
    force = phone.page.locator("#force").bounding_box()
    assert force["x"] >= 0.0
    assert force["x"] + force["width"] <= 360.0
    phone.page.locator("#let-go").tap()
    phone.rests("Object.keys(head.forces).length === 0")
    assert phone.told == []


def test_two_points_are_pinched_by_taps(phone: Phone) -> None:
    phone.page.locator("#hand-pinch").tap()
    phone.page.locator("#stage").scroll_into_view_if_needed()
    for node, toward in ((12, 150), (165, 150)):
        (x, y), (u, v) = phone.seen(node), phone.seen(toward)
        phone.touch("touchStart", (x + 0.05 * (u - x), y + 0.05 * (v - y)))
        phone.touch("touchEnd")
    phone.rests("head.pinches.length === 1")
    assert phone.told == []
