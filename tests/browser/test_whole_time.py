"""A page that was open while all tests of this folder ran, of which this file is the last: live, and no larger."""

import dataclasses

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import WAIT, LeftOpen
from tests.browser.pages import FILE, cell, draws_within, run_cell

expect.set_options(timeout=WAIT)

pytestmark = pytest.mark.matrix  # the page draws all the time, and takes half a core from the other tests

LARGER = {"heap": 10e6, "elements": 1000, "resident": 40e6}  # bytes, nodes of the page's tree, and bytes at most


def test_a_page_that_was_open_all_the_time_is_live_and_neither_it_nor_its_kernel_has_grown(left_open: LeftOpen):
    page, before = left_open.page, left_open.before
    nodes, graph = (page.get_by_role("region", name=name, exact=True) for name in ("Nodes", "Graph"))
    frames = int(page.locator(".ros-Robot-canvas").get_attribute("data-frames") or 0)
    page.wait_for_function(f"() => document.querySelector('.ros-Robot-canvas').dataset.frames > {frames + 20}")
    assert draws_within(page, 2000)  # ms, on a busy machine
    run_cell(page, FILE, cell(page, FILE).locator(".cm-content").inner_text())
    expect(nodes.get_by_role("button", name="/greeter running")).to_be_visible()
    expect(graph.get_by_role("list", name="The graph as a list")).to_contain_text("/greeter")
    expect(nodes.locator(".ros-Log-line").last).to_have_attribute("title", "ai_robot_controller")  # named once, above
    after = left_open.measure()
    seconds = after.at - before.at
    for name, most in LARGER.items():
        grown = getattr(after, name) - getattr(before, name)
        assert grown < most, f"{name} grew by {grown:,.0f} in {seconds:.0f} s: {dataclasses.asdict(after)}"
