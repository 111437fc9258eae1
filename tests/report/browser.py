"""A page in headless Chromium, for the tests of report pages: opened as by double click, with the network watched and
every line of the console kept. SystemExit 77, with the name of what is missing, without Chromium, its driver or
selenium."""
import atexit
import json
import os
import pathlib
import shutil
import subprocess
import sys
import time

chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
try:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common import utils
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
except ImportError:
    print("skipped: python3-selenium is not installed")
    sys.exit(77)
if not chromium or not driver:
    print(f"skipped: there is no {'chromium' if not chromium else 'chromium-driver'}")
    sys.exit(77)


class Folder:
    """An empty folder in which the program runs."""

    def __init__(self, path, program):
        self.path = pathlib.Path(path).resolve()
        shutil.rmtree(self.path, ignore_errors=True)
        self.path.mkdir(parents=True)
        self.environment = dict(os.environ, PATH=f"{pathlib.Path(program).parent}:{os.environ['PATH']}")

    def __truediv__(self, name):
        return self.path / name

    def run(self, arguments, status):
        done = subprocess.run(arguments if isinstance(arguments, str) else [str(one) for one in arguments],
                              shell=isinstance(arguments, str), cwd=self.path, env=self.environment,
                              capture_output=True, text=True, timeout=200)
        assert done.returncode == status, f"{arguments}: {done.returncode}\n{done.stdout}{done.stderr}"
        return done.stdout + done.stderr


class Driver(Service):
    """The driver, asked by its address: without /etc/hosts nothing has the name localhost."""

    @property
    def service_url(self):
        return f"http://127.0.0.1:{self.port}"

    def is_connectable(self):
        return utils.is_connectable(self.port, "127.0.0.1")


class Browser:
    """A page, opened as by double click, with the network watched and every line of the console kept."""
    started = None  # the Chromium of all pages for which no flags are given

    def __init__(self, page, *flags, width=1280, dark=False, still=True):
        if flags:
            self.driver = Browser.blank(*flags)
        else:
            Browser.started = self.driver = Browser.started or Browser.blank()
        self.driver.set_script_timeout(60)
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"},
            {"name": "prefers-reduced-motion", "value": "reduce" if still else "no-preference"}]})
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                    {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False})
        page = pathlib.Path(page)
        self.url = page.as_uri()
        begin = time.monotonic()
        self.driver.get(self.url)
        self.until("return document.documentElement.dataset.ready === 'true'")
        self.there_after = time.monotonic() - begin
        print(f"{page.name}: {page.stat().st_size / 1e6:.2f} MB, there after {self.there_after:.1f} s", flush=True)

    @staticmethod
    def blank(*flags):
        """Chromium with no page in it."""
        options = webdriver.ChromeOptions()
        # The driver reaches Chromium through a pipe, not at localhost.
        for flag in ("--headless=new", "--remote-debugging-pipe", "--no-sandbox", "--disable-dev-shm-usage", "--use-gl=angle",
                     "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--window-size=1280,1000", *flags):
            options.add_argument(flag)
        options.binary_location = chromium
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        chrome = webdriver.Chrome(service=Driver(driver), options=options)
        atexit.register(chrome.quit)
        return chrome

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        log = self.driver.get_log("browser")
        if kind is not None:
            print(f"the console says: {log}", flush=True)
            return
        assert not log, f"the console says: {log}"
        messages = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        asked = [one["params"]["request"]["url"] for one in messages if one["method"] == "Network.requestWillBeSent"]
        assert self.url in asked, f"the network was not watched: {asked}"
        outside = [url for url in asked if url != self.url and not url.startswith("data:")]
        assert not outside, f"the page asked for {outside}"
        if self.driver is not Browser.started:
            self.driver.quit()

    def ask(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def until(self, script, *arguments, seconds=60):
        end = time.monotonic() + seconds
        while not self.ask(script, *arguments):
            assert time.monotonic() < end, f"not within {seconds} s: {script}"
            time.sleep(0.02)

    def text(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector).text

    def shown(self, moment, finding=""):
        """Until the view shows a moment, and a finding in it."""
        self.until("return document.documentElement.dataset.shown === arguments[0]", f"{moment}/{finding}")
        self.driver.execute_async_script("const done = arguments[0];"
                                         "requestAnimationFrame(() => requestAnimationFrame(() => done()));")

    def unfold(self):
        """Every row of a table."""
        self.ask("for (const one of document.querySelectorAll('.fold button[aria-expanded=false]')) one.click()")

    def go_to(self, link):
        """Opens the page by a link."""
        self.driver.get("about:blank")
        self.driver.get(self.url + link)
        self.until("return document.documentElement.dataset.ready === 'true'")

    def scrub(self, moment):
        self.ask("const range = document.getElementById('scrub'); range.value = arguments[0];"
                 "range.dispatchEvent(new Event('input'));", moment)
        self.shown(moment)

    def pixels_of(self, selector):
        """Of each of these views every pixel, as a sum; how many are not of its ground, at its rim as well, and how many are marked. Of
        the sharp pictures, which come after quick ones, and of all in one moment in which none is due."""
        end = time.monotonic() + 60
        while (seen := self.ask("""
          const all = [...document.querySelectorAll(arguments[0])];
          if (all.length === 0 || all.some((canvas) => canvas.dataset.drawn !== 'sharp')) return null;
          return all.map((canvas) => {
            const copy = document.createElement('canvas');
            [copy.width, copy.height] = [canvas.width, canvas.height];
            const pen = copy.getContext('2d');
            pen.drawImage(canvas, 0, 0);
            const all = pen.getImageData(0, 0, copy.width, copy.height).data;
            let drawn = 0, sum = 0, orange = 0, rim = 0;
            for (let i = 0; i < all.length; i += 4) {
              if (all[i] !== all[0] || all[i + 1] !== all[1] || all[i + 2] !== all[2]) {
                const x = (i / 4) % copy.width, y = Math.floor(i / 4 / copy.width);
                ++drawn;
                rim += x === 0 || y === 0 || x === copy.width - 1 || y === copy.height - 1;
              }
              if (all[i] > 150 && all[i] > 1.6 * all[i + 1] && all[i + 2] < 40) ++orange;
              sum = (Math.imul(sum, 31) + all[i] + 7 * all[i + 1] + 13 * all[i + 2]) | 0;
            }
            return {sum, share: drawn / (all.length / 4), orange, rim};
          });""", selector)) is None:
            assert time.monotonic() < end, f"{selector} is not drawn within 60 s"
            time.sleep(0.02)
        return seen

    def pixels(self):
        return self.pixels_of("#canvas")[0]

    def pixels_after(self, action, seen):
        """What is drawn once an action has changed it, which must be none of what was seen before."""
        action()
        end = time.monotonic() + 60
        while (now := self.pixels())["sum"] in seen:
            assert time.monotonic() < end, "nothing new is drawn"
        return now

    def data(self, what):
        return self.ask(f"return JSON.parse(document.getElementById('data').textContent).{what}")

    def choose(self, select, value):
        self.ask("const s = document.getElementById(arguments[0]); s.value = arguments[1];"
                 "s.dispatchEvent(new Event('change'));", select, value)

    def picture(self, path):
        self.driver.save_screenshot(str(path))
