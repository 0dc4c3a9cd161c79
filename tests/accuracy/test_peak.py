from twolink.accuracy import peak
from twolink.accuracy.peak import peak_of_a_core


def test_the_peak_counts_the_operations_of_products(monkeypatch):
    """Products of 2 x 2 matrices are 8 multiplications and 4 additions; each clock lasts 1 s."""
    seconds = iter(range(100))
    monkeypatch.setattr(peak, "perf_counter", lambda: next(seconds))
    monkeypatch.setattr(peak, "_SIZE", 2)
    monkeypatch.setattr(peak, "_PRODUCTS", 5)
    assert peak_of_a_core() == 5 * 12


def test_a_core_is_faster_than_python_and_slower_than_any():
    assert 1e7 < peak_of_a_core() < 1e13
