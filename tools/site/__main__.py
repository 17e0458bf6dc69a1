"""`python -m tools.site OUT`: writes the sources of the site beside OUT and builds it; every warning is an error."""

import argparse
import sys
from pathlib import Path

from sphinx.cmd.build import build_main

from tools.site.source import write_source


def main() -> int:
    """Builds the site and returns the exit status of Sphinx."""
    parser = argparse.ArgumentParser(prog="python -m tools.site", description="Build the documentation site.")
    parser.add_argument("out", type=Path, help="folder for the pages")
    parser.add_argument("--source", type=Path, default=Path("build/docs"), help="folder for the sources")
    chosen = parser.parse_args()
    write_source(chosen.source)
    strict = ["--fail-on-warning", "--keep-going", "--quiet", "--fresh-env"]
    return build_main([*strict, "--builder", "html", str(chosen.source), str(chosen.out)])


if __name__ == "__main__":
    sys.exit(main())
