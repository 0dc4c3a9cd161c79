"""Verdicts: short text, tables at every width, HTML."""

from tests.test_tables import printed
from twolink.data import data_path
from twolink.tables import length
from twolink.urdf import read_planar_urdf
from twolink.verification import verify


def test_every_comparison_has_a_cell_and_80_columns_suffice():
    verdict = verify(read_planar_urdf(data_path("twolink.urdf")), states=20)
    dynamics, motion = verdict.tables()
    assert dynamics.title == "Equations of motion"
    text = printed(dynamics, 80) + printed(motion, 80)
    assert max(length(line.rstrip()) for line in text.splitlines()) <= 80
    assert "✓" in text
    assert "✗" not in text
    for comparison in verdict.comparisons:
        assert comparison.quantity.partition(" of ")[0] in text
    assert "Pinocchio's algorithm" in printed(dynamics, 104)


def test_a_verdict_is_one_line_and_a_page_of_tables():
    verdict = verify(read_planar_urdf(data_path("twolink.urdf")), states=5)
    assert repr(verdict).startswith("<Verdict on twolink.urdf in Pinocchio ")
    assert verdict.sentence in repr(verdict)
    assert "\n" not in repr(verdict)
    page = verdict._repr_html_()
    assert page.count("<table") == 2
    assert page.count("✓") == sum(len(row) - 2 for t in verdict.tables() for row in t.rows)
    assert "Agreement means d ≤ n" in page
