import pytest

from twolink.effects import Surface
from twolink.errors import ParameterError


def test_messages_are_printable_text():
    with pytest.raises(ParameterError) as caught:
        Surface(point=(0, 0), normal=1j, name="\udcff\x1b[31m")
    assert str(caught.value) == (r"\xff\x1b[31m: normal must be a pair of numbers; got 1j")
