"""A child process that answers from a file, and breaks the protocol on one question.

    python rogue.py MODE ANSWERS

It misbehaves when it is asked for the mass matrix; MODE "start" when it is started.
"""

import json
import os
import signal
import sys
import time
from pathlib import Path

MODE, ANSWERS = sys.argv[1], json.loads(Path(sys.argv[2]).read_text())
RIGHT = ANSWERS["mass_matrix"]
COUNT = len(RIGHT)


def write(text):
    sys.stdout.write(text)
    sys.stdout.flush()


def tell(table):
    write(json.dumps(table) + "\n")


def values(seq, found):
    tell({"seq": seq, "values": found})


def for_ever(text):
    while True:
        write(text)


def leave(seq):
    sys.stderr.write("no licence\n")
    sys.exit(3)


def warn(seq):
    sys.stderr.write("[warning] the model is nearly singular\n[warning] again\n")
    values(seq, RIGHT)


def cut(seq):
    write('{"seq": 1, "val')
    sys.exit(0)


def hang_in_a_line(seq):
    write('{"seq":')
    time.sleep(60)


def banner(seq):
    write("engine 1.0, licensed to everybody\n")
    values(seq, RIGHT)


def twice(seq):
    # In one piece, so that the second line is there before the next question.
    write(2 * (json.dumps({"seq": seq, "values": RIGHT}) + "\n"))


MODES = {
    "crash": lambda seq: os.kill(os.getpid(), signal.SIGSEGV),
    "exit": leave,
    "warn": warn,
    "cut": cut,
    "hang": lambda seq: time.sleep(60),
    "hang in a line": hang_in_a_line,
    "flood": lambda seq: for_ever("y" * 4096),
    "flood of lines": lambda seq: for_ever("y\n" * 2048),
    "banner": banner,
    "nan": lambda seq: write(f'{{"seq": {seq}, "values": [NaN]}}\n'),
    "nan as a word": lambda seq: values(seq, [[["nan", 0.0], [0.0, 1.0]]] * COUNT),
    "length": lambda seq: values(seq, RIGHT[:-1]),
    "shape": lambda seq: values(seq, [[1.0, 2.0]] * COUNT),
    "ragged": lambda seq: values(seq, [RIGHT[0], 1.0, *RIGHT[2:]]),
    "words": lambda seq: values(seq, ["much"] * COUNT),
    "other question": lambda seq: values(seq + 1, RIGHT),
    "twice": twice,
    "lie": lambda seq: values(seq, [[[1.0, 0.0], [0.0, 1.0]]] * COUNT),
    "no schema": lambda seq: tell({"seq": seq, "values": RIGHT, "confidence": "high"}),
    "error": lambda seq: tell({"seq": seq, "errored": True, "message": "singular"}),
    "skip": lambda seq: tell(
        {"seq": seq, "skipped": True, "message": "not yet", "issue_url": "https://e.org/1"}
    ),
    "memory": lambda seq: values(seq, [len(bytearray(2**30))]),
}


for line in sys.stdin:
    request = json.loads(line)
    if request["cmd"] == "start":
        sys.stderr.write("warning: no display\n" * (MODE == "warn"))
        if MODE == "start":
            sys.exit("no display")
        engine = {
            "name": "rogue",
            "version": "1",
            "reads": ["parameters"],
            "answers": list(ANSWERS),
        }
        tell({"version": 2 if MODE == "version" else 1, "engine": engine})
    elif request["cmd"] == "model":
        tell({"ok": True})
    elif request["cmd"] == "stop":
        break
    elif request["quantity"] == "mass_matrix":
        MODES[MODE](request["seq"])
    else:
        values(request["seq"], ANSWERS[request["quantity"]])
