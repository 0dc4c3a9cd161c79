"""Messages: schemas, lines of text, and sentences that refuse invalid lines."""

import json
import math

import pytest

from twolink.engines.messages import (
    REQUESTS,
    Ask,
    Errored,
    Loaded,
    Model,
    Parameters,
    ProtocolError,
    Refused,
    Skipped,
    Start,
    States,
    Stop,
    Understood,
    Values,
    answer_of,
    request_of,
    schemas,
)

ASK = Ask(seq=7, test="a/b/c", quantity="mass_matrix", states=States(angles=((0.1, 1e-300),)))
MODEL = Model(
    id="a/b",
    parameters=Parameters(
        mass=(1.0, 2.0),
        length=(1.0, 1.0),
        centre=((0.5, 0.0), (0.5, 0.1)),
        inertia=(0.1, math.inf),
        gravity=9.81,
    ),
)


@pytest.mark.parametrize("message", [Start(), Stop(), ASK, MODEL], ids=lambda m: m.cmd)
def test_requests_survive_a_line_of_text(message):
    line = message.line()
    assert "\n" not in line
    assert request_of(line) == message


def test_numbers_keep_their_bits():
    numbers = (0.1 + 0.2, 5e-324)
    ask = Ask(seq=1, test="t", quantity="q", states=States(angles=(numbers,)))
    assert request_of(ask.line()).states.angles[0] == numbers


def test_numbers_that_are_not_finite_are_words():
    assert json.loads(MODEL.line())["parameters"]["inertia"] == [0.1, "inf"]


def test_every_message_has_a_schema():
    found = schemas()
    assert set(REQUESTS) < set(found)
    for schema in found.values():
        assert schema["type"] == "object"
        assert schema["additionalProperties"] is False
        assert schema["description"]


@pytest.mark.parametrize(
    ("cmd", "line", "expected"),
    [
        ("model", '{"ok": true}', Loaded()),
        ("model", '{"refused": "no"}', Refused(refused="no")),
        (
            "model",
            '{"ok": true, "understood": {"mass": [1, 2], "limits": [null, [-1, 1]]}}',
            Loaded(understood=Understood(mass=(1.0, 2.0), limits=(None, (-1.0, 1.0)))),
        ),
        ("ask", '{"seq": 1, "values": [1]}', Values(seq=1, values=[1])),
        ("ask", '{"seq": 1.0, "values": [1]}', Values(seq=1, values=[1])),
        ("ask", '{"seq": 1, "skipped": true}', Skipped(seq=1)),
        ("move", '{"seq": 2, "errored": true, "message": "x"}', Errored(seq=2, message="x")),
    ],
)
def test_answers(cmd, line, expected):
    assert answer_of(cmd, line) == expected


def test_names_are_on_one_line():
    line = '{"version": 1.0, "engine": {"name": "a\\nb", "version": "1\\t2", "reads": ["urdf"]}}'
    found = answer_of("start", line)
    assert found.version == 1
    assert (found.engine.name, found.engine.version) == ("a\\nb", "1\\t2")


@pytest.mark.parametrize("number", ["1e400", "1" + "0" * 400, "1" + "0" * 5000])
def test_numbers_beyond_float64_are_infinite(number):
    found = answer_of("ask", f'{{"seq": 1, "values": [{number}, -{number}]}}')
    assert found.values == [math.inf, -math.inf]
    moved = answer_of("move", f'{{"seq": 1, "angles": [[{number}, 0]], "speeds": [[0, 0]]}}')
    assert moved.angles == ((math.inf, 0.0),)


@pytest.mark.parametrize(
    ("cmd", "line", "words"),
    [
        ("ask", "", "one JSON object"),
        ("ask", "[1]", "must be a JSON object"),
        ("ask", "[" * 100_000, "one JSON object"),
        ("ask", '{"seq": 1, "values": [Infinity]}', "got Infinity"),
        ("ask", '{"seq": "1", "values": []}', "seq: input should be a valid integer; got '1'"),
        ("ask", '{"seq": 1.5, "values": []}', "seq: input should be a valid integer; got 1.5"),
        ("ask", '{"values": []}', "seq: field required"),
        ("ask", '{"seq": 1, "values": [], "more": 1}', "more: extra inputs"),
        ("model", '{"ok": false}', "ok: input should be True"),
        ("model", '{"ok": true, "understood": {"mass": [1]}}', "understood.mass.1: field required"),
        ("start", '{"version": 1}', "engine: field required"),
        ("start", '{"version": 1, "engine": {"name": "", "version": "", "reads": []}}', "name"),
        ("start", '{"refused": "no"}', "version: field required"),
    ],
)
def test_invalid_answers_are_refused_in_one_sentence(cmd, line, words):
    with pytest.raises(ProtocolError, match="got") as caught:
        answer_of(cmd, line)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_unknown_command_is_refused():
    with pytest.raises(ProtocolError, match="cmd must be one of start, model, ask, move, stop"):
        request_of('{"cmd": "jump"}')


def test_messages_are_frozen():
    with pytest.raises(ValueError, match="frozen"):
        ASK.seq = 8
