"""Checks of the sentences in which a URDF is refused, or assumptions are stated."""

import pytest

from twolink import UrdfError
from twolink.urdf import parse_planar_urdf


def refusal(text: str, **reading) -> str:
    """Return the sentence in which a URDF is refused, which names the file and the requirement."""
    with pytest.raises(UrdfError) as caught:
        parse_planar_urdf(text, source="arm.urdf", **reading)
    sentence = str(caught.value)
    assert len(sentence.splitlines()) == 1
    assert sentence.startswith("arm.urdf: ")
    assert sentence.count("arm.urdf") == 1
    assert "must" in sentence
    assert len(sentence) < 600
    return sentence


def names(sentence: str, *words: str) -> None:
    """Check that a sentence has these words."""
    for word in words:
        assert word in sentence, (word, sentence)


def only(sentences: tuple[str, ...], *words: str) -> None:
    """Check that there is one assumption, and that it is a sentence with these words."""
    assert len(sentences) == 1, sentences
    assert sentences[0].endswith(".")
    names(sentences[0], *words)
