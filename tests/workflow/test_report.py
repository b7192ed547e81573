"""The report, opened in a browser: every figure and every table of the campaign shows in it."""

import json
import re
import shutil
import subprocess
from html import unescape

import pytest

from tests.workflow.test_campaign import SMOKE

pytestmark = [
    pytest.mark.slow,
    pytest.mark.browser,
    pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium here"),
]

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
    const item = document.querySelector(picture ? "img" : "iframe");
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


@pytest.fixture(scope="module")
def found(campaign, tmp_path_factory) -> dict:
    """What the browser finds in the report of the campaign."""
    page = campaign.folder / "report.html"
    campaign.run(*SMOKE, "--report", page.name, "--", "all")
    before, end, after = page.read_text(encoding="utf-8").rpartition("</body>")
    page.write_text(before + LOOK + end + after, encoding="utf-8")
    folder = tmp_path_factory.mktemp("chromium")
    done = subprocess.run(
        [
            *CHROMIUM,
            f"--user-data-dir={folder}",
            "--virtual-time-budget=60000",
            "--dump-dom",
            page.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=300,
    )
    words = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.S)
    assert words, done.stderr
    return json.loads(unescape(words[1]))


def test_every_figure_and_every_table_shows_with_a_title_and_a_caption(campaign, found):
    results = campaign.folder / "results"
    expected = [*results.glob("figures/*.png"), *results.glob("figures/*.gif")]
    expected += results.glob("tables/*.html")
    assert len(expected) == 19 + 1 + 11
    assert set(found["shown"]) == {str(path.relative_to(campaign.folder)) for path in expected}
    for path, shown in found["shown"].items():
        assert shown["size"] > (1 if path.endswith("html") else 300), path
        assert shown["labels"], path
        assert len(shown["caption"]) > 20, path


def test_the_front_page_leads_through_the_folders_of_the_results(found):
    assert len(found["folders"]) == 4
    for folder in found["folders"]:
        assert f"{folder}:" in found["front"]
