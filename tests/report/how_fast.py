#!/usr/bin/env python3
"""How fast pages are, in figures for the log: moments a second while somebody scrubs, how large a page of many
particles is, and after how long it is there. No figure of time is asserted; sizes are, and that every moment is shown.
Usage: how_fast.py CUTPROOF MADE_PAGES WORK. Exit status 77 where there is no browser (browser.py)."""
import os
import sys

from browser import Browser, Folder

program, made_pages = sys.argv[1], sys.argv[2]
work = Folder(sys.argv[3], program)

SCRUB = """const [most, done] = arguments;
  (async () => {
    const range = document.getElementById('scrub'), begin = performance.now(), last = Math.min(Number(range.max), most);
    for (let k = 1; k <= last; ++k) {
      range.value = k;
      range.dispatchEvent(new Event('input'));
      while (document.documentElement.dataset.shown !== `${k}/`) await new Promise((next) => setTimeout(next, 0));
      await new Promise((next) => requestAnimationFrame(next));  // it is drawn
    }
    done(last / (performance.now() - begin) * 1000);
  })();"""


def scrubbed(page, name, show=None, most=20):
    if show:
        page.choose("show", show)
    page.driver.set_script_timeout(200)  # on a machine that has other work
    rate = page.driver.execute_async_script(SCRUB, most)
    print(f"{name}{', ' + show if show else ''}: {rate:.1f} moments a second", flush=True)


print(f"two cores or more: {os.cpu_count()}, load {os.getloadavg()[0]:.1f}; Chromium with SwiftShader, no GPU")
work.run([program, "run", "kidney_discontinuous", "--record", "kidney"], 0)
work.run([program, "report", "kidney", "-o", "kidney.html"], 0)
with Browser(work / "kidney.html", still=False) as page:
    for show in ("skin", "particles"):
        scrubbed(page, "kidney of 8,000 particles", show)

# A hundred frames of a hundred thousand particles, the particles in every second frame.
print(work.run([made_pages, 47, 100, 2, "many.html"], 0).strip())
size = (work / "many.html").stat().st_size
assert size < 30e6, f"{size / 1e6:.1f} MB"
with Browser(work / "many.html", still=False) as page:
    assert page.data("body.kept") == 47 ** 3 and page.data("thinned") == "", page.data("thinned")
    for show in ("skin", "particles"):
        scrubbed(page, "103,823 particles", show, 10)

# A million particles: what was left out is said.
print(work.run([made_pages, 100, 40, 1, "million.html"], 0).strip())
size = (work / "million.html").stat().st_size
assert size < 31e6, f"{size / 1e6:.1f} MB"
with Browser(work / "million.html", still=False) as page:
    said = page.text("#about")
    assert "of 1000000 particles" in said and "It shows" in said, said
    print(page.data("thinned"))
    scrubbed(page, "a million particles", None, 5)
