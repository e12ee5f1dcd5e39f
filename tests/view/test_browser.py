"""The dashboard in a real browser: it is seen to move, a person plays, and the session replays."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Timer
from typing import Any

import pytest
from hapticd.configs import read_text
from hapticd.testing.browser import browser, missing

pytestmark = [
    pytest.mark.live,
    pytest.mark.slow,
    pytest.mark.skipif(bool(missing()), reason=f"NO TEST OF THE DASHBOARD: {missing()}"),
]
PROGRAM = (sys.executable, "-m", "hapticd.runtime")
PATIENCE_S = 90.0
MOVES = "['ENGAGING', 'ACTIVE'].includes(now.mode)"
LAPSED = "['STOPPING', 'HOLDING', 'STOPPED'].includes(now.mode)"


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser() as found:
        yield found


@contextmanager
def running(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A command, and the address of the dashboard that it prints."""
    child = subprocess.Popen(
        [*PROGRAM, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield child, address(child)
    finally:
        child.terminate()
        child.communicate(timeout=60)


def address(child: subprocess.Popen[str]) -> str:
    """The next one that a command prints, which ends where there is none in time."""
    assert child.stdout
    said = []
    patience = Timer(PATIENCE_S, child.terminate)
    patience.start()
    try:
        for line in child.stdout:
            if found := re.search(r"view: (http\S+)", line):
                return found[1]
            said.append(line)
    finally:
        patience.cancel()
    pytest.fail(f"no address within {PATIENCE_S:g} s: {''.join(said)}")


@contextmanager
def opened(chromium: Any, url: str, **options: Any) -> Iterator[Any]:
    """A page of the dashboard that has its first frames, and of which no script fails."""
    context = chromium.new_context(**{"viewport": {"width": 700, "height": 600}, **options})
    try:
        page = context.new_page()
        page.set_default_timeout(1e3 * PATIENCE_S)
        failures: list[str] = []
        page.on("pageerror", lambda error: failures.append(str(error)))
        page.goto(url)
        until(page, "frames.length > 3 && !!now")
        yield page
        assert failures == []
    finally:
        context.close()  # a page that is left open draws on, and takes what the next one needs


def until(page: Any, condition: str) -> None:
    """Wait until an expression of the page's script is true; its policy forbids Playwright's own way.

    A page that has lost its session for a moment has no ``now``.
    """
    end = time.monotonic() + PATIENCE_S
    while not page.evaluate(f"(() => {{ try {{ return !!({condition}); }} catch {{ return false; }} }})()"):
        state = page.evaluate(
            "now && [now.mode, now.pressed, now.e_stop_closed, now.stop, $('next').textContent]"
        )
        assert time.monotonic() < end, f"{condition}: {state}"
        time.sleep(0.1)


def engage(page: Any) -> None:
    """Hold the dead-man switch until the machine moves.

    A page that this host keeps from running for 100 ms has let go, and a person then does what the page says:
    let go, reset, hold again.
    """
    moves = "(now.mode === 'ENGAGING' || now.mode === 'ACTIVE')"
    lapsed = "(now.mode === 'STOPPED' && now.stop === 'dead_man')"
    for _ in range(10):
        page.locator("#hold").click()
        until(page, f"{moves} || {lapsed}")
        if page.evaluate(moves):
            return
        page.locator("#hold").click()
        until(page, "now.pressed === false")
        page.get_by_role("button", name="reset").click()
        until(page, "now.mode === 'READY'")
    pytest.fail("it let go ten times")


FRAMED = """scene.points.map(p => scene.seen(p)).every(([x, y]) =>
    x >= 0 && y >= 0 && x <= scene.canvas.clientWidth && y <= scene.canvas.clientHeight)"""
"""Whether machine, limits and walls are in the picture."""
NAMES = "[...document.querySelectorAll('.head select')].map(s => s.value)"
"""Of what is plotted."""


@pytest.mark.parametrize("machine", ["giant", "rhi"])
def test_a_recording_is_scrubbed_and_fits_phone_and_screen(
    machine: str, recorded: Callable[[str], Path], chromium: Any
) -> None:
    with running("view", str(recorded(machine)), "--port", "0") as (view, url):
        for width, scheme in ((390, "dark"), (1440, "light")):
            options = {"viewport": {"width": width, "height": 700}, "color_scheme": scheme}
            with opened(chromium, url, **options) as page:
                assert page.evaluate("document.documentElement.scrollWidth") == width
                pictures = []
                for index in (40, page.evaluate("frames.length - 5")):
                    page.evaluate(f"seek({index})")
                    page.evaluate(
                        "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
                    )
                    # drawn and read in one turn: the browser keeps no picture of it
                    pictures.append(page.evaluate("(scene.draw(), $('scene').toDataURL())"))
                assert pictures[0] != pictures[1]
                assert page.evaluate(FRAMED)
                assert "s" in page.locator("#clock").text_content()
                assert page.locator("#limits .name").count() == page.evaluate(
                    "hello.channels.filter(c => c.group === 'limits').length"
                )
                # time of lockstep is virtual, and no plot shows what it lacks
                assert not page.locator("#late").is_visible()
                assert "lateness" not in page.evaluate(NAMES)
                # of a phone whose page is scrolled, head and switches are both seen
                page.evaluate("($('controls').hidden = false, $('limits').scrollIntoView())")
                edge = "(id => $(id).closest('header, section').getBoundingClientRect())"
                assert width > 900 or page.evaluate(f"{edge}('lamp').bottom <= {edge}('hold').top + .5")
                page.evaluate("($('controls').hidden = true, scrollTo(0, 0))")
                # what is written stands above and below the scene, and all of it is seen beside long lists
                stacked = "['force', 'scene', 'player'].map(id => $(id).getBoundingClientRect())"
                assert page.evaluate(f"(([a, b, c]) => a.bottom <= b.top && b.bottom <= c.top)({stacked})")
                page.evaluate("$('limits').style.minHeight = '2000px'")
                assert page.evaluate("$('player').getBoundingClientRect().bottom < innerHeight")
                page.evaluate("$('limits').style.minHeight = ''")
                # of two hands, as a station has them, each has its plot
                name = "name: c.group === 'hand' ? s + c.name : c.name"
                two = f"c => ['left ', 'right '].map(s => ({{...c, {name}}}))"
                page.evaluate(f"begin({{...hello, name: 'two', channels: hello.channels.flatMap({two})}})")
                hands = ["force of the left hand", "force of the right hand"]
                assert page.evaluate(NAMES)[:2] == hands
                # a hand that is grabbed leads the middle between the hands, and does not become it
                drag = """(scene.onlead = place => { window.led = place; },
                    scene.grips = [[0, 0, 0], [0, 1, 0]], scene.wrenches = Array(4).fill([0, 0, 0]),
                    scene.draw(),  // as large as the canvas is with other plots beside it
                    [...Array(2).keys()].map(i => {
                        const [x, y] = scene.seen(scene.grips[i]), box = scene.canvas.getBoundingClientRect();
                        for (const [type, dx] of [["down", 0], ["move", 1], ["up", 1]])
                            scene.canvas.dispatchEvent(new PointerEvent("pointer" + type,
                                {pointerId: 1, clientX: x + dx + box.left, clientY: y + box.top}));
                        return Math.hypot(...V.sub(led, [0, .5, 0]));
                    }))"""
                page.evaluate("scene.canvas.setPointerCapture = () => {}")
                assert max(page.evaluate(drag)) < 0.05
                if width == 1440:
                    view.terminate()
                    until(page, "$('hint').textContent.startsWith('the dashboard has ended')")


PICTURE = "(Scene.prototype.draw.call(scene), $('scene').toDataURL())"
"""Drawn and read in one turn: the browser keeps no picture of it."""
SPARING = """(scene.draw = () => {}, plots = [], (all => {
    let last = -Infinity;
    show = () => { if (performance.now() > last + 300) { last = performance.now(); all(); } };
})(show), 0)"""
"""From now on a page writes seldom and draws only pictures: else it takes what the machine needs."""


def test_a_person_plays_and_the_session_replays(chromium: Any, tmp_path: Path) -> None:
    log = tmp_path / "played.mcap"
    with running("demo", "panda", "--log", str(log)) as (child, url):
        with opened(chromium, url) as page:
            until(page, "now.mode === 'ACTIVE'")
            page.evaluate(SPARING)  # from here on: it has drawn all it has by now
            # what nobody renews is not shown as if it were now
            assert page.evaluate("(heard -= 5e3, showMode(), $('mode').textContent)").startswith("silent for")
            until(page, "$('mode').textContent === now.mode")
            before = page.evaluate("now.grips")
            page.evaluate("lead([now.grips[0] + .04, now.grips[1] + .08, now.grips[2]])")
            until(page, f"Math.hypot(...V.sub(now.grips, {before})) > .01 && Math.hypot(...now.wrench) > 1")
            page.get_by_role("button", name="e-stop").click()
            until(page, "now.stop === 'e_stop' && now.e_stop_closed === false")
            assert "emergency stop" in page.locator("#stop").text_content()
            # who clicks it twice, or holds the dead-man with the space bar then, does not pull it out
            page.get_by_role("button", name="e-stop", exact=True).click()
            page.keyboard.press("Space")
            page.evaluate(
                "new Promise(done => { const from = frames.length;"
                " setInterval(() => frames.length > from + 15 && done(), 20); })"
            )
            assert page.evaluate("now.e_stop_closed === false")
            page.get_by_role("button", name="pull e-stop out").click()
            until(page, "now.e_stop_closed")
            until(page, "$('pullout').hidden")
            page.evaluate("say('release')")
            until(page, "now.pressed === false")
            page.get_by_role("button", name="reset").click()
            until(page, "now.mode === 'READY'")
            page.locator("#kept").check()
            engage(page)
            assert page.evaluate("now.counts['records lost']") == 0
            # a page that falls silent has let go
            page.evaluate("(window.WebSocket = null, held = false)")
            until(page, "!now.pressed && !['ENGAGING', 'ACTIVE'].includes(now.mode)")
        child.terminate()
        child.communicate(timeout=60)
    replays(log)


@contextmanager
def sparing(chromium: Any, url: str) -> Iterator[Any]:
    """As ``opened``, and see ``SPARING``."""
    with opened(chromium, url) as page:
        page.evaluate(SPARING)
        yield page


def drag(page: Any, way: tuple[int, int]) -> None:
    """Pull at the first hand's ball with the mouse until the force of the hand is another.

    A hand that moves may have gone on before the mouse is there: then once more.
    """
    tick, before = page.evaluate("[now.tick, now.wrench.slice(0, 3)]")
    for _ in range(20):
        x, y = page.evaluate(
            "(([x, y], box) => [x + box.left, y + box.top])"
            "(scene.seen(scene.grips[0]), scene.canvas.getBoundingClientRect())"
        )
        page.mouse.move(x, y)
        page.mouse.down()
        grabbed = page.evaluate("!!scene.grabbed")
        page.mouse.move(x + way[0], y + way[1], steps=3)
        if grabbed:
            break
        page.mouse.up()
    assert grabbed
    # a push may be over before anybody looks
    felt = f"frames.some(f => f.tick > {tick} && Math.hypot(...V.sub(f.wrench.slice(0, 3), {before})) > 1)"
    until(page, f"{felt} && {MOVES}")
    page.mouse.up()


def press(page: Any) -> None:
    """Hold the dead-man switch, not for as long as the page runs: this host may not let it."""
    page.evaluate("say('press')")


def let_go(page: Any) -> None:
    """Take the dead-man switch from whoever held it, and let go of it."""
    page.locator("#hold").click()
    until(page, f"now.pressed === false && {LAPSED}")
    assert "dead-man" in page.locator("#stop").text_content()
    until(page, "$('deadman').textContent.startsWith('open for')")


def strike(page: Any) -> None:
    """Press the emergency stop."""
    page.get_by_role("button", name="e-stop").click()
    until(page, "now.stop === 'e_stop' && now.mode === 'STOPPED'")
    assert "emergency stop" in page.locator("#stop").text_content()
    assert page.locator("#health").text_content() == "complete so far"


def replays(log: Path) -> None:
    """What people did in the browser is in the recording."""
    again = subprocess.run([*PROGRAM, "replay", str(log), "--verify"], capture_output=True, text=True)
    assert again.returncode == 0 and ", 0 differ" in again.stdout, again.stdout + again.stderr


def test_a_session_whose_recorder_died_is_not_over_and_is_stopped_from_its_page(
    chromium: Any, tmp_path: Path
) -> None:
    log = tmp_path / "lost.mcap"
    with running("demo", "palpation", "--log", str(log)) as (child, url):
        with sparing(chromium, url) as page:
            until(page, "now.mode === 'ACTIVE'")
            for process in Path("/proc").glob("[0-9]*"):
                with suppress(OSError):
                    if f"live.recorder\0rhi\0{log}" in (process / "cmdline").read_text():
                        os.kill(int(process.name), signal.SIGKILL)
            until(page, "$('mode').textContent.endsWith('it may still move')")
            top = subprocess.run([*PROGRAM, "top"], capture_output=True, text=True, check=False)
            assert top.returncode != 0 and "its recorder has ended" in top.stderr
            page.get_by_role("button", name="e-stop", exact=True).click()
            page.wait_for_timeout(1000)  # nothing tells a page any more that it was heard
        child.terminate()
        said, _ = child.communicate(timeout=60)
    assert "R4 e_stop" in said


DOOR = "frames.findLast(f => f.mean.length)"
LATCHED = (
    f"{DOOR}.mean[place('twin handle')] > .1"
    " && frames.every(f => !f.mean.length || f.high[place('twin hinge')] < .01)"
)
"""Its handle is pressed down, and it has not opened: nobody pushed."""


@pytest.mark.parametrize(
    ("name", "way", "seen"),
    [
        ("walk", (30, -30), "true"),
        pytest.param("door", (0, 40), LATCHED, id="door"),
        ("excavator", (30, -30), "true"),
        ("palpation", (30, -30), "true"),
        ("panda_rhi", (30, -30), "true"),
    ],
)
def test_every_machine_moves_is_led_and_is_stopped_from_its_page(
    name: str, way: tuple[int, int], seen: str, chromium: Any, tmp_path: Path
) -> None:
    log = tmp_path / "played.mcap"
    with running("demo", name, "--log", str(log)) as (child, url):
        with sparing(chromium, url) as page:
            until(page, "now.mode === 'ACTIVE'")
            press(page)
            before, place = page.evaluate(PICTURE), page.evaluate("now.grips.slice(0, 3)")
            drag(page, way)
            until(page, f"Math.hypot(...V.sub(now.grips, {place})) > .003 && {MOVES} && {seen}")
            assert page.evaluate(PICTURE) != before
            let_go(page)
            strike(page)
            page.reload()  # who comes later reads why it stopped, too
            until(page, "$('stop').textContent.includes('emergency stop')")
            assert page.locator("#events li").count() > 2
        child.terminate()
        child.communicate(timeout=60)
    replays(log)


def begun(page: Any) -> None:
    """Press the dead-man switch of a machine whose script pressed it before it was ready, or not at all."""
    until(page, "now.mode !== 'BRINGUP'")
    page.evaluate("say('release')")
    until(page, "now.pressed === false")
    if page.evaluate("now.mode !== 'READY'"):
        page.get_by_role("button", name="reset").click()
        until(page, "now.mode === 'READY'")
    press(page)


def calm(folder: Path, station: str) -> str:
    """A station that leaves a host time for two pages: it has fewer ticks, and a weaker hand."""
    text = read_text(f"{station}.toml")
    for old, new in (
        (r'rate = "1 kHz"', 'rate = "400 Hz"'),
        (r"substeps = 3", "substeps = 8"),
        (r'force = "150 N"', 'force = "10 N"'),
        (r'(\[operator\.cue\].*\n)force = "2 N"', r'\1force = "0 N"'),
    ):
        text = re.sub(old, new, text)
    (folder / f"{station}.toml").write_text(text, encoding="utf-8")
    for model in ("bimanual.urdf", "giant.urdf"):
        (folder / model).write_text(read_text(model), encoding="utf-8")
    return str(folder / f"{station}.toml")


FOLLOWED = "now.grips.some((v, i) => Math.abs(v - window.placed[i]) > .003)"
"""A hand is elsewhere than when ``placed`` was kept."""


@pytest.mark.parametrize(
    ("stations", "way"),
    [
        pytest.param(("operator", "avatar"), (30, -30), id="arms"),
        pytest.param(("giant_operator", "giant_avatar"), (10, -10), id="giant"),
    ],
)
def test_both_stations_of_telemanipulation_are_played_from_their_pages(
    stations: tuple[str, str], way: tuple[int, int], chromium: Any, tmp_path: Path
) -> None:
    logs = [tmp_path / f"pair-{end}.mcap" for end in ("operator", "avatar")]
    sources = [calm(tmp_path, station) for station in stations]
    how = ("--live", "--view", "--duration", "600", "--logs", str(tmp_path / "pair"))
    with running("bimanual", *sources, *how) as (child, first):
        second = address(child)
        with sparing(chromium, first) as one, sparing(chromium, second) as other:
            pages = {page.evaluate("hello.name"): page for page in (one, other)}
            operator, avatar = (pages[f"{end}.toml"] for end in ("operator", "avatar"))
            for page in (operator, avatar):
                begun(page)
            for page in (operator, avatar):
                until(page, "now.mode === 'ACTIVE'")
            until(operator, "now.doing.some(word => /linked/.test(word))")
            before = [page.evaluate(PICTURE) for page in (operator, avatar)]
            for page in (operator, avatar):
                page.evaluate("window.placed = now.grips")
            drag(operator, way)
            for page, picture in zip((operator, avatar), before, strict=True):  # the avatar follows
                until(page, f"{FOLLOWED} && {MOVES}")
                assert page.evaluate(PICTURE) != picture
            let_go(operator)
            for page in (avatar, operator):
                strike(page)
        child.terminate()
        child.communicate(timeout=90)
    for log in logs:
        replays(log)
    scrubbed(chromium, logs[0])


def scrubbed(chromium: Any, log: Path) -> None:
    """The recording opens in the same page, and shows another posture at another time."""
    with running("view", str(log), "--port", "0") as (_, url), opened(chromium, url) as page:
        pictures = []
        for share in (0.3, 0.9):
            page.evaluate(f"seek(Math.round({share} * frames.length)), scene.show(now)")
            pictures.append(page.evaluate(PICTURE))
        assert pictures[0] != pictures[1]


def until_rendered(page: Any, twin: str, mode: str) -> None:
    """Wait until the page shows another twin: its button, its joints among the limits, and no other's."""
    rendered = "[...document.querySelectorAll('#orders [aria-pressed=true]')].map(b => b.textContent).join()"
    valued = "(now.mean[k] !== null) === c.name.startsWith(twin + ' ')"
    joints = f"hello.channels.every((c, k) => !/^twin (door|excavator) /.test(c.name) || {valued})"
    until(page, f"(twin => {rendered} === twin && {joints})('twin {twin}') && now.mode === '{mode}'")
    assert f"twin {twin}" in page.locator("#doing").text_content()


def test_twins_are_exchanged_from_the_page_while_it_moves_and_at_rest(chromium: Any, tmp_path: Path) -> None:
    log = tmp_path / "exchanged.mcap"
    with running("demo", "giant", "--twin", "mass,door,excavator", "--log", str(log)) as (child, url):
        with sparing(chromium, url) as page:
            until_rendered(page, "mass", "ACTIVE")
            press(page)
            page.get_by_role("button", name="twin door").click()
            until_rendered(page, "door", "ACTIVE")
            assert page.evaluate("frames.every(f => !f.stop)")
            let_go(page)
            until(page, "now.mode === 'STOPPED'")
            page.get_by_role("button", name="reset").click()
            until(page, "now.mode === 'READY'")
            page.get_by_role("button", name="twin excavator").click()
            until_rendered(page, "excavator", "READY")
        child.terminate()
        child.communicate(timeout=60)
    replays(log)
