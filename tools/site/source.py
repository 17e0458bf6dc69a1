"""The sources of the site in one folder: pages written by hand, notebooks, and pages generated from the code."""

import shutil
from pathlib import Path

from tools.site.commands import command_pages
from tools.site.formats import format_pages
from tools.site.gallery import gallery_pages
from tools.site.interface import interface_pages

ROOT = Path(__file__).parents[2]
FROM_ROOT = {"CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}


def write_source(folder: Path) -> None:
    """Writes all sources into a folder; what the folder held is removed."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(ROOT / "docs", folder, ignore=shutil.ignore_patterns(".*"))
    for name, page in FROM_ROOT.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        (folder / page).write_text(text.replace("](docs/", "]("), encoding="utf-8")
    for generated in (gallery_pages, command_pages, format_pages, interface_pages):
        for path, content in generated().items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(content if isinstance(content, bytes) else content.encode())
