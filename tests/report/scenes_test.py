#!/usr/bin/env python3
"""Pages of runs in a real browser, one for a fault in each of the six stages: it opens where the verdict shows. And what
the 3D view can do beside: cut open, colour by what changed and by distance, two recordings.
Usage: scenes_test.py CUTPROOF PLUGIN WORK (PLUGIN: the reference as a plugin, wrong in the stage that it is told)
Exit status 77 where there is no browser (browser.py)."""
import json
import pathlib
import sys

from browser import Browser, By, Folder, Keys

program, plugin = sys.argv[1], sys.argv[2]
work = Folder(sys.argv[3], program)

scene = {"version": 5, "name": "two halves",
         "body": {"shape": {"kind": "box", "size": [0.08, 0.05, 0.05]}, "spacing": 0.01},
         "clusters": {"method": "sampled", "spacing": 2, "radius": 2},
         "frame": {"settle": 0.016}, "detect": {"criterion": "geometric"}, "ground": {"friction": 0.5},
         "expand": {"rule": "published"},
         "blade": {"speed": 2, "strokes": [{"points": [[0.5, 0.5, 1.3], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]}}
(work / "halves.json").write_text(json.dumps(scene))
STAGES = ("step", "detect", "split", "merge", "expand", "skin")

# Of the picture, as it is drawn: how much of each half is not ground, and how many pixels are yellow.
PIXELS = """const canvas = document.getElementById('canvas'), copy = document.createElement('canvas');
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const pen = copy.getContext('2d'); pen.drawImage(canvas, 0, 0);
  const all = pen.getImageData(0, 0, copy.width, copy.height).data;
  const [r0, g0, b0] = getComputedStyle(canvas.parentElement).backgroundColor.match(/\\d+/g).map(Number);
  const isGround = (i) => Math.abs(all[i] - r0) + Math.abs(all[i + 1] - g0) + Math.abs(all[i + 2] - b0) < 4;
"""
HALVES = PIXELS + """const drawn = [0, 0];
  for (let i = 0; i < all.length; i += 4) if (!isGround(i)) ++drawn[(i / 4) % copy.width < copy.width / 2 ? 0 : 1];
  return drawn.map((n) => n / (all.length / 8));"""
YELLOW = PIXELS + """let n = 0;
  for (let i = 0; i < all.length; i += 4) if (all[i] > 200 && all[i + 1] > 180 && all[i + 2] < 100) ++n;
  return n;"""
DRAWN = PIXELS + """return Array.from({ length: all.length / 4 }, (_, k) => isGround(4 * k) ? 0
  : all[4 * k] < 8 && all[4 * k + 1] > 105 && all[4 * k + 2] > 165 ? 2 : 1);"""

# --- A fault in each stage ---

for stage in STAGES:
    work.run([program, "run", "halves.json", "--backend", f"plugin:{plugin},{stage}", "--check", "--json",
              f"{stage}.json", "--report", f"{stage}.html"], 1)
    verdicts = json.loads((work / f"{stage}.json").read_text())["verdicts"]
    first = min((one for one in verdicts if not one["holds"] and one["stage"] == stage), key=lambda one: one["frame"])
    with Browser(work / f"{stage}.html") as page:
        # The page says which stage, which property and which frame, and shows them, before anybody has clicked.
        summary, card = page.text("#summary"), page.text("#findings article")
        assert f"in frame {first['frame']} after {stage}" in summary, (stage, summary)
        assert page.data("findings[0].stage") == stage and page.data("findings[0].property") in summary, summary
        assert page.data("findings[0].property") in card and f"after {stage}" in card, card
        assert page.data("findings[0].text") in card, card
        marks = page.data("findings[0].marks")
        page.shown(marks["moment"], 0)
        assert marks["exact"], f"{stage}: the page has no moment after the stage that fails"
        seen = page.pixels()
        assert seen["orange"] > 60 or not (marks["particles"] or marks["path"]), (stage, seen)
        assert marks["particles"] or marks["path"] or marks["members"], f"{stage}: nothing is marked"
        assert f"Frame {page.data('findings[0].frame')}, after {stage}" in page.text("#status"), page.text("#status")
        assert page.data("findings[0].text") in page.text("#witness")
        page.picture(work / f"{stage}_after.png")
        # Wherever the marks lie, neither half of the view is empty.
        for half, share in zip(("left", "right"), page.ask(HALVES)):
            assert share > 0.1, f"{stage}: the {half} half of the view is empty: {share}"
        words = page.text("#legend")
        if stage == "detect":
            assert len(marks["particles"]) == 2 and "yellow: its neighbour" in words, words
            assert page.ask(YELLOW) > 60, "the neighbour is marked as the particle itself"
        if stage == "merge":
            number = page.data("findings[0].clusters[0]")
            assert f"the members of cluster {number}" in words, words
        # What is marked is what changes: without it the same moment has other pixels, and none are orange.
        page.scrub(0)
        assert page.pixels()["orange"] == 0, stage
        if stage == "skin":
            corners = page.data("findings[0].marks.corners")
            witness = first["witness"]["triangles"]
            assert witness and len(corners) == 3 * len(witness), (corners, witness)
            page.driver.find_element(By.CSS_SELECTOR, "[data-finding='0']").click()
            page.shown(marks["moment"], 0)
            words = page.text("#legend")
            assert f"{len(witness)} triangles of the skin" in words, words
            # They face whoever looks: from where the body as a whole is looked at, these are seen edge-on.
            assert seen["orange"] > 250, f"{seen['orange']} pixels are marked"
        # The command runs as it stands, and comes to the same. A terminal shows a few of many, so all are compared.
        command = page.text(".command")
        assert page.data("findings[0].property") in page.text("#verdicts")
        work.run(command, 1)
        work.run(command + " --json again.json", 1)
        again = json.loads((work / "again.json").read_text())["verdicts"]
        assert again == verdicts, f"{stage}: the command comes to other verdicts"
work.run([program, "run", "halves.json", "--backend", f"plugin:{plugin},none", "--check"], 0)  # it is the fault alone

# --- Colours of clusters: those that touch differ, whatever goes; and they stay ---

colouring = (pathlib.Path(__file__).parents[2] / "report/page/cluster_colours.js").read_text().replace("export ", "")
said = Browser.blank().execute_script(colouring + """
      const n = 24, at = (x, y, z) => (z * n + y) * n + x, all = n * n * n;
      const edges = { a: [], b: [] }, cluster = new Int32Array(all), alive = new Uint8Array(all).fill(1);
      let seed = 7;
      const random = (m) => { seed = (Math.imul(seed, 1103515245) + 12345) >>> 0; return (seed >>> 8) % m; };
      const seeds = Array.from({ length: 400 }, () => [random(n), random(n), random(n)]);
      for (let z = 0; z < n; ++z) for (let y = 0; y < n; ++y) for (let x = 0; x < n; ++x) {
        let best = 0, least = Infinity;
        seeds.forEach(([a, b, c], k) => { const d = (a - x) ** 2 + (b - y) ** 2 + (c - z) ** 2; if (d < least) [best, least] = [k, d]; });
        cluster[at(x, y, z)] = 3 * best;
        for (const [i, ok] of [[at(x + 1, y, z), x + 1 < n], [at(x, y + 1, z), y + 1 < n], [at(x, y, z + 1), z + 1 < n]]) if (ok) { edges.a.push(at(x, y, z)); edges.b.push(i); }
      }
      // How many touching pairs have one colour; over a cut of two layers, too.
      const clashes = (of, there, colours) => {
        let found = 0;
        edges.a.forEach((a, e) => { const b = edges.b[e]; if (there[a] && there[b] && of[a] !== of[b] && colours[of[a]] === colours[of[b]]) ++found; });
        for (let z = 0; z < n; ++z) for (let y = 0; y < n; ++y) {
          const a = at(10, y, z), b = at(13, y, z);
          if (!there[at(11, y, z)] && !there[at(12, y, z)] && of[a] !== of[b] && colours[of[a]] === colours[of[b]]) ++found;
        }
        return found;
      };
      const first = coloursOfClusters(cluster, alive, edges, [6, 12], null);
      const again = coloursOfClusters(cluster, alive, edges, [6, 12], first);
      // A cut parts the clusters that it goes through.
      const cut = alive.slice(), parted = cluster.slice();
      for (let z = 0; z < n; ++z) for (let y = 0; y < n; ++y) for (let x = 0; x < n; ++x) {
        if (x === 11 || x === 12) { cut[at(x, y, z)] = 0; parted[at(x, y, z)] = -1; }
        if (x > 12 && new Set([cluster[at(10, y, z)]]).has(cluster[at(x, y, z)])) parted[at(x, y, z)] = cluster[at(x, y, z)] + 1;
      }
      const later = coloursOfClusters(parted, cut, edges, [6, 12], first);
      const kept = seeds.map((_, k) => 3 * k).filter((k) => first[k] >= 0 && later[k] >= 0);
      return { first: clashes(cluster, alive, first), later: clashes(parted, cut, later), used: new Set(first).size,
        same: first.every((c, k) => c === again[k]), kept: kept.filter((k) => first[k] === later[k]).length / kept.length,
        unknown: coloursOfClusters(cluster, alive, null, [6, 12], null).every((c, k) => (first[k] < 0) === (c < 0)) };""")
print(f"colours of clusters: {said}")
assert said["first"] == 0 and said["later"] == 0, f"clusters that touch have one colour: {said}"
assert said["same"] and said["kept"] > 0.9 and said["unknown"], said

# --- Cut open, by mouse, keys and sliders ---

work.run([program, "run", "halves.json", "--check", "--record", "halves", "--report", "holds.html"], 0)
with Browser(work / "holds.html") as page:
    last = page.data("moments.length") - 1
    page.scrub(last)
    whole = page.pixels()
    canvas = page.driver.find_element(By.ID, "canvas")
    assert not page.driver.find_element(By.ID, "cut-at").is_displayed()
    seen = {whole["sum"]}

    def next_picture(action):
        now = page.pixels_after(action, seen)
        seen.add(now["sum"])
        return now

    cut = next_picture(lambda: canvas.send_keys("c"))
    assert page.driver.find_element(By.ID, "cut").is_selected() and page.driver.find_element(By.ID, "cut-at").is_displayed()
    assert "Cut open" in page.text("#legend") and "hollow" in page.text("#legend"), page.text("#legend")
    next_picture(lambda: canvas.send_keys("["))
    next_picture(lambda: canvas.send_keys(Keys.ALT, Keys.ARROW_LEFT, Keys.NULL))
    next_picture(lambda: page.driver.find_element(By.ID, "cut-at").send_keys(Keys.PAGE_DOWN))
    next_picture(lambda: page.driver.find_element(By.ID, "cut-above").send_keys(Keys.PAGE_UP))
    page.driver.find_element(By.ID, "cut-face").click()
    assert abs(float(page.ask("return document.getElementById('cut-above').value")) - 25) < 5.1
    # Dragged with Alt.
    page.ask("""const c = document.getElementById('canvas'), box = c.getBoundingClientRect();
      const at = (type, y) => c.dispatchEvent(new PointerEvent(type, { pointerId: 1, clientX: box.x + 100, clientY: box.y + y, altKey: true, buttons: 1, bubbles: true }));
      c.setPointerCapture = () => {}; at('pointerdown', 100);""")
    before = page.ask("return Number(document.getElementById('cut-at').value)")
    page.ask("""const c = document.getElementById('canvas'), box = c.getBoundingClientRect();
      c.dispatchEvent(new PointerEvent('pointermove', { pointerId: 1, clientX: box.x + 100, clientY: box.y + 120, altKey: true, buttons: 1, bubbles: true }));""")
    assert page.ask("return Number(document.getElementById('cut-at').value)") < before, "Alt and the mouse move no cut"
    # Beyond the body nothing is left; the cut face is nearer than all else, so the least that is cut is little.
    page.ask("const s = document.getElementById('cut-at'); s.value = -1; s.dispatchEvent(new Event('input'));")
    assert page.pixels()["share"] < 0.3 * whole["share"], "a cut beyond the body leaves the body there"
    canvas.send_keys("c")
    page.until("return document.getElementById('cut-controls').hidden")

    # --- What the last stage changed ---

    stages = page.ask("return JSON.parse(document.getElementById('data').textContent).moments.map((m) => m.stage)")
    page.choose("colour", "change")
    for stage, words in (("step", "moved"), ("detect", "removed"), ("split", "in a cluster that lost members"),
                         ("merge", "merged"), ("skin", "skin made here")):
        at = [k for k, one in enumerate(stages) if one == stage and k > 0]
        found = []
        for k in at:
            page.scrub(k)
            found.append(page.text("#legend"))
            assert ("particle)" in found[-1] or "particles)" in found[-1]) == bool(
                page.driver.find_elements(By.CSS_SELECTOR, "#legend .swatch")), found[-1]
        assert any(words in text for text in found), f"no {stage} says '{words}': {found[:3]}"

with Browser(work / "expand.html") as page:
    # Here a cluster grows, over the particle that the fault gives it.
    page.choose("colour", "change")
    page.scrub(page.data("findings[0].marks.moment"))
    assert "a cluster grew over it (1 particle)" in page.text("#legend"), page.text("#legend")

# --- Scrubbing where pictures take long: no figure of time, but in what order things happen ---

with Browser(work / "holds.html", still=False) as page:
    page.pixels()
    # The page is kept from going on for longer than a rest, between what somebody wants and its picture.
    drawn = page.driver.execute_async_script("""const done = arguments[0], range = document.getElementById('scrub'), canvas = document.getElementById('canvas');
      const busy = (ms) => { const end = performance.now() + ms; while (performance.now() < end); };
      const drawn = [], sizes = [];
      new MutationObserver(() => drawn.push(canvas.dataset.drawn)).observe(canvas, { attributeFilter: ['data-drawn'] });
      (async () => {
        // Ten pictures are enough where nothing else keeps the browser.
        for (let n = 0; n < 10 || (n < 60 && !(sizes.at(-1) < 0.3)); ++n) {
          const k = 1 + n % 10;
          range.value = k;
          range.dispatchEvent(new Event('input'));
          busy(300);
          while (document.documentElement.dataset.shown !== `${k}/`) await new Promise((next) => setTimeout(next, 0));
          await new Promise((next) => requestAnimationFrame(next));
          busy(120);  // as a picture that is drawn for so long
          await new Promise((next) => requestAnimationFrame(next));
          sizes.push(canvas.width / canvas.clientWidth);
        }
        done({ drawn: [...drawn], sizes });
      })();""")
    assert drawn["drawn"].count("quick") >= 10, drawn
    assert "sharp" not in drawn["drawn"], f"somebody who scrubs waits for a sharp picture: {drawn}"
    coarser = [one for one in drawn["sizes"] if one < 1]
    assert coarser == sorted(coarser, reverse=True) and 0.3 > coarser[-1] > 0.2, f"no coarser pictures: {drawn['sizes']}"
    page.pixels()  # a sharp one comes at rest
    assert page.ask("const c = document.getElementById('canvas'); return c.width / c.clientWidth") > 0.99
    # Without a GPU corners that are rounded off cost a quarter of each moment.
    assert page.ask("const c = document.getElementById('canvas'); return [c, c.parentElement].every((e) => getComputedStyle(e).borderRadius === '0px')")
    # What is said as before is not written again.
    page.ask("window.kept = document.getElementById('legend').firstChild")
    page.scrub(3)
    assert page.ask("return window.kept === document.getElementById('legend').firstChild && window.kept.isConnected")
    # Particles behind others do not go through the GPU.
    page.ask("""window.points = [];
      for (const kind of [WebGLRenderingContext, WebGL2RenderingContext]) {
        const { drawElements, drawArrays } = kind.prototype;
        kind.prototype.drawElements = function (mode, count, ...more) { if (mode === 0) window.points.push(count); return drawElements.call(this, mode, count, ...more); };
        kind.prototype.drawArrays = function (mode, first, count) { if (mode === 0) window.points.push(count); return drawArrays.call(this, mode, first, count); };
      }""")
    page.choose("show", "particles")
    page.scrub(2)
    assert page.pixels()["share"] > 0.02
    counts, kept = page.ask("return window.points"), page.data("body.kept")
    assert counts and 0 < max(counts) < kept, (counts, kept)
    # And what is left out is behind others from wherever somebody looks, when the tissue is stretched too: a cut that
    # cuts nothing draws all of them, and its frame in blue.
    canvas = page.driver.find_element(By.ID, "canvas")
    for at in (2, page.data("moments.length") - 1):
        page.scrub(at)
        for keys in ([], [Keys.ARROW_UP] * 9, [Keys.ARROW_DOWN] * 20):
            if keys:
                canvas.send_keys(*keys)
            page.pixels()
            some = page.ask(DRAWN)
            page.ask("const c = document.getElementById('cut'); c.click(); const s = document.getElementById('cut-at');"
                     "s.value = 1; s.dispatchEvent(new Event('input'));")
            page.until("return document.getElementById('cut-words') !== null")
            page.pixels()
            whole = page.ask(DRAWN)
            page.ask("document.getElementById('cut').click()")
            page.until("return document.getElementById('cut-words') === null")
            holes = sum(1 for a, b in zip(some, whole) if a == 0 and b == 1)
            drawn = sum(1 for b in whole if b == 1)
            assert drawn > 2000, "too little is drawn to say anything"
            # Between discs a line of sight may pass two layers.
            assert holes <= 2e-4 * drawn, f"moment {at}, {len(keys)} turns: {holes} of {drawn} pixels are holes"
    # Removed ones are drawn if somebody wants them, wherever they are in the list.
    page.ask("window.points = []; document.getElementById('removed').click()")
    page.scrub(page.data("moments.length") - 1)
    removed = page.data("body.particles") - page.data("moments")[-1]["particles"]
    assert removed > 0 and max(page.ask("return window.points")) > removed

# --- Two recordings: the same twice, and one that goes its own way ---

work.run([program, "run", "halves.json", "--record", "again"], 0)
work.run([program, "run", "halves.json", "--backend", f"plugin:{plugin},detect", "--record", "other"], 0)
work.run([program, "report", "halves", "again", "-o", "same.html"], 0)
work.run([program, "report", "halves", "other", "-o", "two.html"], 0)
with Browser(work / "same.html") as page:
    assert "the same" in page.text("#first-apart"), page.text("#first-apart")
    assert not page.driver.find_elements(By.ID, "to-first-apart")
with Browser(work / "two.html") as page:
    text = page.text("#first-apart")
    assert "after detect" in text and "which particles are there" in text, text
    assert [one.text for one in page.driver.find_elements(By.CSS_SELECTOR, ".side")] == ["reference", f"plugin:{plugin},detect"]
    page.driver.find_element(By.ID, "to-first-apart").click()
    any_ = page.data("comparison.any")
    at = int(page.ask("return document.documentElement.dataset.moment"))
    page.shown(at)
    moment = page.data(f"moments[{at}]")
    assert (moment["frame"], moment["stage"]) == (any_["frame"], any_["stage"]), (moment, any_)
    assert "different" in page.text("#status"), page.text("#status")
    # The moment before it is the same.
    assert page.data(f"moments[{at - 1}].apart.differs") == "", page.data(f"moments[{at - 1}].apart")
    page.picture(work / "two.png")
    # One camera: a turn moves both halves of the picture.
    halves = """const done = arguments[0], canvas = document.getElementById('canvas');
      const copy = document.createElement('canvas'); [copy.width, copy.height] = [canvas.width, canvas.height];
      const pen = copy.getContext('2d', { willReadFrequently: true }); pen.drawImage(canvas, 0, 0);
      const sum = (x) => pen.getImageData(x, 0, copy.width / 2 - 4, copy.height).data.reduce((s, v) => (Math.imul(s, 31) + v) | 0, 0);
      done([sum(0), sum(copy.width / 2 + 4)]);"""
    page.pixels()
    before = page.driver.execute_async_script(halves)
    seen = {page.pixels()["sum"]}
    page.pixels_after(lambda: page.driver.find_element(By.ID, "canvas").send_keys(Keys.ARROW_LEFT), seen)
    page.pixels()
    after = page.driver.execute_async_script(halves)
    assert before[0] != after[0] and before[1] != after[1], "one of the two did not turn"
# Bodies that are not the same are refused, as is a third recording.
(work / "larger.json").write_text(json.dumps(dict(scene, body={"shape": {"kind": "box", "size": [0.09, 0.05, 0.05]},
                                                                "spacing": 0.01})))
work.run([program, "run", "larger.json", "--record", "larger"], 0)
said = work.run([program, "report", "halves", "larger", "-o", "no.html"], 2)
assert "larger" in said and "particles" in said and "remedy" in said, said
assert "remedy" in work.run([program, "report", "halves", "again", "other", "-o", "no.html"], 2)
assert not (work / "no.html").exists()

# --- Distance to the reference, in lockstep ---

work.run([program, "run", "halves.json", "--backend", "host", "--against", "reference", "--report", "against.html"], 0)
assert not list(work.path.glob(".*")), "a recording that nobody asked for is left"
with Browser(work / "against.html") as page:
    assert "Distance to reference" in page.text("#comparison"), page.text("#comparison")
    greatest = page.data("comparison.greatest")
    assert 0 < greatest["max"] < 1e-4, greatest  # single precision beside double
    page.choose("colour", "apart")
    steps = page.ask("return JSON.parse(document.getElementById('data').textContent).moments.map((m, k) =>"
                     " m.apart && m.apart.max > 0 ? k : -1).filter((k) => k >= 0)")
    page.scrub(steps[-1])
    assert "lockstep" in page.text("#legend") and " h" in page.text("#legend"), page.text("#legend")
    assert "apart by up to" in page.text("#status"), page.text("#status")
    assert not page.driver.find_elements(By.CSS_SELECTOR, ".side")

# --- Contrast and keyboard ---

CONTRAST = """
  const number = (text) => text.match(/[\\d.]+/g).map(Number);
  const light = ([r, g, b]) => { const f = (x) => { x /= 255; return x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4; };
    return 0.2126 * f(r) + 0.7152 * f(g) + 0.0722 * f(b); };
  const over = (top, under) => { const a = top.length > 3 ? top[3] : 1; return [0, 1, 2].map((k) => a * top[k] + (1 - a) * under[k]); };
  const ground = (one) => { const chain = []; for (let e = one; e; e = e.parentElement) chain.unshift(number(getComputedStyle(e).backgroundColor));
    return chain.reduce((under, top) => over(top, under), [255, 255, 255]); };
  const found = [];
  for (const one of document.querySelectorAll('body *')) {
    const own = [...one.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
    if (!own || !one.checkVisibility() || one.closest('script, style, noscript')) continue;
    const style = getComputedStyle(one), isDrawing = one instanceof SVGElement;
    const ink = over(number(isDrawing ? style.fill : style.color), ground(one));
    const [a, b] = [light(ink), light(ground(one))];
    found.push({ ratio: (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), text: one.textContent.trim().slice(0, 40), tag: one.tagName,
      isLarge: parseFloat(style.fontSize) >= 24 });
  }
  return found;"""
for name in ("skin", "two", "holds"):
    for dark in (False, True):
        with Browser(work / f"{name}.html", dark=dark) as page:
            found = page.ask(CONTRAST)
            assert len(found) > 25, f"only {len(found)} texts were looked at"
            poor = [one for one in found if one["ratio"] < (3 if one["isLarge"] else 4.5)]
            assert not poor, f"{name}, {'dark' if dark else 'light'}: {poor[:5]}"
            print(f"{name}, {'dark' if dark else 'light'}: {len(found)} texts, the least contrast is "
                  f"{min(one['ratio'] for one in found):.2f}")
            page.picture(work / f"{name}_{'dark' if dark else 'light'}.png")
with Browser(work / "two.html") as page:
    # Everything that a mouse can use comes in turn under Tab, as far as it is shown.
    page.driver.find_element(By.ID, "cut").click()
    wanted = page.ask("return [...document.querySelectorAll('button, select, input, canvas, summary, a')].filter((e) =>"
                      " e.checkVisibility() || e.className === 'skip').map((e, k) => { e.dataset.test = k; return k; })")
    page.ask("document.activeElement.blur()")
    reached = set()
    for _ in range(3 * len(wanted)):
        page.driver.switch_to.active_element.send_keys(Keys.TAB)
        at = page.ask("return document.activeElement.dataset.test")
        if at is not None:
            reached.add(int(at))
        if len(reached) == len(wanted):
            break
    assert reached == set(wanted), f"not by keyboard: {sorted(set(wanted) - reached)} of {len(wanted)}"
for width, dark in ((390, False), (390, True)):
    for name in ("two", "skin"):
        with Browser(work / f"{name}.html", width=width, dark=dark) as page:
            assert page.ask("return document.documentElement.scrollWidth <= window.innerWidth"), f"wider than {width} pixels"
            page.picture(work / f"{name}_{width}_{'dark' if dark else 'light'}.png")
print("pages lead from a verdict to the place")
