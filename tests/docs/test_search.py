"""The site's own search finds the words that people use."""

from urllib.parse import quote

from site_browser import Site

WORDS = {
    "threads": "threads",
    "stiffness": "glossary",
    "elasticity": "glossary",
    "hardness": "glossary",
    "softness": "glossary",
    "palpation": "glossary",
    "tactile": "glossary",
    "Young's modulus": "glossary",
    "durometer": "glossary",
    "Shore": "researcher",
    "rubber": "researcher",
    "tissue": "howdoi",
    "force sensor": "howdoi",
    "microcontroller": "embedded",
    "Arduino": "embedded",
    "Raspberry Pi": "systems",
    "USB": "kit",
    "udev": "kit",
    "permission denied": "howdoi",
    "no device": "howdoi",
    "firmware": "kit",
    "unplugged": "kit",
    "serial": "serial",
    "drift": "how",
    "tremor": "how",
    "noise": "acceptance",
    "CUSUM": "threshold",
    "baseline": "how",
    "tare": "live",
    "calibration": "researcher",
    "MATLAB": "recordings",
    "CSV": "recordings",
    "Excel": "import",
    "pandas": "frames",
    "browser": "live",
    "Windows": "systems",
    "speed": "speed",
    "citing": "citing",
    "BibTeX": "citing",
    "licence": "citing",
    "changelog": "changes",
}
"""What is typed, and a page that has to be among the first ten results."""

FIRST = 5
FOUND = "return [...document.querySelectorAll('#search-results ul.search li > a')].map((a) => a.getAttribute('href'));"
ENDED = "return /finished|did not match/.test(document.querySelector('#search-results .search-summary')?.textContent);"


def found(opened: Site, words: str) -> list[str]:
    """Return the pages that the search shows for what is typed into its field, the best first."""
    opened.open(f"search.html?q={quote(words)}")
    opened.until(ENDED)
    pages = [href.split("?")[0].split("#")[0].removesuffix(".html") for href in opened.run(FOUND)]
    return list(dict.fromkeys(pages))


def test_it_finds_what_people_type(opened: Site) -> None:
    lost = {
        words: pages[:FIRST] for words, page in WORDS.items() if page not in (pages := found(opened, words))[:FIRST]
    }
    assert lost == {}


def test_it_does_not_find_what_is_not_there(opened: Site) -> None:
    assert found(opened, "flugelhorn") == []
