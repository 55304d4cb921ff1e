"""An open benchmark for the calibration of laser profilers on robots, in space and time."""

import argparse
import sys
import time
from pathlib import Path

from . import __version__, board, commitment, generate, published, real, runner, score, submission, tracks
from .baselines import METHODS
from .files import FileError
from .submission import SubmissionError


def main(arguments: list[str] | None = None) -> int:
    """Run a command. Exit code 0, or 2 where it could not run."""
    options = _parser().parse_args(arguments)
    try:
        options.run(options)
    except (FileError, SubmissionError, commitment.SealError) as error:
        print(f"profilebench: {error}", file=sys.stderr)
        return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="profilebench", description=__doc__)
    parser.add_argument("--version", action="version", version=f"profilebench {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    p = commands.add_parser("generate", help="write the sequences of the tracks")
    p.add_argument("--out", type=Path, required=True, help="folder of the benchmark")
    p.add_argument("--tier", choices=tracks.TIERS, default="small")
    p.add_argument("--track", action="append", choices=tracks.TRACKS, help="only this track; may be given again")
    p.add_argument("--key-file", type=Path, help="secret of the evaluation part; default: the public practice key")
    p.set_defaults(run=_generate)

    p = commands.add_parser("run", help="run a method, or any program, over all sequences")
    p.add_argument("bench", type=Path)
    p.add_argument("--out", type=Path, required=True, help="folder of the submissions")
    p.add_argument("--method", action="append", help=f"one of {', '.join(METHODS)}; default: all of them")
    p.add_argument("--command", help="a program: 'my-program {sequence} {answer}'; --method names it")
    p.add_argument("--track", action="append", help="only this track; may be given again")
    p.add_argument("--jobs", type=int, default=1)
    p.set_defaults(run=_run)

    for name, text in (("score", "print the tables and write the board"), ("board", "write the board only")):
        p = commands.add_parser(name, help=text)
        p.add_argument("bench", type=Path)
        p.add_argument("submissions", type=Path)
        p.add_argument("--out", type=Path, default=Path("board"), help="folder of board.md, board.html, board.json")
        p.add_argument("--key-file", type=Path, help="key that opens sealed truths")
        p.set_defaults(run=_score, show=name == "score")

    p = commands.add_parser("check", help="check answers against the schema, without a benchmark")
    p.add_argument("answers", type=Path, nargs="+", metavar="ANSWER.json")
    p.set_defaults(run=_check)

    p = commands.add_parser("reveal", help="open the sealed truths with the key and check the commitments")
    p.add_argument("bench", type=Path)
    p.add_argument("--key-file", type=Path, help="default: the public practice key")
    p.set_defaults(run=_reveal)

    p = commands.add_parser("real", help="make the real track of recordings that you fetched")
    p.add_argument("--out", type=Path, required=True, help="folder of the benchmark")
    _recordings(p)
    p.set_defaults(run=_real)

    p = commands.add_parser("published", help="repeat published experiments beside their published figures")
    p.add_argument("--cells", type=int, default=30, help="simulated planes; a third as many of each other experiment")
    p.add_argument("--robcalibrator", type=Path, help="folder data/ScanData of RobCalibrator (MIT), for the spheres")
    p.set_defaults(run=lambda o: print(published.table(o.cells, o.robcalibrator)))

    p = commands.add_parser("reproduce", help="everything at once: generate, run all methods, score, published")
    p.add_argument("--out", type=Path, required=True, help="folder of all that is made; the tables are in its tables/")
    p.add_argument("--tier", choices=tracks.TIERS, default="small")
    p.add_argument("--jobs", type=int, default=1)
    p.add_argument("--cells", type=int, default=30, help="as of `published`")
    _recordings(p)
    p.set_defaults(run=_reproduce)
    return parser


def _recordings(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--robcalibrator", type=Path, help="folder data/ScanData of RobCalibrator (MIT)")
    parser.add_argument("--etna", type=Path, help="folder etna_calib/data of ETNA (BSD); needs OpenCV")


def _key(path: Path | None) -> bytes | None:
    if path is None:
        return None
    try:
        key = path.read_bytes().strip()
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from None
    if len(key) < 16:
        raise FileError(f"{path}: a key has at least 16 bytes")
    return key


def _generate(options: argparse.Namespace) -> None:
    key = _key(options.key_file) or commitment.PRACTICE_KEY
    for name in generate.generate(options.out, options.tier, key, options.track):
        print(name)


def _run(options: argparse.Namespace) -> None:
    methods = options.method or list(METHODS)
    if options.command and len(methods) != 1:
        raise FileError("--command needs one --method NAME, under which the answers are filed")
    for method in methods:
        print(f"== {method}")
        for text in runner.run(options.bench, options.out, method, options.command, options.jobs, options.track):
            print(text, flush=True)


def _check(options: argparse.Namespace) -> None:
    for path in options.answers:
        answer = submission.read(path)
        print(f"{path}: {answer.status}, follows the schema")


def _reproduce(options: argparse.Namespace) -> None:
    began = time.perf_counter()
    bench, answers, tables = (options.out / name for name in ("bench", "answers", "tables"))
    list(generate.generate(bench, options.tier, commitment.PRACTICE_KEY, None))
    if options.robcalibrator or options.etna:
        real.load(bench, options.robcalibrator, options.etna)
    for method in METHODS:
        print(f"== {method}", file=sys.stderr)
        for text in runner.run(bench, answers, method, None, options.jobs):
            print(text, file=sys.stderr, flush=True)
    scores = score.score(bench, answers, None)
    board.write(scores, options.out / "board")
    written = board.parts(scores) | {"published": published.table(options.cells, options.robcalibrator)}
    tables.mkdir(parents=True, exist_ok=True)
    for name, text in written.items():
        (tables / f"{name}.md").write_text(text + "\n")
        print(f"## {name}\n\n{text}\n")
    minutes = (time.perf_counter() - began) / 60
    print(f"wrote {tables} and {options.out / 'board'} in {minutes:.1f} min", file=sys.stderr)


def _score(options: argparse.Namespace) -> None:
    scores = score.score(options.bench, options.submissions, _key(options.key_file))
    if options.show:
        print(board.markdown(scores))
    for path in board.write(scores, options.out):
        print(f"wrote {path}", file=sys.stderr)


def _reveal(options: argparse.Namespace) -> None:
    key = _key(options.key_file) or commitment.PRACTICE_KEY
    count = 0
    for folder in score.sequences(options.bench):
        if (folder / "truth.sealed").is_file():
            truth = score.truth_of(folder, key)
            assert truth is not None
            (folder / "truth.json").write_bytes(commitment.canonical(truth) + b"\n")
            count += 1
    print(f"{count} truths opened; each is the one that was committed to")


def _real(options: argparse.Namespace) -> None:
    if options.robcalibrator is None and options.etna is None:
        raise FileError("name a fetched folder with --robcalibrator or --etna")
    for name in real.load(options.out, options.robcalibrator, options.etna):
        print(name)


if __name__ == "__main__":
    sys.exit(main())
