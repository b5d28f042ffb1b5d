"""Conversions by processes that live on from file to file; one that dies takes its file alone."""

from __future__ import annotations

import gc
import os
import signal
import traceback
from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import replace
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from types import FrameType

from hdrusd import map_threads
from hdrusd.account.many import Converted
from hdrusd.batch.plan import DATABASES, Task
from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.delivery import clear_leftovers
from hdrusd.errors import HdrusdError, InputError, one_line
from hdrusd.report import Report

#: A fork would share the threads' locks of USD and OpenImageIO, held for ever.
_PROCESSES = get_context("spawn")

#: Seconds in which a process that is told to stop clears away what is half done.
_PATIENCE = 10.0


def convert_all(tasks: Sequence[Task], options: Options, jobs: int) -> Generator[Converted]:
    """Convert each file, ``jobs`` at once; in the order of ``tasks``, each as soon as it can be.

    Whatever one file does to the process that reads it, the others are converted. Leaving the
    iteration stops those in hand, which leave nothing half-written.
    """
    done: dict[int, Converted] = {}
    told, begun = 0, 0
    workers = [_Worker(jobs) for _ in range(min(jobs, len(tasks)))]
    try:
        while told < len(tasks):
            for worker in workers:
                if worker.index is None and begun < len(tasks):
                    worker.give(begun, tasks[begun], options)
                    begun += 1
            for worker in _ready(workers):
                index = worker.index
                assert index is not None
                done[index] = worker.take(tasks[index])
            while told in done:
                yield done.pop(told)
                told += 1
    finally:
        for worker in workers:
            worker.stop()
        for worker in workers:
            worker.end()
            if worker.index is not None:
                clear_leftovers(tasks[worker.index].output, done=False)


class _Worker:
    """A process, started when there is something to do and again when it has died."""

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs
        self.index: int | None = None  # of the task in hand
        self.process: SpawnProcess | None = None
        self.pipe: Connection

    def give(self, index: int, task: Task, options: Options) -> None:
        if self.process is None or not self.process.is_alive():
            self.pipe, theirs = _PROCESSES.Pipe()
            self.process = _PROCESSES.Process(target=_serve, args=(theirs, self.jobs), daemon=True)
            # A Ctrl-C reaches every process of the terminal; we alone decide what it means.
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                self.process.start()
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
            theirs.close()
        self.index = index
        with suppress(BrokenPipeError):  # it has just died: take() says so
            self.pipe.send((task, options))

    def take(self, task: Task) -> Converted:
        self.index = None
        try:
            outcome: Converted = self.pipe.recv()
        except (EOFError, ConnectionError):
            assert self.process is not None
            self.process.join()
            text = f"the process that read it {_end(self.process.exitcode)}"
            error = InputError(task.source, text)
            outcome = refused(task, Report(), error.exit_code, str(error))
            self.process = None
            clear_leftovers(task.output, done=False)
        return outcome

    def stop(self) -> None:
        if self.process is not None:
            self.pipe.close()  # one that waits for work ends by itself
            if self.index is not None:
                self.process.terminate()

    def end(self) -> None:
        if self.process is not None:
            self.process.join(_PATIENCE)
            self.process.kill()
            self.process.join()


def _ready(workers: Sequence[_Worker]) -> list[_Worker]:
    """Those of the busy ones that have something to say, or are dead."""
    busy = {worker.pipe: worker for worker in workers if worker.index is not None}
    return [busy[pipe] for pipe in wait(list(busy)) if isinstance(pipe, Connection)]


def _end(code: int | None) -> str:
    if code is not None and code < 0:
        with suppress(ValueError):
            return f"was ended by {signal.Signals(-code).name}"
    return f"ended with {code}"


def _serve(pipe: Connection, jobs: int) -> None:
    """Convert what comes through ``pipe`` until it is closed."""
    map_threads.share(jobs)
    with suppress(EOFError, BrokenPipeError, KeyboardInterrupt):
        while True:
            task, options = pipe.recv()
            # Only a conversion has something to clear away.
            signal.signal(signal.SIGTERM, _stopped)
            outcome = _converted(task, options)
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            pipe.send(outcome)
            # What a refusal still holds may be a layer of USD, which the next file would get.
            gc.collect()


def _stopped(_signal: int, _frame: FrameType | None) -> None:
    """Clear away what is half done; nobody listens to what USD says of the interruption."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    raise KeyboardInterrupt


def _converted(task: Task, options: Options) -> Converted:
    own = replace(
        options,
        photometry=task.photometry,
        shared=task.shared,
        roots=(*options.roots, *([task.root] if task.root else [])),
    )
    report = Report()
    try:
        result = convert(task.source, task.output, own, report)
    except HdrusdError as error:
        return refused(task, report, error.exit_code, str(error))
    except OSError as error:
        parts = (task.source.name, error.filename, error.strerror or error)
        return refused(task, report, 1, one_line(": ".join(str(part) for part in parts if part)))
    except Exception:  # a fault of ours: its traceback, and on with the others
        traceback.print_exc()
        text = f"{task.source.name}: not converted by a fault of hdrusd; its traceback stands above"
        return refused(task, report, 1, text)
    return Converted(
        task.source,
        task.output,
        result.as_dict(),
        photometry=task.photometry,
        shared=task.shared,
        unmatched=result.unmatched,
        parts={file for file in result.parts if file.suffix.lower() in DATABASES},
    )


def refused(task: Task, report: Report, code: int, error: str) -> Converted:
    """A file that was not converted, and what was found before."""
    return Converted(task.source, task.output, report.as_dict(), code, error)
