#!/usr/bin/env python3
"""Pages of real runs in a real browser: what they show, what a click does, and that they ask nobody for anything.
Usage: browser_test.py CUTPROOF CXX SOURCES WORK
Exit status 77, with the name of what is missing, where there is no Chromium, no driver of it or no selenium."""
import json
import pathlib
import sys

from browser import Browser, By, Folder, Keys

program, cxx, sources = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
work = Folder(sys.argv[4], program)
run = work.run

# --- Three runs: one that holds, one that fails after split, and one whose names are hostile ---

box = {"version": 5, "name": "two halves",
       "body": {"shape": {"kind": "box", "size": [0.08, 0.05, 0.05]}, "spacing": 0.01},
       "frame": {"settle": 0.016}, "detect": {"criterion": "geometric"}, "ground": {"friction": 0.5},
       "blade": {"speed": 2, "strokes": [{"points": [[0.5, 0.5, 1.3], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]},
       "expect": {"components_at_end": 2}}
hostile = "</script><script>window.hacked=1</script><img src=x onerror=window.hacked=1>"
(work / "halves.json").write_text(json.dumps(box))
(work / "hostile.json").write_text(json.dumps(dict(box, name=hostile, expect={"components_at_end": 5})))
run([program, "run", "halves.json", "--check", "--report", "holds.html"], 0)
run([program, "run", "hostile.json", "--check", "topology", "--report", "hostile.html"], 1)
# The simulator of the tutorial, whose split takes particles for neighbours that are none.
run([cxx, "-std=c++20", "-O1", "-shared", "-fPIC", f"-I{sources / 'guests/include'}",
     sources / "guests/examples/splitter.cpp", "-o", "libsplitter.so"], 0)
run([program, "run", "three_cuts", "--backend", "plugin:./libsplitter.so", "--check", "topology", "--record", "seen",
     "--json", "seen.json", "--report", "fails.html"], 1)
run([program, "report", "seen", "seen.json", "-o", "reported.html"], 0)
run([program, "report", "seen", "-o", "unjudged.html"], 0)

# --- What holds ---

with Browser(work / "holds.html") as page:
    assert page.driver.title == "Holds: two halves · cutproof report", page.driver.title
    summary = page.text("#summary")
    assert "cutproof ran scene two halves on backend reference: all" in summary and "hold" in summary, summary
    assert page.text("#findings-title") == "Nothing fails"
    assert not page.driver.find_elements(By.CSS_SELECTOR, "[data-finding]")
    last = page.data("moments.length") - 1
    # It opens at the last frame that cut, with skin, blade and the blade's way.
    cut = max(frame for frame, n in zip(page.data("frames.frame"), page.data("frames.removed")) if n > 0)
    at = [k for k, one in enumerate(page.data("moments"))
          if (one["frame"], one["stage"], one["start"]) == (cut, "skin", False)]
    page.shown(at[0])
    assert not page.driver.find_elements(By.ID, "no-skin") and "Pale" in page.text("#blade-words")
    with_way = page.pixels()["sum"]
    page.pixels_after(page.driver.find_element(By.ID, "way").click, {with_way})
    page.driver.find_element(By.ID, "way").click()
    made = page.text("#made")
    assert " UTC" in made and "cutproof run halves.json --check motion" in made, made
    page.scrub(0)
    assert "until then particles are shown" in page.text("#legend"), page.text("#legend")
    first = page.pixels()
    assert 0.1 < first["share"] < 0.7, f"the body fills {first['share']} of the view"
    page.scrub(last)
    end = page.pixels()
    assert end["sum"] != first["sum"], "scrubbing changed no pixel"
    assert "2 pieces" in page.text("#status"), page.text("#status")
    # By keys, in the view.
    canvas = page.driver.find_element(By.ID, "canvas")
    canvas.send_keys(",")
    page.shown(last - 1)
    canvas.send_keys(".")
    page.shown(last)
    turned = page.pixels_after(lambda: canvas.send_keys(Keys.ARROW_LEFT), {end["sum"]})
    back = page.pixels_after(lambda: canvas.send_keys("0"), {turned["sum"]})
    assert back["sum"] == end["sum"], "0 did not bring the whole body back"
    # What is shown, and by which colours.
    seen = {end["sum"]}

    # Each differs from all before it.
    for colour in ("cluster", "displacement", "stretch", "holders"):
        seen.add(page.pixels_after(lambda: page.choose("colour", colour), seen)["sum"])
    seen.add(page.pixels_after(lambda: page.choose("show", "particles"), seen)["sum"])
    page.pixels_after(page.driver.find_element(By.ID, "removed").click, seen)
    # It plays from the start to the end, where it stops.
    page.driver.find_element(By.ID, "play").click()
    page.until("return document.documentElement.dataset.moment == arguments[0]"
               " && document.getElementById('play').textContent.includes('Play')", last)
    # A property leads to the frame in which it is nearest to its bound.
    page.scrub(0)
    button = page.driver.find_element(By.CSS_SELECTOR, "#verdicts button")
    page.ask("arguments[0].click()", button)
    page.until("return document.documentElement.dataset.moment != 0")
    assert button.text in page.text("#status").lower(), (button.text, page.text("#status"))
    # Where there is no skin, the page says so, as loaded and later.
    page.choose("show", "skin")
    for k in range(last + 1):
        page.scrub(k)
        moment = page.data(f"moments[{k}]")
        is_without = moment["start"] or (moment["frame"] == 0 and moment["stage"] != "skin")
        assert bool(page.driver.find_elements(By.ID, "no-skin")) == is_without, moment
    # Exact properties are behind one row; each name is explained, by the keyboard, too.
    fold = page.driver.find_element(By.CSS_SELECTOR, "#verdicts .fold button")
    exact = int(fold.text.split()[0])
    rows = "return [...document.querySelectorAll('#verdicts tbody:not([hidden]) tr:not(.fold)')].length"
    assert exact > 20 and page.ask(rows) + exact <= len(page.data("rows"))
    page.unfold()
    assert page.ask(rows) == len(page.data("rows"))
    unexplained = page.ask("return [...document.querySelectorAll('#verdicts tbody th')].filter((e) =>"
                           " !e.querySelector('.explained, button')).map((e) => e.textContent)")
    assert not unexplained, unexplained
    name = page.driver.find_element(By.CSS_SELECTOR, "#verdicts .explained")
    page.ask("arguments[0].focus()", name)
    assert page.text("#explanation").endswith("."), page.text("#explanation")
    name.send_keys(Keys.ESCAPE)
    assert not page.driver.find_element(By.ID, "explanation").is_displayed()
    # The section that a bound comes from is a link, which shows its text.
    link = page.driver.find_element(By.LINK_TEXT, "method.md §5 (Split)")
    page.ask("arguments[0].click()", link)
    assert "5. Split" in page.text("#section h3"), page.text("#section")
    page.driver.switch_to.active_element.send_keys(Keys.ESCAPE)
    page.until("return document.getElementById('section') === null")
    # The state as loaded is no frame.
    for plot in page.driver.find_elements(By.CSS_SELECTOR, ".plot"):
        ticks = [one.text for one in plot.find_elements(By.CSS_SELECTOR, ".tick")]
        assert "-1" not in ticks and ("as loaded" in ticks) == ("Pieces" in plot.text or "Clusters" in plot.text
                                                               or "removed" in plot.text), ticks
    # Plots have units, words, and the same as a table.
    for plot in page.driver.find_elements(By.CSS_SELECTOR, ".plot"):
        assert len(plot.find_elements(By.CSS_SELECTOR, ".axis")) == 2
        assert plot.find_element(By.TAG_NAME, "svg").get_attribute("aria-label")
        page.ask("arguments[0].open = true", plot.find_element(By.TAG_NAME, "details"))
    page.until("return document.querySelectorAll('.plot table').length === document.querySelectorAll('.plot').length")

# --- What fails: from the verdict to the place ---

for name in ("fails.html", "reported.html"):
    with Browser(work / name) as page:
        assert "fails" in page.text("#summary") and "after split" in page.text("#summary"), page.text("#summary")
        first = page.driver.find_element(By.CSS_SELECTOR, "[data-finding='0']")
        row = page.driver.find_element(By.CSS_SELECTOR, "#verdicts tbody tr")
        assert "fails" in row.text, f"the first row is {row.text}"
        # It opens there.
        marks = page.data("findings[0].marks")
        assert marks["exact"] and marks["particles"]
        page.shown(marks["moment"], 0)
        page.scrub(0)
        assert page.pixels()["orange"] == 0
        first.click()
        page.shown(marks["moment"], 0)
        after = page.pixels()
        assert after["orange"] > 100, f"{after['orange']} pixels are marked"
        assert page.data("findings[0].text") in page.text("#witness")
        assert f"Frame {page.data('findings[0].frame')}, after split" in page.text("#status"), page.text("#status")
        assert first.get_attribute("aria-pressed") == "true"
        # Elsewhere nothing is marked.
        page.scrub(0)
        assert page.pixels()["orange"] == 0 and page.text("#witness") == ""
        command = page.text(".command")
        if name == "fails.html":
            page.ask("document.querySelector('.again button').click()")
            page.until("return document.querySelector('.again [role=status]').textContent !== ''")
            assert "split exactness" in run(command, 1), "the command shows something else"
        else:
            assert command == "cutproof check seen", command
            run(command, 1)

# A link leads to a frame and a verdict, and the address says where somebody is.
with Browser(work / "fails.html") as page:
    other = page.data("findings.findIndex((one) => one.property !== 'split exactness')")
    frame, name = page.data(f"findings[{other}].frame"), page.data(f"findings[{other}].property")
    page.go_to(f"#frame={frame}&verdict={name.replace(' ', '+')}")
    page.shown(page.data(f"findings[{other}].marks.moment"), other)
    page.scrub(page.data("moments.length") - 1)
    page.until("return location.hash === `#frame=${arguments[0]}`", page.data("moments")[-1]["frame"])
    page.go_to("#frame=3&stage=detect")
    assert page.text("#status").startswith("Frame 3, after detect"), page.text("#status")

with Browser(work / "unjudged.html") as page:
    assert "Nothing was judged" in page.text("#summary")
    assert page.text(".command") == "cutproof check seen"
    assert not page.driver.find_elements(By.ID, "verdicts")

# --- Names are text ---

with Browser(work / "hostile.html") as page:
    assert page.ask("return window.hacked === undefined && document.images.length === 0")
    assert page.text("#title") == hostile, page.text("#title")
    assert len(page.driver.find_elements(By.CSS_SELECTOR, "script:not([type])")) == 1
with Browser(work / "hostile.html") as page:
    # Nor does a script run that gets into the page all the same: the policy allows the page's own alone.
    page.ask("const s = document.createElement('script'); s.textContent = 'window.hacked = 1'; document.body.append(s);")
    assert page.ask("return window.hacked === undefined")
    assert page.driver.get_log("browser"), "the refusal is logged, and read here so that it counts as no error"

# --- Without WebGL, on a phone, in the dark ---

with Browser(work / "fails.html", "--disable-gpu", "--disable-software-rasterizer", "--disable-3d-apis") as page:
    assert "no 3D view" in page.text("#no-webgl")
    page.driver.find_element(By.CSS_SELECTOR, "[data-finding='0']").click()
    page.until("return document.documentElement.dataset.moment == arguments[0]", page.data("findings[0].marks.moment"))
    assert "after split" in page.text("#status") and page.text("#witness")
for width, dark in ((390, False), (390, True), (1280, True)):
    with Browser(work / "fails.html", width=width, dark=dark) as page:
        assert page.ask("return document.documentElement.scrollWidth <= window.innerWidth"), f"wider than {width} pixels"
        page.picture(work / f"{width}_{'dark' if dark else 'light'}.png")

# --- Documents: a campaign and a judged plugin that fail, a tuning, benchmarks ---

def filtered(page, nth=0):
    """Each value of a table's filter shows its own rows, and together all."""
    select = page.driver.find_elements(By.CSS_SELECTOR, "select.filter")[nth]
    rows = "return [...arguments[0].closest('section').querySelectorAll('tbody tr:not(.fold)')].filter((r) => !r.hidden).length"
    every, seen = page.ask(rows, select), 0
    options = page.ask("return [...arguments[0].options].map((o) => o.value)", select)
    assert len(options) > 2, options
    for value in options[1:]:
        page.ask("arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('change'))", select, value)
        shown = page.ask(rows, select)
        assert 0 < shown < every, (value, shown, every)
        seen += shown
    assert seen == every, (seen, every)


def dots_say(page):
    """Hovering over a point and reaching it by keys say which configuration it is; the table below has it, too."""
    chart = page.driver.find_element(By.CSS_SELECTOR, ".chart:has(.dot)")
    readout = "return arguments[0].querySelector('.readout').textContent"
    first = page.ask("return arguments[0].querySelector('.dot[tabindex=\"0\"]')", chart)
    page.ask("arguments[0].focus()", first)
    words = page.ask(readout, chart)
    assert words == first.get_attribute("aria-label"), words
    page.driver.switch_to.active_element.send_keys(Keys.ARROW_RIGHT)
    after = page.ask(readout, chart)
    assert after != words and after == page.driver.switch_to.active_element.get_attribute("aria-label"), after
    page.ask("arguments[0].dispatchEvent(new PointerEvent('pointerenter'))", first)
    assert page.ask(readout, chart) == words
    page.ask("arguments[0].querySelector('details').open = true", chart)
    page.until("return arguments[0].querySelector('table') !== null", chart)
    table = page.ask("return arguments[0].querySelector('table').textContent", chart)
    assert words.split(":")[0].split(" (")[0] in table, (words, table[:300])
    for plot in page.driver.find_elements(By.CSS_SELECTOR, ".chart svg[role=group]"):
        assert len(plot.find_elements(By.CSS_SELECTOR, ".axis")) == 2


run([program, "fuzz", "--backend", "plugin:./libsplitter.so", "--cases", "200", "--seed", "5", "--shrink", "5",
     "--report", "campaign.html", "--json", "campaign.json"], 1)
run([program, "judge", "./libsplitter.so", "--cases", "80", "--seed", "5", "--shrink", "5", "--report",
     "judged.html"], 1)
run([program, "fuzz", "--cases", "30", "--sizes", "0-9", "--report", "good.html"], 0)
run([program, "tune", "halves.json", "--tolerance", "100", "--frames", "2", "--reference", "substeps", "--repeats", "1",
     "--full", "--write", "tuned.json", "--report", "tuning.html"], 0)
run([program, "bench", "stages", "--sizes", "300,1000", "--frames", "2", "--repeats", "1", "--report",
     "stages.html"], 0)

with Browser(work / "campaign.html") as page:
    assert "Campaign" in page.text("#title") and "violates a property" in page.text("#summary"), page.text("#summary")
    assert "seed 5" in page.text("#facts"), page.text("#facts")
    facts = page.text(".failure dl")
    for word in ("Simplification", "from ", "The case", "Measured / bound", "it fails on plugin:./libsplitter.so"):
        assert word in facts, (word, facts)
    # Where clusters are what differs they are seen: by their colours, and by lines between members of the one named.
    assert page.ask("return document.getElementById('colour').value") == "cluster"
    left, right = page.pixels_of(".pane canvas")
    assert left["sum"] != right["sum"], "a wrong split looks like a right one"
    assert "Lines join the members of cluster " in page.text("#legend"), page.text("#legend")
    # Both states, the witness marked in each, and not elsewhere.
    names = [one.text for one in page.driver.find_elements(By.CSS_SELECTOR, ".pane figcaption")]
    assert names == ["backend plugin:./libsplitter.so", "the reference"], names
    marked = [one["orange"] for one in page.pixels_of(".pane canvas")]
    assert len(marked) == 2 and min(marked) > 100, marked
    assert "fails here" in page.text("#witness") and "after split" in page.text("#status")
    page.ask("const r = document.getElementById('scrub'); r.value = 0;"
             "r.dispatchEvent(new Event('input'));")
    page.until("return document.documentElement.dataset.scenery === '0/0'")
    assert [one["orange"] for one in page.pixels_of(".pane canvas")] == [0, 0]
    assert page.text("#witness") == ""
    page.driver.find_element(By.CSS_SELECTOR, "[data-scenery='0']").click()
    page.until("return document.documentElement.dataset.scenery !== '0/0'")
    assert "fails here" in page.text("#witness")
    filtered(page)
    command = page.text(".failure .command")
    assert command.startswith("cutproof replay "), command
    assert "split exactness" in run(command, 1), "the command shows something else"
    again = page.driver.find_element(By.CSS_SELECTOR, ".notes-card .command").text
    assert "--seed 5" in again and "1 of " in run(again, 1), again
    page.picture(work / "campaign.png")

# A history of commands is shown like any case: the same body with a load, a kick and more stages in between.
history = json.loads((work / json.loads((work / "campaign.json").read_text())["violations"][0]["file"]).read_text())
history["commands"] = [{"run": 1, "whole": False}, {"save_and_load": "memory"}, {"run": 29, "whole": False}]
history["case"]["together"] = 1
(work / "history.json").write_text(json.dumps(history))
run([program, "report", "history.json", "--backend", "plugin:./libsplitter.so", "-o", "history.html"], 0)
with Browser(work / "history.html") as page:
    facts = page.text(".failure dl")
    assert "1 stage, then saved and loaded, then 29 stages" in facts and "3D view" not in facts, facts
    assert "it fails on plugin:./libsplitter.so" in facts, facts
    assert len(page.driver.find_elements(By.CSS_SELECTOR, ".pane canvas")) == 2
    assert min(one["orange"] for one in page.pixels_of(".pane canvas")) > 100
    assert "fails here" in page.text("#witness") and "after split" in page.text("#status"), page.text("#status")
    # From the beginning: the stages before the load are there as well as those behind it.
    page.ask("const r = document.getElementById('scrub'); r.value = 1; r.dispatchEvent(new Event('input'));")
    page.until("return document.documentElement.dataset.scenery === '0/1'")
    assert "Frame 0, after step" in page.text("#status"), page.text("#status")
    page.picture(work / "history.png")

# The same from the document; a plugin runs only if it is named.
run([program, "report", "campaign.json", "-o", "unrun.html"], 0)
with Browser(work / "unrun.html") as page:
    assert "a plugin is run only if --backend names it" in page.text(".failure dl")
    assert not page.driver.find_elements(By.ID, "view")
run([program, "report", "campaign.json", "--backend", "plugin:./libsplitter.so", "-o", "named.html"], 0)
with Browser(work / "named.html", "--disable-gpu", "--disable-software-rasterizer", "--disable-3d-apis") as page:
    assert len(page.driver.find_elements(By.CSS_SELECTOR, ".no-webgl")) == 2
    assert "split exactness" in page.text(".failure") and "after split" in page.text("#status")
    filtered(page)

with Browser(work / "judged.html") as page:
    assert "fails" in page.text("#summary") or "Not everything" in page.text("#summary"), page.text("#summary")
    assert "fails" in page.text(".badge"), page.text(".badge")
    assert page.driver.find_elements(By.CSS_SELECTOR, ".failure .command")
with Browser(work / "good.html") as page:
    assert "none violates any property" in page.text("#summary"), page.text("#summary")
    assert "Nothing fails" in page.text(".failures")

with Browser(work / "tuning.html") as page:
    assert "found" in page.text(".badge") and "The cheapest configuration of halves" in page.text("#summary")
    dots_say(page)
    dashes = page.ask("return ['.front', '.level'].map((s) => getComputedStyle(document.querySelector(`.chart ${s}`)).strokeDasharray)")
    assert dashes[0] == "none" and dashes[1] != "none", f"the front and the tolerance look alike: {dashes}"
    assert "tolerance" in page.text(".chart .legend") and "the answer" in page.text(".chart .legend")
    page.picture(work / "tuning.png")
with Browser(work / "stages.html") as page:
    dots_say(page)
    filtered(page)
    bars = page.driver.find_elements(By.CSS_SELECTOR, ".chart rect")
    assert len(bars) >= 6, f"{len(bars)} parts of two stacks"
    page.ask("document.querySelector('.chart details').open = true")
    page.until("return document.querySelector('.chart table') !== null")
    assert "time [ms]" in page.ask("return document.querySelector('.chart table').textContent")
for name in ("campaign", "judged", "tuning", "stages"):
    for dark in (False, True):
        with Browser(work / f"{name}.html", width=390, dark=dark) as page:
            assert page.ask("return document.documentElement.scrollWidth <= window.innerWidth"), f"{name} is too wide"
            page.picture(work / f"{name}_390_{'dark' if dark else 'light'}.png")
print("pages show what happened")
