"""The real command line, without a start of Python for each command.

To import libraries takes longer than most commands of tests. `python forking.py SOCKET` imports them, and nothing of
rayrace; then it forks for each command. The child imports rayrace, runs the command and ends, as a start of it does.
"""

import contextlib
import gc
import importlib
import io
import json
import os
import runpy
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

PROGRAM = Path(sys.executable).with_name("rayrace")
# What the commands of tests import. What is optional, or used by few commands, is left to these.
LIBRARIES = (
    *("typer", "rich.console", "rich.markup", "rich.table", "pydantic", "platformdirs", "psutil", "secrets"),
    *("numpy", "numpy.random", "pandas", "mpmath", "PIL.Image", "jinja2", "markdown_it"),
    *("matplotlib.pyplot", "matplotlib.backends.backend_pdf", "matplotlib.backends.backend_svg"),
)
HARMLESS = "RAYRACE_", "PYTEST_", "XDG_STATE_HOME"  # no library reads variables that begin so
MOST = 1 << 20  # bytes of a message


class Commands:
    """A process that forks for each command. It starts with the first, and ends with the process that has this object.

    environment: of that process.
    """

    def __init__(self, environment: Mapping[str, str]):
        self.environment, self.process, self.busy = dict(environment), None, False

    def run(self, words: Iterable, cwd=None, env: Mapping[str, str] | None = None, timeout: float = 300):
        """Returns the CompletedProcess of `rayrace WORDS`, with text. env: all its variables, by default `environment`.

        A start of Python of its own runs it where a library could read another variable when it is imported, and while
        another thread's command is running.
        """
        words, env = list(map(str, words)), dict(self.environment if env is None else env)
        if self.busy or self._variables(env) != self._variables(self.environment):
            return subprocess.run(
                [PROGRAM, *words], cwd=cwd, env=env, capture_output=True, text=True, timeout=timeout,
                stdin=subprocess.DEVNULL,
            )  # fmt: skip
        self.busy = True
        try:
            return self._forked(words, cwd or os.getcwd(), env, timeout)
        finally:
            self.busy = False

    @staticmethod
    def _variables(environment):
        return {name: value for name, value in environment.items() if not name.startswith(HARMLESS)}

    def _start(self):
        self.socket, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MOST)
        command = [sys.executable, __file__, str(other.fileno())]
        self.process = subprocess.Popen(
            command, env=self.environment, stdin=subprocess.DEVNULL, pass_fds=[other.fileno()]
        )
        other.close()

    def _forked(self, words, cwd, env, timeout):
        if self.process is None:
            self._start()
        pid = None
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as errors:
            try:
                self.socket.settimeout(timeout)
                job = json.dumps([words, os.fspath(cwd), env]).encode()
                socket.send_fds(self.socket, [job], [out.fileno(), errors.fileno()])
                pid = json.loads(self.socket.recv(MOST))
                status = json.loads(self.socket.recv(MOST))
            except BaseException as error:  # what is still to come is of no later command
                with contextlib.suppress(OSError, TypeError):
                    os.kill(pid, signal.SIGKILL)
                self.close()
                if isinstance(error, TimeoutError):
                    raise subprocess.TimeoutExpired([PROGRAM, *words], timeout) from None
                raise
            texts = []
            for file in (out, errors):
                file.seek(0)
                texts.append(io.TextIOWrapper(file).read())
        return subprocess.CompletedProcess([PROGRAM, *words], status, *texts)

    def close(self) -> None:
        """Ends the process, if there is one; the next command starts another."""
        if self.process:
            self.socket.close()
            self.process.kill()
            self.process.wait()
            self.process = None


def main(number: int) -> None:
    """Forks for each command that comes through a socket. Returns in the children, which are to run it."""
    place = sys.path.pop(0)  # the folder of this file
    for name in LIBRARIES:
        with contextlib.suppress(ImportError):  # a command says so
            importlib.import_module(name)
    sys.path.insert(0, str(PROGRAM.parent))
    gc.freeze()  # else each child would copy all that its collector looks at
    own = [name for name in sys.modules if name.partition(".")[0] in ("rayrace", "harness", "reports", "renderers")]
    assert not own, f"{own} in {place}"
    with socket.socket(fileno=number) as commands:
        while True:
            told, files, _, _ = socket.recv_fds(commands, MOST, 2)
            if not told:
                os._exit(0)
            pid = os.fork()
            if pid == 0:
                break
            for file in files:
                os.close(file)
            commands.send(json.dumps(pid).encode())
            commands.send(json.dumps(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])).encode())
    words, cwd, env = json.loads(told)
    for file, target in zip(files, (1, 2), strict=True):
        os.dup2(file, target)
        os.close(file)
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(env)
    sys.argv[:] = [str(PROGRAM), *words]


if __name__ == "__main__":
    main(int(sys.argv[1]))
    runpy.run_path(str(PROGRAM), run_name="__main__")
