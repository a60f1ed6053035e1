"""The report in a real headless browser: it loads without an error or a request, its figures are there in light
and dark and on paper, hovering names a case, and names cannot inject anything."""

import html
import os
import re
import shutil
import subprocess

import pytest
from PIL import Image
from playwright.sync_api import sync_playwright

from conftest import ROOT, TVSE, tvse

BROWSERS = ["chromium", "chromium-browser", "google-chrome"]
SHOTS = ROOT / "target/report"


@pytest.fixture(scope="session")
def browser():
    """Chromium: the one scripts/python-tests found or installed."""
    path = os.environ.get("CHROMIUM") or next((p for name in BROWSERS if (p := shutil.which(name))), None)
    with sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--disable-gpu"]
        browser = playwright.chromium.launch(executable_path=path, args=arguments)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The notebooks' run, the same with six engines, and a small one of the flight control loops."""
    folder = tmp_path_factory.mktemp("runs")
    for name, cases in [("notebook", 300), ("notebook-six", 300), ("closed-loop", 12)]:
        tvse("run", f"runs/{name}.toml", "--cases", cases, "-o", folder / name)
    return folder


@pytest.fixture(scope="module")
def report(runs):
    gates = ROOT / "tests/python/report.gates.toml"
    target = runs / "report.html"
    tvse("report", runs / "notebook", "-o", target, "--gates", gates, "--compare", runs / "notebook-six",
         "--figures", runs / "figures")
    return target


class Opened:
    """A page with everything it said and asked for."""

    def __init__(self, browser, file, **settings):
        self.context = browser.new_context(viewport={"width": 1100, "height": 900}, **settings)
        self.page = self.context.new_page()
        self.said, self.asked = [], []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(file.as_uri())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.context.close()

    def quiet(self, file):
        assert self.said == []
        own = [file.as_uri(), "data:,"]
        assert [url for url in self.asked if url not in own] == []

    def figures(self):
        return self.page.locator("figure svg").evaluate_all(
            "all => all.map(svg => { const b = svg.getBoundingClientRect();"
            " return [svg.closest('figure').id, b.width, b.height]; })"
        )


def shot(page, name, **options):
    SHOTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SHOTS / f"{name}.png", **options)
    return SHOTS / f"{name}.png"


def test_the_page_loads_without_an_error_or_a_request_and_shows_every_figure(browser, report):
    with Opened(browser, report) as opened:
        found = {name: (width, height) for name, width, height in opened.figures()}
        expected = {
            "poles-tvse", "poles-by-time-tvse", "damping-tvse", "distribution-tvse", "gate-share", "gate-least", "shape-tvse",
            "tornado-damping-ratio-min-jet-damping-tvse", "added-tvse-by-the-other-variants",
            "difference-damping-ratio-min-jet-damping-tvse",
        }
        assert expected <= set(found), expected - set(found)
        assert all(width > 600 and height > 150 for width, height in found.values()), found
        sections = opened.page.locator("section").evaluate_all("all => all.map(s => s.id)")
        for name in ["summary", "worst", "failures", "provenance", "compare", "tornado"]:
            assert name in sections
        opened.quiet(report)
        shot(opened.page, "light", full_page=True)


def test_the_loops_have_their_charts_and_feedback_its_section(browser, runs):
    target = runs / "loops.html"
    tvse("report", runs / "closed-loop", "-o", target)
    with Opened(browser, target) as opened:
        found = {name for name, *_ in opened.figures()}
        for axis in ["roll", "pitch", "yaw"]:
            assert {f"bode-closed-{axis}", f"nichols-closed-{axis}"} <= found
        assert "added-tvse-by-feedback" in found
        assert "feedback, tvse, dispersed" in opened.page.locator("#added").inner_text()
        opened.quiet(target)
        shot(opened.page, "loops", full_page=True)


def test_dark_mode_is_dark_and_its_text_is_light(browser, report):
    def brightness(colour):
        return sum(int(n) for n in re.findall(r"\d+", colour)[:3]) / 3

    for scheme, ground, text in [("light", (200, 256), (0, 90)), ("dark", (0, 60), (180, 256))]:
        with Opened(browser, report, color_scheme=scheme) as opened:
            style = "selector => { const s = getComputedStyle(document.querySelector(selector)); return [s.backgroundColor, s.fill]; }"
            background, _ = opened.page.evaluate(style, "body")
            _, fill = opened.page.evaluate(style, "figure svg text")
            assert ground[0] <= brightness(background) < ground[1]
            assert text[0] <= brightness(fill) < text[1]
            opened.quiet(report)
            shot(opened.page, f"top-{scheme}")


def test_pointing_at_a_pole_names_its_case(browser, report):
    with Opened(browser, report) as opened:
        place = opened.page.evaluate(
            """() => {
                const svg = document.querySelector('#poles-tvse svg');
                svg.scrollIntoView({block: 'center'});
                const path = svg.querySelector('path[data-cases]');
                const [, x, y] = path.getAttribute('d').match(/M([\\d.]+) ([\\d.]+)/);
                const p = new DOMPoint(+x, +y).matrixTransform(svg.getScreenCTM());
                return [p.x, p.y];
            }"""
        )
        opened.page.mouse.move(*place)
        tip = opened.page.locator("#tip")
        assert tip.is_visible()
        assert re.search(r"case \d+, (no_)?jet_damping", tip.inner_text()), tip.inner_text()
        assert "rad/s: " in tip.inner_text()
        shot(opened.page, "hover")


def test_every_axis_has_a_label_with_its_unit_and_texts_do_not_overlap(browser, report):
    with Opened(browser, report) as opened:
        labels = opened.page.locator("svg g.panel").evaluate_all(
            "all => all.map(p => [p.dataset.xLabel, p.dataset.yLabel])"
        )
        assert len(labels) > 12
        for x, y in labels:
            assert x == "" or re.search(r", (%|s|rad/s|Hz|dB|°|1)$", x), x
            assert y == "" or re.search(r", (%|s|rad/s|Hz|dB|°|1)$", y), y
        overlaps = opened.page.evaluate(
            """() => {
                const found = [];
                for (const svg of document.querySelectorAll('figure svg')) {
                    const boxes = [...svg.querySelectorAll('text')].map(t => [t.textContent, t.getBoundingClientRect()]);
                    for (let i = 0; i < boxes.length; i++) for (let j = i + 1; j < boxes.length; j++) {
                        const [a, b] = [boxes[i][1], boxes[j][1]];
                        const w = Math.min(a.right, b.right) - Math.max(a.left, b.left);
                        const h = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
                        if (w > 2 && h > 4) found.push(`${svg.closest('figure').id}: ${boxes[i][0]} | ${boxes[j][0]}`);
                    }
                }
                return found;
            }"""
        )
        assert overlaps == []


def test_it_prints(browser, report):
    with Opened(browser, report) as opened:
        pdf = opened.page.pdf(format="A4")
        assert pdf.startswith(b"%PDF") and len(pdf) > 50_000


def test_the_mode_shape_moves_unless_motion_is_not_wanted(browser, report):
    for wish, moves in [("no-preference", True), ("reduce", False)]:
        with Opened(browser, report, reduced_motion=wish) as opened:
            state = "() => document.querySelector('#shape-tvse svg').animationsPaused()"
            assert opened.page.evaluate(state) == (not moves)


def test_figures_are_files_as_svg_and_png(report, runs):
    folder = runs / "figures"
    names = {path.stem for path in folder.glob("*.svg")}
    assert names == {path.stem for path in folder.glob("*.png")} and len(names) >= 10
    for name in names:
        with Image.open(folder / f"{name}.png") as picture:
            assert picture.width >= 1700 and picture.height >= 400
            # Drawn, text and all: many shades, mostly white.
            colours = picture.convert("L").histogram()
            assert sum(1 for count in colours if count) > 30, name
            assert colours[255] > 0.3 * picture.width * picture.height


def test_a_figure_alone_loads_without_a_request(browser, runs):
    file = runs / "figures/poles-tvse.svg"
    with Opened(browser, file) as opened:
        opened.quiet(file)
        assert opened.page.locator("text").count() > 10


def test_names_cannot_inject_anything(browser, runs, tmp_path):
    """A run whose names and messages are markup: they come from files of others."""
    study = tmp_path / "study"
    evil = "<img src=x onerror=alert(1)>\"'&</script><script>alert(2)</script>"
    for name in ["vehicles", "dispersions"]:
        shutil.copytree(ROOT / name, study / name)
    vehicle = study / "vehicles/sls-like/vehicle.toml"
    text = vehicle.read_text()
    quoted = evil.replace("\\", "\\\\").replace('"', '\\"')
    text = re.sub(r'(?m)^name = ".*"$', lambda _: f'name = "{quoted}"', text, count=1)
    vehicle.write_text(text)
    (study / "runs").mkdir()
    shutil.copy(ROOT / "runs/smoke.toml", study / "runs/smoke.toml")
    gates = study / "gates.toml"
    gates.write_text(
        '[[gate]]\nid = "a"\nmetric = "damping_ratio"\nvariant = "jet_damping"\nmode = "tvse"\nstatistic = "minimum"\n'
        f'at_least_1 = 0.0\nrationale = "{quoted}"\n'
    )
    folder = study / "<b>run' & co"
    done = subprocess.run([TVSE, "run", study / "runs/smoke.toml", "-o", folder], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    target = study / "report.html"
    tvse("report", folder, "-o", target, "--gates", gates)
    text = target.read_text()
    assert html.escape(evil, quote=False).split("\"")[0] in text and "<img" not in text
    assert text.count("<script") == 1 and text.count("</script>") == 1
    with Opened(browser, target) as opened:
        assert opened.page.locator("img, script[src], iframe, b").count() == 0
        assert "onerror" in opened.page.locator("body").inner_text()
        opened.quiet(target)


def test_a_large_campaign_stays_small(browser, runs, tmp_path):
    """A hundred thousand cases of the planar pair: the page is bounded and quick."""
    run = tmp_path / "pair"
    tvse("planar", "--inertia", 1, "--zeta-n", 0.3, "--omega-n", 1.2, "--zeta-b", 0.005, "--omega-b", 1, "--upsilon", 0.2,
         "--phi", 1, "--cases", 100_000, "--output", run, "--scatter", "thrust=0:0.4", "--scatter", "zeta_b=0.0035:0.0075")
    target = tmp_path / "pair.html"
    tvse("report", run, "-o", target)
    assert target.stat().st_size < 3_000_000
    with Opened(browser, target) as opened:
        opened.quiet(target)
        name = next(name for name, *_ in opened.figures() if name.startswith("poles-"))
        dots = opened.page.locator(f"#{name} path[data-cases]").first.get_attribute("data-cases").split()
        assert 200 < len(dots) <= 241 * 151
        taken = opened.page.evaluate(
            """name => {
                const svg = document.querySelector(`#${name} svg`), b = svg.getBoundingClientRect();
                const start = performance.now();
                for (let i = 0; i < 50; i++) svg.dispatchEvent(new PointerEvent('pointermove',
                    {clientX: b.left + b.width * (0.2 + 0.01 * i), clientY: b.top + b.height * 0.5}));
                return (performance.now() - start) / 50;
            }""",
            name,
        )
        assert taken < 50, "ms to find the nearest mark"
