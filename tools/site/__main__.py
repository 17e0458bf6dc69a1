"""`python -m tools.site OUT`: writes the sources of the site beside OUT and builds it; every warning is an error."""

import argparse
import posixpath
import re
import shutil
import sys
from pathlib import Path

from sphinx.cmd.build import build_main

from tools.site.commands import command_pages
from tools.site.formats import format_pages
from tools.site.gallery import gallery_pages
from tools.site.interface import interface_pages
from tools.site.method_pictures import method_pictures, with_picture

ROOT = Path(__file__).parents[2]
FROM_ROOT = {
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "results/README.md": "results.md",
    "results/landscape/which-optimiser.md": "which-optimiser.md",
}


def main() -> int:
    """Builds the site and returns the exit status of Sphinx."""
    parser = argparse.ArgumentParser(prog="python -m tools.site", description="Build the documentation site.")
    parser.add_argument("out", type=Path, help="folder for the pages")
    parser.add_argument("--source", type=Path, default=Path("build/docs"), help="folder for the sources")
    chosen = parser.parse_args()
    write_source(chosen.source)
    strict = ["--fail-on-warning", "--keep-going", "--quiet", "--fresh-env"]
    return build_main([*strict, "--builder", "html", str(chosen.source), str(chosen.out)])


def write_source(folder: Path) -> None:
    """Writes all sources into a folder; what the folder held is removed."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(ROOT / "docs", folder, ignore=shutil.ignore_patterns(".*"))
    pages = {f"docs/{path.relative_to(folder).as_posix()}": path for path in folder.rglob("*.md")}
    pages |= {name: folder / page for name, page in FROM_ROOT.items()}
    for name, page in pages.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        text = follow_links(text, name, page.relative_to(folder).as_posix())
        page.write_text(with_picture(page.stem, text) if page.parent == folder else text, encoding="utf-8")
    for generated in (method_pictures, gallery_pages, command_pages, format_pages, interface_pages):
        for path, content in generated().items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(content if isinstance(content, bytes) else content.encode())


def follow_links(text: str, name: str, page: str) -> str:
    """The text of a file of the repository, as a page of the site: links lead to where the site has the pages."""

    def follow(match: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(posixpath.dirname(name), match[1]))
        place = FROM_ROOT.get(target, target.removeprefix("docs/") if target.startswith("docs/") else None)
        return match[0] if place is None else f"]({posixpath.relpath(place, posixpath.dirname(page) or '.')}"

    return re.sub(r"\]\(([^)#:\s]+)", follow, text)


if __name__ == "__main__":
    sys.exit(main())
