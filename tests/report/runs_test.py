#!/usr/bin/env python3
"""Pages of runs, states, kicks and relations of anybody's simulator in a real browser: they open where something fails,
or where the blade has cut last; witness, pieces, coupling and the blade's sweep are seen; a large run stays small.
Usage: runs_test.py CUTPROOF SOURCES WORK
Exit status 77 where there is no browser (browser.py)."""
import json
import pathlib
import sys

import numpy

from browser import Browser, By, Folder

program, sources = sys.argv[1], pathlib.Path(sys.argv[2])
work = Folder(sys.argv[3], program)
sys.path.insert(0, str(sources / "guests" / "python"))
import cutproof_run  # noqa: E402


def page_of(name, status):
    work.run([program, "check", f"{name}.h5", "--json", f"{name}.json", "--report", f"{name}.html"], status)
    return work / f"{name}.html", json.loads((work / f"{name}.json").read_text())


def simulate(simulator, name, *options):
    work.run(["/usr/bin/python3", "-B", sources / f"guests/examples/runs/{simulator}.py", f"{name}.h5", *options], 0)


def listed(document, holds):
    return [verdict for verdict in document["verdicts"] if verdict["holds"] == holds]


# --- A run that fails opens at its first failure, with the witness marked ---

simulate("springs", "heals", "--fault", "heals")
path, document = page_of("heals", 1)
first = min(listed(document, False), key=lambda verdict: verdict["frame"])
with Browser(path) as page:
    page.shown(first["frame"], 0)
    page.picture(work / "heals.png")
    summary, status = page.text("#summary"), page.text("#status")
    assert f"'{first['property']}' fails" in summary and f"in frame {first['frame']}." in summary, summary
    assert document["pieces"]["in_words"] in summary and "after" not in summary, summary
    assert status.startswith(f"Frame {first['frame']} ") and "coupling group" in status, status
    assert page.text("#witness") == f"{first['property']} fails here.", page.text("#witness")
    assert first["witness"]["text"] in page.text("#findings"), page.text("#findings")
    marks = page.data("findings[0].marks")
    assert marks["particles"] == first["witness"]["particles"] and marks["exact"], marks
    assert page.pixels()["orange"] > 0, "the witness is not seen"
    page.unfold()
    table = page.text("#verdicts")
    assert not any(f"after {stage}" in table for stage in ("step", "skin")), table
    rows = {row["property"]: row for row in page.data("rows")}
    for verdict in document["verdicts"]:
        assert rows[verdict["property"]]["judged"] == 1 and verdict["property"] in table, verdict
    for one in document["not_judged"]:
        assert one["property"] in table and one["why"] in table, one
    buttons = [button.text for button in page.driver.find_elements(By.CSS_SELECTOR, "#view button")]
    assert "Frame »" in buttons and not any("Stage" in text for text in buttons), buttons
    options = [option.get_attribute("value") for option in page.driver.find_elements(By.CSS_SELECTOR, "#colour option")]
    assert options[:2] == ["piece", "cluster"] and "change" not in options, options
    # What is coupled though the blade has been between has one colour, and two as pieces.
    moment = first["frame"]
    assert page.data(f"moments[{moment}].components") == 2
    page.until("return document.getElementById('legend').textContent.includes('are coupled with each other')")
    page.picture(work / "heals_coupled.png")
    page.choose("colour", "piece")
    page.until("return document.getElementById('legend').textContent.includes('the piece of particle 0 (')")
    card = page.text("#findings article")
    assert "Never allowed (bound 0)." in card and "judged frames, first in frame" in card, card
    # The pointer tells a particle's number.
    told = page.ask("""
      const canvas = document.getElementById('canvas'), { left, top, width, height } = canvas.getBoundingClientRect();
      const titles = new Set();
      for (let x = 0; x < width; x += 10) for (let y = 0; y < height; y += 10) {
        canvas.dispatchEvent(new PointerEvent('pointermove', { clientX: left + x, clientY: top + y }));
        titles.add(canvas.title);
      }
      return [...titles];""")
    assert "" in told and len(told) > 20 and all(one in ("", f"particle {one[9:]}") for one in told), told
    # It plays to its end.
    page.driver.find_element(By.ID, "play").click()
    page.until("return document.documentElement.dataset.moment == arguments[0]", document["run"]["frames"] - 1)
    # It fails to the end, and each of these frames says so.
    assert first["witness"]["frames"][-1] == document["run"]["frames"] - 1, first["witness"]["frames"]
    assert first["property"] in page.text("#witness"), page.text("#witness")


# A narrow page folds what a wide one folds.
with Browser(path, width=800) as page:
    hidden = page.driver.find_element(By.CSS_SELECTOR, "#verdicts tbody[hidden] tr")
    assert not hidden.is_displayed(), "rows behind a fold are seen"
    page.unfold()
    assert hidden.is_displayed(), "a fold does not open"
    assert page.driver.find_element(By.CSS_SELECTOR, "#verdicts td:last-child a").is_displayed()

# --- One that holds opens where the blade has parted tissue last, and shows what it swept ---

simulate("tetrahedra", "holds")
path, document = page_of("holds", 0)
last_cut = document["pieces"]["last_cut"]
with Browser(path) as page:
    page.shown(last_cut)
    assert "Pale: the way" in page.text("#blade-words"), page.text("#blade-words")
    page.picture(work / "holds.png")
    assert page.text("#findings-title") == "Nothing fails"
    assert len(page.data(f"moments[{last_cut}].swept")) == 12, page.data(f"moments[{last_cut}].swept")
    assert "Steel" in page.text("#blade-words"), page.text("#legend")
    page.scrub(0)
    assert page.data("moments[0].swept") == [] and "Steel" not in page.text("#legend")
    assert page.text("#status").startswith("Frame 0 ") and page.data("moments[0].components") == 1
    page.scrub(document["run"]["frames"] - 1)
    assert "2 pieces" in page.text("#status"), page.text("#status")
    for plot in page.driver.find_elements(By.CSS_SELECTOR, ".plot"):
        assert "as loaded" not in plot.text, plot.text

# A small body is seen whole where its page opens, and "Whole body" shows it also when its pieces have flown apart.
simulate("tetrahedra", "inverted", "--fault", "inverted")
path, document = page_of("inverted", 1)
with Browser(path) as page:
    assert page.pixels()["rim"] == 0, "the body is cropped where the page opens"
    page.scrub(document["run"]["frames"] - 1)
    page.driver.find_element(By.ID, "way").click()
    page.ask("[...document.querySelectorAll('#view button')].find((b) => b.textContent === 'Whole body').click()")
    assert page.pixels()["rim"] == 0, "the whole body is not within the view"

# What fails without a place dims nothing.
simulate("clusters", "stale", "--fault", "stale_index")
path, document = page_of("stale", 1)
with Browser(path) as page:
    first = page.data("findings[0]")
    assert not any(first["marks"][name] for name in ("particles", "path", "members", "corners")), first
    page.shown(first["marks"]["moment"], 0)
    card = page.text("#findings article")
    assert "times the bound of" in card and "It concerns the whole body." in card, card
    # Beside a failure the blade's way is not drawn.
    seen = page.pixels()["sum"]
    page.driver.find_element(By.ID, "way").click()
    page.scrub(0)
    page.scrub(first["marks"]["moment"])
    assert page.pixels()["sum"] == seen, "a verdict that names no place dims the view"

# --- Particles that come later, and a skin of its own ---

x = numpy.stack(numpy.meshgrid(*3 * [numpy.arange(4.0)], indexing="ij"), 3).reshape(-1, 3) * 0.01
corners = numpy.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 0.05
with cutproof_run.Writer(work / "grows.h5", spacing=0.01, promises="free") as run:
    for frame in range(4):
        there = numpy.concatenate([x, x[:2 * frame] + 0.05])
        run.frame(there + 0.001 * frame, groups=[range(len(there))], vertices=corners + 0.001 * frame,
                  triangles=[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
path, document = page_of("grows", 0)
with Browser(path) as page:
    page.shown(0)
    assert "piece" not in [option.get_attribute("value")
                           for option in page.driver.find_elements(By.CSS_SELECTOR, "#colour option")]
    for frame in range(4):
        assert page.data(f"moments[{frame}].particles") == 64 + 2 * frame
    assert "not drawn: 6 particles not yet there" in page.text("#status"), page.text("#status")
    page.scrub(3)
    particles = page.pixels()["sum"]
    page.pixels_after(lambda: page.choose("show", "skin"), {particles})
    page.picture(work / "grows.png")

# --- A hostile name, and little that is a number ---

x = numpy.random.default_rng(1).random((6, 3))
with cutproof_run.Writer(work / "<!--<script>.h5", rest=x, spacing=1e-3, edges=[[0, 1], [1, 2]]) as run:
    for frame in range(6):
        there = x.copy()
        there[1:3] = {3: numpy.nan, 4: numpy.inf}.get(frame, there[1:3])
        run.frame(there, time=numpy.nan if frame == 5 else frame, groups=[[0, 1], [1, 2]],
                  blade=numpy.full((1, 4, 3), 1e200 if frame == 2 else numpy.inf))
path, document = page_of("<!--<script>", 1)
with Browser(path) as page:
    assert page.driver.title.startswith("Fails: <!--<script>.h5"), page.driver.title
    for frame in range(6):
        page.scrub(frame)
        assert page.data(f"moments[{frame}].swept") == []

# --- A page stays small, and says what it leaves out ---

x = numpy.stack(numpy.meshgrid(*3 * [numpy.arange(20.0)], indexing="ij"), 3).reshape(-1, 3) * 0.01
random = numpy.random.default_rng(1)
print("seed 1")
with cutproof_run.Writer(work / "large.h5", rest=x, spacing=0.01, promises="free") as run:
    for frame in range(700):
        swept = numpy.full((1, 4, 3), numpy.nan)
        if 100 <= frame < 110:
            low, high = 0.02 * (frame - 100) - 0.005, 0.02 * (frame - 99)
            swept[0] = [[0.095, -1, low], [0.095, 1, low], [0.095, 1, high], [0.095, -1, high]]
        run.frame(x + 1e-3 * random.normal(size=x.shape), blade=swept)
path, document = page_of("large", 0)
assert path.stat().st_size < 33e6, path.stat().st_size
with Browser(path) as page:
    about = page.text("#about")
    assert "it shows one frame in" in about and "stage" not in about, about
    frames = page.data("moments.map((moment) => moment.frame)")
    assert len(frames) < 700 and frames[-1] == 699, frames
    # What was swept in frames that are left out is seen in the next one.
    assert sum(len(swept) for swept in page.data("moments.map((moment) => moment.swept)")) == 10 * 12

# --- A state: a single moment, with its pieces; and one that is none ---

line = {"positions": [[k, 0, 0] for k in range(6)], "edges": [[0, 1], [1, 2], [3, 4], [4, 5]],
        "cluster_offsets": [0, 3, 6], "cluster_members": [0, 1, 2, 3, 4, 5]}
states = {"apart": (line, 0), "glued": ({**line, "cluster_members": [0, 1, 3, 2, 4, 5]}, 1),
          "senseless": ({**line, "cluster_members": [0, 1, 99, 3, 4, 5]}, 1)}
for name, (arrays, status) in states.items():
    numpy.savez(work / f"{name}.npz", **{key: numpy.array(value, float if key == "positions" else int)
                                         for key, value in arrays.items()})
    work.run([program, "check", f"{name}.npz", "--report", f"{name}.html"], status)
    with Browser(work / f"{name}.html") as page:
        assert f"cutproof judged the state {name}.npz" in page.text("#summary"), page.text("#summary")
        page.unfold()
        assert "not judged" in page.text("#verdicts") and "after" not in page.text("#verdicts tbody")
        assert not page.driver.find_elements(By.ID, "scrub"), "a state has one moment"
        if name != "senseless":
            assert page.text("#status").startswith("The state · 2 pieces · 2 coupling groups · 6 particles")
        if name == "glued":
            page.shown(0, 0)
            assert page.pixels()["orange"] > 0, "the witness is not seen"
        page.picture(work / f"{name}.png")

# --- A kick: the kicked run, coloured by its distance from the other ---

frames = numpy.repeat(numpy.array(line["positions"], float)[None], 8, 0)
kicked = frames.copy()
kicked[4:, 3:, 2] += 0.1 * numpy.arange(1, 5)[:, None]
for name, leak, status in (("alone", 0, 0), ("leaks", 1e-3, 1)):
    felt = kicked.copy()
    felt[6:, 1, 1] += leak
    numpy.savez(work / f"{name}.npz", positions=frames, kicked=felt, piece=[0, 0, 0, 1, 1, 1], time=0.1 * numpy.arange(8))
    work.run([program, "kick", f"{name}.npz", "--report", f"{name}.html"], status)
    with Browser(work / f"{name}.html") as page:
        page.shown(6 if leak else 4, 0 if leak else "")
        assert "cutproof judged the kicks of" in page.text("#summary"), page.text("#summary")
        assert "the run without a kick" in page.text("#legend") and "2 pieces" in page.text("#status")
        assert "0.6 s" in page.text("#status") or not leak
        assert page.data("body.spacing") == 1, "h is no distance of neighbours"
        if leak:
            assert page.data("findings[0].property") == "no ghost force" and page.pixels()["orange"] > 0
        moved = page.data("moments.map((moment) => moment.apart.max > 0)")
        assert moved == [False] * 4 + [True] * 4, moved
        page.picture(work / f"{name}.png")

# --- A relation: both runs, the second brought back to where the first one is ---

x = numpy.stack(numpy.meshgrid(*3 * [numpy.arange(4.0)], indexing="ij"), 3).reshape(-1, 3) * 0.01
order = numpy.random.default_rng(2).permutation(len(x))
for name, map_, off, status in (("mapped", "units:4,1,1", 0, 0), ("strays", "units:4,1,1", 1e-3, 1),
                                ("mixed", "permute", 0, 0), ("far", "units:4,1,1", 1e3, 1)):
    with cutproof_run.Writer(work / f"{name}_a.h5", rest=x, spacing=0.01, promises="free") as a, \
         cutproof_run.Writer(work / f"{name}_b.h5", rest=4 * x if map_ != "permute" else x[order],
                             spacing=0.04 if map_ != "permute" else 0.01, promises="free",
                             **({"permutation": order} if map_ == "permute" else {})) as b:
        for frame in range(5):
            now = x + [0, 0, 1e-3 * frame ** 2]
            other = (4 * now if map_ != "permute" else now[order]).copy()
            other[7 if off < 1 else slice(None), 0] += off * {3: 1, 4: 1e-9}.get(frame, 0)
            quad = [[[0.01, 0.01, 0.01 * z + 0.015] for z in (frame, frame, frame + 1)] + [[0.02, 0.01, 0.01 * frame]]]
            a.frame(now, time=0.1 * frame, groups=[range(32), range(32, 64)], blade=numpy.array(quad))
            groups = [range(32), range(32, 64)]
            if map_ == "permute":
                groups = [numpy.flatnonzero(order >= 32), numpy.flatnonzero(order < 32)]
            b.frame(other, time=0.1 * frame, groups=groups, blade=numpy.array(quad) * (4 if map_ != "permute" else 1))
    work.run([program, "relate", f"{name}_a.h5", f"{name}_b.h5", "--map", map_, "--report", f"{name}.html"], status)
    with Browser(work / f"{name}.html") as page:
        assert "cutproof judged whether these correspond" in page.text("#summary"), page.text("#summary")
        sides = [one.text for one in page.driver.find_elements(By.CSS_SELECTOR, ".side")]
        assert sides[0] == f"{name}_a.h5" and sides[1].startswith(f"{name}_b.h5"), sides
        apart = page.data("moments.map((moment) => moment.apart.max)")
        assert [one > 1e-9 for one in apart] == [False, False, False, off > 0, off > 1], apart
        assert all(f"{name}_{run}.h5" in page.text(".plot .legend") for run in "ab")
        if name == "far":
            page.scrub(3)
            for where in ("#status", ".side.other"):
                assert "not drawn: 64 particles far away" in page.text(where), page.text(where)
            page.scrub(2)
            assert page.text(".side.other") == "far_b.h5", page.text(".side.other")
        elif off:
            page.shown(3, 0)
            assert "They differ" in page.text("#comparison") and page.pixels()["orange"] > 0
            # A colour is one distance, whatever somebody has looked at before.
            page.go_to("#frame=4")
            before = page.text("#legend"), page.pixels()["sum"]
            page.scrub(3)
            page.scrub(4)
            assert (page.text("#legend"), page.pixels()["sum"]) == before
            # The blade's way is not drawn over marks, in neither run.
            page.driver.find_element(By.CSS_SELECTOR, "[data-finding='0']").click()
            page.shown(3, 0)
            seen = page.pixels()["sum"]
            page.driver.find_element(By.ID, "way").click()
            page.shown(3, 0)
            assert page.pixels()["sum"] == seen, "one of the runs shows the way beside marks"
        else:
            assert "decide differently" not in page.text("#comparison"), page.text("#comparison")
        page.picture(work / f"{name}.png")
    for width in (320, 360, 390):
        with Browser(work / f"{name}.html", width=width) as page:
            assert page.ask("return document.documentElement.scrollWidth <= window.innerWidth"), f"wider than {width} pixels"
print("pages of runs are as they should be")
