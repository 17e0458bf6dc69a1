"""The documentation site: the pages of docs/ and the pages that are generated from the code, built by Sphinx."""
