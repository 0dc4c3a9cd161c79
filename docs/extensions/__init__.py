"""Extensions of Sphinx for this site: mathematics, generated pages, docstrings."""
