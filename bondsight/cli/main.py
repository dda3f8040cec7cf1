"""``bondsight``: diagnose a recording, run the demonstration, print equations, measure."""

from __future__ import annotations

import argparse
import atexit
import contextlib
import io
import os
import signal
import sys
import threading
from collections.abc import Sequence
from importlib import import_module
from typing import Any, Final, NoReturn

from bondgraph.support.errors import BondsightError, nearest
from bondsight import __version__
from bondsight.cli.acquire import add_acquire_command
from bondsight.cli.bench import add_bench_command
from bondsight.cli.calibrate import add_calibrate_command
from bondsight.cli.check import add_check_command
from bondsight.cli.checkout import add_developer_commands
from bondsight.cli.compensate import add_compensate_command
from bondsight.cli.demo import add_demo_command
from bondsight.cli.diagnose import add_diagnose_command
from bondsight.cli.draw import add_draw_command
from bondsight.cli.effects import add_effects_command
from bondsight.cli.equations import add_equations_command
from bondsight.cli.explain import add_explain_command
from bondsight.cli.export import add_export_command
from bondsight.cli.fit import add_fit_command
from bondsight.cli.identifiability import add_identifiability_command
from bondsight.cli.models import add_models_command
from bondsight.cli.output import INTERRUPTED, none_left_empty
from bondsight.cli.recordings import add_recordings_command
from bondsight.cli.regulate import add_regulate_command
from bondsight.cli.sizing import add_sizing_command
from bondsight.cli.spoken import as_options
from bondsight.cli.stack import add_stack_command
from bondsight.cli.studio import add_studio_command
from bondsight.cli.thesis import add_thesis_command
from bondsight.cli.ultrasonic import add_ultrasonic_command
from bondsight.cli.verb_group import VerbGroup

GROUPS: Final = {
    "Find what a model leaves out": (
        add_diagnose_command, add_studio_command, add_explain_command, add_effects_command,
        add_demo_command,
    ),
    "Write and read a model": (
        add_models_command, add_check_command, add_equations_command, add_draw_command,
        add_export_command,
    ),
    "Fit it to recordings": (
        add_fit_command, add_identifiability_command, add_recordings_command,
    ),
    "Measure": (
        add_acquire_command, add_regulate_command, add_calibrate_command, add_bench_command,
    ),
    "Piezo actuators": (
        add_sizing_command, add_compensate_command, add_stack_command, add_ultrasonic_command,
        add_thesis_command,
    ),
}  # fmt: skip
"""What a person wants -> its verbs, in the order of the help."""
COMPLETION: Final = """\
completion ('bondsight[completion]'): bash, zsh  eval "$(register-python-argcomplete bondsight)"
  fish  register-python-argcomplete --shell fish bondsight | source
a MODEL is a name of bondsight models, a file.py with model(), a .json file, or package:function"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit code (0 finished, 2 unusable input)."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a sign that the terminal lacks ends nothing
    try:
        parser = _parser(*words[:1])
        if "_ARGCOMPLETE" in os.environ:  # the shell asks for words
            import_module("argcomplete").autocomplete(parser)
        options = parser.parse_args(words)
        if not hasattr(options, "run"):
            parser.print_help()
            return 0
        with none_left_empty():
            return int(options.run(options))
    except BondsightError as error:
        # notes say what became of data and outputs; they belong to the line
        whole = "; ".join([str(error), *getattr(error, "__notes__", ())])
        print(f"bondsight: {as_options(' '.join(whole.split()))}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f" {error.filename}" if error.filename else ""
        print(f"bondsight: cannot read or write{where}: {error.strerror or error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt as error:
        said = [str(error) or "stopped; files named above, if any, are complete"]
        whole = "; ".join([*said, *getattr(error, "__notes__", ())])
        print(f"bondsight: {' '.join(whole.split())}", file=sys.stderr)
        return INTERRUPTED
    except SystemExit as end:
        # a signal that ended a drive says where the output stands; others have said all already
        if notes := getattr(end, "__notes__", ()):
            whole = "; ".join([f"ended by {_signal(end.code)}", *notes])
            print(f"bondsight: {' '.join(whole.split())}", file=sys.stderr)
        raise


def program() -> NoReturn:
    """Run the command as a program of its own, and end it.

    Threads that hand out work may be writing down a model in C++ when Ctrl-C comes. The end of the
    interpreter would unwind that, and abort; so all is put away, and then everything ends at once.
    """
    code = main()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    if code == INTERRUPTED:
        _others_end()
        atexit._run_exitfuncs()
        os._exit(code)
    sys.exit(code)


def _others_end() -> None:
    """Wait for the threads that the end of the interpreter would wait for, until Ctrl-C again."""
    with contextlib.suppress(KeyboardInterrupt):
        for thread in threading.enumerate():
            if thread is not threading.current_thread() and not thread.daemon:
                thread.join()


def _signal(code: object) -> str:
    """Return the name of the signal behind an exit code."""
    number = code - 128 if isinstance(code, int) else 0
    known = [s.name for s in signal.Signals if s == number]
    return known[0] if known else f"exit {code}"


class _OneLine(argparse.ArgumentParser):
    """A parser that refuses in one line, and takes whole options only."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        self._words: tuple[str, ...] = ()

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Say the nearest word before all words are listed."""
        if (how := ELSEWHERE.get(str(value))) and value not in (action.choices or ()):
            raise argparse.ArgumentError(action, f"no {value!r}: {how}")
        near = nearest(str(value), map(str, action.choices or ()))
        if near and value not in (action.choices or ()):
            meant = " or ".join(map(repr, near))
            raise argparse.ArgumentError(action, f"no {value!r} (did you mean {meant}?)")
        super()._check_value(action, value)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Remember the words, and refuse a misspelled option where it is known what was meant."""
        self._words = tuple(sys.argv[1:] if args is None else args)
        found, rest = super().parse_known_args(args, namespace)
        if rest and self._misspelled():
            self.error("unknown option")
        return found, rest

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where the help is."""
        said = self._misspelled() or " ".join(message.split())
        self.exit(2, f"bondsight: {said}; see {self.prog} --help\n")

    def _misspelled(self) -> str:
        """Return the first option that is none but like one, and that; empty where all are."""
        here = self._words[:1] if self._subparsers else self._words
        for option in (w.partition("=")[0] for w in here if w.startswith("--") and w != "--"):
            near = nearest(option, (o for o in self._option_string_actions if o[:2] == "--"))
            if near and option not in self._option_string_actions:
                return f"no option {option} (did you mean {near[0]}?)"
        return ""


ELSEWHERE = {
    "simulate": "models are simulated in Python, simulate(graph, time, {'F': values}); "
    "bondsight export writes code that does",
    "plot": "bondsight diagnose and fit draw a page with --out; results have .plot() in Python",
    "identify": "bondsight fit estimates parameters, bondsight diagnose says what is missing",
}
"""Words that one looks for as verbs, and where what they mean is done."""


def _parser(called: str = "") -> argparse.ArgumentParser:
    parser = _OneLine(
        prog="bondsight",
        usage="bondsight [-h] [--version] COMMAND ...",
        description="Find the physics that a model leaves out, from a recording.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        add_help=False,
    )
    parser.add_argument("-h", "--help", action="help", help="bondsight COMMAND --help says more")
    parser.add_argument("--version", action="version", version=f"bondsight {__version__}")
    verbs = VerbGroup(
        parser.add_subparsers(prog="bondsight", metavar="COMMAND", help=argparse.SUPPRESS)
    )
    said = []
    for title, adders in GROUPS.items():
        for add in adders:
            add(verbs)
        said.append(verbs.listed(title))
    add_developer_commands(verbs, called)
    said.append(verbs.listed("Evidence (in a checkout)"))
    parser.epilog = "\n\n".join([*said, COMPLETION])
    return parser


if __name__ == "__main__":
    sys.exit(main())
