"""A report of Snakemake, opened in a browser without a window."""

import json
import re
import subprocess
from html import unescape
from pathlib import Path

CHROMIUM = (
    *("chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--no-first-run"),
)

# Shows the results one after the other, as a click does, and leaves in the page what came of each.
LOOK = """
<script>
async function look() {
  const found = {front: document.body.innerText, folders: Object.keys(categories), shown: {}};
  for (const [path, result] of Object.entries(results)) {
    const picture = result.mime_type.startsWith("image");
    const content = picture ? "img" : "html";
    app.setView({content, contentPath: result.data_uri, resultPath: path});
    await new Promise(done => setTimeout(done, 300));
    const items = [...document.querySelectorAll(picture ? "img" : "iframe")];
    const item = items.find(one => one.src === result.data_uri);
    const size = picture ? item.naturalWidth : atob(item.src.split(",")[1]).split("<tr").length;
    found.shown[path] = {size, labels: result.labels, caption: result.caption};
  }
  const page = document.createElement("pre");
  page.id = "found";
  page.textContent = JSON.stringify(found);
  document.body.append(page);
}
window.addEventListener("load", () => setTimeout(look, 500));
</script>
"""


def look_at(report: Path, profile: Path) -> dict:
    """What Chromium finds in a report.

    front: text of the front page. folders: names of the folders of results. shown: each result by
    its path, with its size on the page (pixels across a picture, rows of a table), labels and
    caption. profile: folder for what the browser keeps.
    """
    before, end, after = report.read_text(encoding="utf-8").rpartition("</body>")
    page = profile / report.name
    page.write_text(before + LOOK + end + after, encoding="utf-8")
    done = subprocess.run(
        [
            *(*CHROMIUM, f"--user-data-dir={profile}"),
            *("--virtual-time-budget=60000", "--dump-dom", page.as_uri()),
        ],
        capture_output=True,
        text=True,
        timeout=300,
    )
    words = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.S)
    if words is None:
        raise RuntimeError(f"Chromium shows no report: {done.stderr[-2000:]}")
    return json.loads(unescape(words[1]))
