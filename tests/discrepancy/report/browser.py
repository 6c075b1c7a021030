"""Opens a page in headless Chromium, without network, and tells what a reader would meet."""

import json
import re
import shutil
import subprocess
from pathlib import Path

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)

_PROBE = """
<script>
const errors = [];
window.addEventListener("error", (event) => errors.push(String(event.message)));
window.addEventListener("load", () => setTimeout(() => {
  document.querySelectorAll("details").forEach((one) => { one.open = true; });
  const seen = (one) => one.getClientRects().length > 0 && one.offsetWidth !== 0;
  const report = {
    errors,
    wider_than_window: document.scrollingElement.scrollWidth - window.innerWidth,
    images: [...document.images].map((one) => [one.alt, one.naturalWidth, seen(one)]),
    pictures: [...document.querySelectorAll("figure:has(figcaption)")].map((one) => [
      one.scrollWidth > one.clientWidth,
      getComputedStyle(one.querySelector("figcaption"), "::before").content.includes("scrolls"),
    ]),
    tables: [...document.querySelectorAll("table")].map((one) => [one.rows.length, seen(one)]),
    broken_anchors: [...document.querySelectorAll('a[href^="#"]')]
      .map((one) => one.getAttribute("href")).filter((to) => !document.querySelector(to)),
    links: [...document.querySelectorAll("a[href]")].map((one) => one.getAttribute("href")),
    loaded: performance.getEntriesByType("resource").map((one) => one.name)
      .filter((name) => !name.startsWith("data:")),
    answer: (() => { try { return PROBE; } catch (error) { return String(error); } })(),
  };
  const holder = document.createElement("script");
  holder.type = "application/json";
  holder.id = "probe";
  holder.textContent = JSON.stringify(report);
  document.body.append(holder);
}, 200));
</script>
"""


def probe(page: Path, tmp_path: Path, *, width: int = 1280, script: str = "null") -> dict:
    """Return what the page shows at that width, and what an expression of JavaScript gives."""
    html = page.read_text(encoding="utf-8")
    copy = page.with_name(f".probe-{page.name}")
    copy.write_text(
        html.replace("<head>", "<head>" + _PROBE.replace("PROBE", script), 1), encoding="utf-8"
    )
    try:
        done = subprocess.run(
            [
                str(CHROMIUM),
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--host-resolver-rules=MAP * ~NOTFOUND",
                f"--user-data-dir={tmp_path / 'profile'}",
                f"--window-size={width},900",
                "--virtual-time-budget=4000",
                "--dump-dom",
                copy.as_uri(),
            ],
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
        )
    finally:
        copy.unlink()
    found = re.search(r'<script type="application/json" id="probe">(.*?)</script>', done.stdout)
    return json.loads(found.group(1))
