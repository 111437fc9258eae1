#!/usr/bin/env python3
"""`run --preview` in a browser: the body as it begins, where the blade goes, and that nothing has run.
Usage: preview_test.py CUTPROOF WORK
Exit status 77, with the name of what is missing, where there is no Chromium, no driver of it or no selenium."""
import sys

from browser import Browser, By, Folder

program = sys.argv[1]
work = Folder(sys.argv[2], program)
work.run([program, "run", "cylinder", "--preview", "cylinder.html"], 0)
work.run([program, "run", "kidney_arc", "--set", "blade.length=1.5", "--preview", "arc.html"], 0)
work.run([program, "run", "uniform_stretch", "--preview", "no_blade.html"], 0)

with Browser(work / "cylinder.html") as page:
    assert page.text("#summary").startswith("not judged") and "before it runs" in page.text("#summary"), page.text("#summary")
    assert page.text("#findings-title") == "Nothing has run"
    assert "cutproof run cylinder --check" in page.text("#findings"), page.text("#findings")
    whole = page.text("main")
    assert "after skin" not in whole and "Stage" not in whole and "Over time" not in whole, whole
    assert page.data("frames.triangles[0]") > 0, "the body has no skin"
    seen = page.pixels()
    assert 0.1 < seen["share"], f"the body fills {seen['share']} of the view"
    last = page.data("moments.length") - 1
    assert last > 20, last
    sums = {seen["sum"]}
    for at in (last // 3, 2 * last // 3):
        page.scrub(at)
        assert "blade down" in page.text("#status") and page.text("#status").startswith("Frame "), page.text("#status")
        sums.add(page.pixels()["sum"])
    assert len(sums) == 3, "the blade does not move"

with Browser(work / "arc.html") as page:
    notes = [note.text for note in page.driver.find_elements(By.CSS_SELECTOR, ".notes li")]
    assert any("blade.length" in note and "beside its path" in note for note in notes), notes

with Browser(work / "no_blade.html") as page:
    assert page.data("moments.length") == 1
print("previews show what their scenes say")
