"""Pages as scripts: blocks, commands, and the comparison of their outputs."""

from textwrap import dedent

import pytest

from tests.docs.transcript import agree, blocks, commands, follow

PAGE = dedent(
    """\
    # A page

    ```python
    # greeting.py; run by: python greeting.py
    print("hello", 1 + 1)
    ```

    ```text
    hello 2
    ```

    ```{image} x.svg
    ```

    ```python
    from greeting import print as say
    say(0.5)
    ```

    Between.

    ```text
    a drawing
    ```

    ```console
    $ cat greeting.py | wc -l
    2
    ```
    """
).replace("from greeting import print as say\nsay", "print")


def test_blocks_have_their_language_and_line():
    assert [(block.language, block.line) for block in blocks(PAGE)] == [
        ("python", 3),
        ("text", 8),
        ("python", 15),
        ("text", 21),
        ("console", 25),
    ]


def test_commands_have_the_lines_below_them():
    assert commands("$ a\nx\ny\n$ b\n") == [("a", ["x", "y"]), ("b", [])]


def test_a_page_is_followed(tmp_path):
    file, script, shell = follow(PAGE, tmp_path)
    assert file == (3, "python greeting.py", ["hello 2"], ["hello 2"])
    # The text after a sentence is no output.
    assert (script.shown, script.printed) == ([], ["0.5"])
    assert shell.agrees


def test_a_command_that_fails_is_an_error(tmp_path):
    with pytest.raises(AssertionError, match=r"exit code 3\nwhy"):
        list(follow("```console\n$ echo why; exit 3\n```\n", tmp_path))


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        (["a", "b"], ["a", "", " b "]),
        (["a", "…"], ["a"]),
        (["a", "…", "d"], ["a", "b", "c", "d"]),
        (["…", "b", "…", "d"], ["a", "b", "c", "d"]),
        (["12.0 ms to run, × 1.5"], ["9 ms to run, × 1.26"]),
        (["2.9/144 ✓"], ["<0.01/166 ✓"]),
        (["error 1.7e-13, speed −5.494"], ["error 2.2e-13, speed −5.494"]),
    ],
)
def test_equal_outputs_agree(shown, printed):
    assert agree(shown, printed)


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        (["a"], ["a", "b"]),
        (["a", "…", "d"], ["a", "b"]),
        (["…", "b", "…"], ["a", "c"]),
        (["q 2.315203415 rad"], ["q 2.315213415 rad"]),
        (["error 1.7e-13"], ["error 1.7e-3"]),
        (["29 times"], ["30 times"]),
        (["slides"], ["sticks"]),
    ],
)
def test_different_outputs_disagree(shown, printed):
    assert not agree(shown, printed)
