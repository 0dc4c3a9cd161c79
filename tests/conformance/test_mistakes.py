"""Mistakes as functions of questions."""

from functools import partial

import numpy as np

from twolink.conformance.diagnosis import MISTAKES, flat_model
from twolink.conformance.mistakes import Mistake, Question, of_models, of_questions
from twolink.conformance.quantities import QUANTITIES
from twolink.conformance.suites import suite


def question(name="forward_dynamics", **more):
    group = next(group for group in suite("evaluation") if group.id == "evaluation/general")
    states = {"angles": np.array([[0.3, -0.7]]), "speeds": np.array([[1.1, 0.4]])}
    states["torques"] = np.zeros((1, 2))
    model = flat_model(group, from_urdf=False)
    return Question(QUANTITIES[name], model, states, **more)


def test_the_truth_is_the_certified_answer_or_that_in_float64():
    asked = question()
    assert (asked.truth == asked.answer()).all()
    assert question(certified=2 * asked.truth).truth[0, 0] == 2 * asked.truth[0, 0]


def test_a_variant_that_divides_by_zero_gives_no_answer():
    def divided(asked):
        return asked.truth * (1 // 0)

    mistake = of_questions("halves", "-", lambda a: a.truth / 2, divided, lambda a: a.truth / 4)
    asked = question()
    assert [found[0, 0] / asked.truth[0, 0] for found in mistake.wrong(asked)] == [0.5, 0.25]
    assert len(list(mistake.applied(asked))) == 3


def test_variants_apply_in_all_states():
    """A motion has the answers of one variant in many states."""
    asked = question()
    states = {**asked.states, "angles": np.array([[2.0, 1.0]])}
    other = Question(asked.quantity, asked.model, states)
    for mistake in MISTAKES.values():
        variants = list(mistake.applied(asked))
        assert len(variants) == len(list(mistake.applied(other)))
        found = Mistake("the same", "-", lambda _, kept=variants: kept).wrong(other)
        for one, two in zip(found, mistake.wrong(other), strict=True):
            np.testing.assert_array_equal(one, two)


def test_a_model_that_is_the_right_one_is_no_variant():
    def change(model):
        yield model

    asked = question()
    assert list(of_models("nothing", "-", change).applied(asked)) == []
    twice = of_questions("twice", "-", partial(Question.answer), quantities=("mass_matrix",))
    assert list(twice.applied(asked)) == []
