from twolink.viz.labels import line_mark, round_mark


def test_a_round_mark_is_a_line_without_length():
    assert round_mark((1, 2), 0.5) == [1.0, 2.0, 1.0, 2.0, 0.5]


def test_the_radius_of_a_line_is_half_of_its_width():
    assert line_mark((0, 0), (1, 0), 0.5) == [0.0, 0.0, 1.0, 0.0, 0.25]
