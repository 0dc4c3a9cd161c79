"""Tables of a verdict: every comparison, at every width."""

from tests.test_tables import printed
from twolink.data import data_path
from twolink.tables import length
from twolink.urdf import read_planar_urdf
from twolink.verification import verify
from twolink.verification.tables import tables_of


def test_every_comparison_has_a_cell_and_80_columns_suffice():
    verdict = verify(read_planar_urdf(data_path("twolink.urdf")), states=20)
    dynamics, motion = tables_of(verdict)
    assert dynamics.title == "Equations of motion"
    text = printed(dynamics, 80) + printed(motion, 80)
    assert max(length(line.rstrip()) for line in text.splitlines()) <= 80
    assert "✓" in text
    assert "✗" not in text
    for comparison in verdict.comparisons:
        assert comparison.quantity.partition(" of ")[0] in text
    assert "Pinocchio's algorithm" in printed(dynamics, 104)
