"""``bondsight``: diagnose a recording, run the demonstration, print equations, measure."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from bondgraph.errors import BondsightError
from identification.command_line.acquire import add_acquire_command
from identification.command_line.arguments import jobs, nonnegative
from identification.command_line.bench_serve import add_bench_serve_options, bench_serve
from identification.command_line.blind import add_blind_command
from identification.command_line.conformance import add_conformance_command
from identification.command_line.coverage import add_coverage_command
from identification.command_line.diagnose import add_diagnose_command
from identification.command_line.effects import add_effects_command
from identification.command_line.equations import NOTATIONS as EQUATIONS
from identification.command_line.explain import add_explain_command
from identification.command_line.export import add_export_command
from identification.command_line.fit import add_fit_command
from identification.command_line.identifiability import add_identifiability_command
from identification.command_line.machines import add_machine_commands
from identification.command_line.output import writable
from identification.command_line.published import add_published_command
from identification.command_line.recordings_list import add_recordings_command


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit code (0 finished, 2 unusable input)."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if not hasattr(options, "run"):
        parser.print_help()
        return 0
    try:
        return int(options.run(options))
    except BondsightError as error:
        # notes say what became of data and outputs; they belong to the line
        whole = "; ".join([str(error), *getattr(error, "__notes__", ())])
        print(f"bondsight: {' '.join(whole.split())}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f" {error.filename}" if error.filename else ""
        print(f"bondsight: cannot read or write{where}: {error.strerror or error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt as error:
        said = ["stopped; files already named above are complete"]
        whole = "; ".join([*said, *getattr(error, "__notes__", ())])
        print(f"bondsight: {' '.join(whole.split())}", file=sys.stderr)
        return 130


class _OneLine(argparse.ArgumentParser):
    """A parser that refuses in one line."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where the help is."""
        self.exit(2, f"bondsight: {' '.join(message.split())}; see {self.prog} --help\n")


def _parser() -> argparse.ArgumentParser:
    parser = _OneLine(
        prog="bondsight",
        description="Find the physics that a model leaves out, from a recording.",
    )
    verbs = parser.add_subparsers(title="commands", metavar="COMMAND")

    add_diagnose_command(verbs)

    p = verbs.add_parser("demo", help="conceal an effect on a virtual bench and find it")
    p.add_argument(
        "--seed", type=nonnegative, default=None, help="draw of the bench (default: by chance)"
    )
    p.add_argument(
        "--seeds", type=int, default=None, help="run that many draws and print the score"
    )
    p.add_argument("--first", type=nonnegative, default=1, help="first seed of --seeds")
    p.add_argument("--effect", default=None, help="conceal this effect instead of drawing one")
    p.add_argument("--out", type=Path, default=Path("bondsight-out/demo"))
    p.add_argument("--jobs", type=jobs, default=-1, help="processes (default: all cores)")
    p.set_defaults(run=_demo)

    p = verbs.add_parser("check", help="say everything that is wrong with a model")
    p.add_argument("model")
    p.set_defaults(run=_check)

    p = verbs.add_parser("equations", help="print the equations of a model")
    p.add_argument("model")
    p.add_argument("--format", choices=EQUATIONS, default="ordered")
    p.set_defaults(run=_equations)

    p = verbs.add_parser("draw", help="draw a model with its causal strokes as SVG")
    p.add_argument("model")
    p.add_argument("--out", type=Path, default=None, help="file (default: MODEL.svg)")
    p.set_defaults(run=_draw)

    p = verbs.add_parser("bench", help="measure times and memory, or serve a virtual bench")
    p.add_argument("what", nargs="*", help="names of measurements (default: all), or serve")
    p.add_argument("--quick", action="store_true", help="shorten those that can be (diagnosis)")
    p.set_defaults(run=_bench)
    add_bench_serve_options(p)

    add_acquire_command(verbs)
    add_explain_command(verbs)
    add_effects_command(verbs)
    add_blind_command(verbs)
    add_export_command(verbs)
    add_conformance_command(verbs)
    add_machine_commands(verbs)
    add_fit_command(verbs)
    add_identifiability_command(verbs)
    add_coverage_command(verbs)
    add_published_command(verbs)
    add_recordings_command(verbs)
    return parser


def _demo(options: argparse.Namespace) -> int:
    from identification.command_line.demo import demo, known_effect, score

    known_effect(options.effect)
    writable(options.out)
    if options.seeds is not None:
        return score(options.seeds, options.first, options.out, options.jobs, options.effect)
    return demo(options.seed, options.out, options.jobs, options.effect)


def _check(options: argparse.Namespace) -> int:
    from bondgraph.causality import assign_causality
    from bondgraph.deriving import system
    from identification.command_line.models import load_model

    graph = load_model(options.model)
    if lines := graph.check():
        print("\n".join(lines), file=sys.stderr)
        return 2
    print(assign_causality(graph))
    print(f"sound: {len(graph.elements)} elements, states {', '.join(system(graph).states)}")
    return 0


def _equations(options: argparse.Namespace) -> int:
    from identification.command_line.equations import equations
    from identification.command_line.models import load_model

    print(equations(load_model(options.model), options.format))
    return 0


def _draw(options: argparse.Namespace) -> int:
    from bondgraph.draw import svg
    from identification.command_line.models import load_model
    from identification.diagnosis.verdict import write_atomically

    graph = load_model(options.model)
    target = options.out or Path(f"{graph.name}.svg")
    writable(target.parent)
    write_atomically(target, svg(graph))
    print(target)
    return 0


def _bench(options: argparse.Namespace) -> int:
    if options.what[:1] == ["serve"]:
        return bench_serve(options)
    from identification.command_line.bench import bench

    return bench(options.what, options.quick)


if __name__ == "__main__":
    sys.exit(main())
